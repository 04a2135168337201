"""The kernels of pounding on inputs small enough for the interpreter; the physics is tested in tests/pounding."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from per_obspy.kernels.oscillator.exact_step import unit_responses
from per_obspy.kernels.polynomial_roots import first_fall, value_and_slope
from per_obspy.kernels.pounding_events.motion import fill_taylor, taylor_terms
from per_obspy.kernels.pounding_lanes import lanes
from per_obspy.kernels.pounding_lanes.deferred_maxima import write_lane
from per_obspy.kernels.pounding_lanes.lanes import sweep
from per_obspy.kernels.pounding_lanes.maxima_in_step import state, step
from per_obspy.kernels.pounding_lanes.pair_rows import write_constants, write_phase
from per_obspy.pounding.history.pair_blocks import pair_table
from per_obspy.pounding.history.pair_histories import pounding_histories
from per_obspy.pounding.history.row_history import pounding_history
from per_obspy.pounding.history.tables import refinement, row_at_rest, structure_table
from per_obspy.pounding.structure import Structure


def fall(coefficients, end, sign=1.0, start=0.0):
    table = np.array([coefficients], dtype=float)
    return first_fall(table, 0, 0, len(coefficients), sign, start, end, 0.0)


class TestFirstFall:
    def test_takes_the_first_of_several_roots(self):
        # catches: a Newton step from the start, which lands on the last root
        polynomial = -np.poly([0.3, 0.31, 0.9])[::-1]  # positive at 0, roots 0.3, 0.31, 0.9
        assert_allclose(
            fall(polynomial, 1.0), 0.3, rtol=1e-10
        )  # a slope of 0.006: rounding counts 200 times

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
    @pytest.mark.parametrize(
        ("damping", "stiffness"), [(0.5, 40.0), (6.0, 2.0), (1.0, 0.0), (0.0, 39.0)]
    )
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
    @pytest.mark.parametrize(
        ("period", "dt"), [(1.0, 0.01), (0.05, 0.02), (0.001, 0.01), (0.2, 0.02)]
    )
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
        history = pounding_history(
            pulse(), 0.02, structures, 0.005, restitution, free_vibration=False
        )
        maxima = pounding_histories(
            pulse(), 0.02, 0.9, 0.05, 2.0, 0.4, 0.05, 1.0, 0.005, restitution, free_vibration=False,
            yield_displacement_1=limit, yield_displacement_2=limit, hardening_1=0.1, hardening_2=0.1,
        )  # fmt: skip
        assert len(history.impacts) > 0
        assert history.closure <= 1e-10  # required
        assert_allclose(maxima.per, history.per, rtol=1e-5)  # bounces end earlier in the lanes
        assert_allclose(maxima.displacement_maxima, history.displacement_maxima, rtol=1e-5)

    def test_row_with_a_wall(self):
        row = [
            Structure(0.9, 0.05, 2.0),
            Structure(0.4, 0.05, 1.0),
            Structure(1.0, 0.0, math.inf, participation=0.0),
        ]
        history = pounding_history(pulse(), 0.02, row, [0.0, 0.004], 0.4)
        assert set(history.impacts["left"]) == {0, 1}
        assert history.closure <= 1e-10


def lane_of(fields, duration):
    """Return the line of numbers that the lanes hold of a pair, at rest, and its row."""
    table = pair_table({name: np.array([value]) for name, value in fields.items()})
    row = row_at_rest(table, np.array([[fields["gap"]]]), np.array([[0.5]]))[0]
    pair = np.zeros(lanes.ROWS)
    write_constants(pair, row, 1.0, 0.0, duration)
    write_phase(pair, row, duration)
    return pair, row


LINEAR = {
    "period_1": 0.9, "damping_1": 0.05, "mass_1": 2.0, "period_2": 0.4, "damping_2": 0.2, "mass_2": 1.0, "gap": 1.0,
    "participation_1": 1.0, "participation_2": 1.0, "yield_displacement_1": math.inf,
    "yield_displacement_2": math.inf, "hardening_1": 0.0, "hardening_2": 0.0,
}  # fmt: skip


class TestSweep:
    def swept(self, speeds, **changes):
        """Return the flags after a tile at rest ground, of lanes of one pair that start with these speeds, m/s."""
        pair, _ = lane_of({**LINEAR, **changes}, 0.001)
        table, flags = np.zeros(lanes.ROWS * lanes.LANES), np.zeros(lanes.LANES, np.int64)
        for lane in range(lanes.LANES):
            pair[lanes.SPEED] = speeds[lane] / pair[lanes.OMEGA] if lane < len(speeds) else 0.0
            pair[lanes.HIGHEST_PLACE] = pair[lanes.WIDEST_RADIUS] = (
                math.inf
            )  # no maximum is looked for
            pair[lanes.STRUCTURE_ROWS + lanes.HIGHEST_PLACE] = math.inf
            write_lane(table, lane, pair)
        sweep(table, flags, np.zeros((2, lanes.TILE + 1)), lanes.TILE)
        return flags

    def test_flags_a_lane_that_meets_within_the_tile(self):
        # catches: a guard of the last sample only, the clearance with the wrong sign
        duration = 0.001 * lanes.TILE
        reach = unit_responses(2 * math.pi / 0.9 * duration, 0.05)[0] / (
            2 * math.pi / 0.9
        )  # of 1 m/s
        flags = self.swept([0.0, 1.001 / reach, 0.999 / reach, -1.001 / reach], gap=1.0)
        assert flags.tolist() == [0, lanes.EVENT, 0, 0] + 28 * [0]

    def test_flags_a_structure_that_yields_within_the_tile(self):
        flags = self.swept([0.1, -0.1, 0.001], gap=100.0, yield_displacement_1=0.002)
        assert flags.tolist() == [lanes.EVENT, lanes.EVENT, 0] + 29 * [0]


class TestBoundsInAStep:
    @pytest.mark.parametrize(
        ("period", "damping"), [(0.09, 0.0), (0.09, 0.3), (0.09, 0.95), (3.0, 0.05)]
    )
    def test_hold_for_any_state(self, period, damping):
        # catches: any of the shares in write_bounds halved, the acceleration inside a step taken
        # for that at its ends
        pair, _ = lane_of({**LINEAR, "period_1": period, "damping_1": damping}, 0.01)
        angle, worst = pair[lanes.ANGLE], np.zeros(3)
        for u, z, ground in np.random.default_rng(0).normal(size=(60, 3)):
            start = state(pair, 0, u, z, ground)
            end = step(pair, 0, start, ground, 0.3 * ground)
            strength, row = max(abs(start[2]), abs(end[2])), np.zeros((1, 30))
            row[0, 0] = u
            rate = 2.0 * damping
            force = start[2] + rate * z
            fill_taylor(
                row, 0, 0, 22, z, rate, 1.0, force, -0.7 * pair[lanes.PULL + 2] * ground / angle
            )
            share = np.linspace(0.0, 1.0, 33)[1:-1]
            inside = np.array([value_and_slope(row, 0, 0, 22, s * angle) for s in share]).T
            here, there = (ground, 0.3 * ground)
            pulls = np.array(
                [
                    state(pair, 0, *inside[:, k], here + s * (there - here))[2]
                    for k, s in enumerate(share)
                ]
            )
            powers = pulls + inside[0], (u + start[2], end[0] + end[2])
            for k, (motion, ends) in enumerate(
                ((inside[0], (u, end[0])), (inside[1], (z, end[1])), powers)
            ):
                off = np.abs(motion - (ends[0] + share * (ends[1] - ends[0]))).max()
                worst[k] = max(worst[k], off / strength)
        bounds = pair[[lanes.PLACE_SAG, lanes.SPEED_SAG, lanes.POWER_SAG]]
        assert (worst <= bounds + 1e-12).all()  # rounding
        assert worst[0] > 0.3 * bounds[0]  # not so wide that they never rule anything out
