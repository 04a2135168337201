"""Bounds that rule out steps along many azimuths, and the search of the steps that remain."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.kernels.oscillator.exact_step import step_coefficients
from per_obspy.kernels.spectra import azimuth_samples, azimuth_steps, azimuth_tiles
from per_obspy.kernels.spectra.azimuth_samples import GROUP, Oscillator
from per_obspy.kernels.spectra.tile_search import LANES, TILE, tile_extremes

ANGLES = np.radians(np.arange(0.0, 180.0, 7.5))
PLACES = np.tile(np.linspace(0.0, 1.0, GROUP), ANGLES.size // GROUP)
TURNED = [np.cos(ANGLES), np.sin(ANGLES), np.cos(2 * ANGLES), np.sin(2 * ANGLES)]
DIRECTIONS = np.stack([*TURNED, PLACES])
#: Values per step of the fine states.
PARTS = 20


def _record(tiles):
    ground = np.zeros((2, tiles * TILE + 1))
    noise = np.random.default_rng(6).normal(size=(2, tiles * TILE))
    ground[:, :-1] = noise * [[1.0], [0.3]]
    return ground


def _extremes(ground):
    """Return largest accelerations and changes of each tile, (2, component, tile)."""
    extremes = np.empty((2, 2, (ground.shape[1] - 1) // TILE))
    for component, motion in enumerate(ground):
        tile_extremes(motion, extremes[0, component], extremes[1, component])
    return extremes


def _checkpoints(ground, phase, damping):
    table = np.empty((azimuth_tiles.ROWS, LANES))
    checkpoints = np.empty(((ground.shape[1] - 1) // TILE, 6, LANES))
    azimuth_tiles.pack(np.full(LANES, phase), np.full(LANES, damping), table)
    azimuth_tiles.run_azimuth_tiles(*ground, *_extremes(ground), table, checkpoints)
    return checkpoints


def _edges():
    """Return the edges of the groups of azimuths, filled up with zeros."""
    firsts, lasts = DIRECTIONS[2:4, ::GROUP], DIRECTIONS[2:4, GROUP - 1 :: GROUP]
    rise = 1.0 - np.cos(ANGLES[GROUP - 1 :: GROUP] - ANGLES[::GROUP])
    edges = np.concatenate([firsts, lasts, rise[np.newaxis]])
    return np.pad(edges, ((0, 0), (0, -rise.size % GROUP)))


def _fine_states(ground, phase, damping, plain_states):
    """Return the states in equal parts of every step, (value, component, state)."""
    samples = np.arange(ground.shape[1])
    times = np.arange(PARTS * samples[-1] + 1) / PARTS
    fine = [np.interp(times, samples, motion) for motion in ground]
    return np.stack([plain_states(motion, phase / PARTS, damping) for motion in fine], axis=1)


@pytest.mark.parametrize("share", [0.0, 1.0])
@pytest.mark.parametrize("period", [4.0, 11.0, 60.0, 900.0])
def test_steps_that_are_not_listed_hold_no_more_than_the_samples(period, share, plain_states):
    # catches a bound that is too small, a slope with the wrong sign, and a floor above the largest
    # squares; the search of the listed steps then gives the largest of all values
    damping, phase = 0.05, 2.0 * np.pi / period
    ground = _record(4)
    checkpoints = _checkpoints(ground, phase, damping)
    oscillator = Oscillator(0, phase, damping, share)
    best, steps = np.zeros(ANGLES.size), np.empty((4 * TILE, azimuth_steps.COLUMNS))
    azimuth_samples.raise_azimuths_to_samples(*ground, checkpoints, oscillator, DIRECTIONS, best)
    count = azimuth_steps.list_steps(
        *ground, *_extremes(ground), checkpoints, oscillator, DIRECTIONS, best, steps
    )
    states = _fine_states(ground, phase, damping, plain_states)
    along = np.einsum("ick,ca->iak", states, DIRECTIONS[:2])
    squares = along[..., 0] ** 2 + share * along[..., 1] ** 2
    assert_allclose(best, squares[::PARTS].max(axis=0), rtol=1e-11)
    listed = steps[:count, 9:13]
    for i in range(4 * TILE):
        if not np.any(np.all(np.abs(listed - states[PARTS * i].ravel()) < 1e-9, axis=1)):
            within = squares[PARTS * i : PARTS * (i + 1) + 1].max(axis=0)
            assert np.all(within <= best * (1 + 1e-12))
    azimuth_steps.search_steps(steps[:count], oscillator, DIRECTIONS, _edges(), best)
    dense = squares.max(axis=0)
    assert np.all(best >= dense * (1 - 1e-11))
    # parts miss a peak by h² / 8 of its second derivative, 2 a z' + 2 z a' with |z'| <= |a| + 1.1 r
    peak = np.hypot(*np.abs(ground).max(axis=1))
    radius = np.sqrt((states**2).sum(axis=(1, 2)).max())
    curvature = 2.0 * (peak * (peak + 1.1 * radius) + radius * 2.0 * peak / phase)
    assert_allclose(best, dense, rtol=1e-11, atol=(phase / PARTS) ** 2 / 8 * curvature)


@pytest.mark.parametrize("share", [0.0, 1.0])
@pytest.mark.parametrize("period", [4.0, 11.0])
def test_tiles_without_a_sample_above_the_maxima_are_still_listed(period, share, plain_states):
    # catches a tile that is left out by its samples alone: maxima a little above all samples are
    # exceeded between them
    damping, phase = 0.05, 2.0 * np.pi / period
    ground = _record(4)
    checkpoints = _checkpoints(ground, phase, damping)
    states = _fine_states(ground, phase, damping, plain_states)
    along = np.einsum("ick,ca->iak", states, DIRECTIONS[:2])
    squares = along[..., 0] ** 2 + share * along[..., 1] ** 2
    best = np.full(ANGLES.size, 1.01 * squares[::PARTS].max())
    steps = np.empty((4 * TILE, azimuth_steps.COLUMNS))
    oscillator = Oscillator(0, phase, damping, share)
    count = azimuth_steps.list_steps(
        *ground, *_extremes(ground), checkpoints, oscillator, DIRECTIONS, best, steps
    )
    assert np.any(squares.max(axis=0) > best)
    azimuth_steps.search_steps(steps[:count], oscillator, DIRECTIONS, _edges(), best)
    assert np.all(squares.max(axis=0) <= best * (1 + 1e-11))


def _dense_step(states, ground, phase, damping, parts):
    """Return the states in equal parts of a step from each state, (part, state, step)."""
    dense = np.empty((parts + 1, 4, TILE))
    for part in range(parts + 1):
        share = max(part, 1e-3) / parts
        a11, a12, a21, a22, b11, b12, b21, b22 = step_coefficients(1.0, damping, share * phase)
        stop = ground[:, :-1] + (ground[:, 1:] - ground[:, :-1]) * part / parts
        for row in (0, 2):
            u, z = states[row, :-1], states[row + 1, :-1]
            start, end = ground[row // 2, :-1], stop[row // 2]
            dense[part, row] = a11 * u + a12 * z + b11 * start + b12 * end
            dense[part, row + 1] = a21 * u + a22 * z + b21 * start + b22 * end
    return dense


@pytest.mark.parametrize("share", [0.0, 1.0])
@pytest.mark.parametrize("phase", [0.3, 1.0, 2.0, 3.0])
def test_coefficients_of_a_step_are_never_exceeded(phase, share):
    # catches a deviation from the cubic that is left out or too small, and slopes with the wrong
    # sign or factor
    damping = 0.1
    random = np.random.default_rng(7)
    states = random.normal(size=(4, TILE + 1))
    ground = random.normal(size=(2, TILE + 1))
    forms, slopes = np.empty((3, TILE + 1)), np.empty((3, TILE + 1))
    inner, bulges = np.empty((3, 3, TILE)), np.empty(TILE)
    oscillator = Oscillator(0, phase, damping, share)
    dense = _dense_step(states, ground, phase, damping, 50)
    for i in range(TILE):  # each step on its own: its end belongs to no other
        ends = np.stack([states[:, i], dense[-1, :, i]], axis=1)
        pair = np.concatenate([ends, np.zeros((4, TILE - 1))], axis=1)
        motion = np.concatenate([ground[:, i : i + 2], np.zeros((2, TILE - 1))], axis=1)
        azimuth_samples.fill_forms(pair, share, forms)
        azimuth_steps._fill_slopes(pair, *motion, oscillator, slopes)
        azimuth_steps._fill_bulges(pair, *motion, oscillator, bulges)
        azimuth_steps._fill_coefficients(forms, slopes, bulges, inner)
        for angle in np.linspace(0.0, np.pi, 7):
            turned = np.array([1.0, np.cos(2 * angle), np.sin(2 * angle)])
            bound = max((inner[:, :, 0] @ turned).max(), (forms[:, :2].T @ turned).max())
            u = np.cos(angle) * dense[:, 0, i] + np.sin(angle) * dense[:, 2, i]
            z = np.cos(angle) * dense[:, 1, i] + np.sin(angle) * dense[:, 3, i]
            assert (u**2 + share * z**2).max() <= bound * (1 + 1e-12)


@pytest.mark.parametrize("phase", [0.05, 0.5, 1.0])
def test_a_stiff_oscillator_that_follows_the_ground_hardly_leaves_the_cubic(phase):
    # catches a bound made of the motion itself, where displacement and ground cancel: the search
    # of short periods then takes ten times as long. With u = -a and z = -p the radius Q is 2 xi p
    damping, rate = 0.05, 1e-3
    ground = np.outer([1.0, 0.5], 1.0 + rate * phase * np.arange(TILE + 1))
    states = np.zeros((4, TILE + 1))
    states[0], states[2] = -ground
    states[1], states[3] = -rate, -0.5 * rate
    bulges = np.empty(TILE)
    for share in (0.0, 1.0):
        oscillator = Oscillator(0, phase, damping, share)
        azimuth_steps._fill_bulges(states, *ground, oscillator, bulges)
        # The sizes of displacement and ground, 1.1, times twice Q h⁴ / 144, and a reserve of two
        assert np.all(bulges <= 2.0 * 1.2 * 2.0 * (2.2 * damping * rate) * phase**4 / 144.0)


@pytest.mark.parametrize("width", [0.01, 0.25, 2.0, np.pi])
def test_marked_groups_hold_every_azimuth_along_which_a_maximum_is_exceeded(width):
    # catches floors above the maxima inside a group, and a rise that is too small for wide groups
    random = np.random.default_rng(8)
    angles = np.linspace(0.0, width, GROUP)
    places = np.linspace(0.0, 1.0, GROUP)
    edges = np.zeros((5, GROUP))
    ends = [np.cos(0.0), np.sin(0.0), np.cos(2 * width), np.sin(2 * width)]
    edges[:, 0] = [*ends, 1.0 - np.cos(width)]
    floors, marks = np.full((2, GROUP), np.inf), np.empty(GROUP)
    cosines, sines = np.cos(2 * angles), np.sin(2 * angles)
    marked = 0
    for _ in range(300):
        step = np.zeros(17)
        step[:9] = random.normal(size=9)
        forms = step[:9].reshape(3, 3) @ np.stack([np.ones(GROUP), cosines, sines])
        # Maxima close to the step, some below and some above it
        best = forms.max(axis=0) + random.normal() * random.uniform(0.0, 0.1, GROUP)
        azimuth_steps._fill_group_floors(best, places, floors)
        marked += azimuth_steps._mark_groups(step, edges, floors, marks)
        assert marks[0] > 0.0 or np.all(forms.max(axis=0) <= best)
    assert marked < 300 or width > 0.3  # narrow groups are ruled out as well
