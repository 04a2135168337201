r"""
The exact step of the linear oscillator under piecewise-linear ground acceleration.

The equation of motion is ``u'' + 2 xi omega u' + omega² u = -a``. The state is ``(u, z)`` with
``z = v / omega``, so that both are lengths and the radius is ``sqrt(u² + z²)``; time is counted as
the phase ``omega * t``. With the unit impulse response ``H`` and its integrals ``I1``, ``I2``, a
span of phase ``p`` over which the acceleration goes from ``a0`` to ``a1`` gives (Nigam & Jennings
1969)::

    u(p) = u0 (1 - I1) + z0 H  - [a0 I1 + (a1 - a0) I2 / p] / omega²
    z(p) = -u0 H + z0 H'       - [a0 H  + (a1 - a0) I1 / p] / omega²

The shifted step takes four multiply-adds: the state ``x = (u, z)`` is shifted by its part that
follows the acceleration at the end of a step, rotated so that the acceleration at the start enters
one axis only, and scaled so that it enters with factor 1::

    x' = A x + b0 a + b1 a'
    x = scale R s + b1 a
    s1' = r11 s1 + (r12 s2 + a)
    s2' = r21 s1 + r22 s2
"""

import math

from per_obspy.kernels._jit import kernel

#: Below this phase the closed forms of I1 and I2 would cancel (like eps / phase³); their series
#: ends within 18 terms.
SERIES_PHASE = 0.7
SERIES_TERMS = 18
#: The scaled input vanishes for undamped periods dt / k. A floor far below rounding avoids the
#: division by zero.
SMALLEST_INPUT = 1e-30


@kernel
def unit_responses(phase, damping):
    """
    Return ``H, H', I1, I2`` at a phase: the unit impulse response, its derivative and integrals.

    ``H'' + 2 xi H' + H = 0`` with ``H(0) = 0``, ``H'(0) = 1``; integrating it once and twice gives
    ``H' = 1 - 2 xi H - I1`` and ``H = phase - 2 xi I1 - I2``.
    """
    # Small phases: Taylor series of the integrals, which do not cancel
    if phase < SERIES_PHASE:
        integral_1, integral_2 = _integral_series(1, phase, damping)
        impulse = phase - 2.0 * damping * integral_1 - integral_2
        slope = 1.0 - 2.0 * damping * impulse - integral_1
        return impulse, slope, integral_1, integral_2
    # Other phases: closed form of the damped free vibration
    root = math.sqrt((1.0 - damping) * (1.0 + damping))
    decay = math.exp(-damping * phase)
    impulse = decay * math.sin(root * phase) / root
    slope = decay * math.cos(root * phase) - damping * impulse
    integral_1 = 1.0 - slope - 2.0 * damping * impulse
    integral_2 = phase - impulse - 2.0 * damping * integral_1
    return impulse, slope, integral_1, integral_2


@kernel
def integrals(phase, damping):
    """
    Return ``H', H, I1, I2, I3, I4`` at a phase: as `unit_responses`, with two more integrals.

    Integrating ``H = phase - 2 xi I1 - I2`` gives ``I1 = phase² / 2 - 2 xi I2 - I3``, and this
    ``I2`` in the same way.
    """
    square = phase * phase / 2.0
    cube = phase * phase * phase / 6.0
    # Small phases: series of the highest integrals, from which the lower ones follow
    if phase < SERIES_PHASE:
        integral_3, integral_4 = _integral_series(3, phase, damping)
        integral_2 = cube - 2.0 * damping * integral_3 - integral_4
        integral_1 = square - 2.0 * damping * integral_2 - integral_3
        impulse = phase - 2.0 * damping * integral_1 - integral_2
        slope = 1.0 - 2.0 * damping * impulse - integral_1
        return slope, impulse, integral_1, integral_2, integral_3, integral_4
    # Other phases: higher integrals from the lower ones
    impulse, slope, integral_1, integral_2 = unit_responses(phase, damping)
    integral_3 = square - 2.0 * damping * integral_2 - integral_1
    integral_4 = cube - 2.0 * damping * integral_3 - integral_2
    return slope, impulse, integral_1, integral_2, integral_3, integral_4


