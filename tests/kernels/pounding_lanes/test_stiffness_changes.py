"""Yielding and unloading inside one step, against the event code and against sampled motion."""

import itertools
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from per_obspy.kernels.pounding_events import motion as columns
from per_obspy.kernels.pounding_lanes import lanes
from per_obspy.kernels.pounding_lanes import stiffness_changes as changes
from per_obspy.kernels.pounding_lanes.free_impacts import state_inside_step
from per_obspy.kernels.pounding_lanes.maxima_in_step import (
    complete_state,
    may_yield,
    state_after_step,
)
from per_obspy.kernels.pounding_lanes.phases import (
    load_row,
    write_branch,
    write_constants,
)
from per_obspy.kernels.pounding_lanes.step_by_step import (
    END,
    START,
    STATE_COLUMNS,
    change_stiffnesses,
    run_events,
    segment_of_step,
)
from per_obspy.pounding.kernel_tables import row_at_rest, structure_table
from per_obspy.pounding.structure import Structure

DURATION, LIMIT, PLASTIC, LOG = 0.02, 0.01, 0.004, np.zeros((0, 9))
SECOND = lanes.STRUCTURE_ROWS
SHARES = np.linspace(0.0, 1.0, 101)


def resting_pair(gap=1.0, hardening=0.1, damping=0.3):
    """Return the numbers of the lane of a pair at rest, structure 1 yielded before, and its row."""
    structures = (
        Structure(0.3, damping, 2.0, LIMIT, hardening),
        Structure(0.2, 0.5 * damping, 1.0, LIMIT, 0.0),
    )
    row = row_at_rest(structure_table(structures), np.array([gap]), np.array([0.6]))
    row[0, columns.PLASTIC] = PLASTIC
    row[0, columns.BOUNCE_LIMIT] = 25
    pair = np.zeros(lanes.LANE_ROWS)
    write_constants(pair, row, 1.0, 0.0, DURATION)
    return pair, row


def steps(pair, row, count, seed=0):
    """
    Yield steps of structure 1: states at both ends and ground acceleration at both.

    It is elastic or yields, and once in the step almost at the end of its branch: before or behind
    it, moving or at rest, and pushed to either side.
    """
    random = np.random.default_rng(seed)
    for _ in range(count):
        side = random.choice([-1.0, 0.0, 0.0, 0.0, 1.0])
        row[0, columns.PHASE], row[0, columns.PLASTIC] = side, PLASTIC
        write_branch(pair, row, 0, DURATION)
        # almost at the end of the branch after a share of the step, often at the start
        share, ground, change = random.uniform() * random.choice([0, 1, 1]), *random.normal(size=2)
        small = random.choice([-1.0, 1.0]) * 10.0 ** random.uniform(-9.0, -3.0)
        if side:
            u, z = PLASTIC + side * LIMIT, small
        else:
            u, z = PLASTIC + random.choice([-1.0, 1.0]) * (LIMIT + small), random.normal() * 0.01
            z *= random.choice([0.01, 1.0, 10.0])
        ground *= random.choice([1.0, 10.0])
        now = complete_state(pair, 0, u, z, ground + share * change)
        back = state_inside_step(pair, row, 0, now, change, -share)
        start = complete_state(pair, 0, *back[:2], ground)
        # on its branch at the start
        if side and side * start[1] < 0.0:
            continue
        if not side and abs(start[0] - PLASTIC) > LIMIT:
            continue
        yield start, state_after_step(pair, 0, start, ground, ground + change), ground, change


def dips(pair, row, count):
    """
    Yield steps as ``steps``, in which the elastic structure turns twice.

    It moves away from the end of its range at both ends of the step, and towards it in between.
    """
    random = np.random.default_rng(3)
    row[0, columns.PHASE], row[0, columns.PLASTIC] = 0.0, PLASTIC
    write_branch(pair, row, 0, DURATION)
    for _ in range(count):
        side, push = random.choice([-1.0, 1.0]), random.uniform(0.5, 2.0) * LIMIT
        u = PLASTIC + side * LIMIT * (1.0 - 10.0 ** random.uniform(-9.0, -4.0))
        z = -side * LIMIT * 10.0 ** random.uniform(-9.0, -4.0)
        # pushed to its side at the start, and from it at the end
        still = complete_state(pair, 0, u, z, 0.0)[2]
        drive = pair[lanes.ACCELERATION + 2]
        ground = (side * push - still) / drive
        change = -side * random.uniform(1.9, 2.5) * push / drive
        start = complete_state(pair, 0, u, z, ground)
        yield start, state_after_step(pair, 0, start, ground, ground + change), ground, change


