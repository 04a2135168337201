"""Notes on a trace, rows of rejected traces, and copies that share samples and response."""

import numpy as np
from obspy import Stream, Trace, UTCDateTime
from obspy.core import AttribDict
from obspy.core.inventory import Response

from per_obspy.processing.account import copy_header, is_processed, rejection, taken, with_note


def test_a_copy_is_equal_and_shares_nothing_but_samples_and_response():
    header = {
        "station": "STA",
        "delta": 0.02,
        "starttime": UTCDateTime(2020, 1, 1),
        "corners": AttribDict(highpass=0.1),
    }
    trace = Trace(np.arange(5.0), header | {"response": Response(), "processing": ["one"]})
    before, out = trace.copy(), copy_header(trace)
    assert out == trace
    assert out.stats.response is trace.stats.response
    assert out.data is trace.data
    # New samples and notes are those of the copy alone
    out.data, out.stats.corners.highpass = out.data + 7.0, 0.2
    out.stats.processing.append("two")
    assert trace == before  # would catch a copy of the header that is not deep


def test_traces_that_are_taken_leave_their_stream():
    first, second = Trace(np.zeros(3)), Trace(np.ones(3))
    stream = Stream([first, second])
    remaining = [(trace, len(stream)) for trace in taken(stream)]
    assert [count for _, count in remaining] == [1, 0]
    assert remaining[0][0] is first
    assert remaining[1][0] is second


def test_masked_samples_stay_masked():
    data = np.ma.masked_equal(np.arange(5.0), 2.0)
    assert copy_header(Trace(data)).data.mask.tolist() == data.mask.tolist()


def test_steps_are_listed_and_numbers_are_replaced():
    given = Trace(np.zeros(3))
    trace = with_note(given, "first step", corner=0.1)
    trace = with_note(trace, "second step", corner=0.2, order=5)
    assert "processing" not in given.stats
    assert trace.stats.processing == ["per_obspy: first step", "per_obspy: second step"]
    assert trace.stats.per_obspy == {"corner": 0.2, "order": 5}


def test_a_rejection_names_trace_and_file():
    trace = Trace(np.zeros(3), {"channel": "HNE", "source": "a.mseed"})
    row = rejection(trace, "first", "second")
    assert row == ("record", "...HNE", "a.mseed", None, ("first", "second"))


def test_only_the_level_processed_counts_as_processed():
    levels = ("processed", "raw", "unknown")
    traces = [Trace(header={"processing_level": level}) for level in levels]
    assert [is_processed(trace) for trace in [*traces, Trace()]] == [True, False, False, False]