@kernel
def _integral_series(fold, phase, damping):
    """Return the ``fold`` and one more fold integral of the impulse response by Taylor series."""
    older = 0.0  # H^(n) at zero, each from the two before
    newer = 1.0
    power = phase  # phase^(n + fold) / (n + fold)! for n = 1
    for order in range(2, fold + 2):
        power *= phase / order
    integral = next_integral = 0.0
    for order in range(1, SERIES_TERMS):
        integral += newer * power
        power *= phase / (order + fold + 1)
        next_integral += newer * power
        older, newer = newer, -2.0 * damping * newer - older
    return integral, next_integral


@kernel
def step_coefficients(omega, damping, dt):
    """
    Return the eight coefficients of one step for the state ``(u, z = v / omega)``.

    ``u1 = a11 u0 + a12 z0 + b11 a0 + b12 a1`` and ``z1 = a21 u0 + a22 z0 + b21 a0 + b22 a1``, in
    this order: ``a11, a12, a21, a22, b11, b12, b21, b22``; a0 and a1 are the ground accelerations
    at the step's ends.
    """
    phase = omega * dt
    impulse, slope, integral_1, integral_2 = unit_responses(phase, damping)
    compliance = -1.0 / (omega * omega)
    b12 = compliance * integral_2 / phase
    b22 = compliance * integral_1 / phase
    return (
        1.0 - integral_1,
        impulse,
        -impulse,
        slope,
        compliance * integral_1 - b12,
        b12,
        compliance * impulse - b22,
        b22,
    )


@kernel
def state_after(time, u, v, omega, damping, acceleration, acceleration_rate):
    """Return displacement and velocity after a time under a linearly changing acceleration."""
    impulse, slope, integral_1, integral_2 = unit_responses(omega * time, damping)
    velocity_scale = 1.0 / omega
    z = v * velocity_scale
    # Acceleration over omega², and its rate of change over omega³
    strength = acceleration * velocity_scale * velocity_scale
    strength_rate = acceleration_rate * velocity_scale * velocity_scale * velocity_scale
    u_after = u * (1.0 - integral_1) + z * impulse
    u_after = u_after - strength * integral_1 - strength_rate * integral_2
    z_after = -u * impulse + z * slope
    z_after = z_after - strength * impulse - strength_rate * integral_1
    return u_after, z_after * omega


@kernel
def shifted_step(omega, damping, dt):
    """
    Return the matrix and the frame of the shifted step.

    The matrix is ``r11, r12, r21, r22``; the frame is scale, cosine and sine of the rotation R, and
    both parts of ``b1``.
    """
    a11, a12, a21, a22, b11, b12, b21, b22 = step_coefficients(omega, damping, dt)
    # Input of the shifted state, A b1 + b0; it gives the scale and the rotation
    along = a11 * b12 + a12 * b22 + b11
    across = a21 * b12 + a22 * b22 + b21
    scale = max(math.hypot(along, across), SMALLEST_INPUT * math.hypot(b12, b22))
    c, s = (along / scale, across / scale) if abs(along) + abs(across) >= scale else (1.0, 0.0)
    # Step matrix in the rotated axes, R^T A R
    r11 = c * (a11 * c + a12 * s) + s * (a21 * c + a22 * s)
    r12 = c * (a12 * c - a11 * s) + s * (a22 * c - a21 * s)
    r21 = c * (a21 * c + a22 * s) - s * (a11 * c + a12 * s)
    r22 = c * (a22 * c - a21 * s) - s * (a12 * c - a11 * s)
    return (r11, r12, r21, r22), (scale, c, s, b12, b22)


@kernel
def shifted_rest(frame, acceleration):
    """Return the shifted state of an oscillator at rest under an acceleration."""
    scale, c, s, u, z = frame
    along = -(c * u + s * z) / scale * acceleration
    across = -(c * z - s * u) / scale * acceleration
    return along, across


@kernel
def unshifted(frame, along, across, acceleration):
    """Return the state of an oscillator, ``u`` and ``z = v / omega``, from its shifted state."""
    scale, c, s, shift_u, shift_z = frame
    u = scale * (c * along - s * across) + shift_u * acceleration
    z = scale * (s * along + c * across) + shift_z * acceleration
    return u, z
