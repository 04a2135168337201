"""Plain impacts inside one step, against the event code of single histories and against sampled clearances."""

import itertools
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.kernels.pounding_events import motion as columns
from per_obspy.kernels.pounding_lanes import free_impacts as bounces
from per_obspy.kernels.pounding_lanes import lanes
from per_obspy.kernels.pounding_lanes.maxima_in_step import state, step
from per_obspy.kernels.pounding_lanes.pair_rows import load_pair, write_constants, write_phase
from per_obspy.kernels.pounding_lanes.step_by_step import repeat_step, segment_of
from per_obspy.pounding.history.pair_blocks import pair_table
from per_obspy.pounding.history.tables import row_at_rest

DURATION, GAP, LOG = 0.02, 0.01, np.zeros((0, 9))
SECOND = lanes.STRUCTURE_ROWS
SHARES = np.linspace(0.0, 1.0, 201)


def resting_pair(period_1=0.3, period_2=0.2, damping=0.3, restitution=0.6):
    """Return the line of numbers that the lanes hold of a pair at rest, and its row."""
    own = {"participation": 1.0, "yield_displacement": math.inf, "hardening": 0.0}
    fields = {f"{name}_{i}": np.array([value]) for name, value in own.items() for i in (1, 2)}
    fields |= {
        "period_1": np.array([period_1]),
        "period_2": np.array([period_2]),
        "gap": np.array([GAP]),
    }
    fields |= {"mass_1": np.array([2.0]), "mass_2": np.array([1.0])}
    fields |= {"damping_1": np.array([damping]), "damping_2": np.array([0.5 * damping])}
    row = row_at_rest(pair_table(fields), np.array([[GAP]]), np.array([[restitution]]))[0]
    row[0, columns.STILL], row[0, columns.DELAY], row[0, columns.MOST_BOUNCES] = 1e-12, 1e-5, 25
    pair = np.zeros(lanes.ROWS)
    write_constants(pair, row, 1.0, 0.0, DURATION)
    write_phase(pair, row, DURATION)
    return pair, row


def cases(pair, row, count, seed=0):
    """
    Yield states of both structures at a step's start, those after it without contact, and the ground at both ends.

    They start apart and are once almost in contact, with a rate of any size and pressed together or
    drawn apart.
    """
    random = np.random.default_rng(seed)
    for _ in range(count):
        share, here, there, (u, z) = random.uniform(), *random.normal(size=2), random.normal(size=2)
        share *= random.choice([0, 0, 1])  # often at the start
        clear = random.choice([-1.0, 1.0]) * 10.0 ** random.uniform(-9.0, -4.0)
        rate = random.choice([-1.0, 1.0]) * 10.0 ** random.uniform(-4.0, 0.0)
        u *= random.choice([0.001, 0.1])
        middle = [
            (0, u, 0.01 * z),
            (
                1,
                u - GAP + clear,
                (0.01 * z * pair[lanes.OMEGA] + rate) / pair[SECOND + lanes.OMEGA],
            ),
        ]
        ground, start = here + share * (there - here), []
        for i, place, speed in middle:
            now = state(pair, i * SECOND, place, speed, ground)
            back = bounces.inside(pair, row, i, now, there - here, -share)
            start.append(state(pair, i * SECOND, *back[:2], here))
        if GAP - start[0][0] + start[1][0] < 0.0:
            continue
        after = [step(pair, i * SECOND, start[i], here, there) for i in range(2)]
        yield *start, *after, here, there


def clearances(pair, row, left, right, change):
    """Return the clearance at SHARES of the step."""
    inside = [
        [bounces.inside(pair, row, i, s, change, t)[0] for t in SHARES]
        for i, s in enumerate((left, right))
    ]
    return GAP - np.array(inside[0]) + np.array(inside[1])


@pytest.mark.parametrize(("period", "damping"), [(0.2, 0.0), (0.2, 0.9), (5.0, 0.05)])
def test_two_parts_of_a_step_make_the_step(period, damping):
    # catches: any term of the motion inside a step wrong or left out; the second part starts from
    # what the first gives
    pair, row = resting_pair(period_1=period, damping=damping)
    start, here, there = state(pair, 0, 0.3, -0.7, 4.0), 4.0, -3.0
    middle = bounces.inside(pair, row, 0, start, there - here, 0.37)
    end = bounces.inside(pair, row, 0, middle, there - here, 0.63)
    assert_allclose(end, step(pair, 0, start, here, there), rtol=1e-13)  # rounding
    assert_allclose(middle, state(pair, 0, *middle[:2], here + 0.37 * (there - here)), rtol=1e-13)


