r"""
The linear oscillator ``u'' + 2 xi omega u' + omega² u = -a`` under piecewise-linear ground acceleration, exact.

The state is ``(u, z)`` with ``z = v / omega``, so that both are lengths and the radius is ``sqrt(u²
+ z²)``; time is counted as the phase ``omega * t``. With the unit impulse response ``H`` and its
integrals ``I1``, ``I2``, a span of
phase ``p`` over which the acceleration goes from ``a0`` to ``a1`` gives (Nigam & Jennings 1969)::

    u(p) = u0 (1 - I1) + z0 H  - [a0 I1 + (a1 - a0) I2 / p] / omega²
    z(p) = -u0 H + z0 H'       - [a0 H  + (a1 - a0) I1 / p] / omega²
"""

import math

from per_obspy.kernels._jit import kernel

#: Below this phase the closed forms of I1 and I2 would cancel (like eps / phase³); their series
#: ends within 18 terms.
SERIES_PHASE = 0.7
SERIES_TERMS = 18


@kernel
def unit_responses(phase, damping):
    """
    Return ``H, H', I1, I2`` at a phase: unit impulse response, its derivative, and its first and second integral.

    ``H'' + 2 xi H' + H = 0`` with ``H(0) = 0``, ``H'(0) = 1``; integrating it once and twice gives
    ``H' = 1 - 2 xi H - I1`` and ``H = phase - 2 xi I1 - I2``.
    """
    if phase < SERIES_PHASE:
        once, twice = _integral_series(1, phase, damping)
        impulse = phase - 2.0 * damping * once - twice
        return impulse, 1.0 - 2.0 * damping * impulse - once, once, twice
    root = math.sqrt((1.0 - damping) * (1.0 + damping))
    decay = math.exp(-damping * phase)
    impulse = decay * math.sin(root * phase) / root
    slope = decay * math.cos(root * phase) - damping * impulse
    once = 1.0 - slope - 2.0 * damping * impulse
    return impulse, slope, once, phase - impulse - 2.0 * damping * once


@kernel
def integrals(phase, damping):
    """
    Return ``H', H, I1, I2, I3, I4`` at a phase: what `unit_responses` does, and two integrals more.

    Integrating ``H = phase - 2 xi I1 - I2`` gives ``I1 = phase² / 2 - 2 xi I2 - I3``, and this
    ``I2`` in the same way.
    """
    square, cube = phase * phase / 2.0, phase * phase * phase / 6.0
    if phase < SERIES_PHASE:
        thrice, four_times = _integral_series(3, phase, damping)
        twice = cube - 2.0 * damping * thrice - four_times
        once = square - 2.0 * damping * twice - thrice
        impulse = phase - 2.0 * damping * once - twice
        return 1.0 - 2.0 * damping * impulse - once, impulse, once, twice, thrice, four_times
    impulse, slope, once, twice = unit_responses(phase, damping)
    thrice = square - 2.0 * damping * twice - once
    return slope, impulse, once, twice, thrice, cube - 2.0 * damping * thrice - twice


@kernel
def _integral_series(fold, phase, damping):
    """Return so many fold integrals of the impulse response, and once more, by its Taylor series."""
    older, newer = 0.0, 1.0  # H^(n) at zero, each from the two before
    power = phase  # phase^(n + fold) / (n + fold)! for n = 1
    for order in range(2, fold + 2):
        power *= phase / order
    once = twice = 0.0
    for order in range(1, SERIES_TERMS):
        once += newer * power
        power *= phase / (order + fold + 1)
        twice += newer * power
        older, newer = newer, -2.0 * damping * newer - older
    return once, twice


@kernel
def step(omega, damping, dt):
    """
    Return the eight coefficients of one step for the state ``(u, z = v / omega)``.

    ``u1 = a11 u0 + a12 z0 + b11 a0 + b12 a1`` and ``z1 = a21 u0 + a22 z0 + b21 a0 + b22 a1``, in
    this order: ``a11, a12, a21, a22, b11, b12, b21, b22``; a0 and a1 are the ground accelerations
    at the step's ends.
    """
    phase = omega * dt
    impulse, slope, once, twice = unit_responses(phase, damping)
    compliance = -1.0 / (omega * omega)
    b12 = compliance * twice / phase
    b22 = compliance * once / phase
    return (
        1.0 - once,
        impulse,
        -impulse,
        slope,
        compliance * once - b12,
        b12,
        compliance * impulse - b22,
        b22,
    )


@kernel
def state_after(time, u, v, omega, damping, acceleration, acceleration_rate):
    """Return displacement and velocity after a time under an acceleration that starts here and changes at a rate."""
    impulse, slope, once, twice = unit_responses(omega * time, damping)
    velocity_scale = 1.0 / omega
    z = v * velocity_scale
    strength = acceleration * velocity_scale * velocity_scale
    strength_rate = acceleration_rate * velocity_scale * velocity_scale * velocity_scale
    u_after = u * (1.0 - once) + z * impulse - strength * once - strength_rate * twice
    z_after = -u * impulse + z * slope - strength * impulse - strength_rate * once
    return u_after, z_after * omega
