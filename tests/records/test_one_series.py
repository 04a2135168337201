"""One form of every record."""

import numpy as np
import pytest
from obspy import Stream, Trace, UTCDateTime

from per_obspy.records.folder import one_series

START = UTCDateTime(2020, 1, 2, 3, 4, 5)


def form(
    source: str, units: str = "m/s2", kind: str = "COSMOS", seconds: int = 60, **stats: object
) -> Trace:
    header = {"network": "CE", "station": "1", "channel": "HNN", "delta": 0.01, "starttime": START}
    header |= {"units": units, "_format": kind, "source": source, "processing_level": "raw"}
    return Trace(np.ones(100 * seconds), header | stats)


def kept(*traces: Trace) -> list[str]:
    stream, rejected = one_series(Stream(list(traces)))
    assert len(stream) + len(rejected) == len(traces)
    return [trace.stats.source for trace in stream]


def test_acceleration_goes_before_counts():
    counts, physical = form("a.V0", "counts"), form("a.V1")
    assert kept(counts, physical) == kept(physical, counts) == ["a.V1"]
    _, (row,) = one_series(Stream([counts, physical]))
    assert (row.kind, row.name, row.source) == ("record", "CE.1..HNN", "a.V0")
    assert row.reasons == ("the same record as a.V1 (COSMOS in m/s2), which is read instead",)


def test_the_longer_form_goes_first():
    assert kept(form("a.smc", kind="SMC", seconds=40), form("a.V0", "counts")) == ["a.V0"]


def test_of_equal_forms_the_choice_does_not_depend_on_the_order():
    one, two = form("b.raw", kind="CSMIP_V1"), form("a.smc", kind="SMC")
    assert kept(one, two) == kept(two, one) == ["b.raw"]


@pytest.mark.parametrize(
    "stats",
    [
        {"starttime": START + 3600},
        {"channel": "HNE"},
        {"location": "01"},
        {"station": "2"},
        {"processing_level": "processed"},
    ],
)
def test_another_time_channel_or_state_is_another_record(stats: dict[str, object]):
    assert kept(form("a.V1"), form("b.smc", kind="SMC", **stats)) == ["a.V1", "b.smc"]


def test_pieces_of_one_form_all_stay():
    later = form("b.V1", starttime=START + 50)
    assert kept(form("a.V1"), later, form("a.V0", "counts")) == ["a.V1", "b.V1"]
