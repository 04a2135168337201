"""Pieces of a channel: joined, spliced where clocks contradict each other, or refused."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from obspy import Stream, Trace, UTCDateTime, read

from per_obspy.processing.merging import best_overlap, merged, splice


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


def test_velocity_and_displacement_of_a_channel_are_not_pieces_of_its_acceleration():
    acceleration = trace(units="m/s2")
    integrals = [trace(units="m/s"), trace(units="m")]
    whole, rejected = merged(Stream([acceleration, *integrals]))
    assert rejected == ()
    assert [part.stats.units for part in whole] == ["m/s2", "m/s", "m"]


def copies(*factors, **stats):
    """Return copies of one piece, times factors, each under a file of its own."""
    parts = [trace(**stats) for _ in factors]
    for part, factor in zip(parts, factors, strict=True):
        part.data = factor * part.data
    return parts


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 0, 1), (1, 2, 0)])
@pytest.mark.parametrize("factors", [(1, 8, 3), (1, 1, 3), (1, 0, 1), (1, 1, 1.01)])
def test_three_pieces_that_contradict_each_other_are_refused(factors, order):
    # mutation: joined in turn, two of them leave a hole that the third one fills
    parts = copies(*factors)
    whole, rejected = merged(Stream([parts[place] for place in order]))
    assert not whole
    # the sine is 0 at its first sample only
    assert "999 of 1000 samples contradict each other" in rejected[0].reasons[0]


@pytest.mark.parametrize("shift", [0.01, 0.5, 3.0])
@pytest.mark.parametrize("count", [2, 3])
def test_a_copy_that_is_shifted_is_refused(earthquake, count, shift):
    parts = [trace() for _ in range(count)]
    for part in parts:
        part.data = earthquake()
    parts[-1].stats.starttime += shift
    assert not merged(Stream(parts))[0]


def test_a_short_copy_of_another_size_is_not_joined_to_its_end(earthquake):
    # mutation: the correlation of a signal with 8 times itself is 1
    parts = [trace(), trace()]
    for factor, part in zip((1, 8), parts, strict=True):
        part.data = factor * earthquake(onset=5.0)[:2000]
    assert not merged(Stream(parts))[0]


@pytest.mark.parametrize("count", [1, 2, 10])
def test_any_number_of_pieces_that_agree_is_joined_in_any_order(earthquake, count):
    truth, parts = earthquake(), []
    starts = np.linspace(0, truth.size - 2000, count).astype(int)
    ends = [*(starts[1:] + 300), truth.size]
    for start, end in zip(starts, ends, strict=True):
        part = trace(start=start / 100)
        part.data = truth[start:end]
        parts += [part, part.copy()]
    np.random.default_rng(3).shuffle(parts)
    whole, rejected = merged(Stream(parts))
    assert rejected == ()
    assert_array_equal(whole[0].data, truth)


@pytest.mark.parametrize("rate", [99.99999, 100 / 1.0000001, 99.9999, 100.0005])
def test_rates_that_differ_by_rounding_are_one(earthquake, rate):
    # An hour of 1e-7 is a thousandth of a sample
    truth = earthquake()
    first, second = trace(), trace(start=60.0, sampling_rate=rate)
    first.data, second.data = truth[:6000], truth[6000:]
    whole, rejected = merged(Stream([second, first]))
    assert rejected == ()
    assert_array_equal(whole[0].data, truth)
    assert whole[0].stats.sampling_rate == pytest.approx(100, rel=1e-5)


@pytest.mark.parametrize(
    ("stats", "reason"),
    [
        ({"sampling_rate": 50.0}, "sampling_rate: 100.0, 50.0"),
        ({"sampling_rate": 99.9}, "sampling_rate: 100.0, 99.9"),
        ({"units": "m/s2"}, "units: counts, m/s2"),
        ({"units": "counts", "calib": 2.0}, "calib: 1.0, 2.0"),
        ({"coordinates": {"latitude": 35.5, "longitude": -117.0}}, "latitude: 35.0, 35.5"),
    ],
)
def test_pieces_of_another_kind_are_refused(stats, reason):
    place = {"latitude": 35.0, "longitude": -117.0}
    parts = [trace(coordinates=place), trace(start=10.0, **{"coordinates": place} | stats)]
    whole, rejected = merged(Stream(parts))
    assert not whole
    assert rejected[0].reasons == (f"pieces differ in {reason}",)


def test_factors_and_places_that_differ_by_rounding_are_one():
    place = {"latitude": 35.0, "longitude": -117.0}
    near = {"latitude": 35.001, "longitude": -117.001}
    second = {"coordinates": near, "calib": float(np.float32(0.001)), "units": "m/s2"}
    parts = [trace(coordinates=place, calib=0.001, units="m/s2"), trace(start=10.0, **second)]
    assert merged(Stream(parts))[1] == ()


def test_pieces_with_and_without_their_response_removed_are_no_channel():
    # mutation: the header of the first piece decides, and the other is divided once more
    removed = "ObsPy 1.4.0: remove_response(inventory=None::output='ACC')"
    parts = [trace(), trace(start=10.0, processing=[removed])]
    assert merged(Stream(parts))[1][0].reasons == ("pieces differ in units: counts, m/s2",)


def test_directions_that_a_reader_does_not_know_are_no_pieces_of_each_other():
    parts = [trace("HN", direction=word) for word in ("OTHR", "NONE")]
    whole, rejected = merged(Stream(parts))
    assert (len(whole), rejected) == (2, ())


def test_pieces_years_apart_take_no_memory():
    parts = [trace(), trace(start=10 * 365 * 86400.0)]
    assert "pieces are up to" in merged(Stream(parts))[1][0].reasons[0]


RATE = 100.0


def pieces(samples, overlap, clock_error, noise=0.0):
    """Return two halves that share an overlap (s); the clock of the second is wrong by seconds."""
    half, count = samples.size // 2, round(overlap * RATE)
    second = samples[half - count :]
    second = second + noise * np.random.default_rng(5).normal(size=second.size)
    # times by the clocks
    start = UTCDateTime(2010, 2, 27)
    header = {"sampling_rate": RATE, "channel": "HNE", "starttime": start}
    late = {"starttime": start + (half - count) / RATE + clock_error}
    return Stream([Trace(samples[:half], header), Trace(second, header | late)])


@pytest.mark.parametrize("clock_error", [-3.0, 11.0])
def test_pieces_are_joined_where_their_samples_agree(earthquake, clock_error):
    # mutation: trusting the clocks doubles or drops seconds of shaking
    truth = earthquake(onset=40.0)
    joined = splice(pieces(truth, 20.0, clock_error, noise=1e-3))
    assert joined.stats.npts == truth.size
    assert_allclose(joined.data, truth, atol=6e-3)  # six times the noise
    assert joined.stats.per_obspy.splice_shift == pytest.approx(-clock_error, abs=1e-6)


def test_one_piece_fades_into_the_other(earthquake):
    # mutation: taking either piece for the whole overlap makes a step
    first, second = pieces(earthquake(onset=40.0), 20.0, 3.0)
    second.data = second.data + 0.05
    joined = splice(Stream([first, second])).data - earthquake(onset=40.0)
    assert_allclose(joined[4000:6000], np.linspace(0, 0.05, 2000), atol=1e-12)


def test_pieces_that_agree_nowhere_are_not_joined(earthquake):
    first, second = pieces(earthquake(onset=40.0), 20.0, 0.0)
    second.data = second.data[::-1].copy()
    assert splice(Stream([first, second])) is None


def test_the_overlap_is_found_exactly(earthquake):
    truth = earthquake(onset=40.0)
    count, correlation = best_overlap(truth[:6000], truth[4321:], 200, 3000)
    assert count == 6000 - 4321
    assert correlation == pytest.approx(1.0)
    assert best_overlap(truth[:100], truth[:100], 200, 3000) == (0, 0.0)


def test_a_gap_is_never_closed(earthquake):
    stream = pieces(earthquake(), 5.0, 30.0)
    whole, rejected = merged(stream)
    assert not whole
    assert "samples are missing" in rejected[0].reasons[0]


@pytest.mark.real_data
@pytest.mark.parametrize("station", ["angol", "stgomaipu", "curico"])
def test_maule_records_in_two_files_become_one(real_data, station):
    # their files overlap by 20 s, by their clocks 7 to 9 s
    folder = real_data / "records" / "maule2010_renadic"
    parts = [read(str(path), format="RENADIC") for path in sorted(folder.glob(f"{station}*.v1"))]
    whole, rejected = merged(parts[0] + parts[1])
    assert not [row for row in rejected if "HN4" not in row.name]
    moving = [trace for trace in whole if np.ptp(trace.data)]
    count = parts[0][0].stats.npts + parts[1][0].stats.npts - 1999
    assert {trace.stats.npts for trace in moving} == {count}


def test_components_under_one_code_never_give_the_last_one():
    parts = [trace("HN") for _ in range(3)]
    for seed, part in enumerate(parts):
        part.data = np.random.default_rng(seed).normal(size=1000)
    whole, rejected = merged(Stream(parts))
    assert not whole
    assert "1000 of 1000 samples contradict each other" in rejected[0].reasons[0]
