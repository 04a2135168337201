"""Histories of rows in 32 lanes: the loop over the record and the free vibration after it."""

from per_obspy.kernels._jit import lean
from per_obspy.kernels.pounding_events.motion import LARGEST_DISPLACEMENT, LARGEST_RADIUS_SQUARED
from per_obspy.kernels.pounding_events.row_history import is_settled
from per_obspy.kernels.pounding_lanes.deferred_maxima import (
    FIRST_DISPLACEMENT,
    FIRST_STEP,
    FIRST_VELOCITY,
    STEP_COUNT,
    defer_tile,
    fill_ground,
    may_hold_maximum,
    raise_maxima_to_samples,
    read_lane,
    write_lane,
)
from per_obspy.kernels.pounding_lanes.lanes import (
    EVENT_FLAG,
    MAXIMUM_SO_FAR,
    PAIR_LANES,
    RADIUS_SQUARED_SO_FAR,
    TILE_STEPS,
    at,
)
from per_obspy.kernels.pounding_lanes.maxima_in_step import search_tile
from per_obspy.kernels.pounding_lanes.pair_rows import fill_ramp_response, rest_pair
from per_obspy.kernels.pounding_lanes.remaining_motion import GROUP_SAMPLES, remains_still
from per_obspy.kernels.pounding_lanes.run_block import GROUPS_BETWEEN_CHECKS, SETTLING_STEPS
from per_obspy.kernels.pounding_rows.building_lanes import sweep_tile
from per_obspy.kernels.pounding_rows.member_phases import load_row, write_constants
from per_obspy.kernels.pounding_rows.row_steps import step_row_through_tile


@lean
def _prepare(lanes, members, lines, firsts, cosine, sine, duration):
    """Set all rows to rest in their lanes, and for good the lanes without a building."""
    used = firsts[firsts.size - 1]
    # rows
    for number in range(firsts.size - 1):
        first = firsts[number]
        last = firsts[number + 1]
        row = lines[first:last]
        write_constants(members[first:last], row, cosine[number], sine[number], duration)
    # lanes without a building
    for lane in range(used, PAIR_LANES):
        members[lane, :] = 0.0
        rest_pair(members[lane])
    for lane in range(PAIR_LANES):
        write_lane(lanes, lane, members[lane])


@lean
def _search_deferred(lanes, lane, memory, record, ground):
    """Search the deferred tile of a building if it may hold a maximum; none remains deferred."""
    member, line, deferred = memory
    if may_hold_maximum(deferred, line, 0):
        # coefficients of the lane and ground motion of the tile
        read_lane(lanes, lane, member)
        fill_ground(record, int(deferred[0, FIRST_STEP]), ground)
        # maxima of the tile
        u = deferred[0, FIRST_DISPLACEMENT]
        z = deferred[0, FIRST_VELOCITY]
        fill_ramp_response(member, line, 0)
        search_tile(member, line, 0, u, z, ground, int(deferred[0, STEP_COUNT]))
        lanes[at(MAXIMUM_SO_FAR, lane)] = line[0, LARGEST_DISPLACEMENT]
        lanes[at(RADIUS_SQUARED_SO_FAR, lane)] = line[0, LARGEST_RADIUS_SQUARED]
    deferred[0, STEP_COUNT] = 0.0


@lean
def _raise_maxima_of_tile(lanes, lane, memory, record, ground, step, count):
    """Raise the maxima of a building to the samples of a tile, and defer its search."""
    _, line, deferred = memory
    raise_maxima_to_samples(lanes, lane, line, 0)
    # an earlier tile may still hold more
    if may_hold_maximum(deferred, line, 0):
        _search_deferred(lanes, lane, memory, record, ground)
    defer_tile(lanes, lane, deferred, 0, step, count)


@lean
def _treat_row(lanes, flags, first, memory, record, grounds, step, count):
    """Treat the flagged lanes of a row after the sweep; return whether it got through."""
    members, row, log, states, deferred, window = memory
    # flags of the row
    together = 0
    for i in range(row.shape[0]):
        together |= flags[first + i]
    if not together & EVENT_FLAG:
        # maxima only
        for i in range(row.shape[0]):
            if flags[first + i]:
                own = members[i], row[i : i + 1], deferred[i : i + 1]
                _raise_maxima_of_tile(lanes, first + i, own, record, grounds[1], step, count)
        return True
    # an event: earlier maxima first, then the tile again from its start
    for i in range(row.shape[0]):
        own = members[i], row[i : i + 1], deferred[i : i + 1]
        _search_deferred(lanes, first + i, own, record, grounds[1])
        read_lane(lanes, first + i, members[i])
    is_through = step_row_through_tile(
        members, row, log, states, window, grounds[0], count, record.duration
    )
    for i in range(row.shape[0]):
        members[i, MAXIMUM_SO_FAR] = row[i, LARGEST_DISPLACEMENT]
        members[i, RADIUS_SQUARED_SO_FAR] = row[i, LARGEST_RADIUS_SQUARED]
        write_lane(lanes, first + i, members[i])
    return is_through


