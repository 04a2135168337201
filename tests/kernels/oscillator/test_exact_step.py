"""The exact step of an oscillator, against exact arithmetic and against itself."""

import math
from fractions import Fraction
from itertools import pairwise

import pytest
from numpy.testing import assert_allclose

from per_obspy.kernels.oscillator.exact_step import (
    SERIES_PHASE,
    integrals,
    shifted_rest,
    shifted_step,
    state_after,
    step_coefficients,
    unit_responses,
    unshifted,
)


def _by_fractions(phase, damping):
    """Taylor series of the impulse response and its integrals in exact rational arithmetic."""
    p, x = Fraction(phase), Fraction(damping)
    coefficients = [Fraction(0), Fraction(1)]
    for _ in range(60):
        coefficients.append(-2 * x * coefficients[-1] - coefficients[-2])
    orders = range(60)
    return [
        float(
            sum(
                coefficients[n + lift] * p ** (n + power) / math.factorial(n + power)
                for n in orders
            )
        )
        for lift, power in ((0, 0), (1, 0), (0, 1), (0, 2), (0, 3), (0, 4))
    ]


@pytest.mark.parametrize("damping", [0.0, 0.05, 0.5, 0.99])
@pytest.mark.parametrize(
    "phase", [1e-7, 1e-3, 0.1, SERIES_PHASE * 0.999, SERIES_PHASE * 1.001, 2.0, 6.0]
)
def test_unit_responses_agree_with_exact_arithmetic(phase, damping):
    # catches a closed form used where it cancels (it loses all digits of I2 at 1e-5), and a series
    # cut too early
    assert_allclose(unit_responses(phase, damping), _by_fractions(phase, damping)[:4], rtol=2e-14)


@pytest.mark.parametrize("damping", [0.0, 0.05, 0.5, 0.99])
@pytest.mark.parametrize(
    "phase", [1e-7, 1e-3, 0.1, SERIES_PHASE * 0.999, SERIES_PHASE * 1.001, 2.0, 6.0]
)
def test_integrals_agree_with_exact_arithmetic(phase, damping):
    # mutation: a power or a factorial of the series that belongs to the neighbouring integral
    impulse, slope, *expected = _by_fractions(phase, damping)
    # just above the series the closed form of I4 loses three digits
    assert_allclose(integrals(phase, damping), (slope, impulse, *expected), rtol=5e-13)


@pytest.mark.parametrize(("damping", "dt"), [(0.0, 0.01), (0.3, 0.2), (0.95, 1.7)])
def test_two_steps_are_one_of_twice_the_length(damping, dt):
    # catches coefficients of the input exchanged: the acceleration goes straight from 2 over 3 to 4
    omega, u, z = 5.0, 0.3, -0.2
    for first, last in ((2.0, 3.0), (3.0, 4.0)):
        a11, a12, a21, a22, b11, b12, b21, b22 = step_coefficients(omega, damping, dt)
        u_end = a11 * u + a12 * z + b11 * first + b12 * last
        z_end = a21 * u + a22 * z + b21 * first + b22 * last
        u, z = u_end, z_end
    a11, a12, a21, a22, b11, b12, b21, b22 = step_coefficients(omega, damping, 2 * dt)
    whole = (
        a11 * 0.3 - a12 * 0.2 + b11 * 2.0 + b12 * 4.0,
        a21 * 0.3 - a22 * 0.2 + b21 * 2.0 + b22 * 4.0,
    )
    assert_allclose([u, z], whole, rtol=1e-13)


def test_constant_acceleration_keeps_the_static_displacement():
    # closed form: u = -a / omega² stays
    a11, a12, a21, a22, b11, b12, b21, b22 = step_coefficients(3.0, 0.1, 0.4)
    static = -7.0 / 9.0
    assert_allclose(a11 * static + (b11 + b12) * 7.0, static, rtol=1e-14)
    assert_allclose(a21 * static + (b21 + b22) * 7.0, 0.0, atol=1e-15)
    assert a12 == -a21
    assert a22 < 1.0


def test_state_after_part_of_a_step_leads_to_its_end():
    omega, damping = 4.0, 0.07
    half = state_after(0.3, 0.1, -0.5, omega, damping, 2.0, 5.0)
    end = state_after(0.3, *half, omega, damping, 2.0 + 5.0 * 0.3, 5.0)
    assert_allclose(end, state_after(0.6, 0.1, -0.5, omega, damping, 2.0, 5.0), rtol=1e-13)
    a11, a12, _, _, b11, b12, _, _ = step_coefficients(omega, damping, 0.6)
    assert_allclose(end[0], a11 * 0.1 - a12 * 0.5 / omega + b11 * 2.0 + b12 * 5.0, rtol=1e-13)


@pytest.mark.parametrize(("damping", "dt"), [(0.05, 0.1), (0.9, 2.0), (0.0, 2 * math.pi / 3)])
def test_shifted_steps_undone_are_exact_steps(damping, dt):
    # mutations: shift, rotation or scale not undone; the last case is a period of dt, whose input
    # vanishes and cannot be scaled
    omega, record = 3.0, (0.7, -1.1, 0.4, 2.0)
    (r11, r12, r21, r22), frame = shifted_step(omega, damping, dt)
    a11, a12, a21, a22, b11, b12, b21, b22 = step_coefficients(omega, damping, dt)
    along, across = shifted_rest(frame, record[0])
    u = z = 0.0
    for start, end in pairwise(record):
        turned = r11 * along + (r12 * across + start), r21 * along + r22 * across
        along, across = turned
        state = (
            a11 * u + a12 * z + b11 * start + b12 * end,
            a21 * u + a22 * z + b21 * start + b22 * end,
        )
        u, z = state
        assert_allclose(unshifted(frame, along, across, end), (u, z), rtol=1e-12, atol=1e-16)
