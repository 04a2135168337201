"""
Fast path for the impacts of a row inside one step, where bounds show that clearances close once.

It goes from impact to impact on the exact solution. Every other event (release, yielding,
unloading, contact without approach) is left to the event code of single histories.
"""

import math

from per_obspy.kernels._jit import inlined, lean
from per_obspy.kernels.polynomial_roots import fall_within
from per_obspy.kernels.pounding_events.contact import (
    COUNTED_SHARE,
    apply_impact,
    is_lingering,
    is_touching,
    resolve_contact,
)
from per_obspy.kernels.pounding_events.motion import (
    APPROACH,
    BOUNCE_LIMIT,
    BOUNCES,
    CLEARANCE_ORDER,
    EVENT_FUNCTION,
    IN_CONTACT,
    LARGEST_DISPLACEMENT,
    PHASE,
    RESTITUTION,
    STICKING_SPEED,
    TERM_COUNT,
    UNLOADING,
    YIELD,
    U,
    V,
    fill_clearance,
    mass_share,
)
from per_obspy.kernels.pounding_events.next_event import find_event, finish_piece
from per_obspy.kernels.pounding_lanes.free_impacts import (
    CLOSES_NOW,
    CLOSES_ONCE,
    STAYS_OPEN,
    locate_impact,
    state_inside_step,
    states_inside_step,
)
from per_obspy.kernels.pounding_lanes.impact_steps import clearance_course, stays_open
from per_obspy.kernels.pounding_lanes.lanes import (
    CONTACT_FUNCTION,
    CONTACT_ROUNDING,
    DISPLACEMENT_ERROR,
    OMEGA,
    VELOCITY_ERROR,
)
from per_obspy.kernels.pounding_lanes.maxima_in_step import (
    complete_state,
    fill_displacement_in_step,
    may_exceed_maxima,
    may_yield,
    raise_maxima_inside,
)
from per_obspy.kernels.pounding_rows.member_phases import update_phases
from per_obspy.kernels.pounding_rows.remaining_row_motion import COUNTED_SPEED

# columns of the states of a row in a step: displacement, velocity over omega and acceleration over
# omega² (m), at the start of a piece, at the end of the step, and at an event
START, END, REACHED = 0, 3, 6
#: share of the step at which the interface after a building closes; UNKNOWN before it is located
NEXT_HIT = 9
STATE_COLUMNS = 10
UNKNOWN = -1.0


@inlined
def state(states, i, column):
    """Return the state of building i at the start or the end of a piece."""
    return states[i, column], states[i, column + 1], states[i, column + 2]


@inlined
def set_state(states, i, column, value):
    """Set the state of building i at the start or the end of a piece."""
    states[i, column] = value[0]
    states[i, column + 1] = value[1]
    states[i, column + 2] = value[2]


@inlined
def _contact_value(members, states, j, column, ground):
    """Return the contact function of interface j: positive until its buildings meet or part."""
    # part of the velocity and the ground, then both displacements
    form = members[j, CONTACT_FUNCTION + 2] * states[j, column + 1] + (
        members[j, CONTACT_FUNCTION + 3] * ground + members[j, CONTACT_FUNCTION + 4]
    )
    return members[j, CONTACT_FUNCTION] * states[j, column] + (
        members[j, CONTACT_FUNCTION + 1] * states[j + 1, column] + form
    )


@lean
def may_meet_or_part(members, row, states, j, ground_start, ground_end):
    """Return whether the contact function of an interface may fall through zero in a piece."""
    # least value at the ends of the piece
    least = min(
        _contact_value(members, states, j, START, ground_start),
        _contact_value(members, states, j, END, ground_end),
    )
    # error bound of the contact function: part of the left building, then of the right one
    margin = (
        abs(members[j, CONTACT_FUNCTION]) * members[j, DISPLACEMENT_ERROR]
        + abs(members[j, CONTACT_FUNCTION + 2]) * members[j, VELOCITY_ERROR]
    )
    margin *= max(abs(states[j, START + 2]), abs(states[j, END + 2]))
    other = abs(members[j, CONTACT_FUNCTION + 1]) * members[j + 1, DISPLACEMENT_ERROR]
    margin += other * max(abs(states[j + 1, START + 2]), abs(states[j + 1, END + 2]))
    return least - margin < -members[j, CONTACT_ROUNDING] * row[j, LARGEST_DISPLACEMENT]


@lean
def may_yield_in_piece(members, row, states):
    """Return whether a building may yield or unload in a piece."""
    for i in range(row.shape[0]):
        if row[i, YIELD] < math.inf and may_yield(
            members[i], 0, state(states, i, START), state(states, i, END)
        ):
            return True
    return False


@lean
def raise_maxima(members, row, states, column, change, share):
    """Raise the maxima of every building to those from its start to the state in a column."""
    for i in range(row.shape[0]):
        start = state(states, i, START)
        end = state(states, i, column)
        one = row[i : i + 1]
        if may_exceed_maxima(members[i], one, 0, start, end):
            raise_maxima_inside(members[i], one, 0, start, end, change, share)


