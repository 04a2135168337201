"""Element between two structures, against a numerical solver and closed forms."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from per_obspy.kernels.pounding_events import links, motion
from per_obspy.pounding.kernel_tables import row_at_rest, structure_table
from per_obspy.pounding.structure import Structure

STRUCTURES = (Structure(0.9, 0.05, 2.0), Structure(0.4, 0.02, 1.0, participation=1.3))
TERMS, DURATION, ACCELERATION, SLOPE = 24, 0.03, 1.5, -20.0


def moving_row():
    row = row_at_rest(structure_table(STRUCTURES), np.zeros(1), np.zeros(1))
    row[:, motion.U], row[:, motion.V] = (0.02, 0.01), (0.3, -0.2)
    return row


def advance(row, element, phase, maxima):
    return links.advance_linked(
        row, element, phase, 0.0, maxima, DURATION, ACCELERATION, SLOPE, TERMS
    )


def test_a_linear_link_solves_the_coupled_equations():
    # catches: the force on structure 2 with the wrong sign, a mass left out, the dashpot by z
    row, maxima = moving_row(), np.zeros(5)
    element = links.Element(50.0, 3.0, math.inf, 0.0, 0.0)

    def rates(t, y):
        # force of the link, and the equation of motion of each structure
        force = 50.0 * (y[0] - y[2]) + 3.0 * (y[1] - y[3])
        ground, accelerations = ACCELERATION + SLOPE * t, []
        for s, u, v, push in zip(STRUCTURES, y[::2], y[1::2], (-force, force), strict=True):
            own = 2.0 * s.damping * s.frequency * v + s.frequency**2 * u
            accelerations.append(push / s.mass - own - s.participation * ground)
        return [y[1], accelerations[0], y[3], accelerations[1]]

    start = [0.02, 0.3, 0.01, -0.2]
    solved = solve_ivp(rates, (0.0, DURATION), start, "DOP853", rtol=1e-13, atol=1e-15)
    assert advance(row, element, links.ELASTIC, maxima) == (links.ELASTIC, 0.0, True)
    found = row[:, [motion.U, motion.V]].ravel()
    assert_allclose(found, solved.y[:, -1], rtol=1e-11)  # the solver's
    # the largest distance is at least that at any time
    assert maxima[links.MAXIMUM_CLOSING] >= (solved.y[0] - solved.y[2]).max() - 1e-12


class TestPhases:
    def test_a_yielding_link_holds_its_yield_force(self):
        # catches: the plastic part not moved along, the force in the phase after unloading
        row, maxima = moving_row(), np.zeros(5)
        element = links.Element(500.0, 0.0, 6.0, 0.0, 0.0)
        phase, _, is_through = advance(row, element, links.ELASTIC, maxima)
        assert (phase, is_through) == (links.PULLED, True)
        assert_allclose(maxima[links.MAXIMUM_FORCE], 6.0, rtol=1e-12)  # rounding

    @pytest.mark.parametrize("phase", [links.ELASTIC, links.PULLED])
    def test_the_force_is_continuous_where_a_link_yields(self, phase):
        element, plastic = links.Element(500.0, 0.0, 6.0, 0.1, 0.0), 0.003
        stiffness, _, constant = links.element_force(element, phase, plastic)
        distance = 0.003 + 6.0 / 500.0  # z at the end of the elastic range
        expected = 6.0 + 0.1 * 500.0 * 0.003  # with the hardening spring
        assert_allclose(stiffness * distance + constant, expected, rtol=1e-14)  # rounding

    def test_an_open_contact_closes_where_the_clearance_is_zero(self):
        # catches: the force of a closed contact measured from zero instead of the gap
        row, maxima = moving_row(), np.zeros(5)
        element = links.Element(5e3, 0.0, math.inf, 0.0, 0.015)
        phase, _, is_through = advance(row, element, links.OPEN, maxima)
        assert (phase, is_through) == (links.CLOSED, True)
        overlap = maxima[links.MAXIMUM_CLOSING] - 0.015
        assert overlap > 0.0
        assert_allclose(maxima[links.MAXIMUM_FORCE], 5e3 * overlap, rtol=1e-10)  # rounding


def test_extremes_inside_a_piece():
    # a parabola with its top between the ends
    row = np.zeros((2, motion.ROW_COLUMNS))
    row[0, motion.TAYLOR : motion.TAYLOR + 3] = 1.0, 2.0, -4.0  # top 1.25 at 0.25
    assert_allclose(
        links.extremes_in_piece(row, 0, motion.TAYLOR, 3, 0.6), (0.76, 1.25), rtol=1e-14
    )