@lean
def _retire(lanes, memory, firsts, record, grounds, free_steps, elapsed):
    """
    Rest the rows whose result is final after so many sampling intervals of free vibration.

    Return the number of the others.
    """
    members, lines, _, _, deferred, _ = memory
    active = 0
    for number in range(firsts.size - 1):
        if free_steps[number] >= 0:
            first = firsts[number]
            end = firsts[number + 1]
            # maxima so far, and the state as a row
            for lane in range(first, end):
                own = members[lane], lines[lane : lane + 1], deferred[lane : lane + 1]
                _search_deferred(lanes, lane, own, record, grounds[1])
                read_lane(lanes, lane, members[lane])
            load_row(members[first:end], lines[first:end])
            row = lines[first:end]
            # at rest from now on
            is_over = is_settled(row)
            if not is_over:
                is_over = remains_still(row, 1.0, 0.0, record.sizes, 0.0, record.sizes.shape[1])
            if elapsed >= free_steps[number] or is_over:
                free_steps[number] = -1
                _rest_row(lanes, members, first, end)
            else:
                active += 1
    return active


@lean
def _rest_row(lanes, members, first, end):
    """Set the lanes of a row to rest for good."""
    for lane in range(first, end):
        rest_pair(members[lane])
        write_lane(lanes, lane, members[lane])


@lean
def _retire_still_rows(lanes, memory, firsts, cosine, sine, record, grounds, free_steps, group):
    """
    Rest the rows whose result no longer changes in the rest of the record.

    Return the number of the others.
    """
    members, lines, _, _, deferred, _ = memory
    duration = GROUP_SAMPLES * record.refinement * record.duration
    active = 0
    for number in range(firsts.size - 1):
        if free_steps[number] >= 0:
            first = firsts[number]
            end = firsts[number + 1]
            # the state as a row
            for lane in range(first, end):
                read_lane(lanes, lane, members[lane])
            load_row(members[first:end], lines[first:end])
            # maxima of deferred tiles are larger still: a row that is over is over with them
            if remains_still(
                lines[first:end], cosine[number], sine[number], record.sizes, duration, group
            ):
                for lane in range(first, end):
                    own = members[lane], lines[lane : lane + 1], deferred[lane : lane + 1]
                    _search_deferred(lanes, lane, own, record, grounds[1])
                free_steps[number] = -1
                _rest_row(lanes, members, first, end)
            else:
                active += 1
    return active


@lean
def _advance_rows(lanes, flags, memory, firsts, record, grounds, step, last):
    """Carry all rows from a step to the last one; return whether all got through."""
    members, lines, logs, states, deferred, window = memory
    is_through = True
    while step < last:
        # all lanes side by side through one tile
        fill_ground(record, step, grounds[0])
        count = min(TILE_STEPS, last - step)
        if sweep_tile(lanes, flags, grounds[0], count):
            # flagged rows one by one
            for number in range(firsts.size - 1):
                first = firsts[number]
                end = firsts[number + 1]
                own = (
                    members[first:end],
                    lines[first:end],
                    logs[number],
                    states[first:end],
                    deferred[first:end],
                    window,
                )
                is_through &= _treat_row(lanes, flags, first, own, record, grounds, step, count)
        step += count
    return is_through


@lean
def run_rows(record, lanes, flags, grounds, memory, firsts, cosine, sine, free_steps):
    """
    Run rows of 32 buildings in all through a record and the free vibration after it.

    Parameters
    ----------
    record : Record
        Ground motion and the steps through it.
    lanes : (LANE_ROWS * PAIR_LANES,) ndarray
        Room for the numbers of all lanes.
    flags : (PAIR_LANES,) ndarray of int
        Room for their flags.
    grounds : (2, 2, TILE_STEPS + 1) ndarray
        Room for the north and east acceleration of the current tile and of a deferred one.
    memory : tuple of ndarray
        Room for lanes as lines (PAIR_LANES, LANE_ROWS); lines of all buildings (PAIR_LANES,
        ROW_COLUMNS) at rest, then at the end, see `motion` for the columns; logs (n_rows, n_lines,
        LOG_COLUMNS), which receive one line per impact as long as there is room; room for states
        (PAIR_LANES, STATE_COLUMNS), deferred tiles (PAIR_LANES, DEFERRED_COLUMNS) and a window
        (WINDOW_SIZE,), zero at the start.
    firsts : (n_rows + 1,) ndarray of int
        First lane of each row, then the number of buildings.
    cosine, sine : (n_rows,) ndarray
        Of the azimuth of the axis of each row.
    free_steps : (n_rows,) ndarray of int
        Largest number of sampling intervals of free vibration for each row; it is overwritten.

    Returns
    -------
    bool
        Whether all rows got through: no step had too many events.
    """
    members, lines, _, _, _, _ = memory
    _prepare(lanes, members, lines, firsts, cosine, sine, record.duration)
    # the record, as far as any row needs it
    last = (record.components.shape[1] - 1) * record.refinement
    group = 0
    is_through = True
    active = firsts.size - 1
    while active and group < record.sizes.shape[1]:
        step = group * GROUP_SAMPLES * record.refinement
        group = min(group + GROUPS_BETWEEN_CHECKS, record.sizes.shape[1])
        end = min(group * GROUP_SAMPLES * record.refinement, last)
        is_through &= _advance_rows(lanes, flags, memory, firsts, record, grounds, step, end)
        active = _retire_still_rows(
            lanes, memory, firsts, cosine, sine, record, grounds, free_steps, group
        )
    # free vibration, until every row is settled
    elapsed = 0
    while _retire(lanes, memory, firsts, record, grounds, free_steps, elapsed):
        step = last
        last += SETTLING_STEPS * record.refinement
        is_through &= _advance_rows(lanes, flags, memory, firsts, record, grounds, step, last)
        elapsed += SETTLING_STEPS
    return is_through
