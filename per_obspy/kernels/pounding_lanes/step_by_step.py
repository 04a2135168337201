"""
Scalar steps of one row through a tile that may hold an event.

Steps that certainly hold no event use the same formulas as ``lanes``; the others are repeated. Of a
pair, single impacts go through ``impact_steps``, yielding and unloading through
``stiffness_changes``, and all else from event to event, through the code of single histories
(``next_event``). Pairs that never touch have no impacts; an event is then a relative displacement
that may pass its largest value. Longer rows go through ``row_impacts``.
"""

import math

from per_obspy.kernels._jit import inlined, lean
from per_obspy.kernels.pounding_events.contact import has_room
from per_obspy.kernels.pounding_events.motion import (
    BOUNCE_LIMIT,
    BOUNCES,
    GAP,
    IN_CONTACT,
    LARGEST_DISPLACEMENT,
    OPENING,
    TERM_COUNT,
    YIELD,
    Segment,
    U,
    V,
)
from per_obspy.kernels.pounding_events.next_event import find_event, finish_piece
from per_obspy.kernels.pounding_lanes.impact_steps import run_free_impacts, set_states, stays_open
from per_obspy.kernels.pounding_lanes.lanes import (
    CLUSTER_FIRST,
    CLUSTER_LAST,
    CONTACT_FUNCTION,
    CONTACT_ROUNDING,
    DISPLACEMENT,
    DISPLACEMENT_ERROR,
    OMEGA,
    START_DISPLACEMENT,
    START_VELOCITY,
    STRUCTURE_ROWS,
    VELOCITY,
    VELOCITY_ERROR,
)
from per_obspy.kernels.pounding_lanes.maxima_in_step import (
    complete_state,
    ground_along,
    may_yield,
    raise_maxima,
    state_after_step,
)
from per_obspy.kernels.pounding_lanes.phases import load_row, store_row
from per_obspy.kernels.pounding_lanes.relative_in_step import (
    may_exceed_relative,
    raise_relative,
    raise_relative_to,
)
from per_obspy.kernels.pounding_lanes.stiffness_changes import (
    branch_and_maxima,
    restore,
    run_changes,
    run_stiffness_changes,
)
from per_obspy.kernels.pounding_rows.row_impacts import run_row_impacts

#: Events of one step above which a history is given up: so many, and so many per bounce allowed.
MOST_EVENTS, EVENTS_PER_BOUNCE = 1000, 100

# columns of the states of a row in a step: displacement, velocity over omega and acceleration over
# omega² (m), at its start and at its end; then what a step that is run again may change: branch and
# maxima, and the range of the displacement in it (m)
START, END, BEFORE, LOW, HIGH = 0, 3, 6, 11, 12
STATE_COLUMNS = 13


@inlined
def _state(states, i, column):
    """Return the state of building i at the start or the end of a step."""
    return states[i, column], states[i, column + 1], states[i, column + 2]


@inlined
def _set_state(states, i, column, value):
    """Set the state of building i at the start or the end of a step."""
    states[i, column] = value[0]
    states[i, column + 1] = value[1]
    states[i, column + 2] = value[2]


@inlined
def _state_of_lane(members, i, displacement, velocity, ground):
    """Return the state of building i, of which a lane has displacement and velocity."""
    own = i * STRUCTURE_ROWS
    u, z = members[own + displacement], members[own + velocity]
    return complete_state(members, own, u, z, ground)


@lean
def _read_row(members, row, states, ground):
    """Set the states at the end of the step to those of the row."""
    for i in range(row.shape[0]):
        own = i * STRUCTURE_ROWS
        z = row[i, V] / members[own + OMEGA]
        _set_state(states, i, END, complete_state(members, own, row[i, U], z, ground))


@lean
def _write_members(members, row, states):
    """Set displacement and velocity of the lanes to those at the start of the step."""
    for i in range(row.shape[0]):
        members[i * STRUCTURE_ROWS + DISPLACEMENT] = states[i, START]
        members[i * STRUCTURE_ROWS + VELOCITY] = states[i, START + 1]


