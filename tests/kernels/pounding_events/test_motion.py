"""Taylor motion of a row between two events."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from per_obspy.kernels.polynomial_roots import value_and_slope
from per_obspy.kernels.pounding_events import motion
from per_obspy.kernels.pounding_events.motion import (
    EVENT_FUNCTION,
    TAYLOR,
    fill_clearance,
    fill_contact_force,
    fill_displacements,
    fill_taylor,
    mass_share,
    restoring_force,
    taylor_terms,
)
from per_obspy.pounding.kernel_tables import row_at_rest, structure_table
from per_obspy.pounding.structure import Structure

TERMS = 22


def row_of(structures, gap):
    """Return a row of structures at rest with equal gaps."""
    gaps = np.full(len(structures) - 1, gap)
    return row_at_rest(structure_table(structures), gaps, np.full_like(gaps, 0.5))


class TestTaylor:
    @pytest.mark.parametrize(
        ("damping", "stiffness"), [(0.5, 40.0), (6.0, 2.0), (1.0, 0.0), (0.0, 39.0)]
    )
    def test_solves_the_equation(self, damping, stiffness):
        # catches: a wrong recurrence; under- and overdamped, without stiffness
        table = np.zeros((1, 30))
        table[0, 0] = 0.2
        fill_taylor(table, 0, 0, TERMS, -0.7, damping, stiffness, 1.3 - stiffness * 0.2, -5.0)

        def rates(t, y):
            return [y[1], 1.3 - 5.0 * t - damping * y[1] - stiffness * y[0]]

        solved = solve_ivp(rates, (0.0, 0.1), [0.2, -0.7], "DOP853", rtol=1e-13, atol=1e-15)
        found = value_and_slope(table, 0, 0, TERMS, 0.1)
        assert_allclose(found, solved.y[:, -1], rtol=1e-11)  # the solver's

    def test_terms_grow_with_the_angle(self):
        table = structure_table([Structure(1.0, 0.05, 1.0), Structure(2.0, 0.05, 1.0)])
        few, many = taylor_terms(table, 0.001), taylor_terms(table, 0.1)
        assert few < many <= 24
        assert (2 * math.pi * 0.1 * 1.05) ** many / math.factorial(many) < 1e-16


@pytest.mark.parametrize("side", [1, -1])
def test_restoring_force_is_continuous_where_a_structure_yields(side):
    # catches: the sign of the side or the hardening missing in one of the phases
    row = row_of([Structure(1.0, 0.05, 1.0, 0.02, 0.1), Structure(2.0, 0.05, 1.0)], 1.0)
    row[0, motion.PLASTIC] = 0.013
    row[0, motion.U] = 0.013 + side * 0.02
    stiffness, constant = restoring_force(row, 0)
    elastic = stiffness * row[0, motion.U] - constant
    row[0, motion.PHASE] = side
    stiffness, constant = restoring_force(row, 0)
    assert_allclose(stiffness * row[0, motion.U] - constant, elastic, rtol=1e-14)  # rounding


def test_a_wall_has_all_the_mass_of_its_cluster():
    row = row_of([Structure(1.0, 0.0, mass) for mass in (2.0, math.inf, 3.0)], 0.0)
    assert [mass_share(row, 0, 2, i) for i in range(3)] == [0.0, 1.0, 0.0]
    assert mass_share(row, 0, 0, 0) == 1.0


@pytest.mark.parametrize("order", [0, 1])
def test_clearance_is_gap_less_left_plus_right(order):
    # catches: left and right exchanged, a division by t that also divides the gap
    row = row_of([Structure(0.9, 0.05, 2.0), Structure(0.4, 0.05, 1.0)], 0.01)
    row[:, motion.U] = 0.03, 0.02 if order else 0.05  # in contact, or 3 cm apart
    row[:, motion.V] = -0.2, 0.3
    row[0, motion.CLEARANCE_ORDER] = order
    fill_displacements(row, 1.5, -20.0, TERMS)
    fill_clearance(row, 0, TERMS, 0.02)
    found = value_and_slope(row, 0, EVENT_FUNCTION, TERMS, 0.013)[0]
    left, right = (value_and_slope(row, i, TAYLOR, TERMS, 0.013)[0] for i in range(2))
    assert_allclose(found, (0.01 - left + right) / 0.013**order, rtol=1e-12)  # rounding


class TestContactForce:
    structures = (
        Structure(0.9, 0.05, 2.0, 0.01, 0.1),
        Structure(0.4, 0.02, 1.0),
        Structure(0.6, 0.1, 3.0),
    )

    def force(self, structures, sign):
        """Return the coefficients of the contact forces of a row that moves as one."""
        # one displacement and velocity, under linear ground acceleration
        row = row_of(structures, 0.0)
        row[:, motion.U], row[:, motion.V] = sign * 0.004, sign * 0.3
        fill_displacements(row, sign * 1.5, sign * -20.0, TERMS)
        for j in range(len(structures) - 1):
            fill_contact_force(row, j, sign * 1.5, sign * -20.0, 0.02, TERMS)
        return row[:-1, EVENT_FUNCTION : EVENT_FUNCTION + TERMS - 2]

    def test_action_equals_reaction(self):
        # catches: a force of the structures on one side only; the mirrored row computes it from the
        # structures on the other side
        left = self.force(self.structures, 1.0)
        right = self.force(self.structures[::-1], -1.0)[::-1]
        size = np.abs(left).max(axis=0)
        assert (np.abs(left - right) <= 1e-13 * size).all()  # rounding of the sums
        assert (size[:4] > 0.1).all()

    def test_is_zero_between_structures_that_move_alike(self):
        # catches: mass or participation missing in one of the terms
        structure = Structure(0.9, 0.05, 2.0)
        assert_allclose(self.force([structure, structure], 1.0)[0, :4], 0.0, atol=1e-12)  # of 100 N
