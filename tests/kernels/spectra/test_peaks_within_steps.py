"""Peaks side by side against those of one step after the other, and the bounds that rule steps out."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.kernels.oscillator import within_step
from per_obspy.kernels.oscillator.exact_step import step
from per_obspy.kernels.spectra import azimuth_steps, azimuths, blocks, peaks_within_steps


def _alone(problem, phase, damping):
    """Largest squared radius and displacement at the stationary points of one step, by the search one at a time."""
    largest, wanted = np.zeros(4), np.array([True, True, False, False])
    within_step.largest_in_step(*problem, damping, phase, wanted, within_step.workspace(), largest)
    return largest[0], largest[1] ** 2


@pytest.mark.parametrize("share", [0.0, 1.0])
@pytest.mark.parametrize(
    ("phase", "damping"), [(0.02, 0.0), (0.1, 0.05), (0.45, 0.3), (0.499, 0.0), (2.0, 0.05)]
)
def test_peaks_side_by_side_are_those_of_each_step(phase, damping, share):
    # catches lanes mixed up, a root taken for sure where there may be two, and places exchanged
    problems = np.random.default_rng(4).normal(size=(4, blocks.LANES))
    problems[1] *= phase  # displacement peaks within the step
    places = np.random.default_rng(5).permutation(blocks.LANES)
    best, count = np.zeros(blocks.LANES), blocks.LANES - 3
    u, z, start, end = problems.copy()
    peaks_within_steps.raise_to_peaks(
        problems, places, count, azimuths.Oscillator(0, phase, damping, share), best
    )
    a11, a12, a21, a22, b11, b12, b21, b22 = step(1.0, damping, phase)
    u_end, z_end = (
        a11 * u + a12 * z + b11 * start + b12 * end,
        a21 * u + a22 * z + b21 * start + b22 * end,
    )
    samples = np.maximum(u**2 + share * z**2, u_end**2 + share * z_end**2)
    expected = [
        _alone((u[i], z[i], start[i], end[i]), phase, damping)[0 if share else 1]
        for i in range(count)
    ]
    # samples count on both sides: only peaks above them matter
    found = np.maximum(best[places[:count]], samples[:count])
    # both find a root to 1e-8 of the step, and the square changes by the square of that
    assert_allclose(found, np.maximum(expected, samples[:count]), rtol=1e-13)
    assert np.all(best[places[count:]] == 0.0)


@pytest.mark.parametrize("share", [0.0, 1.0])
@pytest.mark.parametrize("period", [4.0, 11.0, 60.0, 900.0])
def test_steps_that_are_not_listed_hold_no_more_than_the_samples(period, share):
    # catches a bound that is too small, a slope with the wrong sign, and a floor above the largest
    # squares
    samples, damping, phase = 4 * blocks.TILE, 0.05, 2.0 * np.pi / period
    north, east = np.zeros((2, samples + 1))
    north[:samples], east[:samples] = np.random.default_rng(6).normal(size=(2, samples)) * [
        [1.0],
        [0.3],
    ]
    packed, state, kept = (
        np.empty((8, blocks.LANES)),
        np.zeros((4, blocks.LANES)),
        np.empty((4, 6, blocks.LANES)),
    )
    azimuths.pack_steps(np.full(blocks.LANES, phase), np.full(blocks.LANES, damping), packed)
    azimuths.run_azimuth_tiles(north, east, packed, state, kept)
    extremes = np.empty((2, 2, 4))
    for component, motion in enumerate((north, east)):
        blocks.tile_extremes(motion, extremes[0, component], extremes[1, component])
    angles = np.radians(np.arange(0.0, 180.0, 7.5))
    directions = np.stack([np.cos(angles), np.sin(angles), np.cos(2 * angles), np.sin(2 * angles)])
    oscillator = azimuths.Oscillator(0, phase, damping, share)
    best, steps = np.zeros(angles.size), np.empty((samples, azimuth_steps.COLUMNS))
    azimuths.raise_azimuths_to_samples(north, east, kept, oscillator, directions, best)
    count = azimuth_steps.list_steps(
        north, east, *extremes, kept, oscillator, directions, best, steps
    )
    # twenty values a step, all azimuths, from states of the same oscillator with a twentieth of the
    # step
    fine = [
        np.interp(np.arange(20 * samples + 1) / 20, np.arange(samples + 1), motion)
        for motion in (north, east)
    ]
    a11, a12, a21, a22, b11, b12, b21, b22 = step(1.0, damping, phase / 20)
    states = np.zeros((20 * samples + 1, 2, 2))
    for i in range(20 * samples):
        for component, motion in enumerate(fine):
            u, z = states[i, component]
            states[i + 1, component] = (
                a11 * u + a12 * z + b11 * motion[i] + b12 * motion[i + 1],
                a21 * u + a22 * z + b21 * motion[i] + b22 * motion[i + 1],
            )
    along = np.einsum("ick,ca->iak", states, directions[:2])
    squares = along[..., 0] ** 2 + share * along[..., 1] ** 2
    assert_allclose(best, squares[::20].max(axis=0), rtol=1e-11)
    for i in range(samples):
        if not np.any(np.all(np.abs(steps[:count, 9:13] - states[20 * i].ravel()) < 1e-9, axis=1)):
            assert np.all(squares[20 * i : 20 * i + 21].max(axis=0) <= best * (1 + 1e-12))


@pytest.mark.parametrize("share", [0.0, 1.0])
@pytest.mark.parametrize("phase", [0.3, 1.0, 2.0, 3.0])
def test_coefficients_of_a_step_are_never_exceeded(phase, share):
    # catches a deviation from the cubic that is left out or too small, and slopes with the wrong
    # sign or factor
    damping, parts = 0.1, 50
    random = np.random.default_rng(7)
    states = random.normal(size=(4, blocks.TILE + 1))
    ground = random.normal(size=(2, blocks.TILE + 1))
    forms, slopes = np.empty((3, blocks.TILE + 1)), np.empty((3, blocks.TILE + 1))
    inner, oscillator = np.empty((3, 3, blocks.TILE)), azimuths.Oscillator(0, phase, damping, share)
    dense = np.empty((parts + 1, 4, blocks.TILE))
    for part in range(parts + 1):
        a11, a12, a21, a22, b11, b12, b21, b22 = step(1.0, damping, max(part, 1e-3) / parts * phase)
        stop = ground[:, :-1] + (ground[:, 1:] - ground[:, :-1]) * part / parts
        for row in (0, 2):
            u, z, start, end = (
                states[row, :-1],
                states[row + 1, :-1],
                ground[row // 2, :-1],
                stop[row // 2],
            )
            dense[part, row] = a11 * u + a12 * z + b11 * start + b12 * end
            dense[part, row + 1] = a21 * u + a22 * z + b21 * start + b22 * end
    for i in range(blocks.TILE):  # each step on its own: its end belongs to no other
        ends = np.stack([states[:, i], dense[-1, :, i]], axis=1)
        pair = np.concatenate([ends, np.zeros((4, blocks.TILE - 1))], axis=1)
        motion = np.concatenate([ground[:, i : i + 2], np.zeros((2, blocks.TILE - 1))], axis=1)
        azimuths.fill_forms(pair, share, forms)
        azimuth_steps._fill_slopes(pair, *motion, oscillator, slopes)
        peak, jump = np.hypot(*np.abs(motion).max(axis=1)), np.hypot(*(motion[:, 1] - motion[:, 0]))
        radius = within_step.radius_bound((ends**2).sum(axis=0).max(), peak, damping, phase)
        azimuth_steps._fill_coefficients(
            forms, slopes, azimuth_steps._bounds(radius, peak, jump, oscillator)[1], inner
        )
        for angle in np.linspace(0.0, np.pi, 7):
            turned = np.array([1.0, np.cos(2 * angle), np.sin(2 * angle)])
            bound = max((inner[:, :, 0] @ turned).max(), (forms[:, :2].T @ turned).max())
            u, z = (
                np.cos(angle) * dense[:, row, i] + np.sin(angle) * dense[:, row + 2, i]
                for row in (0, 1)
            )
            assert (u**2 + share * z**2).max() <= bound * (1 + 1e-12)