@inlined
def segment_of_step(row, ground_start, ground_end, duration):
    """Return a step as a segment of linear ground acceleration."""
    slope = (ground_end - ground_start) / duration
    return Segment(0.0, duration, ground_start, slope, int(row[0, TERM_COUNT]))


@inlined
def _contact_value(members, j, left, right, ground):
    """Return the contact function of interface j: positive until its buildings meet or part."""
    # part of the velocity and the ground, then both displacements
    own = j * STRUCTURE_ROWS
    form = members[own + CONTACT_FUNCTION + 2] * left[1] + (
        members[own + CONTACT_FUNCTION + 3] * ground + members[own + CONTACT_FUNCTION + 4]
    )
    return members[own + CONTACT_FUNCTION] * left[0] + (
        members[own + CONTACT_FUNCTION + 1] * right[0] + form
    )


@inlined
def _may_meet_or_part(members, row, j, least, ends):
    """Return whether the contact function may fall through zero inside a step, by its least end."""
    left, right, next_left, next_right = ends
    own = j * STRUCTURE_ROWS
    # error bound of the contact function: part of the left building, then of the right one
    margin = (
        abs(members[own + CONTACT_FUNCTION]) * members[own + DISPLACEMENT_ERROR]
        + abs(members[own + CONTACT_FUNCTION + 2]) * members[own + VELOCITY_ERROR]
    )
    margin *= max(abs(left[2]), abs(next_left[2]))
    other = (
        abs(members[own + CONTACT_FUNCTION + 1])
        * members[own + STRUCTURE_ROWS + DISPLACEMENT_ERROR]
    )
    margin += other * max(abs(right[2]), abs(next_right[2]))
    return least - margin < -members[own + CONTACT_ROUNDING] * row[j, LARGEST_DISPLACEMENT]


@inlined
def _may_touch_in_step(members, row, states, before, after, duration):
    """Return whether bounds do not exclude contact or release in a step of a row."""
    for j in range(row.shape[0] - 1):
        left, right = _state(states, j, START), _state(states, j + 1, START)
        next_left, next_right = _state(states, j, END), _state(states, j + 1, END)
        ends = left, right, next_left, next_right
        # by the chord of its contact function
        least = min(
            _contact_value(members, j, left, right, before),
            _contact_value(members, j, next_left, next_right, after),
        )
        if _may_meet_or_part(members, row, j, least, ends):
            # an open interface by a cubic too
            own = members[j * STRUCTURE_ROWS :]
            if row[j, IN_CONTACT] or not stays_open(
                own, left, right, next_left, next_right, 1.0, duration, False
            ):
                return True
    return False


@inlined
def _may_yield_in_step(members, row, states):
    """Return whether a building of a row may yield or unload in a step."""
    for i in range(row.shape[0]):
        if row[i, YIELD] < math.inf and may_yield(
            members, i * STRUCTURE_ROWS, _state(states, i, START), _state(states, i, END)
        ):
            return True
    return False


@inlined
def _may_join_yielding(members, row, states):
    """Return whether a building that may yield or unload in a step is in contact with another."""
    for i in range(row.shape[0]):
        own = i * STRUCTURE_ROWS
        is_joined = members[own + CLUSTER_FIRST] != members[own + CLUSTER_LAST]
        if is_joined and may_yield(members, own, _state(states, i, START), _state(states, i, END)):
            return True
    return False


