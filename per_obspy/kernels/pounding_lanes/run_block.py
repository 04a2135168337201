"""The life of a lane: histories of rows in 32 lanes, through a record and what follows it."""

import numpy as np
from numpy.typing import NDArray

from per_obspy.kernels._jit import inlined, lean
from per_obspy.kernels.pounding_events.motion import OPENING
from per_obspy.kernels.pounding_events.row_history import is_settled
from per_obspy.kernels.pounding_lanes.deferred_maxima import (
    Record,
    fill_ground,
    raise_maxima_of_tile,
    read_states,
    search_deferred,
    write_back,
    write_lane,
)
from per_obspy.kernels.pounding_lanes.lanes import (
    APART,
    BANK,
    EVENT_FLAG,
    PAIR_LANES,
    PAIRS,
    PEAK_FLAGS,
    RELATIVE_SO_FAR,
    ROW_TILE_STEPS,
    ROWS,
    STRUCTURE_ROWS,
    TILE_STEPS,
    at,
    sweep_tile,
)
from per_obspy.kernels.pounding_lanes.phases import load_row, rest_row, write_constants
from per_obspy.kernels.pounding_lanes.relative_in_step import is_relative_settled
from per_obspy.kernels.pounding_lanes.remaining_motion import GROUP_SAMPLES, remains_still
from per_obspy.kernels.pounding_lanes.step_by_step import step_row_through_tile, step_through_tile

#: Sampling intervals of free vibration between two checks whether a row is settled.
SETTLING_STEPS = 16
#: Groups of samples of the record between two checks whether the rest of it counts.
GROUPS_BETWEEN_CHECKS = 8
#: Gap that no structure reaches, and relative displacement that none passes, m.
UNREACHABLE = 1e12


@inlined
def _row_of(kind, memory, firsts, number):
    """Return what belongs to a row: first place, stride, numbers, lines, log, deferred tiles."""
    members, lines, logs, deferred, states, window = memory
    # pairs have one lane each
    first, end = firsts[number], firsts[number + 1]
    place, stride = (first, 1) if kind == ROWS else (number, BANK)
    own = members[first * STRUCTURE_ROWS : end * STRUCTURE_ROWS]
    rooms = states, window
    return place, stride, own, lines[first:end], logs[number], deferred[first:end], rooms


@lean
def _write_relative(lanes, place, row):
    """Copy the largest relative displacements of a pair that never touches to its lane."""
    lanes[at(RELATIVE_SO_FAR, place)] = row[0, OPENING]
    lanes[at(RELATIVE_SO_FAR + 1, place)] = row[1, OPENING]


@lean
def _rest(kind, lanes, place, stride, members, row):
    """Set the lanes of a row to rest for good."""
    rest_row(members, row.shape[0])
    for i in range(row.shape[0]):
        write_lane(lanes, place + i * stride, members, i * STRUCTURE_ROWS)
    if kind == APART:
        lanes[at(RELATIVE_SO_FAR, place)] = UNREACHABLE
        lanes[at(RELATIVE_SO_FAR + 1, place)] = UNREACHABLE


@lean
def _prepare(kind, lanes, memory, firsts, cosine, sine, free_steps, duration):
    """Set all rows to rest in their lanes, for good those with negative ``free_steps``."""
    # lanes without a building
    for k in range(lanes.size):
        lanes[k] = 0.0
    members = memory[0]
    for lane in range(firsts[firsts.size - 1], PAIR_LANES):
        own = members[lane * STRUCTURE_ROWS : (lane + 1) * STRUCTURE_ROWS]
        rest_row(own, 1)
        write_lane(lanes, lane, own, 0)
    # rows
    for number in range(firsts.size - 1):
        place, stride, own, row, _, _, _ = _row_of(kind, memory, firsts, number)
        write_constants(own, row, cosine[number], sine[number], duration)
        for i in range(row.shape[0]):
            write_lane(lanes, place + i * stride, own, i * STRUCTURE_ROWS)
        if free_steps[number] < 0:
            _rest(kind, lanes, place, stride, own, row)


@inlined
def _flags_of(kind, flags, firsts, number):
    """Return the flags of a row; both buildings of a pair have theirs in one lane."""
    if kind != ROWS:
        return flags[number]
    together = 0
    for lane in range(firsts[number], firsts[number + 1]):
        together |= flags[lane]
    return together


