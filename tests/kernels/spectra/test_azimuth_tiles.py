"""Bounds over all azimuths of each tile, against plain steps and fine parts of steps."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.kernels.oscillator.exact_step import step_coefficients
from per_obspy.kernels.spectra import azimuth_tiles
from per_obspy.kernels.spectra.tile_search import LANES, TILE, tile_extremes

#: Values per step between which a maximum is not missed by more than rounding allows.
PARTS = 16


def swept(ground, phases, dampings):
    """Return the advanced table, and the checkpoints (tiles, 6, LANES)."""
    tiles = (ground.shape[1] - 1) // TILE
    extremes = np.empty((2, 2, tiles))
    for component, motion in enumerate(ground):
        tile_extremes(motion, extremes[0, component], extremes[1, component])
    table, checkpoints = np.empty((azimuth_tiles.ROWS, LANES)), np.empty((tiles, 6, LANES))
    azimuth_tiles.pack(phases, dampings, table)
    azimuth_tiles.run_azimuth_tiles(*ground, *extremes, table, checkpoints)
    return table, checkpoints


def fine_states(ground, phase, damping, plain_states):
    """Return the states in equal parts of every step, (value, component, state)."""
    samples = np.arange(ground.shape[1])
    times = np.arange(PARTS * samples[-1] + 1) / PARTS
    fine = [np.interp(times, samples, motion) for motion in ground]
    return np.stack([plain_states(motion, phase / PARTS, damping) for motion in fine], axis=1)


@pytest.mark.parametrize("lane", [0, 20, 41, 60, 61, 62, 63])
def test_states_before_tiles_are_those_of_plain_steps(lane, block, plain_states):
    # catches a weight of a sample that is moved on too often or not at all, and components mixed up
    ground = np.stack([np.append(motion[:-1], motion) for motion in (block.north, block.east)])
    table, checkpoints = swept(ground, block.phases, block.dampings)
    phase, damping = block.phases[lane], block.dampings[lane]
    states = np.stack([plain_states(motion, phase, damping) for motion in ground], axis=1)
    scale = np.abs(states).max()  # of components that pass zero
    for number, row in ((0, checkpoints[0, :4]), (TILE, checkpoints[1, :4]), (-1, table[:4])):
        assert_allclose(row[:, lane], states[number].ravel(), rtol=1e-9, atol=1e-12 * scale)


def test_bounds_of_smooth_motion_are_close(plain_states):
    # catches bounds that let every tile pass: sine waves of 60 samples under a period of 100
    times = np.arange(4 * TILE + 1) * 2.0 * np.pi / 60.0
    ground = np.stack([np.sin(times), 0.3 * np.cos(times)])
    phase = 2.0 * np.pi / 100.0
    _, checkpoints = swept(ground, np.full(LANES, phase), np.full(LANES, 0.05))
    states = np.stack([plain_states(motion, phase, 0.05) for motion in ground], axis=1)
    for tile, bounds in enumerate(checkpoints[:, :, 5]):
        motion = states[TILE * tile : TILE * (tile + 1) + 1]
        radius = np.linalg.norm(motion, ord=2, axis=(1, 2)).max() ** 2
        assert bounds[4] <= 1.1 * radius
        assert bounds[5] <= 1.1 * (motion[..., 0] ** 2).sum(axis=1).max()


@pytest.mark.parametrize("period", [2.5, 5.0, 12.0, 40.0, 200.0])
@pytest.mark.parametrize("damping", [0.0, 0.05, 0.4, 0.9])
def test_no_motion_exceeds_the_bounds_of_its_tile(period, damping, plain_states):
    # catches a bound that is too small: a stride taken for a step, sums of |a| of one half of the
    # strides or of one component, no growth backwards, and a second derivative without one of its
    # terms. Tiles hold one short pulse each, which moves through a stride, or weak noise
    random = np.random.default_rng(int(10 * period))
    ground = np.zeros((2, 40 * TILE + 1))
    for tile in range(1, 40, 2):
        first = tile * TILE + random.integers(8)
        pulse = random.normal(size=(2, 1)) * random.normal(size=(1, 1 + tile % 5))
        ground[:, first : first + pulse.shape[1]] = pulse
        ground[:, (tile + 1) * TILE - 20 : (tile + 1) * TILE - 1] = 0.01 * random.normal()
    phase = 2.0 * np.pi / period
    _, checkpoints = swept(ground, np.full(LANES, phase), np.full(LANES, damping))
    states = fine_states(ground, phase, damping, plain_states)
    for tile, bounds in enumerate(checkpoints[:, :, 5]):
        motion = states[PARTS * TILE * tile : PARTS * TILE * (tile + 1) + 1]
        radius = np.linalg.norm(motion, ord=2, axis=(1, 2)).max() ** 2
        displacement = (motion[..., 0] ** 2).sum(axis=1).max()
        assert radius * (1.0 - 1e-12) <= bounds[4]
        assert displacement * (1.0 - 1e-12) <= bounds[5]


def _within_steps(phases, dampings, states, motion):
    """Return the states (part, value, lane) of oscillators under one component, part by part."""
    found = [states]
    fine = [
        step_coefficients(1.0, damping, part / PARTS * phase)
        for part in range(1, PARTS + 1)
        for phase, damping in zip(phases, dampings, strict=True)
    ]
    coefficients = np.reshape(fine, (PARTS, LANES, 8)).transpose(0, 2, 1)
    for start, end in pairwise(motion):
        u, z = found[-1]
        for part, (a11, a12, a21, a22, b11, b12, b21, b22) in enumerate(coefficients, 1):
            stop = start + (end - start) * part / PARTS
            moved = a21 * u + a22 * z + b21 * start + b22 * stop
            found.append(np.stack([a11 * u + a12 * z + b11 * start + b12 * stop, moved]))
    return np.array(found)


@pytest.mark.compiled
def test_no_motion_within_one_stride_exceeds_the_bounds():
    # catches sums of |a| of one half of the strides, and a second derivative without one of its
    # terms: of many states and accelerations along one line some come close to the bounds
    random = np.random.default_rng(9)
    phases, dampings = np.geomspace(0.05, 1.2, LANES), np.resize([0.0, 0.05, 0.4, 0.9], LANES)
    for trial in range(400):
        north_or_east = trial % 2
        ground, extremes = np.zeros((2, TILE + 1)), np.empty((2, 2, 1))
        ground[north_or_east, :5] = random.normal(size=5) * random.integers(2, size=5) * 3.0
        for component, motion in enumerate(ground):
            tile_extremes(motion, extremes[0, component], extremes[1, component])
        table, checkpoints = np.empty((azimuth_tiles.ROWS, LANES)), np.empty((1, 6, LANES))
        azimuth_tiles.pack(phases, dampings, table)
        start = random.normal(size=(2, LANES)) * random.integers(2, size=(2, 1))
        table[2 * north_or_east : 2 * north_or_east + 2] = start
        states = _within_steps(phases, dampings, start, ground[north_or_east, :5])
        azimuth_tiles.run_azimuth_tiles(*ground, *extremes, table, checkpoints)
        squares = (states**2).sum(axis=1).max(axis=0), (states[:, 0] ** 2).max(axis=0)
        for row, square in enumerate(squares):
            assert np.all(square * (1.0 - 1e-12) <= checkpoints[0, 4 + row])


@pytest.mark.parametrize("damping", [0.0, 0.05, 0.4, 0.9])
def test_radii_grow_backwards_by_no_more_than_the_table_has(damping):
    # catches the growth of a whole stride that is taken for less: the inverse of half a stride
    phases, table = np.geomspace(0.01, 3.0, LANES), np.empty((azimuth_tiles.ROWS, LANES))
    azimuth_tiles.pack(phases, np.full(LANES, damping), table)
    for phase, growth in zip(phases, table[-1], strict=True):
        half = step_coefficients(1.0, damping, azimuth_tiles.STRIDE // 2 * phase)[:4]
        backwards = np.linalg.inv(np.reshape(half, (2, 2)))
        assert np.linalg.norm(backwards, ord=2) <= growth * (1.0 + 1e-12)
