"""Response spectra: laws of physics first, then references that share no code."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.signal import lsim

from per_obspy.kernels.spectra import tile_search as blocks
from per_obspy.spectra import elastic
from per_obspy.spectra.elastic import (
    over_blocks,
    per_spectrum,
    prepare_oscillators,
    response_spectra,
    sampled_per_spectrum,
    sampled_response_spectra,
    stretches,
    tiled_record,
)

DT = 0.01


PERIODS = np.array([0.03, 0.1, 0.33, 1.0, 4.0])


@pytest.mark.parametrize("damping", [0.0, 0.05, 0.3, 0.99])
@pytest.mark.parametrize("ratio", [0.3, 1.0, 1.7, 3.0, 10.0, 70.0, 700.0, 5000.0])
def test_agrees_with_matrix_exponentials(noise, reference, ratio, damping):
    # catches any wrong coefficient, missed stationary point, missing ramp or missing free vibration
    period = ratio * DT
    ours = response_spectra(noise, DT, [period], damping)
    expected = reference(noise, DT, period, damping)
    # 1e-9 is what the package promises; Brent's method leaves 1e-10 of the reference
    assert_allclose([ours.per[0], ours.sd[0], ours.sv[0], ours.sa[0]], expected, rtol=1e-9)
    assert_allclose(per_spectrum(noise, DT, [period], damping), expected[:1], rtol=1e-9)


@pytest.mark.parametrize("record", [[2.0], [0.0, -1.0], [1.0, 1.0], [3.0, -1.0]])
def test_shortest_records_agree_with_matrix_exponentials(reference, record):
    # catches a lost first sample or a lost closing ramp
    ours = response_spectra(record, DT, [0.05, 0.4], 0.02)
    for i, period in enumerate([0.05, 0.4]):
        expected = reference(np.array(record), DT, period, 0.02)
        assert_allclose([ours.per[i], ours.sd[i], ours.sv[i], ours.sa[i]], expected, rtol=1e-9)


def test_samples_agree_with_lsim(noise):
    # catches an error that the search between samples could hide
    closed = np.append(noise, 0.0)
    time = np.arange(closed.size) * DT
    for period in PERIODS:
        omega = 2 * np.pi / period
        system = ([[0, 1], [-(omega**2), -0.1 * omega]], [[0], [-1]], np.eye(2), [[0], [0]])
        _, states, _ = lsim(system, closed, time)
        radius = np.hypot(states[:, 0], states[:, 1] / omega).max()
        # lsim's own matrix exponential is good to 1e-12
        assert_allclose(sampled_per_spectrum(noise, DT, [period], 0.05), [radius], rtol=1e-10)
        assert_allclose(
            sampled_response_spectra(noise, DT, [period], 0.05).per, [radius], rtol=1e-10
        )


def test_more_samples_of_the_same_straight_lines_change_nothing(noise):
    # catches maxima taken at samples only; the rounding of interpolated samples allows 1e-12
    closed = np.append(noise, 0.0)
    finer = np.interp(np.arange(closed.size * 7 - 6) / 7, np.arange(closed.size), closed)
    for coarse, fine in zip(
        response_spectra(noise, DT, PERIODS), response_spectra(finer, DT / 7, PERIODS), strict=True
    ):
        assert_allclose(fine, coarse, rtol=1e-11)


def test_sampled_peaks_never_exceed_the_exact_ones(noise):
    # catches a search that replaces instead of raising
    dampings = [0.0, 0.05]
    exact, sampled = (
        response_spectra(noise, DT, PERIODS, dampings),
        sampled_response_spectra(noise, DT, PERIODS, dampings),
    )
    for larger, smaller in zip(exact, sampled, strict=True):
        assert np.all(smaller <= larger * (1 + 1e-13))
    assert np.any(sampled.per < 0.99 * exact.per)  # T = 3 dt: several per cent are missed


@pytest.mark.parametrize("factor", [1e-3, -2.0, 50.0, 1e-170, 1e170])
def test_everything_is_proportional_to_the_motion(noise, factor):
    # catches absolute thresholds, and squares that overflow or vanish
    for once, scaled in zip(
        response_spectra(noise, DT, PERIODS),
        response_spectra(factor * noise, DT, PERIODS),
        strict=True,
    ):
        assert_allclose(scaled, abs(factor) * once, rtol=1e-12)


def test_powers_of_two_scale_exactly(noise):
    # catches a scale that is not undone exactly
    assert_array_equal(per_spectrum(8 * noise, DT, PERIODS), 8 * per_spectrum(noise, DT, PERIODS))


def test_the_weakest_record_that_a_float_holds_scales_too(noise):
    # catches an inverse of the scale that overflows; at 2**-1040 samples and result keep a few
    # digits only: the smallest number is 2**-1074
    weak = per_spectrum(noise * 2.0**-1040, DT, PERIODS)
    once = per_spectrum(noise, DT, PERIODS)
    assert_allclose(weak * 2.0**1020 * 2.0**20, once, rtol=1e-5)


def test_stretched_time_scales_lengths_by_its_square(noise):
    # catches a mixed-up omega: [m] = [m/s²] [s²]
    once, stretched = (
        response_spectra(noise, DT, PERIODS),
        response_spectra(noise, 4 * DT, 4 * PERIODS),
    )
    for field, power in (("per", 2), ("sd", 2), ("sv", 1), ("sa", 0), ("psv", 1), ("psa", 0)):
        assert_allclose(getattr(stretched, field), 4.0**power * getattr(once, field), rtol=1e-12)


@pytest.mark.parametrize("count", [1, 63, 64, 65, 16384])
def test_a_late_start_changes_nothing(noise, count):
    # catches states lost between tiles (64 steps) or stretches (16384 steps)
    quiet_start = np.concatenate([[0.0], noise])
    late = np.concatenate([np.zeros(count), quiet_start])
    # a tile seam moves, and with it which of two equal formulas is used
    assert_allclose(
        per_spectrum(late, DT, PERIODS), per_spectrum(quiet_start, DT, PERIODS), rtol=1e-12
    )


@pytest.mark.parametrize("count", [1, 500])
def test_zeros_after_the_record_change_nothing(noise, count):
    # catches free vibration that is left out; undamped at long periods it holds the largest
    # displacement
    padded = np.concatenate([noise, np.zeros(count)])
    for damping in (0.0, 0.05):
        pairs = zip(
            response_spectra(noise, DT, PERIODS, damping),
            response_spectra(padded, DT, PERIODS, damping),
            strict=True,
        )
        for once, longer in pairs:
            assert_allclose(longer, once, rtol=1e-12)


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    samples=st.integers(1, 300),
    smoothing=st.integers(1, 12),
    ratio=st.floats(0.3, 2000.0),
    damping=st.floats(0.0, 0.95),
)
def test_radius_lies_between_its_bounds(seed, samples, smoothing, ratio, damping):
    # (13) and (14) of Valles-Mattox & Reinhorn as the inequalities that hold; catches a peak of SD
    # or SV between the samples that PER misses (or the reverse), as at periods of few steps, where
    # samples alone miss up to 14 %
    noise = np.random.default_rng(seed).normal(size=samples + smoothing - 1)
    record = np.convolve(noise, np.ones(smoothing), "valid")
    periods = ratio * DT * np.array([1.0, 1.3, 7.0])
    spectra = response_spectra(record, DT, periods, damping)
    omega = 2 * np.pi / periods
    # rounding alone: these are inequalities between exact numbers
    assert np.all(np.maximum(spectra.sd, spectra.sv / omega) <= spectra.per * (1 + 1e-12))
    assert np.all(spectra.per <= np.hypot(spectra.sd, spectra.sv / omega) * (1 + 1e-12))
    # the same radius by the other kernel; its states are rotated, which costs some digits
    assert_allclose(per_spectrum(record, DT, periods, damping), spectra.per, rtol=1e-9)


def test_undamped_oscillator_under_a_sudden_step():
    # closed form: twice the static displacement, at half a period
    spectra = response_spectra(np.full(300, 9.81), DT, [1.0], damping=0.0)
    assert_allclose(spectra.sd, 2 * 9.81 / (2 * np.pi) ** 2, rtol=1e-12)
    assert_allclose(spectra.sa, 2 * 9.81, rtol=1e-12)


def test_damped_oscillator_under_a_sudden_step():
    # closed form: overshoot exp(-pi xi / sqrt(1 - xi²))
    damping = np.array([0.05, 0.5])
    overshoot = np.exp(-np.pi * damping / np.sqrt(1 - damping**2))
    spectra = response_spectra(np.full(300, 9.81), DT, [1.0], damping)
    assert_allclose(spectra.sd[:, 0], (1 + overshoot) * 9.81 / (2 * np.pi) ** 2, rtol=1e-12)


def test_stiff_oscillators_follow_the_ground():
    # T << dt: quasi-static but for the jump of the slope, of order T / dt
    smooth = np.concatenate([[0.0], np.sin(np.arange(1, 40) * 0.3)])
    period = DT / 50
    omega = 2 * np.pi / period
    assert_allclose(per_spectrum(smooth, DT, [period]) * omega**2, np.abs(smooth).max(), rtol=0.01)


def test_soft_oscillators_stay_where_they_are(noise):
    # T -> infinity: SD is the peak ground displacement, PER the peak ground velocity over omega
    period = 1e4
    record = np.append(noise, -noise.sum())
    velocity = np.concatenate([[0.0], np.cumsum(0.5 * (record[1:] + record[:-1]))]) * DT
    # error: omega² times the square of the duration
    spectra = response_spectra(record, DT, [period], 0.0)
    peaks = np.abs(velocity).max(), spectra.sv[0]
    # the peak ground velocity lies between samples: less than one sample of acceleration more
    assert peaks[0] <= peaks[1] <= peaks[0] + np.abs(record).max() * DT
    assert_allclose(spectra.per * 2 * np.pi / period, spectra.sv, rtol=1e-6)


@pytest.mark.parametrize("divisor", [1, 2, 3])
def test_undamped_period_that_divides_the_step(noise, reference, divisor):
    # the scaled input of the packed step vanishes here
    period = DT / divisor
    assert_allclose(
        per_spectrum(noise, DT, [period], 0.0), reference(noise, DT, period, 0.0)[:1], rtol=1e-9
    )


def test_no_motion_no_response():
    for values in response_spectra(np.zeros(100), DT, PERIODS, [0.0, 0.05]):
        assert_array_equal(values, np.zeros((2, PERIODS.size)))


def test_shapes_follow_the_dampings(noise):
    assert per_spectrum(noise, DT, PERIODS).shape == (5,)
    assert per_spectrum(noise, DT, PERIODS, [0.05]).shape == (1, 5)
    assert per_spectrum(noise, DT, PERIODS, [0.02, 0.05, 0.1]).shape == (3, 5)
    assert per_spectrum(noise, DT, 1.0).shape == (1,)
    # catches rows and columns exchanged
    assert_array_equal(
        per_spectrum(noise, DT, PERIODS, [0.02, 0.1])[1], per_spectrum(noise, DT, PERIODS, 0.1)
    )


def test_many_oscillators_equal_few(noise):
    # catches lanes mixed up between blocks of 64
    periods = np.geomspace(0.05, 5.0, 130)
    alone = np.concatenate([per_spectrum(noise, DT, [period]) for period in periods])
    assert_array_equal(per_spectrum(noise, DT, periods), alone)


def test_inputs_stay_unchanged_and_counts_are_numbers(noise):
    before = noise.copy()
    response_spectra(noise, DT, PERIODS)
    assert_array_equal(noise, before)
    assert_array_equal(
        per_spectrum([1, 2, 3], DT, PERIODS), per_spectrum([1.0, 2.0, 3.0], DT, PERIODS)
    )


def test_threads_change_no_bit(noise, monkeypatch):
    periods = np.geomspace(0.05, 5.0, 300)
    alone = response_spectra(noise, DT, periods)
    monkeypatch.setattr(elastic, "STEPS_WORTH_THREADS", 0)
    monkeypatch.setattr("per_obspy.threads.usable_processors", lambda: 4)
    for once, threaded in zip(alone, response_spectra(noise, DT, periods), strict=True):
        assert_array_equal(threaded, once)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"acceleration": [0.0, np.nan]}, "acceleration must be finite, got nan"),
        ({"acceleration": [0.0, np.inf]}, "acceleration must be finite, got inf"),
        ({"acceleration": []}, "acceleration must be one row"),
        ({"acceleration": np.zeros((2, 3))}, r"acceleration must be one row .*\(2, 3\)"),
        ({"acceleration": ["a"]}, "acceleration must be real numbers"),
        ({"acceleration": [1j]}, "acceleration must be real numbers"),
        ({"dt": 0.0}, "dt must be positive, got 0"),
        ({"dt": -1.0}, "dt must be positive, got -1"),
        ({"dt": [0.1, 0.2]}, "dt must be a single number"),
        ({"periods": [1.0, 0.0]}, "periods must be positive, got 0.0 at index 1"),
        ({"periods": []}, r"periods must be one row of at least one value, got the shape \(0,\)"),
        ({"periods": [[1.0]]}, "periods must be one row"),
        ({"damping": 1.0}, "damping must be at least 0 and below 1, got 1.0"),
        ({"damping": [-0.1]}, "damping must be at least 0 and below 1, got -0.1"),
        ({"damping": [[0.1]]}, r"damping must be .* got the shape \(1, 1\)"),
        ({"damping": []}, r"damping must be .* got the shape \(0,\)"),
    ],
)
def test_wrong_arguments_are_named(changed, message):
    arguments = {"acceleration": [0.0, 1.0], "dt": DT, "periods": [1.0], "damping": 0.05} | changed
    for function in (
        per_spectrum,
        response_spectra,
        sampled_per_spectrum,
        sampled_response_spectra,
    ):
        with pytest.raises(ValueError, match=message):
            function(**arguments)


RANDOM = np.random.default_rng(4)


@pytest.mark.parametrize("count", [1, blocks.TILE - 1, blocks.TILE, 3 * blocks.TILE + 7])
@pytest.mark.parametrize("factor", [1e-200, 1.0, 7e150])
def test_the_scale_is_undone_exactly_and_zeros_close_the_record(count, factor):
    # would catch a scale that is no power of two, and a last sample without its ramp
    motion = factor * RANDOM.normal(size=count)
    record = tiled_record(motion)
    assert_array_equal(record.north[:count] * record.scale, motion)
    assert 1.0 <= np.abs(record.north).max() < 2.0
    assert (record.north.size - 1) % blocks.TILE == 0
    assert record.north.size > count
    assert not record.north[count:].any()


def test_no_motion_is_not_scaled():
    # would catch a logarithm of zero
    record = tiled_record(np.zeros(5), np.zeros(5))
    assert record.scale == 1.0
    assert not record.peaks.any()


def test_peaks_and_jumps_are_those_of_each_tile():
    # would catch a tile without its last sample, which belongs to the next one too
    north, east = RANDOM.normal(size=(2, 4 * blocks.TILE))
    record = tiled_record(north, east)
    for component, scaled in enumerate((record.north, record.east)):
        for tile in range(4):
            samples = scaled[tile * blocks.TILE : (tile + 1) * blocks.TILE + 1]
            assert record.peaks[component, tile] == np.abs(samples).max()
            assert record.jumps[component, tile] == np.abs(np.diff(samples)).max()


def test_stretches_share_one_sample_and_hold_the_whole_record():
    count = blocks.TILES * blocks.TILE
    record = tiled_record(*RANDOM.normal(size=(2, 2 * count + 5)))
    parts = list(stretches(record))
    assert [part.peaks.shape[1] for part in parts] == [blocks.TILES, blocks.TILES, 1]
    # The state at the shared sample is where the next stretch goes on
    for part, following in itertools.pairwise(parts):
        assert following.north[0] == part.north[-1]
    joined = np.concatenate([parts[0].east, *(part.east[1:] for part in parts[1:])])
    assert_array_equal(joined, record.east)


def test_oscillators_feel_their_own_azimuth():
    oscillators = prepare_oscillators(
        0.01, np.array([0.5, 2.0]), np.array([0.0, 0.1]), np.array([0.0, 90.0])
    )
    np.testing.assert_allclose(oscillators.weights, [[1.0, 0.0], [0.0, 1.0]], atol=1e-16)
    assert_array_equal(oscillators.phases, oscillators.omegas * 0.01)


@pytest.mark.parametrize("count", [1, blocks.LANES, 2 * blocks.LANES + 3])
def test_blocks_return_every_oscillator_once_and_in_order(count):
    # would catch results of the copies that fill up the last block
    periods = RANDOM.uniform(0.1, 1.0, count)
    oscillators = prepare_oscillators(0.01, periods, np.zeros(count))
    sizes = []

    def omegas_of(block):
        sizes.append(block.size)
        assert block.omegas.size == blocks.LANES
        return block.omegas[np.newaxis]

    rows = over_blocks(omegas_of, oscillators, tiled_record(np.ones(3)))
    assert_array_equal(rows, [2.0 * np.pi / periods])
    assert sum(sizes) == count
