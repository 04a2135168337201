"""
Turning points inside one step, against the same motion at many times.

Covers ``per_obspy.kernels.pounding_lanes.maxima_in_step``.
"""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.kernels.pounding_lanes import lanes
from per_obspy.kernels.pounding_lanes.free_impacts import state_inside_step
from per_obspy.kernels.pounding_lanes.maxima_in_step import complete_state, turning_point
from per_obspy.kernels.pounding_lanes.phases import write_constants
from per_obspy.pounding.kernel_tables import row_at_rest, structure_table
from per_obspy.pounding.structure import Structure

DURATION = 0.02
INSIDE = np.linspace(0.0, 1.0, 101)


def pair_of(damping):
    """Return the numbers of the lane of a pair, and its row."""
    structures = (Structure(1.0, damping, 2.0), Structure(0.19, damping, 1.0))
    row = row_at_rest(structure_table(structures), np.array([1.0]), np.array([0.5]))
    pair = np.zeros(lanes.LANE_ROWS)
    write_constants(pair, row, 1.0, 0.0, DURATION)
    return pair, row


def located(pair, row, i, start, change, share):
    """Return the displacement at which the velocity changes its sign, by halving."""
    low, high = 0.0, share
    for _ in range(50):
        middle = 0.5 * (low + high)
        _, z, _ = state_inside_step(pair, row, i, start, change, middle)
        low, high = (middle, high) if z * start[1] > 0.0 else (low, middle)
    return state_inside_step(pair, row, i, start, change, low)[0]


@pytest.mark.parametrize("damping", [0.0, 0.05, 0.5])
def test_turning_points_are_those_of_the_motion(damping):
    # catches: a bound of the acceleration left out, an estimate without the exact motion, a term
    # of the largest displacement with the wrong factor
    pair, row = pair_of(damping)
    random = np.random.default_rng(2)
    found = none = uncertain = 0
    for case in range(300):
        i = case % 2
        first, angle = i * lanes.STRUCTURE_ROWS, pair[i * lanes.STRUCTURE_ROWS + lanes.ANGLE]
        share = random.choice([1.0, 0.3])
        # slow enough to turn, accelerated by displacement and ground
        u, ground, change = random.normal(size=3)
        scale = pair[first + lanes.OMEGA] ** 2
        ground, change = scale * ground, random.choice([0.1, 3.0]) * scale * change
        start = complete_state(pair, first, u, angle * share * random.normal(), ground)
        inside = [state_inside_step(pair, row, i, start, change, share * s) for s in INSIDE]
        turn = turning_point(pair, row, i, start, inside[-1], change, share)
        signs = np.sign([z for _, z, _ in inside])
        if math.isnan(turn):
            uncertain += 1
        elif turn == start[0]:
            none += 1
            assert np.ptp(signs) == 0.0
        else:
            found += 1
            expected = located(pair, row, i, start, change, share)
            assert_allclose(turn, expected, rtol=1e-14, atol=1e-15)  # rounding
    assert min(found, none) > 40
    assert uncertain < 120


def test_a_motion_that_turns_twice_is_uncertain():
    # catches: signs of the velocity at the ends believed where the acceleration changes its own
    pair, row = pair_of(0.05)
    omega, angle = pair[lanes.OMEGA], pair[lanes.ANGLE]
    # accelerated one way and then the other
    ground, change = omega**2, -2.0 * omega**2
    start = complete_state(pair, 0, 0.0, 0.0, ground)
    start = complete_state(pair, 0, 0.0, -0.1 * angle * start[2], ground)
    inside = [state_inside_step(pair, row, 0, start, change, s) for s in INSIDE]
    assert np.count_nonzero(np.diff(np.sign([z for _, z, _ in inside]))) == 2
    assert math.isnan(turning_point(pair, row, 0, start, inside[-1], change, 1.0))


@pytest.mark.parametrize("damping", [0.0, 0.02])
def test_a_turn_where_the_acceleration_vanishes_is_inside_the_step(damping):
    # catches: Newton's step out of the step, where the series grows without bound
    pair, row = pair_of(damping)
    random = np.random.default_rng(5)
    found = 0
    for case in range(2000):
        i = case % 2
        first = i * lanes.STRUCTURE_ROWS
        # velocity and acceleration both vanish near the end of the step
        rest = complete_state(pair, first, random.normal(), 0.0, 0.0)
        share = random.uniform(0.9, 1.1)
        change = -rest[2] / (pair[first + lanes.ACCELERATION + 2] * share)
        late = 10.0 ** random.uniform(-5.0, -1.0)
        start = (
            rest[0],
            -0.5 * (1.0 - late) * share * pair[first + lanes.ANGLE] * rest[2],
            rest[2],
        )
        end = state_inside_step(pair, row, i, start, change, 1.0)
        turn = turning_point(pair, row, i, start, end, change, 1.0)
        if not math.isnan(turn) and turn != start[0]:
            found += 1
            expected = located(pair, row, i, start, change, 1.0)
            assert_allclose(turn, expected, rtol=1e-14, atol=1e-15)  # rounding
    assert found > 100
