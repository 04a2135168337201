"""Coefficients of a pair in each of its phases, against the Taylor motion of its row."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.kernels.polynomial_roots import value_and_slope
from per_obspy.kernels.pounding_events import motion
from per_obspy.kernels.pounding_events.motion import (
    EVENT_FUNCTION,
    TAYLOR,
    fill_clearance,
    fill_contact_force,
    fill_displacements,
    fill_taylor,
)
from per_obspy.kernels.pounding_lanes import lanes
from per_obspy.kernels.pounding_lanes.maxima_in_step import complete_state, state_after_step
from per_obspy.kernels.pounding_lanes.phases import (
    load_row,
    store_row,
    write_constants,
)
from per_obspy.pounding.kernel_tables import row_at_rest, structure_table
from per_obspy.pounding.structure import Structure

DURATION = 0.01
STRUCTURES = (Structure(0.9, 0.05, 2.0, 0.02, 0.1, 1.2), Structure(0.4, 0.2, 1.0, 0.01, 0.0))
PHASES = {
    "elastic": {},
    "yielding": {motion.PHASE: (1.0, -1.0)},
    "touching": {motion.IN_CONTACT: (1.0, 0.0), motion.U: (0.01, 0.0), motion.V: (0.1, 0.1)},
}
PHASES["touching after yielding"] = {**PHASES["touching"], motion.PLASTIC: (0.005, -0.003)}


def pair_of(structures, gap=0.01, **changes):
    """Return the numbers of the lane of a pair, and its row, in a state with these columns."""
    row = row_at_rest(structure_table(structures), np.array([gap]), np.array([0.5]))
    row[:, motion.U], row[:, motion.V] = (0.015, 0.007), (0.1, -0.05)
    for column, values in changes.get("columns", {}).items():
        row[:, column] = values
    # along the north component
    pair = np.zeros(lanes.LANE_ROWS)
    write_constants(pair, row, 1.0, 0.0, DURATION)
    store_row(pair, row, DURATION)
    return pair, row


def states_of(pair, ground):
    """Return the states of both structures now."""
    return [
        complete_state(
            pair, first, pair[first + lanes.DISPLACEMENT], pair[first + lanes.VELOCITY], ground
        )
        for first in (0, lanes.STRUCTURE_ROWS)
    ]


@pytest.mark.parametrize("phase", PHASES)
class TestPhases:
    def test_a_step_is_the_motion_of_the_row(self, phase):
        # catches: a coefficient of the wrong phase, participation or plastic displacement left out
        pair, row = pair_of(STRUCTURES, columns=PHASES[phase])
        fill_displacements(row, 1.5, -200.0, 22)
        start = states_of(pair, 1.5)
        for i, first in enumerate((0, lanes.STRUCTURE_ROWS)):
            omega = pair[first + lanes.OMEGA]
            after = state_after_step(pair, first, start[i], 1.5, 1.5 - 200.0 * DURATION)
            displacement, velocity = value_and_slope(row, i, TAYLOR, 22, DURATION)
            assert_allclose(after[0], displacement, rtol=1e-12)  # rounding, as below
            assert_allclose(after[1] * omega, velocity, rtol=1e-11)
            assert_allclose(start[i][2] * omega**2, 2.0 * row[i, TAYLOR + 2], rtol=1e-11)

    def test_the_contact_function_is_clearance_or_force(self, phase):
        # catches: a force positive in tension, coefficients of displacement 1 and 2 exchanged
        pair, row = pair_of(STRUCTURES, columns=PHASES[phase])
        left, right = states_of(pair, 1.5)
        found = (
            pair[lanes.CONTACT_FUNCTION : lanes.CONTACT_FUNCTION + 5]
            @ (left[0], right[0], left[1], 1.5, 1.0)
        )  # fmt: skip
        fill_displacements(row, 1.5, 0.0, 22)
        if phase.startswith("touching"):
            fill_contact_force(row, 0, 1.5, 0.0, DURATION, 22)
            expected = row[0, EVENT_FUNCTION] / 2.0  # over the mass of structure 1
        else:
            fill_clearance(row, 0, 22, DURATION)
            expected = row[0, EVENT_FUNCTION]
        assert_allclose(found, expected, rtol=1e-11)  # rounding

    def test_lane_and_row_exchange_their_state(self, phase):
        pair, row = pair_of(STRUCTURES, columns=PHASES[phase])
        expected, other = row[:, [motion.U, motion.V, motion.PLASTIC]].copy(), pair.copy()
        row[:, [motion.U, motion.V]] = 0.0
        load_row(pair, row)
        if phase == "yielding":  # then the plastic displacement follows
            expected[:, 2] = expected[:, 0] - row[:, motion.PHASE] * row[:, motion.YIELD]
        assert_allclose(row[:, [motion.U, motion.V, motion.PLASTIC]], expected, rtol=1e-15)
        store_row(other, row, DURATION)
        assert_allclose(other, pair, rtol=1e-15)  # rounding of a division and a product


def test_a_new_phase_has_new_coefficients():
    # catches: a lane that goes on with the coefficients of the phase before
    pair, row = pair_of(STRUCTURES)
    row[0, motion.PHASE] = 1.0
    store_row(pair, row, DURATION)
    fresh, _ = pair_of(STRUCTURES, columns={motion.PHASE: (1.0, 0.0)})
    assert_allclose(pair, fresh, rtol=1e-15)


class TestBoundsInAStep:
    @pytest.mark.parametrize(
        ("period", "damping"), [(0.09, 0.0), (0.09, 0.3), (0.09, 0.95), (3.0, 0.05)]
    )
    def test_hold_for_any_state(self, period, damping):
        # catches: any of the shares in write_error_bounds halved, the acceleration inside a step
        # taken for that at its ends
        pair, _ = pair_of([Structure(period, damping, 2.0), Structure(0.4, 0.2, 1.0)])
        worst = np.zeros(3)
        for u, z, ground in np.random.default_rng(0).normal(size=(60, 3)):
            worst = np.maximum(worst, self.errors(pair, damping, u, z, ground))
        bounds = pair[[lanes.DISPLACEMENT_ERROR, lanes.VELOCITY_ERROR, lanes.POWER_ERROR]]
        assert (worst <= bounds + 1e-12).all()  # rounding
        assert worst[0] > 0.3 * bounds[0]  # not so wide that they never rule anything out

    def errors(self, pair, damping, u, z, ground):
        """Return how far displacement, velocity and power leave their chords in a step."""
        start = complete_state(pair, 0, u, z, ground)
        end = state_after_step(pair, 0, start, ground, 0.3 * ground)
        # the motion inside the step, with time as the angle omega t
        angle, row, share = pair[lanes.ANGLE], np.zeros((1, 30)), np.linspace(0.0, 1.0, 33)[1:-1]
        row[0, 0] = u
        slope = -0.7 * pair[lanes.ACCELERATION + 2] * ground / angle
        fill_taylor(
            row, 0, 0, 22, z, 2.0 * damping, 1.0, start[2] + 2.0 * damping * z, slope
        )  # fmt: skip
        inside = np.array([value_and_slope(row, 0, 0, 22, s * angle) for s in share]).T
        accelerations = np.array(
            [
                complete_state(pair, 0, *inside[:, k], ground * (1.0 - 0.7 * s))[2]
                for k, s in enumerate(share)
            ]
        )
        # displacement, velocity and power less the chords between their ends
        motions = inside[0], inside[1], accelerations + inside[0]
        ends = (u, end[0]), (z, end[1]), (u + start[2], end[0] + end[2])
        off = [
            np.abs(values - (first + share * (last - first))).max()
            for values, (first, last) in zip(motions, ends, strict=True)
        ]
        return np.array(off) / max(abs(start[2]), abs(end[2]))


def test_a_wall_takes_no_part_in_the_contact_force():
    # catches: the force over the mass of the wall, which is zero whatever the motion
    wall = Structure(1.0, 0.0, math.inf, participation=0.0)
    touching = {motion.IN_CONTACT: (1.0, 0.0), motion.U: (0.0, 0.0), motion.V: (0.0, 0.0)}
    for structures, push in (((Structure(0.9, 0.05, 2.0), wall), -1.0),
                             ((wall, Structure(0.9, 0.05, 2.0)), 1.0)):  # fmt: skip
        pair, _ = pair_of(structures, gap=0.0, columns=touching)
        assert_allclose(pair[lanes.CONTACT_FUNCTION + 3], push, rtol=1e-14)  # of ground motion
