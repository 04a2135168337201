"""Bounds of what lies between samples: never exceeded, and in proportion to what parts two structures."""

from itertools import pairwise

import numpy as np
import pytest

from per_obspy.kernels.oscillator.exact_step import state_after, step
from per_obspy.kernels.relative.bounds import excess, may_grow, strongest_inputs
from per_obspy.kernels.relative.samples import (
    KEPT,
    LANES,
    ROWS,
    TILE,
    pack_pair,
    run_tiles,
    start_at_rest,
)

DT = 0.02
GROUND = np.random.default_rng(8).standard_normal((2, TILE + 1))


def margins(pair, ground=GROUND):
    """Return the bounds for a pair alone, whose lanes are all alike."""
    table, kept = np.empty((ROWS, LANES)), np.empty((1, KEPT, LANES))
    for lane in range(LANES):
        pack_pair(np.asarray(pair), DT, table, lane)
    start_at_rest(ground[0, 0], ground[1, 0], table)
    run_tiles(ground[0], ground[1], table, kept)
    return np.array(excess(np.asarray(pair), DT, table, 0, strongest_inputs(ground, DT)))


def motion(pair, parts):
    """Return the relative displacement and its slope at the samples, and the displacement at parts of each step."""
    coefficients = [step(pair[3 * body], pair[3 * body + 1], DT) for body in range(2)]
    state, samples, between = np.zeros((2, 2)), [(0.0, 0.0)], []
    ground = pair[6] * GROUND[0] + pair[7] * GROUND[1]
    weights = pair[2], -pair[5]
    for start, end in pairwise(ground):
        row = np.zeros(parts)
        for body in range(2):
            omega, damping = pair[3 * body : 3 * body + 2]
            u, v = state[body, 0], state[body, 1] * omega
            for part in range(1, parts):
                here = state_after(
                    part / parts * DT, u, v, omega, damping, start, (end - start) / DT
                )
                row[part] += weights[body] * here[0]
            a, z = coefficients[body], state[body, 1]
            state[body] = (
                a[0] * u + a[1] * z + a[4] * start + a[5] * end,
                a[2] * u + a[3] * z + a[6] * start + a[7] * end,
            )
        between.append(row)
        samples.append(tuple(sum(w * s for w, s in zip(weights, column, strict=True)) for column in (
            state[:, 0], state[:, 1] * (pair[0], pair[3]))))  # fmt: skip
    return np.array(samples), np.array(between)


@pytest.mark.parametrize("pair", [
    (20.0, 0.05, 1.0, 9.0, 0.02, 1.3), (20.0, 0.05, 1.0, 20.001, 0.05, 1.0), (70.0, 0.02, 1.2, 6.0, 0.1, 1.0),
    (6.0, 0.3, 1.0, 6.0, 0.3, 1.0001), (6.0, 0.0, 1.0, 6.0, 1e-5, 1.0),
])  # fmt: skip
def test_nothing_between_samples_exceeds_the_bounds(pair):
    # mutation: a term of the difference left out (its bound is then too small for the structures
    # nearly alike)
    pair, parts = (*pair, 0.6, 0.8), 4
    samples, between = motion(pair, parts)
    x = np.arange(1, parts) / parts
    (d0, s0), (d1, s1) = samples[:-1].T[:, :, None], samples[1:].T[:, :, None]
    chord = np.maximum(abs(between[:, 1:] - d0), abs(between[:, 1:] - d1)) - abs(d1 - d0)
    hermite = d0 * (1 + 2 * x) * (1 - x) ** 2 + s0 * DT * x * (1 - x) ** 2 + d1 * x**2 * (3 - 2 * x)
    hermite += s1 * DT * x**2 * (x - 1)
    sampled, cubic = margins(pair)
    rounding = 1e-13 * abs(samples).max()
    assert chord.max() <= sampled + rounding
    assert abs(between[:, 1:] - hermite).max() <= cubic + rounding


@pytest.mark.parametrize("place", [3, 4, 5])
def test_bounds_fall_with_the_difference_of_the_structures(place):
    # mutation: bounds from the radii alone, which let nearly equal structures be searched in every
    # step
    def bounds(difference):
        pair = np.array([9.0, 0.05, 1.0, 9.0, 0.05, 1.0, 1.0, 0.0])
        pair[place] += difference
        return margins(pair)

    np.testing.assert_allclose(
        bounds(1e-9) / bounds(1e-6), 1e-3, rtol=1e-2
    )  # rounding of 1e-16 in 1e-9 and its motion


def test_what_is_left_of_the_free_vibration():
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
    # of 0.1 they part by less than 1e-6 / (2 e xi) of it, bounded by 1e-6 / xi: 2e-6 m
    assert may_grow(alike, moving, np.array([1e-7, 1.0]))
    assert not may_grow(alike, moving, np.array([1e-5, 1.0]))
    assert may_grow(
        np.array([9.0, 0.0, 1.0, 9.1, 0.0, 1.0, 1.0, 0.0]), moving, largest
    )  # undamped: they will beat
