"""
Fast path for the steps of a free pair whose events are single impacts.

It is used when the clearance closes once in the rest of a step, or not at all: most steps of a
pounding pair that hold an event consist of such pieces. Everything else is left, from the start of
the step or from the last impact on, to the event code of single histories.
"""

import math

from per_obspy.kernels._jit import inlined, lean
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
from per_obspy.kernels.pounding_lanes.clearance_bounds import clearance_course, stays_open
from per_obspy.kernels.pounding_lanes.free_impacts import (
    CLOSES_NOW,
    CLOSES_ONCE,
    STAYS_OPEN,
    add_velocity,
    locate_impact_from,
    opening_rate,
)
from per_obspy.kernels.pounding_lanes.lanes import (
    ACCELERATION,
    DISPLACEMENT,
    IMPACT_GROWTH,
    OMEGA,
    STRUCTURE_ROWS,
    VELOCITY,
    YIELD_LIMIT,
)
from per_obspy.kernels.pounding_lanes.maxima_in_step import (
    may_exceed_maxima,
    may_yield,
    raise_maxima_inside,
)
from per_obspy.kernels.pounding_lanes.pair_rows import load_pair

#: Displacement and rate at the start of a step by a unit rate there.
AT_START = (0.0, 1.0)


@inlined
def set_states(pair, left, right):
    """Set displacement and velocity of a pair to those of two states."""
    pair[DISPLACEMENT] = left[0]
    pair[VELOCITY] = left[1]
    pair[STRUCTURE_ROWS + DISPLACEMENT] = right[0]
    pair[STRUCTURE_ROWS + VELOCITY] = right[1]


@inlined
def _note_impact(pair, row, log, left, right, approach, time):
    """Note an impact of a pair in two states: a line of the log only if it may count."""
    if approach > max(SLOWEST_COUNTED, COUNTED_SHARE * row[0, APPROACH]):
        set_states(pair, left, right)
        load_pair(pair, row)
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
def _raise_both(pair, row, left, right, next_left, next_right, change, share):
    """Raise the maxima of both structures to those of a piece."""
    if may_exceed_maxima(pair, row, 0, left, next_left):
        raise_maxima_inside(pair, row, 0, left, next_left, change, share)
    if may_exceed_maxima(pair, row, 1, right, next_right):
        raise_maxima_inside(pair, row, 1, right, next_right, change, share)


@inlined
def _may_yield(pair, left, right, next_left, next_right):
    """Return whether a structure may yield or unload in a piece; linear ones never do."""
    if min(pair[YIELD_LIMIT], pair[STRUCTURE_ROWS + YIELD_LIMIT]) == math.inf:
        return False
    other_yields = may_yield(pair, STRUCTURE_ROWS, right, next_right)
    return may_yield(pair, 0, left, next_left) | other_yields


@inlined
def next_impact(pair, row, ends, origin, other_origin, elapsed, segment, has_met):
    """
    Return the time until the impact in a piece, as a share of the step, and both states then.

    The time is infinite, and the states are those at the end, if there is no impact; it is -1 if
    that is uncertain. Also return the responses for ``add_velocity``; see ``locate_impact_from``.
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
        return locate_impact_from(
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


@lean
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
        _raise_both(pair, row, left, right, hit_left, hit_right, change, min(share, remaining))
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
        other_growth = pair[IMPACT_GROWTH + 1] * approach
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
    load_pair(pair, row)
    resolve_contact(row, log, segment, elapsed * segment.duration, 0)
    return elapsed * segment.duration
