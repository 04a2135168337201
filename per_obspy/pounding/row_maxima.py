"""Largest responses of rows of buildings against one record, in blocks of 32 lanes."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.kernels.pounding_events import motion as columns
from per_obspy.kernels.pounding_events.contact import (
    MOST_IMPACTS,
    SLOWEST_COUNTED,
    drop_uncounted,
)
from per_obspy.kernels.pounding_lanes.deferred_maxima import DEFERRED_COLUMNS, Record
from per_obspy.kernels.pounding_lanes.lanes import (
    LANE_ROWS,
    PAIR_LANES,
    ROWS,
    STRUCTURE_ROWS,
    TILE_STEPS,
)
from per_obspy.kernels.pounding_lanes.run_block import run_block, run_lanes
from per_obspy.kernels.pounding_lanes.step_by_step import STATE_COLUMNS
from per_obspy.kernels.pounding_rows.row_by_events import run_row_by_events
from per_obspy.kernels.pounding_rows.window_lanes import WINDOW_SIZE
from per_obspy.pounding.kernel_tables import (
    SHORTEST_BOUNCE,
    SPEED_SHARE,
    KeptLogs,
    aligned,
    both_components,
    closed_record,
    free_samples,
    largest_ground_velocity,
    records_in_steps,
    refinement,
    run_blocks,
)
from per_obspy.pounding.row_tables import (
    BoolArray,
    RowScales,
    building_table,
    checked_rows,
    row_scales,
    run_in_parts,
    some_buildings,
    two_by_two,
)
from per_obspy.pounding.row_tables import (
    BuildingRows as BuildingRows,
)
from per_obspy.spectra.elastic import azimuth_maxima
from per_obspy.threads import map_in_threads

IntArray = NDArray[np.int64]

#: Impacts of a row that may count for which there is room at first, and factor of more room.
FIRST_ROOM, MORE_ROOM = 1 << 12, 16

#: Rows of which a block keeps the logs: as many rows of three buildings as it has.
MOST_ROWS = PAIR_LANES // 3


def packed_rows(first: IntArray, parts: IntArray, some: IntArray) -> list[IntArray]:
    """
    Return the rows of each block: of equal refinement, 32 buildings at most in all.

    Of ``some`` rows, by their first buildings and steps per sampling interval; a row of more than
    32 buildings is a separate block. The longest rows, which take longest, are first.
    """
    sizes = np.diff(first)
    some = some[np.argsort(-sizes[some], kind="stable")]
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
) -> IntArray:
    """
    Carry all rows through a record and the free vibration after it, on all processors.

    The ground (2, n_samples) is in m/s², dt in s; ``lines`` (n_buildings, ROW_COLUMNS) are at rest,
    then at the end, those of a row from its ``first`` on. Each row has its steps of a sampling
    interval, sampling intervals of free vibration at most, and azimuth (rad). Return impacts that
    count after each building (`drop_uncounted`); ``RuntimeError`` if a step has more events than
    any record causes.
    """
    # Rows of two are pairs, of which a block has more
    counts, sizes = _run_pairs(ground, dt, first, lines, parts, free_steps, azimuth), np.diff(first)
    records, kept = records_in_steps(ground, parts, dt), KeptLogs(MOST_ROWS, FIRST_ROOM)

    def run(block: IntArray) -> None:
        """Run the rows of one block, and write their results to their places."""
        members = np.concatenate([np.arange(first[k], first[k + 1]) for k in block])
        # Blocks do not depend on each other
        record, others = records[int(parts[block[0]])], (azimuth[block], free_steps[block])
        lines[members] = _counted_block(record, lines[members], sizes[block], others, kept)
        counts[members] = lines[members, columns.IMPACTS]

    map_in_threads(run, packed_rows(first, parts, np.flatnonzero(sizes != 2)))
    return counts


def _run_pairs(
    ground: FloatArray,
    dt: float,
    first: IntArray,
    lines: FloatArray,
    *of_rows: NDArray[Any],
) -> IntArray:
    """Carry rows of two through a record; return impacts that count after each building."""
    counts, pairs = np.zeros(len(lines), dtype=np.int64), np.flatnonzero(np.diff(first) == 2)
    both = first[pairs, np.newaxis] + np.arange(2)
    # Lines of both buildings as a row
    rows, steps = lines[both], [column[pairs] for column in of_rows]
    counts[both[:, 0]] = run_blocks(run_block, LANE_ROWS, ground, dt, rows, *steps)
    lines[both] = rows
    return counts


def _counted_block(
    record: Record,
    start: FloatArray,
    sizes: IntArray,
    others: tuple[FloatArray, IntArray],
    kept: KeptLogs,
) -> FloatArray:
    """Return the buildings of one block at the end, with impacts that count."""
    firsts = np.append(0, np.cumsum(sizes))
    own, logs = run_logged_block(record, start, firsts, *others, kept)
    # Row by row
    for begin, end, log in zip(firsts[:-1], firsts[1:], logs, strict=True):
        drop_uncounted(own[begin:end], log)
    kept.keep(logs)
    return own


def run_logged_block(
    record: Record,
    start: FloatArray,
    firsts: IntArray,
    azimuth: FloatArray,
    free: IntArray,
    kept: KeptLogs,
) -> tuple[FloatArray, FloatArray]:
    """
    Return the buildings of one block at the end, and logs of all impacts that may count.

    ``start`` (n_buildings, ROW_COLUMNS) are at rest; rows have their first buildings ``firsts``
    (n_rows + 1), axis (rad) and sampling intervals of free vibration at most. The logs (n_rows,
    n_lines, LOG_COLUMNS) are memory that is kept, and are to be given back.
    """
    own, direction = start.copy(), (np.cos(azimuth), np.sin(azimuth))
    run = _run_alone if len(own) > PAIR_LANES else _run_in_lanes

    def fill(logs: FloatArray) -> int:
        """Run the block from rest; the kernels change the lines and the steps of free vibration."""
        own[:] = start
        is_through = run(record, own, logs, firsts, direction, free.copy())
        if own[firsts[:-1], columns.ALL_IMPACTS].max() > MOST_IMPACTS:
            raise RuntimeError(f"a row has more than {MOST_IMPACTS} impacts")
        # A run ends where a log is full
        impacts = int(np.add.reduceat(own[:, columns.IMPACTS], firsts[:-1]).max())
        room: int = logs.shape[1]
        if impacts > room:
            return MORE_ROOM * room
        if not is_through:
            raise RuntimeError("no end of events in a step of a row")
        return impacts

    # Most impacts of a row decide on the room of all
    return own, kept.fill(firsts.size - 1, fill)


def _run_alone(
    record: Record,
    row: FloatArray,
    logs: FloatArray,
    _: IntArray,
    direction: tuple[FloatArray, FloatArray],
    free: IntArray,
) -> bool:
    """Run a row of more buildings than there are lanes; return whether it got through."""
    north, east = record.components
    cosine, sine = (float(component[0]) for component in direction)
    steps = record.duration * record.refinement, record.refinement
    return bool(run_row_by_events(north, east, cosine, sine, *steps, row, logs[0], int(free[0])))


def _run_in_lanes(
    record: Record,
    own: FloatArray,
    logs: FloatArray,
    firsts: IntArray,
    direction: tuple[FloatArray, FloatArray],
    free: IntArray,
) -> bool:
    """Run the rows of a block in lanes; return whether all got through."""
    lines = np.zeros((PAIR_LANES, columns.ROW_COLUMNS))
    lines[: len(own)] = own
    lanes = aligned(LANE_ROWS * PAIR_LANES)
    flags = aligned(PAIR_LANES).view(np.int64)
    grounds = np.empty((2, 2, TILE_STEPS + 1))

    # Lanes as lines, states of a step and deferred tiles
    members = np.zeros(PAIR_LANES * STRUCTURE_ROWS)
    states = np.zeros((PAIR_LANES, STATE_COLUMNS))
    deferred = np.zeros((PAIR_LANES, DEFERRED_COLUMNS))
    memory = members, lines, logs, deferred, states, aligned(WINDOW_SIZE)
    motion = firsts, *direction, free
    is_through = run_lanes(ROWS, record, lanes, flags, grounds, memory, *motion)
    own[:] = lines[: len(own)]
    return bool(is_through)


#: Bouncing ends in contact after this many impacts per interface in one step. Chatter at one
#: interface disturbs that at the others, the more the less alike the masses are. With 400, maxima
#: of two of 1 850 rows of the demonstration were off by up to a sixth, and of touching rows whose
#: masses alternate by a factor of 100 by up to a third. From 3 200 (demonstration) and 6 400
#: (factor of 100) on they no longer change; with a factor of 1 000 they are certain to 1e-3 only.
BOUNCES_OF_ROWS = 25_600

#: Rows of which the kernels' lines are held at a time.
PART = 4096
#: Displacement, radius, impact velocity and impacts of a building.
MAXIMA = 4


class RowMaxima(NamedTuple):
    """
    Largest responses of each building of the rows, and the impacts of each interface.

    Attributes
    ----------
    radius : (n_buildings,) ndarray
        Largest radius ``sqrt(D² + (D' / w)²)`` of the modal coordinate in the row, exact between
        samples, m.
    free_radius : (n_buildings,) ndarray
        Largest radius of the building alone, without contact, m.
    displacement : (n_buildings,) ndarray
        Largest ``|D|`` in the row, exact between samples, m.
    impacts : (n_buildings,) ndarray of int
        Number of impacts between the building and the next one of its row that are faster than 1
        mm/s and than 1 % of the fastest of this interface; 0 for the last building of a row.
    impact_velocity : (n_buildings,) ndarray
        Largest approach speed at the contact height of this interface, m/s; 0 without impact.
    """

    radius: FloatArray
    free_radius: FloatArray
    displacement: FloatArray
    impacts: NDArray[np.int64]
    impact_velocity: FloatArray


def row_maxima(
    north: ArrayLike,
    east: ArrayLike,
    dt: float,
    rows: BuildingRows,
    *,
    free_vibration: bool = True,
) -> RowMaxima:
    """
    Compute the maxima of the exact pounding histories of rows of buildings.

    The physics is that of `pounding_history`, with a separate contact height for every interface:
    an impulse ``J`` at the interface after building k changes its modal velocity by ``-a J / m``
    and that of its neighbour by ``b J / m``, with the participations ``a`` (right) and ``b``
    (left). Bouncing ends in contact when a bounce would last less than a thousandth of a sampling
    interval, or after 25 600 impacts per interface in one step. The result of a row does not depend
    on the other rows, nor on the number of threads.

    Parameters
    ----------
    north, east : (n_samples,) array_like
        Components of the ground acceleration, m/s².
    dt : float
        Sampling interval, s.
    rows : BuildingRows
        Rows of one building or more each.
    free_vibration : bool
        As in `pounding_history`.

    Returns
    -------
    RowMaxima
        One entry per building, in the order of the rows.

    Raises
    ------
    ValueError
        If an argument is outside its range.
    RuntimeError
        If a step has more events than any record causes.

    References
    ----------
    Valles-Mattox & Reinhorn (1996), An energy approach to pounding of structures, 11WCEE, eq. (7),
    (8).
    """
    return _maxima(north, east, dt, rows, free_vibration, np.zeros(len(rows.period), bool))[0]


def row_and_pair_maxima(
    north: ArrayLike, east: ArrayLike, dt: float, rows: BuildingRows, wanted: BoolArray
) -> tuple[RowMaxima, RowMaxima]:
    """
    Compute `row_maxima` and those of neighbours without the others of their row.

    Two neighbours that meet no other one in their row are computed once for both.

    Parameters
    ----------
    north, east, dt, rows
        As in `row_maxima`; free vibration is followed.
    wanted : (n_buildings,) ndarray of bool
        Whether a building and the next one are computed alone even if they meet others.

    Returns
    -------
    rows, pairs : RowMaxima
        One entry per building; the pairs have one line per building, ``(n_buildings, 2)``, of it
        and the next one, without meaning for the last of each row. Pairs that are not wanted and
        meet others are NaN, without impacts.

    Raises
    ------
    ValueError, RuntimeError
        As `row_maxima`.
    """
    return _maxima(north, east, dt, rows, True, wanted)


def _maxima(
    north: ArrayLike,
    east: ArrayLike,
    dt: float,
    rows: BuildingRows,
    free_vibration: bool,
    wanted: BoolArray,
) -> tuple[RowMaxima, RowMaxima]:
    # The ground comes to rest before free vibration
    step = checks.number("dt", dt, checks.positive)
    checked = checked_rows(rows)
    ground = both_components(north, east)
    if free_vibration:
        ground = closed_record(ground)

    # Every building alone, then every part of a row whose gaps may close
    maxima = np.zeros((checked.period.size, MAXIMA))
    maxima[:, :2] = _alone(ground, step, checked, free_vibration)
    free = maxima[:, 1].copy()
    pairs = run_in_parts(
        checked, maxima, lambda parts: _run(ground, step, parts, free_vibration), wanted
    )
    next_free = np.stack([free, np.append(free[1:], 0.0)], axis=1)
    return _row_maxima(maxima, free), _row_maxima(pairs, next_free)


def _row_maxima(maxima: FloatArray, free_radius: FloatArray) -> RowMaxima:
    displacement, radius, impact_velocity, impacts = np.moveaxis(maxima, -1, 0)
    counts = np.nan_to_num(impacts).astype(np.int64)
    return RowMaxima(radius, free_radius, displacement, counts, impact_velocity)


def _alone(ground: FloatArray, dt: float, rows: BuildingRows, free_vibration: bool) -> FloatArray:
    """Return the largest displacement and radius of every building alone, (n_buildings, 2)."""
    # Elastic ones from the record directly, with the free vibration after it
    azimuth = np.repeat(rows.azimuth, np.diff(rows.first))
    alone = azimuth_maxima(ground[0], ground[1], dt, rows.period, rows.damping, azimuth)
    maxima = np.stack([alone.sd, alone.per], axis=1)
    # Those that yield in pairs that never meet, of which a block takes more than of rows
    others = np.flatnonzero((alone.sd > rows.yield_displacement) | (not free_vibration))
    if others.size:
        both, pairs = two_by_two(rows, others)
        maxima[both] = _run(ground, dt, pairs, free_vibration)[:, :2]
    return maxima


def _run(ground: FloatArray, dt: float, rows: BuildingRows, free_vibration: bool) -> FloatArray:
    """Return the maxima of rows, some rows at a time."""
    maxima = np.empty((rows.period.size, MAXIMA))
    # The lines of the kernels take 900 bytes per building
    for begin in range(0, rows.azimuth.size, PART):
        first = rows.first[begin : begin + PART + 1]
        buildings = np.arange(first[0], first[-1])
        part = some_buildings(rows, buildings, first - first[0])
        maxima[buildings] = _run_part(ground, dt, part, free_vibration)
    return maxima


def _run_part(
    ground: FloatArray, dt: float, rows: BuildingRows, free_vibration: bool
) -> FloatArray:
    scales = row_scales(rows)
    lines = _lines_at_rest(rows, scales)
    counts = _run_lines(ground, dt, rows, lines, free_vibration)

    # The lines hold squares of the largest radii
    displacement = lines[:, columns.LARGEST_DISPLACEMENT] / scales.displacement
    radius = np.sqrt(lines[:, columns.LARGEST_RADIUS_SQUARED]) / scales.displacement
    approach = lines[:, columns.APPROACH] / scales.clearance
    return np.stack([displacement, radius, approach, counts], axis=1)


def _run_lines(
    ground: FloatArray,
    dt: float,
    rows: BuildingRows,
    lines: FloatArray,
    free_vibration: bool,
) -> IntArray:
    """Carry the lines of all buildings from rest to the end; return impacts that count."""
    starts = rows.first[:-1]
    of_rows = np.column_stack([lines[:, [columns.STIFFNESS, columns.PARTICIPATION]], rows.period])
    stiffness, drive, period = np.maximum.reduceat(of_rows, starts).T

    # Steps per sampling interval, and the free vibration after the record where it is asked for
    parts = refinement(np.sqrt(stiffness), dt)
    steps = parts, free_samples(period, dt) * free_vibration, np.radians(rows.azimuth)

    # Bouncing ends in contact below a separation speed, a duration, or after many impacts
    velocity = SPEED_SHARE * sum(largest_ground_velocity(one, dt) for one in ground)
    lines[starts, columns.STICKING_SPEED] = velocity * drive
    lines[starts, columns.STICKING_DELAY] = 0.5 * SHORTEST_BOUNCE * dt / parts
    lines[starts, columns.BOUNCE_LIMIT] = BOUNCES_OF_ROWS * np.maximum(1, np.diff(rows.first) - 1)
    return run_row_blocks(ground, dt, rows.first, lines, *steps)


def _lines_at_rest(rows: BuildingRows, scales: RowScales) -> FloatArray:
    """Return the kernels' lines of all buildings; when bounces end is still to be set."""
    lines = np.zeros((rows.period.size, columns.ROW_COLUMNS))
    lines[:, :6] = building_table(rows, scales)

    # The last building of a row has no neighbour on its right: its gap is 1
    lines[:, columns.GAP] = scales.clearance * rows.gap
    lines[:, columns.RESTITUTION] = rows.restitution
    lines[:, columns.COUNTED_SPEED] = scales.clearance * SLOWEST_COUNTED
    lines[:, columns.IN_CONTACT] = rows.gap <= 0.0
    return lines
