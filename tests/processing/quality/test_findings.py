import numpy as np
import pytest
from obspy import Stream, Trace

from per_obspy.config import Check
from per_obspy.errors import RecordRejected
from per_obspy.processing.quality.findings import Finding, above, below, judged, surviving


def test_thresholds_belong_to_the_good_side():
    setting = Check(threshold=2.0, level="warn")
    assert (below("x", setting, 2.0, ""), above("x", setting, 2.0, "")) == ([], [])
    assert below("x", setting, 1.5, "figure")[0].reason == "figure 1.5, needs 2"
    assert above("x", setting, 2.5, "figure")[0].reason == "figure 2.5, allowed 2"


def test_levels_decide_what_a_finding_means():
    trace = Trace(np.zeros(3), {"channel": "HNE"})
    accepted = judged(
        trace,
        [Finding("a", "warn", "one"), Finding("b", "note", "two"), Finding("c", "warn", "three")],
    )[0]
    assert (accepted.stats.per_obspy.warnings, accepted.stats.per_obspy.notes) == (
        "one; three",
        "two",
    )
    assert accepted.stats.per_obspy.failed_checks == "a c"  # not b, which only notes
    with pytest.raises(RecordRejected) as caught:
        judged(
            accepted,
            [
                Finding("d", "reject", "four"),
                Finding("e", "reject", "five"),
                Finding("f", "warn", "six"),
            ],
        )
    assert caught.value.reasons == ("four", "five", "one; three", "six")
    assert "per_obspy" not in trace.stats


def test_a_bad_trace_is_rejected_alone():
    # a step that refuses one channel
    def picky(stream):
        if stream[0].stats.channel == "HNE":
            raise RecordRejected(stream[0].id, "first", "second")
        return stream

    traces = [Trace(np.zeros(3), {"channel": channel}) for channel in ("HNE", "HNN")]
    accepted, rejected = surviving(picky, Stream(traces))
    assert [trace.stats.channel for trace in accepted] == ["HNN"]
    assert rejected[0].reasons == ("first", "second")
