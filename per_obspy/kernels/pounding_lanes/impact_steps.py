r"""
Fast path for the steps of a free pair whose events are single impacts.

It is used when the clearance closes once in the rest of a step, or not at all: most steps of a
pounding pair that hold an event consist of such pieces. Everything else is left, from the start of
the step or from the last impact on, to the event code of single histories.

Bounds from the states at both ends of a piece decide whether it closes.
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

import math

from per_obspy.kernels._jit import inlined
from per_obspy.kernels.pounding_events.contact import (
    COUNTED_SHARE,
    SLOWEST_COUNTED,
    apply_impact,
    resolve_contact,
)
from per_obspy.kernels.pounding_events.motion import (
    APPROACH,
    BOUNCE_LIMIT,
    BOUNCES,
    STICKING_DELAY,
    STICKING_SPEED,
)
from per_obspy.kernels.pounding_lanes.free_impacts import (
    CLEARANCE_ROUNDING,
    CLOSES_NOW,
    CLOSES_ONCE,
    STAYS_OPEN,
    UNCERTAIN,
    add_velocity,
    locate_impact,
    opening_rate,
)
from per_obspy.kernels.pounding_lanes.lanes import (
    ACCELERATION,
    ACCELERATION_ERROR,
    ANGLE,
    CONTACT_FUNCTION,
    DISPLACEMENT,
    IMPACT_GROWTH,
    OMEGA,
    STRUCTURE_ROWS,
    VELOCITY,
    YIELD_LIMIT,
    YIELD_SIDE,
)
from per_obspy.kernels.pounding_lanes.maxima_in_step import (
    may_yield,
    raise_maxima,
)
from per_obspy.kernels.pounding_lanes.phases import load_row

#: Displacement and rate at the start of a step by a unit rate there.
AT_START = (0.0, 1.0)
#: ``t² (h - t)² / 24`` over ``h⁴ / 384`` is at most this times ``t (h - t)² / h³``.
ROOM_AFTER_CONTACT = 16.0


@inlined
def set_states(pair, left, right):
    """Set displacement and velocity of a pair to those of two states."""
    pair[DISPLACEMENT] = left[0]
    pair[VELOCITY] = left[1]
    pair[STRUCTURE_ROWS + DISPLACEMENT] = right[0]
    pair[STRUCTURE_ROWS + VELOCITY] = right[1]


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
    """Predict the clearance of an open interface in a piece: one of the four predictions."""
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


@inlined
def _note_impact(pair, row, log, left, right, approach, time):
    """Note an impact of a pair in two states: a line of the log only if it may count."""
    if approach > max(SLOWEST_COUNTED, COUNTED_SHARE * row[0, APPROACH]):
        set_states(pair, left, right)
        load_row(pair, row)
        apply_impact(row, log, 0, time)
    else:
        row[0, APPROACH] = max(row[0, APPROACH], approach)
        row[0, BOUNCES] += 1.0


@inlined
def _faster(pair, first, state, growth):
    """Return a state with so much more velocity."""
    u, z, y = state
    return u, z + growth, y + pair[first + ACCELERATION + 1] * growth


@inlined
def _may_yield(pair, left, right, next_left, next_right):
    """Return whether a structure may yield or unload in a piece; linear ones never do."""
    # a structure that yields now has no limit either
    is_elastic = (pair[YIELD_SIDE] == 0.0) & (pair[STRUCTURE_ROWS + YIELD_SIDE] == 0.0)
    if is_elastic & (min(pair[YIELD_LIMIT], pair[STRUCTURE_ROWS + YIELD_LIMIT]) == math.inf):
        return False
    other_yields = may_yield(pair, STRUCTURE_ROWS, right, next_right)
    return may_yield(pair, 0, left, next_left) | other_yields


@inlined
def next_impact(pair, row, ends, origin, other_origin, elapsed, segment, has_met):
    """
    Return the time until the impact in a piece, as a share of the step, and both states then.

    The time is infinite, and the states are those at the end, if there is no impact; it is -1 if
    that is uncertain. Also return the responses for ``add_velocity``; see ``locate_impact``.
    If the pair ``has_met`` its clearance is zero at the start.
    """
    left, right, next_left, next_right = ends
    remaining = 1.0 - elapsed
    duration = segment.duration
    if _may_yield(pair, left, right, next_left, next_right):
        return -1.0, next_left, next_right, AT_START, AT_START
    if stays_open(pair, left, right, next_left, next_right, remaining, duration, has_met):
        return math.inf, next_left, next_right, AT_START, AT_START
    # one way out per prediction
    course = clearance_course(pair, left, right, next_left, next_right, remaining, duration)
    if course == CLOSES_ONCE:
        return locate_impact(
            pair, row, ends, origin, other_origin, elapsed, remaining, segment, has_met
        )
    if course == CLOSES_NOW and elapsed == 0.0:
        return 0.0, left, right, AT_START, AT_START
    time = math.inf if course == STAYS_OPEN else -1.0
    return time, next_left, next_right, AT_START, AT_START


@inlined
def _bounces_end(pair, row, left, right):
    """Return whether a free pair separates so slowly after an impact that it may stay closed."""
    omega = pair[OMEGA]
    other_omega = pair[STRUCTURE_ROWS + OMEGA]
    separation = opening_rate(pair, left, right)
    # as ``is_lingering``: a bounce lasts 2 separation / closing acceleration
    closing = omega * omega * left[2] - other_omega * other_omega * right[2]
    return (
        (separation <= row[0, STICKING_SPEED])
        | (row[0, BOUNCES] >= row[0, BOUNCE_LIMIT])
        | (separation <= row[0, STICKING_DELAY] * closing)
    )


@inlined
def run_free_impacts(pair, row, log, left, right, next_left, next_right, segment):
    """
    Carry a free pair through a step of single impacts.

    Parameters
    ----------
    pair : (LANE_ROWS,) ndarray
        Numbers of its lane; see `lanes` for its rows.
    row : (2, ROW_COLUMNS) ndarray
        Its row of structures; see `motion` for its columns.
    log : (n_lines, LOG_COLUMNS) ndarray
        Log of impacts.
    left, right : tuple of float
        States of both structures at the start of the step: displacement, velocity over omega,
        acceleration over omega² (m).
    next_left, next_right : tuple of float
        States at its end without impact.
    segment : Segment
        The step.

    Returns
    -------
    float
        Time up to which the step was carried out, s: its duration, when ``pair`` has the state;
        else that of the last impact, when ``row`` has it; or -1 if no impact was carried out.
    """
    # times are shares of the step; free motion from the origins leads through each piece
    elapsed = 0.0
    change = segment.slope * segment.duration
    origin = left
    other_origin = right
    has_met = False
    while True:
        remaining = 1.0 - elapsed
        ends = left, right, next_left, next_right
        share, hit_left, hit_right, response, other_response = next_impact(
            pair, row, ends, origin, other_origin, elapsed, segment, has_met
        )
        # uncertain, or an impact without approach: left to the event code
        approach = -opening_rate(pair, hit_left, hit_right)
        if share < 0.0 or (share <= remaining and approach <= row[0, STICKING_SPEED]):
            break
        piece = min(share, remaining)
        raise_maxima(pair, row, 0, left, hit_left, change, piece)
        raise_maxima(pair, row, 1, right, hit_right, change, piece)
        # no further impact: the end of the step
        if share > remaining:
            set_states(pair, next_left, next_right)
            return segment.duration
        # the impact
        elapsed += share
        has_met = True
        time = segment.start + elapsed * segment.duration
        _note_impact(pair, row, log, hit_left, hit_right, approach, time)
        growth = pair[IMPACT_GROWTH] * approach
        other_growth = pair[STRUCTURE_ROWS + IMPACT_GROWTH] * approach
        left = _faster(pair, 0, hit_left, growth)
        right = _faster(pair, STRUCTURE_ROWS, hit_right, other_growth)
        if _bounces_end(pair, row, left, right):
            break
        # the step after it
        origin, next_left = add_velocity(pair, 0, origin, next_left, response, growth)
        other_origin, next_right = add_velocity(
            pair, STRUCTURE_ROWS, other_origin, next_right, other_response, other_growth
        )
    if not has_met:
        return -1.0
    # the row stays at the last impact
    set_states(pair, left, right)
    load_row(pair, row)
    resolve_contact(row, log, segment, elapsed * segment.duration, 0)
    return elapsed * segment.duration