@lean
def _exact_closing_share(members, row, states, j, elapsed, segment):
    """Return the share of the step at which an open interface closes, by Taylor polynomials."""
    change = segment.slope * segment.duration
    for i in (j, j + 1):
        fill_displacement_in_step(members[i], row[i : i + 1], 0, 0, state(states, i, START), change)
    # first fall of the clearance, with time as the share of the step
    terms = int(row[0, TERM_COUNT])
    remaining = 1.0 - elapsed
    rounding, size, curvature = fill_clearance(row, j, terms, remaining)
    share = fall_within(
        row, j, EVENT_FUNCTION, terms, 1.0, 0.0, remaining, rounding, size, curvature
    )
    return elapsed + share if share >= 0.0 else math.inf


@lean
def _closing_share(members, row, states, j, elapsed, segment):
    """Return the share of the step at which an open interface closes, infinite if it does not."""
    # far enough from each other at both ends; those that have just met are not
    if row[j, CLEARANCE_ORDER] != 1.0 and not may_meet_or_part(members, row, states, j, 0.0, 0.0):
        return math.inf
    left = state(states, j, START)
    right = state(states, j + 1, START)
    next_left = state(states, j, END)
    next_right = state(states, j + 1, END)
    remaining = 1.0 - elapsed
    # a clearance without value and rate is left to the polynomials
    order = row[j, CLEARANCE_ORDER]
    if order <= 1.0:
        one = members[j]
        duration = segment.duration
        has_met = order == 1.0
        if stays_open(one, left, right, next_left, next_right, remaining, duration, has_met):
            return math.inf
        course = clearance_course(one, left, right, next_left, next_right, remaining, duration)
        if course == STAYS_OPEN:
            return math.inf
        if course == CLOSES_NOW:
            return elapsed
        if course == CLOSES_ONCE:
            share, _, _ = locate_impact(
                members[j], row[j : j + 2], left, right, next_left, next_right, remaining, segment
            )
            if share >= 0.0:
                return elapsed + share
    return _exact_closing_share(members, row, states, j, elapsed, segment)


@lean
def _find_hit(members, row, states, elapsed, segment):
    """Return the next share at which an interface closes, and which; UNKNOWN if one may open."""
    change = segment.slope * segment.duration
    ground_start = segment.acceleration + elapsed * change
    ground_end = segment.acceleration + change
    earliest = math.inf
    hit = 0
    for j in range(row.shape[0] - 1):
        if row[j, IN_CONTACT]:
            # a release is not located here
            if may_meet_or_part(members, row, states, j, ground_start, ground_end):
                return UNKNOWN, j
        else:
            if states[j, NEXT_HIT] == UNKNOWN:
                states[j, NEXT_HIT] = _closing_share(members, row, states, j, elapsed, segment)
            if states[j, NEXT_HIT] < earliest:
                earliest = states[j, NEXT_HIT]
                hit = j
    return earliest, hit


@lean
def _advance_to_hit(members, row, states, share, change):
    """Move the start of the piece, and the row, by a share of the step, with all maxima."""
    for i in range(row.shape[0]):
        start = state(states, i, START)
        one = row[i : i + 1]
        reached = state_inside_step(members[i], one, 0, start, change, share)
        set_state(states, i, REACHED, reached)
    # maxima on the way, then the new start
    raise_maxima(members, row, states, REACHED, change, share)
    for i in range(row.shape[0]):
        set_state(states, i, START, state(states, i, REACHED))
        row[i, CLEARANCE_ORDER] = 0.0
        row[i, UNLOADING] = 0.0
        row[i, U] = states[i, START]
        row[i, V] = states[i, START + 1] * members[i, OMEGA]


@lean
def _read_from_row(members, row, states, elapsed, segment, is_moved):
    """Complete the states of the piece after impacts, or after the row itself has moved."""
    change = segment.slope * segment.duration
    ground = segment.acceleration + elapsed * change
    has_changed = update_phases(members, row, segment.duration) or is_moved
    for i in range(row.shape[0]):
        z = row[i, V] / members[i, OMEGA]
        if has_changed or row[i, V] != states[i, START + 1] * members[i, OMEGA]:
            # its state now and at the end of the step
            start = complete_state(members[i], 0, row[i, U], z, ground)
            set_state(states, i, START, start)
            end = state_inside_step(members[i], row[i : i + 1], 0, start, change, 1.0 - elapsed)
            set_state(states, i, END, end)
            # both of its interfaces close at another time
            states[i, NEXT_HIT] = UNKNOWN
            if i > 0:
                states[i - 1, NEXT_HIT] = UNKNOWN


@inlined
def _is_alone(row, hit):
    """Return whether the two buildings that hit each other are elastic and touch no other."""
    is_alone = (row[hit, PHASE] == 0.0) & (row[hit + 1, PHASE] == 0.0)
    if hit > 0:
        is_alone &= not is_touching(row, hit - 1)
    if hit < row.shape[0] - 2:
        is_alone &= not is_touching(row, hit + 1)
    return is_alone


