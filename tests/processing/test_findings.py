import numpy as np
import pytest
from obspy import Trace

from per_obspy.config import Check, Checks
from per_obspy.errors import RecordRejected
from per_obspy.processing.account import Finding, Findings, judge, survivors


def test_thresholds_belong_to_the_good_side():
    limit = Check(threshold=2.0, level="warn")
    findings = Findings(Checks(duration=limit, outlier=limit))
    assert not findings.compare("duration", 2.0)
    assert not findings.compare("outlier", 2.0, "HNE")
    assert findings.compare("duration", 1.5)
    assert findings.compare("outlier", 2.5, "HNE")
    assert findings == [
        ("duration", "warn", "duration, s: 1.5, needs 2"),
        ("outlier", "warn", "peak over that of HNE: 2.5, allowed 2"),
    ]


def test_levels_decide_what_a_finding_means():
    trace = Trace(np.zeros(3), {"channel": "HNE"})
    accepted = judge(
        trace,
        [Finding("a", "warn", "one"), Finding("b", "note", "two"), Finding("c", "warn", "three")],
    )
    assert (accepted.stats.per_obspy.warnings, accepted.stats.per_obspy.notes) == (
        "one; three",
        "two",
    )
    assert accepted.stats.per_obspy.failed_checks == "a c"  # not b, which only notes
    with pytest.raises(RecordRejected) as caught:
        judge(
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
    def picky(trace):
        if trace.stats.channel == "HNE":
            raise RecordRejected(trace.id, "first", "second")
        return trace

    traces = [Trace(np.zeros(3), {"channel": channel}) for channel in ("HNE", "HNN")]
    accepted, rejected = survivors(picky, traces)
    assert [trace.stats.channel for trace in accepted] == ["HNN"]
    assert rejected[0].reasons == ("first", "second")