@inlined
def _treat(kind, lanes, flags, together, memory, firsts, number, record, grounds, step, count):
    """Treat a row with such flags in all after the sweep; return whether it got through."""
    place, stride, own, row, log, deferred, rooms = _row_of(kind, memory, firsts, number)
    if not together & EVENT_FLAG:
        # maxima only
        for i in range(row.shape[0]):
            if kind == ROWS:
                is_peak = flags[place + i] & PEAK_FLAGS[0]
            else:
                is_peak = flags[place] & (PEAK_FLAGS[1] if i else PEAK_FLAGS[0])
            if is_peak:
                here = place + i * stride
                raise_maxima_of_tile(
                    lanes, here, own, row, i, deferred, record, grounds[1], step, count
                )
        return True
    # an event: earlier maxima first, then the tile again from its start
    for i in range(row.shape[0]):
        here = place + i * stride
        search_deferred(lanes, here, own, row, i, deferred, record, grounds[1])
        read_states(lanes, here, own, i * STRUCTURE_ROWS)
    # the steps of any row, or those of two buildings
    if kind == ROWS:
        is_through = step_row_through_tile(
            own, row, log, rooms[0], rooms[1], grounds[0], count, record.duration
        )
    else:
        is_through = step_through_tile(
            own, row, log, grounds[0], count, record.duration, kind == APART
        )
    for i in range(row.shape[0]):
        write_back(lanes, place + i * stride, own, row, i)
    if kind == APART:
        _write_relative(lanes, place, row)
    return is_through


@lean
def _advance(kind, lanes, flags, memory, firsts, record, grounds, step, last):
    """Carry all lanes from a step to the last one; return whether all got through."""
    while step < last:
        # all lanes side by side through one tile
        count = min(ROW_TILE_STEPS if kind == ROWS else TILE_STEPS, last - step)
        fill_ground(record, step, count, grounds[0])
        if sweep_tile(kind, lanes, flags, grounds[0], count):
            # flagged rows one by one
            for number in range(firsts.size - 1):
                together = _flags_of(kind, flags, firsts, number)
                if together and not _treat(
                    kind,
                    lanes,
                    flags,
                    together,
                    memory,
                    firsts,
                    number,
                    record,
                    grounds,
                    step,
                    count,
                ):
                    return False
        step += count
    return True


@lean
def _retire(kind, lanes, memory, firsts, cosine, sine, record, grounds, free_steps, group, elapsed):
    """
    Rest the rows whose result no longer changes from a group of samples of the record on.

    Or, after the last group, after so many sampling intervals of free vibration. Return the number
    of the others.
    """
    active = 0
    is_free = group == record.sizes.shape[1]
    duration = GROUP_SAMPLES * record.refinement * record.duration
    for number in range(firsts.size - 1):
        if free_steps[number] < 0:
            continue
        # the state as a row; maxima of deferred tiles are larger still: a row that is over now is
        # over with them
        place, stride, own, row, _, deferred, _ = _row_of(kind, memory, firsts, number)
        for i in range(row.shape[0]):
            here = place + i * stride
            if is_free:
                search_deferred(lanes, here, own, row, i, deferred, record, grounds[1])
            read_states(lanes, here, own, i * STRUCTURE_ROWS)
        load_row(own, row)
        if kind == APART:
            is_over = is_free and is_relative_settled(row)
        else:
            is_over = (is_free and is_settled(row)) or remains_still(
                row, cosine[number], sine[number], record.sizes, duration, group
            )
        # at rest from now on
        if is_over or (is_free and elapsed >= free_steps[number]):
            for i in range(row.shape[0]):
                here = place + i * stride
                search_deferred(lanes, here, own, row, i, deferred, record, grounds[1])
            free_steps[number] = -1
            _rest(kind, lanes, place, stride, own, row)
        else:
            active += 1
    return active