@inlined
def _never_counts(row, j):
    """Return whether an impact does not count, whatever the fastest of its interface will be."""
    limit = max(row[j, COUNTED_SPEED], COUNTED_SHARE * row[j, APPROACH])
    return row[j, V] - row[j + 1, V] <= limit


@inlined
def _apply_unlogged(row, j):
    """Apply one impact as ``apply_impact``, without a line of the log and without energies."""
    approach = row[j, V] - row[j + 1, V]
    # velocities after the impact, (7) and (8)
    change = (1.0 + row[j, RESTITUTION]) * approach
    row[j, V] -= change * mass_share(row, j, j + 1, j + 1)
    row[j + 1, V] += change * mass_share(row, j, j + 1, j)
    row[j, APPROACH] = max(row[j, APPROACH], approach)
    row[0, BOUNCES] += 1.0


@lean
def _passes_single_impact(members, row, log, states, elapsed, segment, hit):
    """
    Apply an impact in which no other building takes part; return whether both then part.

    It is ``resolve_contact`` where bouncing goes on, as after most impacts; all else is left to it.
    """
    if elapsed >= 1.0 or not _is_alone(row, hit):
        return False
    # the impact
    change = segment.slope * segment.duration
    ground = segment.acceleration + elapsed * change
    if _never_counts(row, hit):
        _apply_unlogged(row, hit)
    else:
        apply_impact(row, log, hit, elapsed * segment.duration)
    if is_lingering(row, hit, ground):
        return False
    row[hit, CLEARANCE_ORDER] = 1.0
    # states of both now and at the end of the step
    for i in (hit, hit + 1):
        z = row[i, V] / members[i, OMEGA]
        set_state(states, i, START, complete_state(members[i], 0, row[i, U], z, ground))
    left, right = states_inside_step(
        members[hit],
        row[hit : hit + 2],
        state(states, hit, START),
        state(states, hit + 1, START),
        change,
        1.0 - elapsed,
    )
    set_state(states, hit, END, left)
    set_state(states, hit + 1, END, right)
    # their interfaces close at another time
    for j in range(max(hit - 1, 0), hit + 2):
        states[j, NEXT_HIT] = UNKNOWN
    return True


@lean
def _pass_event(row, log, segment, elapsed):
    """Carry the row to its next event by the event code; return the share reached."""
    time = elapsed * segment.duration
    span, kind, index = find_event(row, segment, time)
    time = time + span if kind else segment.duration
    finish_piece(row, log, segment, time, span, kind, index)
    return time / segment.duration if time < segment.duration else 1.0


@lean
def _finish_step(members, row, states, change, share):
    """Raise the maxima of every building to the end of the step, where no clearance is zero."""
    raise_maxima(members, row, states, END, change, share)
    for i in range(row.shape[0]):
        row[i, CLEARANCE_ORDER] = 0.0
        row[i, UNLOADING] = 0.0


@lean
def run_row_impacts(members, row, log, states, segment):
    """
    Carry a row through a step of impacts.

    Parameters
    ----------
    members : (n_buildings, LANE_ROWS) ndarray
        Numbers of its lanes; see `lanes` for the columns.
    row : (n_buildings, ROW_COLUMNS) ndarray
        Its lines at the start of the step; see `motion` for the columns.
    log : (n_lines, LOG_COLUMNS) ndarray
        Log of impacts.
    states : (n_buildings, STATE_COLUMNS) ndarray
        States at the start of the step, and at its end if no event happened in it; then those at
        its end.
    segment : Segment
        The step.

    Returns
    -------
    bool
        Whether it got through: the step had not too many events.
    """
    change = segment.slope * segment.duration
    elapsed = 0.0
    is_bilinear = False
    for j in range(row.shape[0]):
        states[j, NEXT_HIT] = UNKNOWN
        is_bilinear |= row[j, YIELD] < math.inf
    for _ in range(100 * int(row[0, BOUNCE_LIMIT])):
        share = UNKNOWN
        hit = 0
        if not (is_bilinear and may_yield_in_piece(members, row, states)):
            share, hit = _find_hit(members, row, states, elapsed, segment)
        # no further impact: the end of the step
        if share == math.inf:
            _finish_step(members, row, states, change, 1.0 - elapsed)
            return True
        is_hit = share != UNKNOWN
        if is_hit:
            # the impact
            if share > elapsed:
                _advance_to_hit(members, row, states, share - elapsed, change)
            elapsed = share
            is_hit = row[hit, V] - row[hit + 1, V] > row[0, STICKING_SPEED]
        if is_hit and _passes_single_impact(members, row, log, states, elapsed, segment, hit):
            continue
        if is_hit:
            resolve_contact(row, log, segment, elapsed * segment.duration, hit)
        else:
            # any other event
            elapsed = _pass_event(row, log, segment, elapsed)
        _read_from_row(members, row, states, elapsed, segment, not is_hit)
        if elapsed >= 1.0:
            return True
    return False
