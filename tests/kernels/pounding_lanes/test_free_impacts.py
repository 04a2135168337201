"""
Single impacts inside one step, against the event code and against sampled clearances.

Covers ``per_obspy.kernels.pounding_lanes.impact_steps`` too.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.kernels.pounding_events import motion as columns
from per_obspy.kernels.pounding_events.contact import LOG_COLUMNS, count_impacts, is_lingering
from per_obspy.kernels.pounding_lanes import free_impacts, impact_steps, lanes
from per_obspy.kernels.pounding_lanes.impact_steps import clearance_course
from per_obspy.kernels.pounding_lanes.maxima_in_step import complete_state, state_after_step
from per_obspy.kernels.pounding_lanes.phases import load_row, write_constants
from per_obspy.kernels.pounding_lanes.step_by_step import run_events, segment_of_step
from per_obspy.pounding.kernel_tables import row_at_rest, structure_table
from per_obspy.pounding.structure import Structure

DURATION, GAP, LINES = 0.02, 0.01, 100
SECOND = lanes.STRUCTURE_ROWS
SHARES = np.linspace(0.0, 1.0, 201)


def resting_pair(period_1=0.3, period_2=0.2, damping=0.3, restitution=0.6):
    """Return the numbers of the lane of a pair at rest, and its row."""
    structures = (Structure(period_1, damping, 2.0), Structure(period_2, 0.5 * damping, 1.0))
    row = row_at_rest(structure_table(structures), np.array([GAP]), np.array([restitution]))
    # end of bounces
    row[0, columns.STICKING_SPEED] = 1e-12
    row[0, columns.STICKING_DELAY] = 1e-5
    row[0, columns.BOUNCE_LIMIT] = 25
    pair = np.zeros(lanes.LANE_ROWS)
    write_constants(pair, row, 1.0, 0.0, DURATION)
    return pair, row


def course(pair, *states):
    """Return the prediction for a whole step."""
    return clearance_course(pair, *states, 1.0, DURATION)


def cases(pair, row, count, seed=0):
    """
    Yield a step: states of both structures at its start and end, and ground acceleration at both.

    The structures start with a clearance and are once almost in contact, with a rate of any size
    and pressed together or drawn apart.
    """
    random = np.random.default_rng(seed)
    for _ in range(count):
        share = random.uniform()
        ground_start, ground_end = random.normal(size=2)
        u, z = random.normal(size=2)
        share *= random.choice([0, 0, 1])  # often at the start
        # almost in contact after the share of the step
        clear = random.choice([-1.0, 1.0]) * 10.0 ** random.uniform(-9.0, -4.0)
        rate = random.choice([-1.0, 1.0]) * 10.0 ** random.uniform(-4.0, 0.0)
        u *= random.choice([0.001, 0.1])
        other_z = (0.01 * z * pair[lanes.OMEGA] + rate) / pair[SECOND + lanes.OMEGA]
        ground, change = (
            ground_start + share * (ground_end - ground_start),
            ground_end - ground_start,
        )
        # from there back to the start, and on to the end
        start = []
        for i, displacement, velocity in ((0, u, 0.01 * z), (1, u - GAP + clear, other_z)):
            now = complete_state(pair, i * SECOND, displacement, velocity, ground)
            back = free_impacts.state_inside_step(pair, row, i, now, change, -share)
            start.append(complete_state(pair, i * SECOND, *back[:2], ground_start))
        if GAP - start[0][0] + start[1][0] < 0.0:
            continue
        end = [
            state_after_step(pair, i * SECOND, start[i], ground_start, ground_end) for i in range(2)
        ]
        yield *start, *end, ground_start, ground_end


def clearances(pair, row, left, right, change):
    """Return the clearance at SHARES of the step."""
    displacements = [
        [free_impacts.state_inside_step(pair, row, i, state, change, share)[0] for share in SHARES]
        for i, state in enumerate((left, right))
    ]
    return GAP - np.array(displacements[0]) + np.array(displacements[1])


@pytest.mark.parametrize(("period", "damping"), [(0.2, 0.0), (0.2, 0.9), (5.0, 0.05)])
def test_two_parts_of_a_step_make_the_step(period, damping):
    # catches: any term of the motion inside a step wrong or left out; the second part starts from
    # the end of the first
    pair, row = resting_pair(period_1=period, damping=damping)
    start = complete_state(pair, 0, 0.3, -0.7, 4.0)
    middle = free_impacts.state_inside_step(pair, row, 0, start, -7.0, 0.37)
    end = free_impacts.state_inside_step(pair, row, 0, middle, -7.0, 0.63)
    assert_allclose(end, state_after_step(pair, 0, start, 4.0, -3.0), rtol=1e-13)  # rounding
    expected = complete_state(pair, 0, *middle[:2], 4.0 - 0.37 * 7.0)
    assert_allclose(middle, expected, rtol=1e-13)


def located(pair, row, states, segment):
    """Return the time of the impact in a step, and both states then."""
    origins = states[:2]
    found = free_impacts.locate_impact(pair, row, tuple(states), *origins, 0.0, 1.0, segment, False)
    return found[:3]


@pytest.mark.parametrize("terms", [4, 5, 10, 11])
def test_both_series_at_once_are_those_of_each_structure(terms):
    # catches: the last of an odd number of terms left out, even and odd powers exchanged
    pair, row = resting_pair()
    row[0, columns.TERM_COUNT] = terms
    states = complete_state(pair, 0, 0.3, -0.7, 4.0), complete_state(pair, SECOND, -0.1, 0.9, 4.0)
    ramps = free_impacts._ramps(row, 0.37)
    for i, first in enumerate((0, SECOND)):
        found = free_impacts._state_by_ramp(pair, first, states[i], -7.0, 0.37, ramps[i])
        expected = free_impacts.state_inside_step(pair, row, i, states[i], -7.0, 0.37)
        assert_allclose(found, expected, rtol=1e-14)  # rounding


def test_predictions_come_true():
    # catches: the bounds of rate or acceleration left out or halved, rising and falling exchanged
    pair, row = resting_pair()
    counts = dict.fromkeys(range(4), 0)
    for *states, ground_start, ground_end in cases(pair, row, 300):
        prediction = course(pair, *states)
        counts[prediction] += 1
        clear = clearances(pair, row, *states[:2], ground_end - ground_start)
        if prediction == free_impacts.STAYS_OPEN:
            assert clear.min() > -1e-16  # rounding
        if prediction == free_impacts.CLOSES_ONCE:
            assert clear[-1] < 0.0
            assert np.count_nonzero(np.diff(np.sign(clear))) == 1
    assert counts[free_impacts.STAYS_OPEN] > 25  # or it would be of no use
    assert counts[free_impacts.CLOSES_ONCE] > 15


def test_the_clearance_is_zero_where_they_meet():
    # catches: an impact located by the first guess only
    pair, row = resting_pair()
    met = 0
    for *states, ground_start, ground_end in cases(pair, row, 200):
        prediction = course(pair, *states)
        if prediction != free_impacts.CLOSES_ONCE:
            continue
        segment = segment_of_step(row, ground_start, ground_end, DURATION)
        share, *hit = located(pair, row, states, segment)
        assert abs(GAP - hit[0][0] + hit[1][0]) < 1e-15  # rounding of a few 0.1 m
        # both states lie on the motion of the step
        for i in range(2):
            expected = free_impacts.state_inside_step(
                pair, row, i, states[i], ground_end - ground_start, share
            )
            assert_allclose(hit[i][:2], expected[:2], rtol=1e-12, atol=1e-16)  # rounding
        met += 1
    assert met > 10


def test_most_impacts_need_one_correction():
    # catches: a first guess by the parabola only, or by a wrong quartic
    pair, row = resting_pair()
    guesses, improved = [], []
    for left, right, *ends, ground_start, ground_end in cases(pair, row, 400, seed=2):
        if course(pair, left, right, *ends) == free_impacts.CLOSES_ONCE:
            segment = segment_of_step(row, ground_start, ground_end, DURATION)
            time, *_ = located(pair, row, (left, right, *ends), segment)
            change = ground_end - ground_start
            series, _ = free_impacts._clearance_series(pair, left, right, change, DURATION)
            end = free_impacts._clearance(pair, *ends)
            guess = free_impacts._first_guess(*series[:2], end)
            guesses.append(abs(guess - time))
            improved.append(abs(free_impacts._improved_guess(series, end, 1.0, guess) - time))
    assert len(improved) > 20
    # one correction is enough where the cubic from there is exact
    assert np.mean(np.array(improved) < free_impacts.CUBIC_SHARE) > 0.8
    assert np.median(improved) < 0.01 * np.median(guesses)


def test_bounces_end_as_in_the_event_code():
    # catches: accelerations of the two structures exchanged, one of the three limits left out
    pair, row = resting_pair()
    ends = []
    for left, right, _, _, ground, _ in cases(pair, row, 300, seed=3):
        for count, speed, delay in ((0.0, 1e-12, 1e-3), (0.0, 1e-2, 0.0), (25.0, 0.0, 0.0)):
            row[0, columns.BOUNCES] = count
            row[0, columns.STICKING_SPEED], row[0, columns.STICKING_DELAY] = speed, delay
            impact_steps.set_states(pair, left, right)
            load_row(pair, row)
            expected = is_lingering(row, 0, ground)
            assert impact_steps._bounces_end(pair, row, left, right) == expected
            ends.append(expected)
    assert 0.4 < np.mean(ends) < 0.9


@pytest.mark.parametrize("damping", [0.0, 0.3])
def test_motion_after_an_impact_is_that_from_another_start(damping):
    # catches: the determinant left out or without the damping, displacement and velocity exchanged,
    # a response that is not moved to the impact
    pair, row = resting_pair(damping=damping)
    random, met = np.random.default_rng(6), 0
    for *states, ground_start, ground_end in cases(pair, row, 300, seed=4):
        if course(pair, *states) != free_impacts.CLOSES_ONCE:
            continue
        segment = segment_of_step(row, ground_start, ground_end, DURATION)
        change = ground_end - ground_start
        share, *hit = free_impacts.locate_impact(
            pair, row, tuple(states), *states[:2], 0.0, 1.0, segment, False
        )
        for i, growth in enumerate(random.normal(size=2)):
            first = i * SECOND
            start, end = free_impacts.add_velocity(
                pair, first, states[i], states[2 + i], hit[2 + i], growth
            )
            # from the new start to the impact: the same place, with the other velocity
            u, z, _ = hit[i]
            after = complete_state(pair, first, u, z + growth, ground_start + share * change)
            reached = free_impacts.state_inside_step(pair, row, i, start, change, share)
            assert_allclose(reached, after, rtol=1e-12, atol=1e-13)  # rounding
            # and from the impact to the end
            expected = free_impacts.state_inside_step(pair, row, i, after, change, 1.0 - share)
            assert_allclose(end, expected, rtol=1e-12, atol=1e-13)
        met += 1
    assert met > 10


def test_the_way_back_to_contact_is_estimated_from_its_start():
    # catches: a guess by the parabola only, or by a wrong cubic
    pair, row = resting_pair()
    random, guesses, errors = np.random.default_rng(7), [], []
    for _ in range(300):
        # in contact, opening, and pressed together
        u, z = random.uniform(0.03, 0.1), random.normal(0.0, 0.01)
        rate = 10.0 ** random.uniform(-3.0, -0.5)
        ground, change = random.normal(0.0, 5.0, 2)
        left = complete_state(pair, 0, u, z, ground)
        other = (z * pair[lanes.OMEGA] + rate) / pair[SECOND + lanes.OMEGA]
        right = complete_state(pair, SECOND, u - GAP, other, ground)
        ends = [
            free_impacts.state_inside_step(pair, row, i, state, change, 1.0)
            for i, state in enumerate((left, right))
        ]
        states = left, right, *ends
        if course(pair, *states) != free_impacts.CLOSES_ONCE:
            continue
        segment = segment_of_step(row, ground, ground + change, DURATION)
        time, *hit = free_impacts.locate_impact(
            pair, row, states, left, right, 0.0, 1.0, segment, True
        )
        assert abs(GAP - hit[0][0] + hit[1][0]) < 1e-15  # rounding of 0.1 m
        series, _ = free_impacts._clearance_series(pair, left, right, change, DURATION)
        end = free_impacts._clearance(pair, *ends)
        guesses.append(abs(series[1] / (series[1] - end) - time))
        errors.append(abs(free_impacts._guess_after_contact(series, end, 1.0) - time))
    assert len(errors) > 50
    # one correction is enough where the cubic from there is exact
    assert np.mean(np.array(errors) < free_impacts.CUBIC_SHARE) > 0.75
    assert np.median(errors) < 2e-4 * np.median(guesses)


@pytest.mark.parametrize("restitution", [0.3, 0.6, 1.0])
def test_agrees_with_the_event_code(restitution):
    # catches: an impact missed or counted twice, one that counts not logged, velocities exchanged,
    # the rest of the step from the state before impact
    pair, row = resting_pair(restitution=restitution)
    most = carried = skipped = 0
    for *states, ground_start, ground_end in cases(pair, row, 600, seed=1):
        segment = segment_of_step(row, ground_start, ground_end, DURATION)
        # an earlier impact was so fast that slow ones never count, every other time
        row[0, columns.APPROACH] = 10.0 - row[0, columns.APPROACH]
        # event by event, with a line for every impact as in single histories
        fast, expected = row.copy(), row.copy()
        expected[0, columns.TERM_COUNT] = 0.0
        fast_log, log = np.zeros((2, LINES, LOG_COLUMNS))
        impact_steps.set_states(pair, *states[:2])
        load_row(pair, expected)
        assert run_events(expected, log, segment, 0.0, False)
        # by single impacts, where these carry through the step
        if impact_steps.run_free_impacts(pair, fast, fast_log, *states, segment) < DURATION:
            continue
        load_row(pair, fast)
        assert fast[0, columns.BOUNCES] == expected[0, columns.BOUNCES]
        # those that never count have no line of the log
        numbers = count_impacts(np.stack([fast, expected]), np.stack([fast_log, log]))
        assert numbers[0] == numbers[1]
        skipped += expected[0, columns.IMPACTS] - fast[0, columns.IMPACTS]
        compared = [
            columns.U,
            columns.V,
            columns.LARGEST_DISPLACEMENT,
            columns.LARGEST_RADIUS_SQUARED,
            columns.APPROACH,
        ]
        # rounding over impacts that graze
        assert_allclose(fast[:, compared], expected[:, compared], rtol=1e-9, atol=1e-14)
        most, carried = max(most, fast[0, columns.BOUNCES]), carried + 1
    assert carried > 100
    assert skipped > 0
    assert most >= 2.0  # two impacts in one step
