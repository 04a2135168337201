"""Links and Kelvin-Voigt contacts: matrix exponential, an ODE solver, limits."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from per_obspy.pounding.contact_elements import kelvin_voigt_history, linked_history
from per_obspy.pounding.row_history import pounding_history
from per_obspy.pounding.structure import Structure

from .made_up import shaking

DT = 0.02
LEFT, RIGHT = Structure(1.5, 0.05, 4.0, participation=1.2), Structure(0.6, 0.02, 1.0)


def coupled(stiffness, damping):
    """Matrix and ground vector of the state (u1, v1, u2, v2)."""
    matrix, ground = np.zeros((4, 4)), np.zeros(4)
    for displacement, s, sign in ((0, LEFT, 1.0), (2, RIGHT, -1.0)):
        velocity = displacement + 1
        matrix[displacement, velocity] = 1.0
        matrix[velocity, displacement] = -(s.frequency**2)
        matrix[velocity, velocity] = -2 * s.damping * s.frequency

        # the link pulls back what moves ahead of the other structure
        matrix[velocity, [0, 2]] -= sign * np.array([stiffness, -stiffness]) / s.mass
        matrix[velocity, [1, 3]] -= sign * np.array([damping, -damping]) / s.mass
        ground[velocity] = -s.participation
    return matrix, ground


def first_order_hold(acceleration, stiffness, damping):
    """States at the samples by the exponential of the augmented matrix; shares no code."""
    matrix, ground = coupled(stiffness, damping)
    # acceleration and its slope as two more states
    augmented = np.zeros((6, 6))
    augmented[:4, :4], augmented[:4, 4], augmented[4, 5] = matrix, ground, 1.0
    step, states = expm(augmented * DT), [np.zeros(4)]
    for a, b in pairwise(acceleration):
        before = np.concatenate([states[-1], [a, (b - a) / DT]])
        states.append((step @ before)[:4])
    return np.array(states)


class TestLinearLink:
    @pytest.mark.parametrize(
        ("stiffness", "damping"), [(0.0, 0.0), (50.0, 0.0), (0.0, 8.0), (300.0, 5.0)]
    )
    def test_equals_the_matrix_exponential(self, stiffness, damping):
        # catches: link force on the wrong structure, damping and stiffness exchanged, participation
        # left out
        acceleration = shaking(6.0)
        history = linked_history(
            acceleration, DT, LEFT, RIGHT, stiffness, damping, free_vibration=False
        )
        states = first_order_hold(acceleration, stiffness, damping)
        assert_allclose(
            history.displacement, states[:, [0, 2]].T, rtol=0, atol=1e-12
        )  # both are exact
        assert_allclose(history.velocity, states[:, [1, 3]].T, rtol=0, atol=1e-11)
        force = stiffness * (states[:, 0] - states[:, 2]) + damping * (states[:, 1] - states[:, 3])
        assert_allclose(history.force, force, rtol=0, atol=1e-9)
        assert history.force_maximum >= np.abs(force).max() * (1 - 1e-12)
        assert_allclose(
            history.force_maximum, np.abs(force).max(), rtol=0.05
        )  # between samples a little more

    def test_without_link_is_uncoupled(self):
        # catches: coupling where there is none
        apart = pounding_history(shaking(6.0), DT, [LEFT, RIGHT], 100.0, 0.5)
        history = linked_history(shaking(6.0), DT, LEFT, RIGHT, 0.0)
        assert_allclose(history.displacement_maxima, apart.displacement_maxima, rtol=1e-10)
        assert history.force_maximum == 0.0

    def test_rigid_link_joins_the_structures(self):
        # catches: a link that pushes where it should pull
        history = linked_history(shaking(2.0), DT, LEFT, RIGHT, 1e7)
        assert (
            max(history.closing, history.parting) < 1e-5
        )  # force of about 20 N over the stiffness
        assert history.force_maximum > 1.0


class TestBilinearLink:
    def test_equals_an_ode_solver(self):
        # catches: yield at the wrong side, plastic part not carried on
        acceleration, k, limit, hardening = shaking(4.0, seed=2), 60.0, 1.5, 0.1
        history = linked_history(
            acceleration, DT, LEFT, RIGHT, k, 1.0, limit, hardening, free_vibration=False
        )
        displacement = self.by_ode(acceleration, k, limit, hardening)
        assert history.force_maximum > limit * 1.02  # it did yield
        # the solver steps over the corners
        assert_allclose(history.displacement, displacement, rtol=0, atol=3e-4)

    @staticmethod
    def by_ode(acceleration, stiffness, limit, hardening):
        """Return both displacements by SciPy; the fifth state is the elastoplastic force."""
        matrix, ground = coupled(hardening * stiffness, 1.0)
        times = DT * np.arange(acceleration.size)
        soft, full = (1 - hardening) * stiffness, (1 - hardening) * limit
        pull = np.array([0.0, -1 / LEFT.mass, 0.0, 1 / RIGHT.mass])

        def rate(t, y):
            # both structures under the ground, the hardened spring and the elastoplastic part
            forces = matrix @ y[:4] + ground * np.interp(t, times, acceleration) + pull * y[4]
            # at the yield force the elastoplastic part no longer grows
            closing = y[1] - y[3]
            stuck = abs(y[4]) >= full and closing * y[4] > 0
            return np.append(forces, 0.0 if stuck else soft * closing)

        accuracy = {"max_step": DT / 20, "rtol": 1e-8, "atol": 1e-10}
        return solve_ivp(rate, (0, times[-1]), np.zeros(5), t_eval=times, **accuracy).y[[0, 2]]

    def test_strong_link_is_elastic(self):
        elastic = linked_history(shaking(6.0), DT, LEFT, RIGHT, 60.0, 1.0)
        strong = linked_history(
            shaking(6.0), DT, LEFT, RIGHT, 60.0, 1.0, yield_force=1e6, hardening=0.3
        )
        assert_allclose(strong.displacement, elastic.displacement, rtol=0, atol=1e-12)

    def test_force_stays_on_the_yield_line(self):
        # catches: yielding at a force other than the yield force
        history = linked_history(
            shaking(6.0), DT, LEFT, RIGHT, 60.0, 0.0, yield_force=1.0, hardening=0.0
        )
        assert_allclose(history.force_maximum, 1.0, rtol=1e-12)


class TestKelvinVoigt:
    def test_converges_to_impacts(self):
        # catches: contact that pulls, gap with the wrong sign; e = 1 without damping
        acceleration, errors = shaking(2.4), []
        exact = pounding_history(acceleration, DT, [LEFT, RIGHT], 0.03, 1.0, free_vibration=False)
        assert 1 <= len(exact.impacts) < 6
        for stiffness in (1e4, 1e6, 1e8):
            history = kelvin_voigt_history(
                acceleration, DT, LEFT, RIGHT, 0.03, stiffness, free_vibration=False
            )
            errors.append(np.abs(history.displacement - exact.displacement).max())
        assert (
            errors[2] < 0.2 * errors[1] < 0.04 * errors[0]
        )  # like the root of the compliance: 0.1 each

    def test_damping_dissipates_like_restitution(self):
        # catches: damping ratio of the contact; e = exp(-(xi/q) atan2(2 xi q, 2 xi² - 1)) without
        # tension
        acceleration, stiffness, xi = shaking(2.0, seed=5), 1e8, 0.2
        reduced = LEFT.mass * RIGHT.mass / (LEFT.mass + RIGHT.mass)
        damping = 2 * xi * np.sqrt(stiffness * reduced)
        q = np.sqrt(1 - xi**2)
        restitution = np.exp(-xi / q * np.arctan2(2 * xi * q, 2 * xi**2 - 1))
        exact = pounding_history(
            acceleration, DT, [LEFT, RIGHT], 0.01, restitution, free_vibration=False
        )
        first, second = exact.impacts["time"][:2]
        before = DT * np.arange(acceleration.size) < second - DT
        assert second - first > 3 * DT
        history = kelvin_voigt_history(
            acceleration, DT, LEFT, RIGHT, 0.01, stiffness, damping, free_vibration=False
        )
        assert_allclose(
            history.displacement[:, before], exact.displacement[:, before], rtol=0, atol=2e-4
        )  # stiff limit

    def test_never_pulls(self):
        history = kelvin_voigt_history(shaking(6.0), DT, LEFT, RIGHT, 0.0, 1e5, 50.0)
        assert history.force.min() >= -1e-9  # rounding of a stiff spring
        assert history.force_maximum > 0.0
