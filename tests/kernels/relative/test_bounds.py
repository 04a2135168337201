"""Bounds between samples: never exceeded, and in proportion to the difference of the structures."""

from itertools import pairwise

import numpy as np
import pytest

from per_obspy.kernels.oscillator.exact_step import state_after, step_coefficients
from per_obspy.kernels.relative.bounds import (
    largest_radii,
    may_grow,
    strongest_inputs,
    tile_inputs,
    tile_margins,
)
from per_obspy.kernels.relative.relative_samples import (
    PAIR_CHECKPOINT_ROWS,
    PAIR_LANES,
    PAIR_ROWS,
    pack_pair,
    run_pair_tiles,
)
from per_obspy.kernels.spectra.tile_search import TILE

DT = 0.02
GROUND = np.random.default_rng(8).standard_normal((2, TILE + 1))


def margins(pair, ground=GROUND):
    """Return the bounds for a pair that fills all lanes of a block."""
    table = np.zeros((PAIR_ROWS, PAIR_LANES))
    checkpoints = np.empty((1, PAIR_CHECKPOINT_ROWS, PAIR_LANES))
    pair = np.asarray(pair)
    for lane in range(PAIR_LANES):
        pack_pair(pair, DT, table, lane)
    windows = np.zeros((2, PAIR_LANES), dtype=np.int64)
    run_pair_tiles(ground[0], ground[1], 0, windows, table, checkpoints)
    strongest = strongest_inputs(tile_inputs(ground, DT))
    radii = largest_radii(pair, table, 0, strongest)
    return np.array(tile_margins(pair, DT, radii, strongest))


def motion(pair, parts):
    """
    Return the relative displacement and its slope at the samples, (samples, 2), and within steps.

    The latter is the displacement at parts of each step, (steps, parts).
    """
    coefficients = [step_coefficients(pair[3 * i], pair[3 * i + 1], DT) for i in range(2)]
    weights = pair[2], -pair[5]
    state, samples, within = np.zeros((2, 2)), [(0.0, 0.0)], []
    for start, end in pairwise(pair[6] * GROUND[0] + pair[7] * GROUND[1]):
        row = np.zeros(parts)
        for body in range(2):
            omega, damping = pair[3 * body : 3 * body + 2]
            u, z = state[body]
            rate = (end - start) / DT
            for part in range(1, parts):
                time = part / parts * DT
                displacement, _ = state_after(time, u, z * omega, omega, damping, start, rate)
                row[part] += weights[body] * displacement
            a = coefficients[body]
            state[body] = (
                a[0] * u + a[1] * z + a[4] * start + a[5] * end,
                a[2] * u + a[3] * z + a[6] * start + a[7] * end,
            )
        within.append(row)
        distance = weights[0] * state[0, 0] + weights[1] * state[1, 0]
        slope = weights[0] * state[0, 1] * pair[0] + weights[1] * state[1, 1] * pair[3]
        samples.append((distance, slope))
    return np.array(samples), np.array(within)


def test_strongest_motion_of_tiles():
    # mutation: the first or the last sample of a tile left out, or one of the parts
    for place in (0, 1, TILE // 2, TILE - 1, TILE, TILE + 5, 2 * TILE):
        ground = np.random.default_rng(place).uniform(-1.0, 1.0, (2, 2 * TILE + 1))
        ground[0, place] *= -9.0
        inputs = tile_inputs(ground, DT)
        for tile in range(2):
            samples = abs(ground[:, tile * TILE : (tile + 1) * TILE + 1])
            changes = abs(np.diff(ground[:, tile * TILE : (tile + 1) * TILE + 1]))
            expected = samples.max(axis=1), changes.max(axis=1) / DT, np.trapezoid(samples, dx=DT)
            np.testing.assert_allclose(inputs[tile], expected, rtol=1e-14)


@pytest.mark.parametrize(
    "pair",
    [
        (20.0, 0.05, 1.0, 9.0, 0.02, 1.3),
        (20.0, 0.05, 1.0, 20.001, 0.05, 1.0),
        (70.0, 0.02, 1.2, 6.0, 0.1, 1.0),
        (6.0, 0.3, 1.0, 6.0, 0.3, 1.0001),
        (6.0, 0.0, 1.0, 6.0, 1e-5, 1.0),
    ],
)
def test_nothing_between_samples_exceeds_the_bounds(pair):
    # mutation: a term of the difference left out (its bound is then too small for the structures
    # nearly alike)
    pair, parts = (*pair, 0.6, 0.8), 4
    samples, within = motion(pair, parts)
    x = np.arange(1, parts) / parts
    (d0, s0), (d1, s1) = samples[:-1].T[:, :, None], samples[1:].T[:, :, None]
    chord = np.maximum(abs(within[:, 1:] - d0), abs(within[:, 1:] - d1)) - abs(d1 - d0)
    hermite = d0 * (1 + 2 * x) * (1 - x) ** 2 + s0 * DT * x * (1 - x) ** 2 + d1 * x**2 * (3 - 2 * x)
    hermite += s1 * DT * x**2 * (x - 1)
    sampled, cubic = margins(pair)
    rounding = 1e-13 * abs(samples).max()
    assert chord.max() <= sampled + rounding
    assert abs(within[:, 1:] - hermite).max() <= cubic + rounding


@pytest.mark.parametrize("row", [3, 4, 5])
def test_bounds_fall_with_the_difference_of_the_structures(row):
    # mutation: bounds from the radii alone, which let nearly equal structures be searched in every
    # step
    def bounds(difference):
        pair = np.array([9.0, 0.05, 1.0, 9.0, 0.05, 1.0, 1.0, 0.0])
        pair[row] += difference
        return margins(pair)

    # rounding of 1e-16 in 1e-9 and its motion
    np.testing.assert_allclose(bounds(1e-9) / bounds(1e-6), 1e-3, rtol=1e-2)


def test_growth_in_the_free_vibration():
    pair = np.array([9.0, 0.05, 1.0, 9.0, 0.05, 1.0, 1.0, 0.0])
    still, moving = np.zeros(4), np.array([0.1, 0.0, 0.1, 0.0])
    largest = np.array([0.01, 0.02])
    assert not may_grow(pair, still, largest)
    assert not may_grow(pair, moving, largest)  # both move alike and will go on so
    other = pair.copy()
    other[3] = 12.0
    assert may_grow(other, moving, largest)
    assert not may_grow(other, moving, largest + 0.3)
    alike = pair.copy()
    alike[3] *= 1 + 1e-6
    # of 0.1 they separate by less than 1e-6 / (2 e xi) of it, bounded by 1e-6 / xi: 2e-6 m
    assert may_grow(alike, moving, np.array([1e-7, 1.0]))
    assert not may_grow(alike, moving, np.array([1e-5, 1.0]))
    # undamped: they will beat
    assert may_grow(np.array([9.0, 0.0, 1.0, 9.1, 0.0, 1.0, 1.0, 0.0]), moving, largest)