def distance(pair, states):
    """Return what falls below zero where a structure leaves its branch in these states."""
    side = pair[lanes.YIELD_SIDE]
    if side:
        return side * states[:, 1]
    return pair[lanes.YIELD_LIMIT] - np.abs(states[:, 0] - pair[lanes.YIELD_CENTRE])


def inside(pair, row, start, change):
    """Return the states at SHARES of a step."""
    return np.array([state_inside_step(pair, row, 0, start, change, share) for share in SHARES])


class TestPredictions:
    def test_come_true(self):
        # catches: a bound of rate or curvature left out, rising and falling exchanged, an end of
        # the elastic range forgotten
        pair, row = resting_pair()
        counts = dict.fromkeys(range(4), 0)
        cases = itertools.chain(steps(pair, row, 500), dips(pair, row, 100))
        for start, end, _, change in cases:
            prediction = changes.predict_change(pair, 0, start, end, 1.0)
            counts[prediction] += 1
            clear = distance(pair, inside(pair, row, start, change))
            if prediction == changes.STAYS:
                assert clear.min() > -1e-16  # rounding
            if prediction == changes.CHANGES_ONCE:
                assert clear[0] > 0.0 > clear[-1]
                assert np.count_nonzero(np.diff(np.sign(clear))) == 1
        assert counts[changes.STAYS] > 15  # or they would be of no use
        assert counts[changes.CHANGES_ONCE] > 60
        assert counts[changes.UNCERTAIN] < 180

    def test_a_range_narrower_than_a_step_is_uncertain(self):
        # catches: the end of the elastic range on the other side
        pair, _ = resting_pair()
        start = complete_state(pair, 0, PLASTIC - 0.9 * LIMIT, 0.5, 0.0)
        end = state_after_step(pair, 0, start, 0.0, 0.0)
        assert distance(pair, np.array([end])) < 0.0
        pair[lanes.YIELD_LIMIT] = 1e-6
        start = complete_state(pair, 0, PLASTIC, 0.1, -5.0)
        end = state_after_step(pair, 0, start, -5.0, 5.0)
        assert changes.predict_change(pair, 0, start, end, 1.0) == changes.UNCERTAIN


def test_a_change_is_located_where_the_branch_ends():
    # catches: a change at the first estimate only, a term of the Taylor coefficients left out
    pair, row = resting_pair()
    located = 0
    for start, end, _, change in steps(pair, row, 200):
        if changes.predict_change(pair, 0, start, end, 1.0) == changes.CHANGES_ONCE:
            share, state = changes.locate_change(pair, row, 0, start, end, change, 1.0)
            if share >= 0.0:
                located += 1
                exact = state_inside_step(pair, row, 0, start, change, share)
                assert_allclose(state, exact, rtol=1e-12, atol=1e-16)  # rounding
                # of displacement and limit, or of velocity
                assert abs(distance(pair, np.array([state]))[0]) < 1e-16
    assert located > 40