def test_what_is_foreseen_comes_true():
    # catches: the bounds of rate or acceleration left out or halved, rising and falling exchanged
    pair, row = resting_pair()
    seen = dict.fromkeys(range(4), 0)
    for left, right, next_left, next_right, here, there in cases(pair, row, 300):
        fate = bounces.foreseen(pair, left, right, next_left, next_right, 1.0)
        seen[fate] += 1
        clear = clearances(pair, row, left, right, there - here)
        if fate == bounces.STAYS_OPEN:
            assert clear.min() > -1e-16  # rounding
        if fate == bounces.CLOSES_ONCE:
            assert clear[-1] < 0.0
            assert np.count_nonzero(np.diff(np.sign(clear))) == 1
    assert seen[bounces.STAYS_OPEN] > 25  # or it would be of no use
    assert seen[bounces.CLOSES_ONCE] > 15


def test_the_clearance_is_zero_where_they_meet():
    # catches: an impact located by the first guess only
    pair, row = resting_pair()
    met = 0
    for left, right, next_left, next_right, here, there in cases(pair, row, 200):
        if bounces.foreseen(pair, left, right, next_left, next_right, 1.0) == bounces.CLOSES_ONCE:
            segment = segment_of(row, here, there, DURATION)
            share, *hit = bounces.meeting(
                pair, row, left, right, next_left, next_right, 1.0, segment
            )
            assert abs(GAP - hit[0][0] + hit[1][0]) < 1e-15  # rounding of a few 0.1 m
            for i, (one, start) in enumerate(zip(hit, (left, right), strict=True)):
                expected = bounces.inside(pair, row, i, start, there - here, share)
                assert_allclose(one[:2], expected[:2], rtol=1e-12, atol=1e-16)  # rounding
            met += 1
    assert met > 10


def turning_points(pair):
    """Yield states at which the rate of the clearance, or its own rate, has an extreme and is almost zero."""
    squares = pair[lanes.OMEGA] ** 2, pair[SECOND + lanes.OMEGA] ** 2
    for speed, tiny, of_rate, apart in itertools.product(
        (-1.0, 1.0), (-1e-6, 1e-6), (True, False), (-GAP, GAP)
    ):
        # undamped, under no ground motion; the displacement that makes the acceleration of the
        # clearance zero or tiny
        place = ((0.0 if of_rate else tiny) - squares[1] * apart) / (squares[0] - squares[1])
        other = (
            speed + tiny if of_rate else speed * squares[0] / squares[1]
        )  # or that of its rate zero
        yield (
            state(pair, 0, place, speed / squares[0] ** 0.5, 0.0),
            state(pair, SECOND, place - apart, other / squares[1] ** 0.5, 0.0),
        )


def test_bounds_hold_where_a_rate_is_about_to_change_its_sign():
    # catches: the bounds of rate or acceleration left out, so that the ends alone decide
    pair, row = resting_pair(damping=0.0)
    omega, wrong_by_ends = np.array([pair[lanes.OMEGA], pair[SECOND + lanes.OMEGA]]), 0
    for middle in turning_points(pair):
        moved = np.array(
            [
                [bounces.inside(pair, row, i, middle[i], 0.0, t) for t in SHARES - 0.5]
                for i in range(2)
            ]
        )
        rate = omega[1] * moved[1, :, 1] - omega[0] * moved[0, :, 1]
        growth = omega[1] ** 2 * moved[1, :, 2] - omega[0] ** 2 * moved[0, :, 2]
        ends = [tuple(moved[i, k]) for k in (0, -1) for i in range(2)]
        rises, falls, turns = bounces.course(pair, *ends, 1.0)
        assert not rises or rate.min() > 0.0
        assert not falls or rate.max() < 0.0
        assert not turns or growth.max() < 0.0
        wrong_by_ends += (
            rate[[0, -1]].min() > 0.0 > rate.min() or growth[[0, -1]].max() < 0.0 < growth.max()
        )
    assert wrong_by_ends > 0


@pytest.mark.parametrize("restitution", [0.3, 0.6, 1.0])
def test_agrees_with_the_event_code(restitution):
    # catches: an impact missed or counted twice, speeds exchanged, the rest of the step from the
    # state before impact
    pair, row = resting_pair(restitution=restitution)
    most = carried = 0
    for left, right, next_left, next_right, here, there in cases(pair, row, 600, seed=1):
        segment = segment_of(row, here, there, DURATION)
        own, other = row.copy(), row.copy()
        bounces.put(pair, left, right)
        load_pair(pair, other)
        assert repeat_step(other, LOG, segment, 0.0)
        if bounces.bounce(pair, own, LOG, left, right, next_left, next_right, segment) < DURATION:
            continue
        load_pair(pair, own)
        assert own[0, columns.IMPACTS] == other[0, columns.IMPACTS]
        for column in (columns.U, columns.V, columns.HIGHEST, columns.WIDEST):
            assert_allclose(
                own[:, column], other[:, column], rtol=1e-9, atol=1e-14
            )  # rounding over impacts that graze
        assert_allclose(own[0, columns.APPROACH], other[0, columns.APPROACH], rtol=1e-9, atol=1e-14)
        most, carried = max(most, own[0, columns.IMPACTS]), carried + 1
    assert carried > 100
    assert most >= 2.0  # two impacts in one step
