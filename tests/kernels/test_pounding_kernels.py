"""The kernels of pounding on inputs small enough for the interpreter; the physics is tested in tests/pounding."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from per_obspy.kernels import pounding_lanes as lanes
from per_obspy.kernels.polynomial_roots import first_fall, value_and_slope
from per_obspy.kernels.pounding_motion import fill_taylor, taylor_terms
from per_obspy.pounding.histories import pounding_histories
from per_obspy.pounding.history import pounding_history
from per_obspy.pounding.rows import refinement, structure_table
from per_obspy.pounding.structure import Structure


def fall(coefficients, end, sign=1.0, start=0.0):
    table = np.array([coefficients], dtype=float)
    return first_fall(table, 0, 0, len(coefficients), sign, start, end, 0.0)


class TestFirstFall:
    def test_takes_the_first_of_several_roots(self):
        # catches: a Newton step from the start, which lands on the last root
        polynomial = -np.poly([0.3, 0.31, 0.9])[::-1]  # positive at 0, roots 0.3, 0.31, 0.9
        assert_allclose(fall(polynomial, 1.0), 0.3, rtol=1e-10)  # a slope of 0.006: rounding counts 200 times

    def test_does_not_invent_a_root(self):
        assert fall([1e-9, 0.0, 0.0, 1.0], 1.0) == -1.0
        assert fall([0.0400001, -0.4, 1.0], 1.0) == -1.0  # least 1e-7 above zero

    def test_leaves_a_rising_zero(self):
        # catches: a structure that has just been hit, hit again at once
        assert_allclose(fall([0.0, 1.0, -2.0], 1.0), 0.5, rtol=1e-12)

    @pytest.mark.parametrize("coefficients", [[0.0, 0.0, 0.0], [0.0, 1.0], [1.0]])
    def test_nothing_to_find(self, coefficients):
        assert fall(coefficients, 1.0) == -1.0
        assert fall(coefficients, 0.0) == -1.0


class TestTaylor:
    @pytest.mark.parametrize(("damping", "stiffness"), [(0.5, 40.0), (6.0, 2.0), (1.0, 0.0), (0.0, 39.0)])
    def test_solves_the_equation(self, damping, stiffness):
        # catches: a wrong recurrence; under- and overdamped, without stiffness
        table = np.zeros((1, 30))
        table[0, 0] = 0.2
        fill_taylor(table, 0, 0, 22, -0.7, damping, stiffness, 1.3 - stiffness * 0.2, -5.0)
        end = solve_ivp(
            lambda t, y: [y[1], 1.3 - 5.0 * t - damping * y[1] - stiffness * y[0]],
            (0.0, 0.1), [0.2, -0.7], "DOP853", rtol=1e-13, atol=1e-15,
        ).y[:, -1]  # fmt: skip
        assert_allclose(value_and_slope(table, 0, 0, 22, 0.1), end, rtol=1e-11)  # the solver's

    def test_terms_grow_with_the_phase(self):
        table = structure_table([Structure(1.0, 0.05, 1.0), Structure(2.0, 0.05, 1.0)])
        few, many = taylor_terms(table, 0.001), taylor_terms(table, 0.1)
        assert few < many <= 24
        assert (2 * math.pi * 0.1 * 1.05) ** many / math.factorial(many) < 1e-16


class TestRefinement:
    @pytest.mark.parametrize(("period", "dt"), [(1.0, 0.01), (0.05, 0.02), (0.001, 0.01), (0.2, 0.02)])
    def test_keeps_the_phase_small(self, period, dt):
        parts = refinement(2 * math.pi / period, dt)
        assert 2 * math.pi / period * dt / parts <= 0.7
        assert parts == 1 or 2 * math.pi / period * dt / parts > 0.35


def pulse(count=40, dt=0.02):
    return -4.0 * np.sin(2 * np.pi * np.arange(count) * dt / 0.8)


class TestSmallHistories:
    """Run every branch of the event code without compilation: indices are checked then."""

    @pytest.mark.parametrize("restitution", [0.0, 0.5])
    @pytest.mark.parametrize("limit", [0.01, math.inf])
    def test_lanes_agree_with_the_row(self, restitution, limit):
        # catches: lanes and rows that differ in phase handling
        structures = [Structure(0.9, 0.05, 2.0, limit, 0.1), Structure(0.4, 0.05, 1.0, limit, 0.1)]
        history = pounding_history(pulse(), 0.02, structures, 0.005, restitution, free_vibration=False)
        maxima = pounding_histories(
            pulse(), 0.02, 0.9, 0.05, 2.0, 0.4, 0.05, 1.0, 0.005, restitution, free_vibration=False,
            yield_displacement_1=limit, yield_displacement_2=limit, hardening_1=0.1, hardening_2=0.1,
        )  # fmt: skip
        assert len(history.impacts) > 0
        assert history.closure <= 1e-10  # required
        assert_allclose(maxima.per, history.per, rtol=1e-5)  # bounces end earlier in the lanes
        assert_allclose(maxima.displacement_maxima, history.displacement_maxima, rtol=1e-5)

    def test_row_with_a_wall(self):
        row = [Structure(0.9, 0.05, 2.0), Structure(0.4, 0.05, 1.0), Structure(1.0, 0.0, math.inf, participation=0.0)]
        history = pounding_history(pulse(), 0.02, row, [0.0, 0.004], 0.4)
        assert set(history.impacts["left"]) == {0, 1}
        assert history.closure <= 1e-10


def test_a_step_of_the_lanes_flags_what_it_must():
    # catches: a bound that leaves a contact inside the step unseen
    table, flags = np.zeros(lanes.ROWS * lanes.LANES), np.zeros(lanes.LANES + 1, np.int64)
    half = lanes.STRUCTURE_ROWS * lanes.LANES
    rows = table.reshape(lanes.ROWS, lanes.LANES)
    for first in (0, lanes.STRUCTURE_ROWS):
        rows[first + lanes.STEP_PLACE] = rows[first + lanes.STEP_SPEED + 1] = 1.0
        rows[first + lanes.STEP_PLACE + 1] = 0.01  # free flight over a step of 0.01 s
        rows[first + lanes.HIGHEST_PLACE] = rows[first + lanes.WIDEST_RADIUS] = 9.0
    rows[lanes.CLEAR], rows[lanes.FORCE + 4] = 1.0, 1.0
    rows[lanes.SPEED, 3] = 101.0  # closes 1.01 m in the step
    rows[lanes.SPEED, 4] = 99.0
    rest = (0.0, 0.0, 0.0, 0.0)
    total = lanes.step_lanes((table, table[:half], table[half:]), flags, rest, 0.01, False, True)
    assert total == lanes.EVENT
    assert flags[3] == lanes.EVENT
