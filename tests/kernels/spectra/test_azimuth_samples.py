"""Squares over all azimuths at the samples, against the plain step along each azimuth."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.kernels.spectra import azimuth_samples, azimuth_tiles
from per_obspy.kernels.spectra.tile_search import LANES, tile_extremes

ANGLES = np.radians(np.arange(0.0, 180.0, 7.5))
DIRECTIONS = np.stack([np.cos(ANGLES), np.sin(ANGLES), np.cos(2 * ANGLES), np.sin(2 * ANGLES)])


@pytest.fixture(scope="module")
def run(block):
    extremes = np.empty((2, 2, 1))
    for component, motion in enumerate((block.north, block.east)):
        tile_extremes(motion, extremes[0, component], extremes[1, component])
    table, checkpoints = np.empty((azimuth_tiles.ROWS, LANES)), np.empty((1, 6, LANES))
    azimuth_tiles.pack(block.phases, block.dampings, table)
    azimuth_tiles.run_azimuth_tiles(block.north, block.east, *extremes, table, checkpoints)
    return table[:4], checkpoints


@pytest.mark.parametrize("share", [0.0, 1.0])
@pytest.mark.parametrize("lane", [20, 50, 63])
def test_largest_squares_along_each_azimuth(run, lane, share, block, plain_states):
    # mutations: cosine and sine exchanged, a floor above a largest square
    _, checkpoints = run
    phase, damping = float(block.phases[lane]), float(block.dampings[lane])
    oscillator = azimuth_samples.Oscillator(lane, phase, damping, share)
    best = np.zeros(ANGLES.size)
    azimuth_samples.raise_azimuths_to_samples(
        block.north, block.east, checkpoints, oscillator, DIRECTIONS, best
    )
    for angle, square in zip(ANGLES, best, strict=True):
        along = np.cos(angle) * block.north + np.sin(angle) * block.east
        u, z = plain_states(along, phase, damping).T
        assert_allclose(square, (u**2 + share * z**2).max(), rtol=1e-11)


def test_the_floor_is_exceeded_along_every_azimuth():
    # mutation: Fourier coefficients that are not lowered far enough
    random = np.random.default_rng(3)
    for amplitude in (0.0, 1.0, 5.0):
        best = 10.0 + amplitude * DIRECTIONS[2] + random.uniform(size=ANGLES.size)
        form, least = azimuth_samples.floor_form(best, *DIRECTIONS[2:], np.empty(best.size))
        floor = form[0] + form[1] * DIRECTIONS[2] + form[2] * DIRECTIONS[3]
        assert least == best.min()
        assert np.all(floor <= best * (1 + 1e-14))
        # a sample whose form is above the floor somewhere is marked
        assert azimuth_samples.excess_over_floor(form[0] + 1e-9, form[1], form[2], form) > 0.0
        assert azimuth_samples.excess_over_floor(form[0] - 1e-9, form[1], form[2], form) < 0.0
        assert azimuth_samples.excess_over_floor(form[0] - 1.0, form[1] + 2.0, form[2], form) > 0.0


def test_free_displacements_reach_the_next_peak(run):
    # undamped: the next peak of the displacement is the radius
    state, _ = run
    best = np.zeros((LANES, ANGLES.size))
    azimuth_samples.free_displacements(state, np.zeros(LANES), LANES - 1, DIRECTIONS, best)
    u = np.outer(state[0], DIRECTIONS[0]) + np.outer(state[2], DIRECTIONS[1])
    z = np.outer(state[1], DIRECTIONS[0]) + np.outer(state[3], DIRECTIONS[1])
    assert_allclose(best[:-1], (u**2 + z**2)[:-1], rtol=1e-12)
    assert np.all(best[-1] == 0.0)
