r"""
Whether an open interface closes in a piece of a step, by bounds from the states at both ends.

The clearance f and its rate are known at both ends of a piece of length h, and so is its
acceleration. Three bounds follow. With time as the angle ``omega t`` the acceleration y of a
building leaves its chord over the piece by an eighth of the squared length times the largest
``|y''|``, which is ``share * ACCELERATION_ERROR`` times its larger ``|y|`` at both ends at most,
because the error of a step has one term that grows with its length and one with its square.

* The cubic that has the values and rates of f at both ends leaves f by ``t² (h - t)² / 24`` times
  the largest ``|f''''|`` at most, which is ``h⁴ / 384`` times it. As ``|y''|`` is 8 over the
  squared length times its error, the part of a building is ``error angle² / 48`` times ``|y|``.
  The cubic lies above the least of its four control points.
* The acceleration of f leaves its chord by ``bend``, the sum of the errors of both buildings.
* The rate of f leaves its chord by ``h / 8`` times the change of that acceleration over the piece,
  which is what a linear acceleration causes, and by ``h / 2`` times ``bend``: with e the rest of
  the acceleration, the rate of the rest is ``(1 - s) ∫ e`` up to s less ``s ∫ e`` after it, with s
  the share of the piece, at most ``2 h s (1 - s) bend``.
"""

from per_obspy.kernels._jit import inlined
from per_obspy.kernels.pounding_lanes.free_impacts import (
    CLEARANCE_ROUNDING,
    CLOSES_NOW,
    CLOSES_ONCE,
    STAYS_OPEN,
    UNCERTAIN,
)
from per_obspy.kernels.pounding_lanes.lanes import (
    ACCELERATION_ERROR,
    ANGLE,
    CONTACT_FUNCTION,
    OMEGA,
    STRUCTURE_ROWS,
)

#: ``t² (h - t)² / 24`` over ``h⁴ / 384`` is at most this times ``t (h - t)² / h³``.
ROOM_AFTER_CONTACT = 16.0


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
def _stays_above(value, next_value, rate, next_rate, span, rest, rounding, has_met):
    """
    Return whether a function stays above a rounding, by its cubic over a span less a rest.

    If it ``has_met`` it is zero at the start, and stays positive after it: there the rest is below
    ``ROOM_AFTER_CONTACT`` times ``s (1 - s)² rest``, and the control point ``3 s (1 - s)² rate``.
    """
    if next_value <= rounding:
        return False
    third = span * (1.0 / 3.0)
    near = third * rate
    far = next_value - third * next_rate
    if has_met:
        return (3.0 * near > ROOM_AFTER_CONTACT * rest) & (min(near, far) > rounding)
    return min(value, value + near, far, next_value) - rest > rounding


@inlined
def stays_open(pair, left, right, next_left, next_right, share, duration, has_met):
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
    has_met : bool
        Whether the clearance is zero at the start.
    """
    value, next_value, rate, next_rate, size = _ends(pair, left, right, next_left, next_right)
    # rest of the clearance beyond its cubic
    error, other_error = _errors(pair, left, right, next_left, next_right, share)
    angle = share * pair[ANGLE]
    other_angle = share * pair[STRUCTURE_ROWS + ANGLE]
    rest = (angle * angle * error + other_angle * other_angle * other_error) * (1.0 / 48.0)
    rounding = CLEARANCE_ROUNDING * size
    span = share * duration
    return _stays_above(value, next_value, rate, next_rate, span, rest, rounding, has_met)


@inlined
def clearance_course(pair, left, right, next_left, next_right, share, duration):
    """Predict the clearance of an open interface in a piece, as ``predict_clearance`` does."""
    value, next_value, rate, next_rate, size = _ends(pair, left, right, next_left, next_right)
    # acceleration of the clearance at both ends, and the bound of what it is beyond its chord
    stiffness = pair[OMEGA] * pair[OMEGA]
    other_stiffness = pair[STRUCTURE_ROWS + OMEGA] * pair[STRUCTURE_ROWS + OMEGA]
    change = other_stiffness * right[2] - stiffness * left[2]
    next_change = other_stiffness * next_right[2] - stiffness * next_left[2]
    error, other_error = _errors(pair, left, right, next_left, next_right, share)
    bend = stiffness * error + other_stiffness * other_error
    # bound of what the rate is beyond its chord
    swing = share * duration * (0.125 * abs(next_change - change) + 0.5 * bend)
    is_concave = max(change, next_change) + bend < 0.0
    is_convex = min(change, next_change) - bend > 0.0
    # sign of the rate inside
    rises = min(rate, next_rate) > swing
    rises |= (is_convex & (rate > 0.0)) | (is_concave & (next_rate > 0.0))
    falls = max(rate, next_rate) < -swing
    falls |= (is_concave & (rate < 0.0)) | (is_convex & (next_rate < 0.0))
    if rises:
        return STAYS_OPEN
    if not (falls | (is_concave & (rate > 0.0))):
        return UNCERTAIN
    # it falls once: its signs at the ends decide
    if falls & (value <= CLEARANCE_ROUNDING * size):
        return CLOSES_NOW
    return CLOSES_ONCE if next_value < 0.0 else STAYS_OPEN
