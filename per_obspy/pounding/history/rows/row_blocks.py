"""Rows of buildings in blocks of 32 lanes: packing, working memory and threads."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.kernels.pounding_events import motion as columns
from per_obspy.kernels.pounding_lanes.deferred_maxima import DEFERRED_COLUMNS, Record
from per_obspy.kernels.pounding_lanes.lanes import LANE_ROWS, PAIR_LANES, TILE_STEPS
from per_obspy.kernels.pounding_lanes.run_block import run_block
from per_obspy.kernels.pounding_rows.pieces import STATE_COLUMNS
from per_obspy.kernels.pounding_rows.row_by_events import count_row_impacts, run_row_by_events
from per_obspy.kernels.pounding_rows.run_rows import run_rows
from per_obspy.kernels.pounding_rows.window_lanes import WINDOW_SIZE
from per_obspy.pounding.history.pair_blocks import (
    KeptLogs,
    aligned,
    records_in_steps,
    run_blocks,
)
from per_obspy.threads import map_in_threads

IntArray = NDArray[np.int64]

#: Impacts of a row that may count for which there is room at first.
FIRST_ROOM = 1 << 14

#: Impacts of a row that may count at most: their log takes 300 MB. Touching rows whose masses
#: differ by a factor of a million have more.
MOST_IMPACTS = 1 << 22

#: Rows of which a block keeps the logs: as many rows of three buildings as it has.
MOST_ROWS = PAIR_LANES // 3


def packed_rows(first: IntArray, parts: IntArray, some: IntArray) -> list[IntArray]:
    """
    Return the rows of each block: of equal refinement, 32 buildings at most in all.

    Parameters
    ----------
    first : (n_rows + 1,) ndarray of int
        First building of each row, then the number of buildings.
    parts : (n_rows,) ndarray of int
        Steps of a sampling interval.
    some : (n,) ndarray of int
        Numbers of the rows that are packed.

    Returns
    -------
    list of ndarray of int
        Numbers of the rows; a row of more than 32 buildings is a separate block.
    """
    sizes = np.diff(first)
    blocks = []
    for part in np.unique(parts[some]):
        block: list[int] = []
        used = 0
        for number in some[parts[some] == part].tolist():
            # The next block begins where a row has no room
            if used + sizes[number] > PAIR_LANES and block:
                blocks.append(np.array(block))
                block, used = [], 0
            block.append(number)
            used += int(sizes[number])
        blocks.append(np.array(block))
    return blocks


def run_row_blocks(
    ground: FloatArray,
    dt: float,
    first: IntArray,
    lines: FloatArray,
    parts: IntArray,
    free_steps: IntArray,
    azimuth: FloatArray,
    scale: FloatArray,
) -> IntArray:
    """
    Carry all rows through a record and the free vibration after it, on all processors.

    Parameters
    ----------
    ground : (2, n_samples) ndarray
        North and east acceleration, m/s².
    dt : float
        Sampling interval, s.
    first : (n_rows + 1,) ndarray of int
        First building of each row, then the number of buildings.
    lines : (n_buildings, ROW_COLUMNS) ndarray
        Buildings at rest; then at the end.
    parts, free_steps : (n_rows,) ndarray of int
        Steps of a sampling interval, and sampling intervals of free vibration at most.
    azimuth : (n_rows,) ndarray
        Of the axis of each row, rad.
    scale : (n_buildings,) ndarray
        Of the clearance after each building, see `row_scales`.

    Returns
    -------
    (n_buildings,) ndarray of int
        Impacts that count, see `count_row_impacts`.

    Raises
    ------
    RuntimeError
        If a step has more events than any record causes.
    """
    sizes = np.diff(first)
    # Rows of two are pairs, of which a block has more
    counts = np.zeros(len(lines), dtype=np.int64)
    left, steps = _pairs(first, parts, free_steps, azimuth)
    counts[left] = _run_pairs(ground, dt, left, lines, steps)
    records = records_in_steps(ground, parts, dt)
    kept = KeptLogs(MOST_ROWS, FIRST_ROOM)

    def run(block: IntArray) -> None:
        """Run the rows of one block, and write their results to their places."""
        # Blocks do not depend on each other
        members = np.concatenate([np.arange(first[k], first[k + 1]) for k in block])
        record = records[int(parts[block[0]])]
        others = azimuth[block], free_steps[block]
        start, own = lines[members], sizes[block]
        found = _counted_block(record, start, own, others, scale[members], kept)
        lines[members], counts[members] = found

    map_in_threads(run, packed_rows(first, parts, np.flatnonzero(sizes != 2)))
    return counts


def _pairs(
    first: IntArray, *columns_of_rows: NDArray[Any]
) -> tuple[IntArray, tuple[NDArray[Any], ...]]:
    """Return the left buildings of rows of two, and columns of these rows."""
    pairs = np.flatnonzero(np.diff(first) == 2)
    return first[pairs], tuple(column[pairs] for column in columns_of_rows)


def _run_pairs(
    ground: FloatArray,
    dt: float,
    left: IntArray,
    lines: FloatArray,
    steps: tuple[NDArray[Any], ...],
) -> IntArray:
    """Carry rows of two from their left buildings through a record; return impacts that count."""
    both = left[:, np.newaxis] + np.arange(2)
    rows = lines[both]
    counts = run_blocks(run_block, LANE_ROWS, ground, dt, rows, *steps)
    lines[both] = rows
    return counts


def _counted_block(
    record: Record,
    start: FloatArray,
    sizes: IntArray,
    others: tuple[FloatArray, IntArray],
    scale: FloatArray,
    kept: KeptLogs,
) -> tuple[FloatArray, IntArray]:
    """Return the buildings of one block at the end, and impacts that count."""
    firsts = np.concatenate([[0], np.cumsum(sizes)])
    own, logs = run_logged_block(record, start, firsts, *others, kept)
    # Row by row
    counts = []
    for begin, end, log in zip(firsts[:-1], firsts[1:], logs, strict=True):
        counts.append(count_row_impacts(own[begin:end], log, scale[begin:end]))
    kept.keep(logs)
    return own, np.concatenate(counts)


def run_logged_block(
    record: Record,
    start: FloatArray,
    firsts: IntArray,
    azimuth: FloatArray,
    free: IntArray,
    kept: KeptLogs,
) -> tuple[FloatArray, FloatArray]:
    """
    Carry the rows of one block through a record, with a log of every impact.

    Parameters
    ----------
    record : Record
        Ground motion and the steps through it.
    start : (n_buildings, ROW_COLUMNS) ndarray
        Buildings at rest.
    firsts : (n_rows + 1,) ndarray of int
        First building of each row, then the number of buildings.
    azimuth : (n_rows,) ndarray
        Of the axis of each row, rad.
    free : (n_rows,) ndarray of int
        Sampling intervals of free vibration at most.
    kept : KeptLogs
        Memory of the logs; to be given back.

    Returns
    -------
    lines : (n_buildings, ROW_COLUMNS) ndarray
        Buildings at the end.
    logs : (n_rows, n_lines, LOG_COLUMNS) ndarray
        All impacts of each row that may count.

    Raises
    ------
    RuntimeError
        If a step has more events than any record causes, or a row too many impacts.
    """
    direction = np.cos(azimuth), np.sin(azimuth)
    room = kept.impacts
    # Grow the logs until all impacts of every row have room
    while True:
        logs = kept.room(firsts.size - 1, room)
        # The kernels change the lines and the steps of free vibration
        own = start.copy()
        if len(own) > PAIR_LANES:
            is_through = _run_alone(record, own, logs[0], direction, int(free[0]))
        else:
            is_through = _run_in_lanes(record, own, logs, firsts, direction, free.copy())
        if not is_through:
            raise RuntimeError("no end of events in a step of a row")
        impacts = int(np.add.reduceat(own[:, columns.IMPACTS], firsts[:-1]).max())
        if impacts <= room:
            return own, logs
        if impacts > MOST_IMPACTS:
            raise RuntimeError(f"a row has {impacts} impacts that may count, most {MOST_IMPACTS}")
        kept.keep(logs)
        room = impacts


def _run_alone(
    record: Record, row: FloatArray, log: FloatArray, direction: tuple[FloatArray, ...], free: int
) -> bool:
    """Run a row of more buildings than there are lanes; return whether it got through."""
    north, east = record.components
    cosine, sine = (float(component[0]) for component in direction)
    dt = record.duration * record.refinement
    run = run_row_by_events(north, east, cosine, sine, dt, record.refinement, row, log, free)
    return bool(run)


def _run_in_lanes(
    record: Record,
    own: FloatArray,
    logs: FloatArray,
    firsts: IntArray,
    direction: tuple[FloatArray, ...],
    free: IntArray,
) -> bool:
    """Run the rows of a block in lanes; return whether all got through."""
    lines = np.zeros((PAIR_LANES, columns.ROW_COLUMNS))
    lines[: len(own)] = own
    lanes = aligned(LANE_ROWS * PAIR_LANES)
    flags = aligned(PAIR_LANES).view(np.int64)
    grounds = np.empty((2, 2, TILE_STEPS + 1))

    # Lanes as lines, states of a step and deferred tiles
    members = np.zeros((PAIR_LANES, LANE_ROWS))
    states = np.zeros((PAIR_LANES, STATE_COLUMNS))
    deferred = np.zeros((PAIR_LANES, DEFERRED_COLUMNS))
    memory = members, lines, logs, states, deferred, aligned(WINDOW_SIZE)
    is_through = run_rows(record, lanes, flags, grounds, memory, firsts, *direction, free)
    own[:] = lines[: len(own)]
    return bool(is_through)
