import numpy as np
import pytest
from numpy.testing import assert_array_equal
from obspy import Stream, Trace, UTCDateTime

from per_obspy.processing.station.merging import merged


def trace(channel="HNE", count=1000, start=0.0, location="", **stats):
    header = {
        "network": "XX",
        "station": "STA",
        "location": location,
        "channel": channel,
        "sampling_rate": 100.0,
    }
    header |= {"starttime": UTCDateTime(2020, 1, 1) + start} | stats
    return Trace(np.sin(np.arange(count) + 100 * start), header)


def test_pieces_that_follow_each_other_become_one_trace():
    whole, rejected = merged(Stream([trace(start=10.0), trace()]))
    assert_array_equal(whole[0].data, np.concatenate([trace().data, trace(start=10.0).data]))
    assert rejected == ()


def test_a_gap_is_a_reason_and_not_zeros():
    whole, rejected = merged(Stream([trace(), trace(start=12.0), trace("HNN")]))
    assert [component.id for component in whole] == ["XX.STA..HNN"]
    assert rejected[0].name == "XX.STA..HNE"
    assert "200 of 2200 samples are missing" in rejected[0].reasons[0]
    assert "2020-01-01T00:00:10" in rejected[0].reasons[0]


def test_overlapping_pieces_that_disagree_are_a_reason():
    other = trace(start=5.0)
    other.data = np.random.default_rng(1).normal(size=1000)
    assert (
        "500 of 1500 samples contradict each other"
        in merged(Stream([trace(), other]))[1][0].reasons[0]
    )


@pytest.mark.parametrize("bad", [np.nan, np.inf, -1e200])
def test_samples_that_are_not_finite_are_a_reason(bad):
    broken = trace()
    broken.data[7] = bad
    whole, rejected = merged(Stream([broken]))
    assert not whole
    reason = (
        "1 of 1000 samples are not finite or beyond 1e+30, the first at 2020-01-01T00:00:00.070000Z"
    )
    assert rejected[0].reasons == (reason,)


def test_masked_samples_are_a_reason():
    broken = trace()
    broken.data = np.ma.masked_greater(broken.data, 0.9999)
    assert "are missing" in merged(Stream([broken]))[1][0].reasons[0]


def test_every_difference_between_pieces_is_named():
    _, rejected = merged(Stream([trace(), trace(start=10.0, calib=2.0, sampling_rate=50.0)]))
    assert len(rejected[0].reasons) == 2
    assert "sampling_rate: 100.0, 50.0" in rejected[0].reasons[0]


def test_an_empty_trace_is_a_reason():
    assert merged(Stream([trace(count=0)]))[1][0].reasons == ("no samples",)


def test_inputs_stay_unchanged():
    stream = Stream([trace(), trace(start=10.0), trace("HNN")])
    before = stream.copy()
    merged(stream)
    assert stream == before


def test_velocity_and_displacement_of_a_channel_are_not_pieces_of_its_acceleration():
    acceleration = trace(units="m/s2")
    integrals = [trace(units="m/s"), trace(units="m")]
    whole, rejected = merged(Stream([acceleration, *integrals]))
    assert rejected == ()
    assert [part.stats.units for part in whole] == ["m/s2", "m/s", "m"]