@lean
def change_stiffnesses(members, row, states, segment):
    """
    Carry a row through a step in which buildings yield or unload, each on its own.

    Return whether none of them certainly meets another; else the row is as before.
    """
    if _may_join_yielding(members, row, states):
        return False
    # one building after the other, and the interface before it
    for i in range(row.shape[0]):
        # what may have to come back
        before = branch_and_maxima(row, i)
        for k in range(len(before)):
            states[i, BEFORE + k] = before[k]
        # its step
        start, end = _state(states, i, START), _state(states, i, END)
        is_certain, end, low, high = run_changes(members, row, i, start, end, segment)
        if i > 0 and not row[i - 1, IN_CONTACT]:
            is_certain &= low - states[i - 1, HIGH] > -row[i - 1, GAP]
        if not is_certain:
            # all of them back
            for k in range(i + 1):
                branch = states[k, BEFORE], states[k, BEFORE + 1], states[k, BEFORE + 2]
                maxima = states[k, BEFORE + 3], states[k, BEFORE + 4]
                restore(members, row, k, branch + maxima, segment.duration)
            return False
        states[i, LOW], states[i, HIGH] = low, high
        _set_state(states, i, END, end)
    return True


@lean
def run_events(row, log, segment, elapsed, is_apart):
    """Carry a row through the rest of one step, event by event; return whether it got through."""
    for _ in range(MOST_EVENTS + EVENTS_PER_BOUNCE * int(row[0, BOUNCE_LIMIT])):
        # the piece until the next event
        span, kind, index = find_event(row, segment, elapsed)
        if is_apart:
            raise_relative(row, span, segment.terms)
        elapsed = elapsed + span if kind else segment.duration
        finish_piece(row, log, segment, elapsed, span, kind, index)
        if elapsed >= segment.duration:
            return True
    return False


@inlined
def _repeat_step(pair, row, log, ends, segment, happens, yields, is_apart):
    """
    Carry a pair through a step that may hold an event; return whether it got through.

    ``ends`` are the states of both structures at its start, then at its end without event.
    """
    left, right, next_left, next_right = ends
    # yielding and unloading of a free pair that does not meet, or pass its largest distances
    least, largest = -row[0, GAP], math.inf
    if is_apart:
        least, largest = -row[1, OPENING], row[0, OPENING]
    if (
        yields
        and not (happens or row[0, IN_CONTACT])
        and run_stiffness_changes(
            pair, row, left, right, next_left, next_right, segment, least, largest
        )
    ):
        return True
    set_states(pair, left, right)
    row[0, BOUNCES] = 0.0
    elapsed = -1.0
    # single impacts of a free pair
    if not (yields or is_apart or row[0, IN_CONTACT]):
        elapsed = run_free_impacts(pair, row, log, left, right, next_left, next_right, segment)
        if elapsed == segment.duration:
            return True
    # the rest event by event; the row has the state only after an impact
    if elapsed < 0.0:
        load_row(pair, row)
    is_through = run_events(row, log, segment, max(elapsed, 0.0), is_apart)
    store_row(pair, row, segment.duration)
    return is_through


