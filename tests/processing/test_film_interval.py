import numpy as np
from numpy.testing import assert_allclose, assert_array_equal
from obspy import Stream, Trace

from per_obspy.processing.components import at_one_interval, orient, paired


def film(channel, dt, seconds=20.0, digitised=True):
    times = dt * np.arange(round(seconds / dt))
    header = {"channel": channel, "delta": dt, "units": "m/s2"}
    return Trace(np.sin(times), header | ({"digitised": True} if digitised else {}))


def test_horizontals_of_film_whose_intervals_differ_by_parts_in_100_000_are_a_pair():
    stream = map(orient, Stream([film("HNN", 0.01), film("HNE", 0.01 * (1 + 4e-5))]))
    kept, rejected = paired(stream, 0.8)
    assert rejected == ()
    assert [trace.stats.delta for trace in kept] == [0.01, 0.01]
    assert len({trace.stats.npts for trace in kept}) == 1
    # Linear interpolation of sin(t) is at most dt^2 / 8 = 1.25e-5 off
    for trace in kept:
        assert_allclose(trace.data, np.sin(trace.times()), rtol=0, atol=1.3e-5)
    notes = [line for trace in kept for line in trace.stats.get("processing", [])]
    assert len(notes) == 1
    assert "film interpolated from 0.0100004 s to 0.01 s" in notes[0]


def test_other_records_whose_intervals_differ_are_no_pair():
    stream = [film("HNN", 0.01, digitised=False), film("HNE", 0.0100004, digitised=False)]
    _, rejected = paired(map(orient, Stream(stream)), 0.8)
    assert len(rejected) == 1
    assert "sampled every" in rejected[0].reasons[0]


def test_inputs_stay_unchanged():
    stream = Stream([film("HNN", 0.01), film("HNE", 0.02), film("HNZ", 0.03, digitised=False)])
    before = [trace.copy() for trace in stream]
    result = at_one_interval(stream)
    assert [trace.stats.delta for trace in result] == [0.01, 0.01, 0.03]
    for trace, old in zip(stream, before, strict=True):
        assert_array_equal(trace.data, old.data)
        assert trace.stats == old.stats
