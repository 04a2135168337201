import numpy as np
import pytest
from numpy.testing import assert_allclose
from obspy import Stream, Trace, UTCDateTime, read

from per_obspy.processing.merging import best_overlap, merged, splice

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
