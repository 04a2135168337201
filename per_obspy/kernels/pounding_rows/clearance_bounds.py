r"""
Whether an open interface closes in a piece of a step, by bounds from the states at both ends.

The clearance f and its rate are known at both ends of a piece of length h. With time as the angle
``omega t`` the acceleration y of a building leaves its chord over the piece by an eighth of the
squared length times the largest ``|y''|``, which is ``share * ACCELERATION_ERROR`` times its larger
``|y|`` at both ends at most, because the error of a step has one term that grows with its length
and one with its square.

The cubic that has the values and rates of f at both ends leaves f by ``t² (h - t)² / 24`` times the
largest ``|f''''|`` at most, which is ``h⁴ / 384`` times it. As ``|y''|`` is 8 over the squared
length times its error, the part of a building is ``error angle² / 48`` times ``|y|``. The cubic
lies above the least of its four control points.
"""

from per_obspy.kernels._jit import inlined
from per_obspy.kernels.pounding_lanes.free_impacts import (
    CLEARANCE_ROUNDING,
)
from per_obspy.kernels.pounding_lanes.lanes import (
    ACCELERATION_ERROR,
    ANGLE,
    CONTACT_FUNCTION,
    OMEGA,
    STRUCTURE_ROWS,
)


@inlined
def _ends(pair, left, right, next_left, next_right):
    """Return the clearance of a pair, and the size of its terms, and its rate, at both ends."""
    omega = pair[OMEGA]
    other_omega = pair[STRUCTURE_ROWS + OMEGA]
    gap = pair[CONTACT_FUNCTION + 4]
    size = abs(left[0]) + abs(right[0]) + gap
    # opening rates
    rate = other_omega * right[1] - omega * left[1]
    next_rate = other_omega * next_right[1] - omega * next_left[1]
    return gap - left[0] + right[0], gap - next_left[0] + next_right[0], rate, next_rate, size


@inlined
def _errors(pair, left, right, next_left, next_right, share):
    """Return both errors of ``y`` over the piece: those of the left and of the right building."""
    second = STRUCTURE_ROWS
    strength = max(abs(left[2]), abs(next_left[2]))
    other_strength = max(abs(right[2]), abs(next_right[2]))
    error = share * pair[ACCELERATION_ERROR] * strength
    return error, share * pair[second + ACCELERATION_ERROR] * other_strength


@inlined
def stays_open(pair, left, right, next_left, next_right, share, duration):
    """
    Return whether the clearance of an open interface certainly stays positive in a piece.

    Parameters
    ----------
    pair : (LANE_ROWS,) ndarray
        Numbers of the building before the interface, with those of the other as structure 2.
    left, right, next_left, next_right : tuple of float
        States of both buildings at the start and at the end of the piece.
    share : float
        Length of the piece over that of a step.
    duration : float
        Of a step, s.
    """
    value, next_value, rate, next_rate, size = _ends(pair, left, right, next_left, next_right)
    # rest of the clearance beyond its cubic
    error, other_error = _errors(pair, left, right, next_left, next_right, share)
    angle = share * pair[ANGLE]
    other_angle = share * pair[STRUCTURE_ROWS + ANGLE]
    rest = (angle * angle * error + other_angle * other_angle * other_error) * (1.0 / 48.0)
    # least of its four control points
    third = share * duration * (1.0 / 3.0)
    least = min(value, value + third * rate, next_value - third * next_rate, next_value)
    return least - rest > CLEARANCE_ROUNDING * size