class TestStep:
    @pytest.mark.parametrize("hardening", [0.0, 0.1, 0.5])
    def test_is_the_step_of_the_event_code(self, hardening):
        # catches: the coefficients, the plastic displacement or the side of the branch before,
        # the maxima of a piece left out, a piece with the duration of the step
        pair, row = resting_pair(hardening=hardening)
        carried = changed = 0
        results = [columns.U, columns.V, columns.PHASE, columns.PLASTIC]
        maxima = [columns.LARGEST_DISPLACEMENT, columns.LARGEST_RADIUS_SQUARED]
        for start, end, ground, change in steps(pair, row, 160):
            segment = segment_of_step(row, ground, ground + change, DURATION)
            row[:, maxima] = 0.0
            phase = row[0, columns.PHASE]
            other = complete_state(pair, SECOND, 0.0, 0.0, ground)
            other_end = state_after_step(pair, SECOND, other, ground, ground + change)
            pair[:2], pair[SECOND : SECOND + 2] = start[:2], other[:2]
            load_row(pair, row)
            expected = row.copy()
            assert run_events(expected, LOG, segment, 0.0, False)
            if changes.run_stiffness_changes(
                pair, row, start, other, end, other_end, segment, -1.0, 1.0
            ):
                carried += 1
                load_row(pair, row)
                changed += row[0, columns.PHASE] != phase
                # rounding; a velocity near zero has that of the accelerations over a step
                assert_allclose(row[:, results], expected[:, results], rtol=1e-10, atol=1e-14)
                assert_allclose(row[:, maxima], expected[:, maxima], rtol=1e-11)
                assert pair[lanes.YIELD_SIDE] == row[0, columns.PHASE]
        assert carried > 60
        assert changed > 30

    def test_begins_at_the_end_of_the_elastic_range(self):
        # catches: a structure at the end of its range that stays elastic
        pair, row = resting_pair()
        start = complete_state(pair, 0, PLASTIC + LIMIT, 2.0 * LIMIT, 0.0)
        end = state_after_step(pair, 0, start, 0.0, 0.0)
        segment = segment_of_step(row, 0.0, 0.0, DURATION)
        pair[:2] = start[:2]
        load_row(pair, row)
        expected = row.copy()
        assert run_events(expected, LOG, segment, 0.0, False)
        is_certain, after, _, _ = changes.run_changes(pair, row, 0, start, end, segment)
        assert is_certain
        assert row[0, columns.PHASE] == expected[0, columns.PHASE] == 1.0
        assert after[0] == pytest.approx(expected[0, columns.U], rel=1e-13)  # rounding

    @pytest.mark.parametrize(("least", "largest"), [(0.0, 1.0), (-1.0, 0.0)])
    def test_a_step_that_is_left_changes_nothing(self, least, largest):
        # catches: a branch, a plastic displacement or maxima of a step that another code repeats
        pair, row = resting_pair()
        left_alone = 0
        for start, end, ground, change in steps(pair, row, 60):
            segment = segment_of_step(row, ground, ground + change, DURATION)
            other = complete_state(pair, SECOND, 0.0, 0.0, ground)
            row[:, columns.UNLOADING] = 2.0
            before, row_before = pair.copy(), row.copy()
            # the relative displacement leaves this range, or begins at an end of it
            assert not changes.run_stiffness_changes(
                pair, row, start, other, end, other, segment, least - start[0], largest - start[0]
            )
            assert_array_equal(pair, before)
            kept = [*range(columns.TAYLOR), *range(columns.TERM_COUNT, columns.ROW_COLUMNS)]
            assert_array_equal(row[:, kept], row_before[:, kept])
            # nor does one of a row, whose clearance closes at its start
            row[0, columns.GAP] = pair[lanes.CONTACT_FUNCTION + 4] = start[0]
            states = np.zeros((2, STATE_COLUMNS))
            states[:, START : START + 3], states[:, END : END + 3] = [start, other], [end, other]
            before, row_before = pair.copy(), row.copy()
            assert not change_stiffnesses(pair, row, states, segment)
            assert_array_equal(pair, before)
            assert_array_equal(row[:, kept], row_before[:, kept])
            left_alone += may_yield(pair, 0, start, end)
        assert left_alone > 20

    def test_bounds_contain_the_displacement(self):
        # catches: bounds of the ends of the step only, or of one piece
        pair, row = resting_pair()
        for start, end, ground, change in steps(pair, row, 60, seed=1):
            segment = segment_of_step(row, ground, ground + change, DURATION)
            side = row[0, columns.PHASE]
            sampled = [start[0]]
            pair[:2], pair[SECOND : SECOND + 2] = start[:2], 0.0
            load_row(pair, row)
            single = row.copy()
            # the event code in many parts of the step
            for k in range(20):
                part = ground + change * np.array([k, k + 1]) / 20
                piece = segment_of_step(row, *part, DURATION / 20)
                assert run_events(single, LOG, piece, 0.0, False)
                sampled.append(single[0, columns.U])
            is_certain, _, low, high = changes.run_changes(pair, row, 0, start, end, segment)
            if is_certain:
                assert low <= min(sampled) + 1e-15
                assert high >= max(sampled) - 1e-15
            row[0, columns.PHASE] = side

    def test_bounds_contain_a_turn(self):
        # catches: the error bound of the chord left out
        pair, row = resting_pair()
        for side in (-1.0, 1.0):
            turning = complete_state(pair, 0, PLASTIC, side * 0.001, 10.0 * side)
            end = state_after_step(pair, 0, turning, 10.0 * side, 10.0 * side)
            assert turning[1] * end[1] < 0.0
            segment = segment_of_step(row, 10.0 * side, 10.0 * side, DURATION)
            is_certain, _, low, high = changes.run_changes(pair, row, 0, turning, end, segment)
            reached = inside(pair, row, turning, 0.0)[:, 0]
            assert is_certain
            assert low <= reached.min()
            assert high >= reached.max()

    def test_linear_structures_have_no_change(self):
        # catches: the infinite limit of a linear structure
        pair, row = resting_pair()
        row[0, columns.YIELD] = math.inf
        row[0, columns.PLASTIC] = 0.0
        write_branch(pair, row, 0, DURATION)
        start = complete_state(pair, 0, 0.1, 2.0, 3.0)
        end = state_after_step(pair, 0, start, 3.0, -3.0)
        assert changes.predict_change(pair, 0, start, end, 1.0) == changes.STAYS