@lean
def step_through_tile(pair, row, log, ground, count, duration, is_apart):
    """
    Carry a pair through a tile that may hold an event.

    It is `step_row_through_tile` with the states in registers: in an array they take 1.1 to 1.25
    times as long.

    Parameters
    ----------
    pair : (2 * STRUCTURE_ROWS,) ndarray
        Numbers of its lane; see `lanes` for its rows.
    row : (2, ROW_COLUMNS) ndarray
        Its row of structures; see `motion` for its columns.
    log : (n_lines, LOG_COLUMNS) ndarray
        Log of impacts.
    ground : (2, TILE_STEPS + 1) ndarray
        North and east acceleration at the tile's samples, m/s².
    count : int
        Number of steps of the tile.
    duration : float
        Of a step, s.
    is_apart : bool
        Whether the pair never touches, and its largest relative displacements are raised.

    Returns
    -------
    bool
        Whether it got through: no step had too many events.
    """
    second = STRUCTURE_ROWS
    is_through = True
    is_bilinear = min(row[0, YIELD], row[1, YIELD]) < math.inf
    # states and contact function at the start of the tile
    before = ground_along(pair, ground, 0)
    left = _state_of_lane(pair, 0, START_DISPLACEMENT, START_VELOCITY, before)
    right = _state_of_lane(pair, 1, START_DISPLACEMENT, START_VELOCITY, before)
    least = _contact_value(pair, 0, left, right, before)
    for k in range(1, count + 1):
        # states after the step, as if no event happened in it
        after = ground_along(pair, ground, k)
        next_left = state_after_step(pair, 0, left, before, after)
        next_right = state_after_step(pair, second, right, before, after)
        next_least = _contact_value(pair, 0, next_left, next_right, after)
        ends = left, right, next_left, next_right
        # events that the error bounds do not exclude
        if is_apart:
            happens = may_exceed_relative(pair, row, left, right, next_left, next_right)
        else:
            happens = _may_meet_or_part(pair, row, 0, min(least, next_least), ends)
        yields = is_bilinear and (
            may_yield(pair, 0, left, next_left) or may_yield(pair, second, right, next_right)
        )
        if happens | yields:
            # the step again with its events
            segment = segment_of_step(row, before, after, duration)
            is_through &= _repeat_step(pair, row, log, ends, segment, happens, yields, is_apart)
            next_left = _state_of_lane(pair, 0, DISPLACEMENT, VELOCITY, after)
            next_right = _state_of_lane(pair, 1, DISPLACEMENT, VELOCITY, after)
            next_least = _contact_value(pair, 0, next_left, next_right, after)
        else:
            # maxima inside the step
            raise_maxima(pair, row, 0, left, next_left, after - before, 1.0)
            raise_maxima(pair, row, 1, right, next_right, after - before, 1.0)
        left, right, least, before = next_left, next_right, next_least, after
    set_states(pair, left, right)
    if is_apart:
        raise_relative_to(row, right[0] - left[0])
    return is_through


@lean
def step_row_through_tile(members, row, log, states, window, ground, count, duration):
    """
    Carry a row through a tile that may hold an event.

    Parameters
    ----------
    members : (n_buildings * STRUCTURE_ROWS,) ndarray
        Numbers of its lanes; see `lanes` for the rows.
    row : (n_buildings, ROW_COLUMNS) ndarray
        Its lines; see `motion` for the columns.
    log, ground, count, duration
        As in `step_through_tile`.
    states : (n_buildings, STATE_COLUMNS) ndarray
        Room for the states of a step.
    window : (WINDOW_SIZE,) ndarray
        Room for the lanes of a window.

    Returns
    -------
    bool
        Whether it got through: no step had too many events, and the log had room.
    """
    # states at the start of the tile
    before = ground_along(members, ground, 0)
    for i in range(row.shape[0]):
        start = _state_of_lane(members, i, START_DISPLACEMENT, START_VELOCITY, before)
        _set_state(states, i, START, start)
    for k in range(1, count + 1):
        # states after the step, as if no event happened in it
        after = ground_along(members, ground, k)
        for i in range(row.shape[0]):
            own = i * STRUCTURE_ROWS
            start = _state(states, i, START)
            _set_state(states, i, END, state_after_step(members, own, start, before, after))
        touches = _may_touch_in_step(members, row, states, before, after, duration)
        yields = _may_yield_in_step(members, row, states)
        segment = segment_of_step(row, before, after, duration)
        if yields and not touches and change_stiffnesses(members, row, states, segment):
            # each building on its own, to the end of the step
            for i in range(row.shape[0]):
                own, end = i * STRUCTURE_ROWS, _state(states, i, END)
                _set_state(states, i, END, complete_state(members, own, end[0], end[1], after))
        elif touches or yields:
            # the step again with its events
            _write_members(members, row, states)
            load_row(members, row)
            row[0, BOUNCES] = 0.0
            is_through = run_row_impacts(members, row, log, window, segment)
            if not is_through or not has_room(row, log):
                return False
            _read_row(members, row, states, after)
        else:
            # maxima inside the step
            for i in range(row.shape[0]):
                start, end = _state(states, i, START), _state(states, i, END)
                raise_maxima(members, row, i, start, end, after - before, 1.0)
        # on to the next step
        for i in range(row.shape[0]):
            _set_state(states, i, START, _state(states, i, END))
        before = after
    _write_members(members, row, states)
    return True
