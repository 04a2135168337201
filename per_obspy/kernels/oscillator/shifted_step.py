r"""
One step of an oscillator in four multiply-adds: shifted, rotated and scaled states.

The state ``x = (u, z)`` is shifted by its part that follows the acceleration at the end of a step,
rotated so that the
acceleration at the start enters one axis only, and scaled so that it enters with factor 1::

    x' = A x + b0 a + b1 a';  x = scale R s + b1 a;  s1' = r11 s1 + (r12 s2 + a);  s2' = r21 s1 +
    r22 s2
"""

import math

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.oscillator.exact_step import step

#: The scaled input vanishes for undamped periods dt / k. A floor far below rounding avoids the
#: division by zero.
SMALLEST_INPUT = 1e-30


@kernel
def shifted_step(omega, damping, dt):
    """Return ``r11, r12, r21, r22``, then the frame: scale, cosine and sine of the rotation R, and both parts of b1."""
    a11, a12, a21, a22, b11, b12, b21, b22 = step(omega, damping, dt)
    along, across = a11 * b12 + a12 * b22 + b11, a21 * b12 + a22 * b22 + b21
    scale = max(math.hypot(along, across), SMALLEST_INPUT * math.hypot(b12, b22))
    c, s = (along / scale, across / scale) if abs(along) + abs(across) >= scale else (1.0, 0.0)
    r11 = c * (a11 * c + a12 * s) + s * (a21 * c + a22 * s)
    r12 = c * (a12 * c - a11 * s) + s * (a22 * c - a21 * s)
    r21 = c * (a21 * c + a22 * s) - s * (a11 * c + a12 * s)
    r22 = c * (a22 * c - a21 * s) - s * (a12 * c - a11 * s)
    return (r11, r12, r21, r22), (scale, c, s, b12, b22)


@kernel
def shifted_rest(frame, acceleration):
    """Return the shifted state of an oscillator at rest under an acceleration."""
    scale, c, s, u, z = frame
    return -(c * u + s * z) / scale * acceleration, -(c * z - s * u) / scale * acceleration


@kernel
def unshifted(frame, along, across, acceleration):
    """Return the state of an oscillator, ``u`` and ``z = v / omega``, from its shifted state."""
    scale, c, s, u, z = frame
    return scale * (c * along - s * across) + u * acceleration, scale * (
        s * along + c * across
    ) + z * acceleration