@lean
def run_lanes(kind, record, lanes, flags, grounds, memory, firsts, cosine, sine, free_steps):
    """
    Run rows of buildings side by side through a record and the free vibration after it.

    Parameters
    ----------
    kind : int
        PAIRS, APART (pairs that never touch) or ROWS.
    record : Record
        Ground motion and the steps through it.
    lanes : (n_lane_rows * PAIR_LANES,) ndarray
        Room for the numbers of all lanes.
    flags : (PAIR_LANES,) ndarray of int
        Room for their flags.
    grounds : (2, 2, TILE_STEPS + 1) ndarray
        Room for the north and east acceleration of the current tile and of a deferred one.
    memory : tuple of ndarray
        Room for lines of lanes (n_buildings * STRUCTURE_ROWS,); lines of all buildings
        (n_buildings, ROW_COLUMNS) at rest, then at the end, see `motion` for the columns; logs
        (n_rows, n_lines, LOG_COLUMNS), which receive one line per impact that may count; deferred
        tiles (n_buildings, DEFERRED_COLUMNS), zero at the start; room for the states of a row
        (n_buildings, STATE_COLUMNS) and a window (WINDOW_SIZE,), zero at the start, for ROWS only.
    firsts : (n_rows + 1,) ndarray of int
        First building of each row, then the number of buildings.
    cosine, sine : (n_rows,) ndarray
        Of the azimuth of the axis of each row.
    free_steps : (n_rows,) ndarray of int
        Largest number of sampling intervals of free vibration for each row, negative for one that
        is left out; it is overwritten.

    Returns
    -------
    bool
        Whether all rows got through: no step had too many events, and each log had room. The run
        ends with the first that did not.
    """
    _prepare(kind, lanes, memory, firsts, cosine, sine, free_steps, record.duration)
    # the record, as far as any row needs it
    last = (record.components.shape[1] - 1) * record.refinement
    groups = record.sizes.shape[1]
    group = 0
    active = firsts.size - 1
    while active and group < groups:
        step = group * GROUP_SAMPLES * record.refinement
        group = min(group + GROUPS_BETWEEN_CHECKS, groups)
        end = min(group * GROUP_SAMPLES * record.refinement, last)
        if not _advance(kind, lanes, flags, memory, firsts, record, grounds, step, end):
            return False
        if group < groups:
            active = _retire(
                kind, lanes, memory, firsts, cosine, sine, record, grounds, free_steps, group, -1
            )
    # free vibration, until every row is settled
    elapsed = 0
    while _retire(
        kind, lanes, memory, firsts, cosine, sine, record, grounds, free_steps, groups, elapsed
    ):
        step = last
        last += SETTLING_STEPS * record.refinement
        if not _advance(kind, lanes, flags, memory, firsts, record, grounds, step, last):
            return False
        elapsed += SETTLING_STEPS
    return True


Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

#: First building of each of 32 pairs, and the number of buildings.
FIRSTS_OF_PAIRS = 2 * np.arange(PAIR_LANES + 1)


def run_block(
    record: Record,
    lanes: Floats,
    flags: Integers,
    grounds: Floats,
    pairs: Floats,
    deferred: Floats,
    rows: Floats,
    logs: Floats,
    cosine: Floats,
    sine: Floats,
    free_steps: Integers,
    *,
    kind: int = PAIRS,
) -> bool:
    """
    Run 32 pairs through a record and the free vibration after it, as `run_lanes`.

    Parameters
    ----------
    record, lanes, flags, grounds, logs, cosine, sine, free_steps
        As in `run_lanes`.
    pairs : (PAIR_LANES, LANE_ROWS) ndarray
        Room for the numbers of each lane as one line.
    deferred : (PAIR_LANES, 2, DEFERRED_COLUMNS) ndarray
        Deferred tiles of both structures; zero at the start.
    rows : (PAIR_LANES, 2, ROW_COLUMNS) ndarray
        Rows of structures of the pairs at rest, then at the end; see `motion` for the columns. They
        hold the results: LARGEST_DISPLACEMENT (m), LARGEST_RADIUS_SQUARED (m²), APPROACH
        (m/s) and IMPACTS, the lines of the log.
    kind : int
        PAIRS or APART.

    Returns
    -------
    bool
        Whether all pairs reached the end: no step had too many events.
    """
    # a line per structure
    lines, waiting = rows.reshape(-1, rows.shape[2]), deferred.reshape(-1, deferred.shape[2])
    memory = pairs.reshape(-1), lines, logs, waiting, np.empty((0, 0)), np.empty(0)
    motion = FIRSTS_OF_PAIRS, cosine, sine, free_steps
    return bool(run_lanes(kind, record, lanes, flags, grounds, memory, *motion))
