"""
Fast path for the steps of a free pair whose events are single impacts.

It is used when the clearance closes once in the rest of a step, or not at all: most steps of a
pounding pair that hold an event consist of such pieces. Everything else is left, from the start of
the step or from the last impact on, to the event code of single histories.
"""

import math

from per_obspy.kernels._jit import inlined, lean
from per_obspy.kernels.pounding_events.contact import apply_impact, resolve_contact
from per_obspy.kernels.pounding_events.motion import (
    BOUNCE_LIMIT,
    BOUNCES,
    STICKING_DELAY,
    STICKING_SPEED,
    V,
)
from per_obspy.kernels.pounding_lanes.free_impacts import (
    CLOSES_NOW,
    CLOSES_ONCE,
    STAYS_OPEN,
    UNCERTAIN,
    locate_impact,
    opening_rate,
    predict_clearance,
    states_inside_step,
)
from per_obspy.kernels.pounding_lanes.lanes import (
    DISPLACEMENT,
    OMEGA,
    STRUCTURE_ROWS,
    VELOCITY,
)
from per_obspy.kernels.pounding_lanes.maxima_in_step import (
    complete_state,
    may_exceed_maxima,
    may_yield,
    raise_maxima_inside,
)
from per_obspy.kernels.pounding_lanes.pair_rows import load_pair


@inlined
def set_states(pair, left, right):
    """Set displacement and velocity of a pair to those of two states."""
    pair[DISPLACEMENT] = left[0]
    pair[VELOCITY] = left[1]
    pair[STRUCTURE_ROWS + DISPLACEMENT] = right[0]
    pair[STRUCTURE_ROWS + VELOCITY] = right[1]


@inlined
def _states_after_impact(pair, row, log, left, right, segment, elapsed):
    """Apply an impact to a pair in these states, after a share of the step; return its states."""
    # impact, on the row
    set_states(pair, left, right)
    load_pair(pair, row)
    apply_impact(row, log, 0, segment.start + elapsed * segment.duration)
    # states with the velocities after it
    ground = segment.acceleration + elapsed * segment.slope * segment.duration
    second = STRUCTURE_ROWS
    hit_left = complete_state(pair, 0, left[0], row[0, V] / pair[OMEGA], ground)
    hit_right = complete_state(pair, second, right[0], row[1, V] / pair[second + OMEGA], ground)
    return hit_left, hit_right


@inlined
def _raise_both(pair, row, left, right, next_left, next_right, change, share):
    """Raise the maxima of both structures to those of a piece."""
    if may_exceed_maxima(pair, row, 0, left, next_left):
        raise_maxima_inside(pair, row, 0, left, next_left, change, share)
    if may_exceed_maxima(pair, row, 1, right, next_right):
        raise_maxima_inside(pair, row, 1, right, next_right, change, share)


@inlined
def next_impact(pair, row, left, right, next_left, next_right, share, segment):
    """
    Return the time until the impact in a piece, as a share of the step, and both states then.

    The time is infinite, and the states are those at the end, if there is no impact; it is -1 if
    that is uncertain.
    """
    prediction = predict_clearance(pair, left, right, next_left, next_right, share)
    if may_yield(pair, 0, left, next_left) or may_yield(pair, STRUCTURE_ROWS, right, next_right):
        prediction = UNCERTAIN
    # one way out per prediction
    if prediction == CLOSES_ONCE:
        return locate_impact(pair, row, left, right, next_left, next_right, share, segment)
    if prediction == CLOSES_NOW:
        return 0.0, left, right
    return math.inf if prediction == STAYS_OPEN else -1.0, next_left, next_right


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
    # times are shares of the step
    elapsed = 0.0
    change = segment.slope * segment.duration
    while True:
        remaining = 1.0 - elapsed
        share, next_left, next_right = next_impact(
            pair, row, left, right, next_left, next_right, remaining, segment
        )
        # uncertain, or an impact without approach: left to the event code
        if share < 0.0 or (
            share <= remaining
            and opening_rate(pair, next_left, next_right) >= -row[0, STICKING_SPEED]
        ):
            break
        _raise_both(pair, row, left, right, next_left, next_right, change, min(share, remaining))
        # no further impact: the end of the step
        if share > remaining:
            set_states(pair, next_left, next_right)
            return segment.duration
        # the impact, and the states at the end of the step after it
        elapsed += share
        left, right = _states_after_impact(pair, row, log, next_left, next_right, segment, elapsed)
        if _bounces_end(pair, row, left, right):
            break
        next_left, next_right = states_inside_step(pair, row, left, right, change, 1.0 - elapsed)
    if row[0, BOUNCES] == 0.0:
        return -1.0
    # the row stays at the last impact
    resolve_contact(row, log, segment, elapsed * segment.duration, 0)
    return elapsed * segment.duration
