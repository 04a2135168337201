"""Tables of structures for the kernels, and pairs against one record in blocks of 32."""

from collections.abc import Callable, Sequence
from itertools import pairwise
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray
from per_obspy.kernels.pounding_events import motion as columns
from per_obspy.kernels.pounding_events.contact import LOG_COLUMNS, count_impacts
from per_obspy.kernels.pounding_lanes.deferred_maxima import DEFERRED_COLUMNS, Record
from per_obspy.kernels.pounding_lanes.lanes import LANE_ROWS, PAIR_LANES, TILE_STEPS
from per_obspy.kernels.pounding_lanes.remaining_motion import GROUP_SAMPLES
from per_obspy.kernels.pounding_lanes.run_block import SETTLING_STEPS
from per_obspy.pounding.structure import Pairs, Structure
from per_obspy.threads import map_in_threads

IntArray = NDArray[np.int64]

#: Free vibration after the record is followed for this many of the longest period at most.
PERIODS_AFTER_RECORD = 20.0

#: Bouncing ends in contact once the separation speed is below this share of the largest ground
#: velocity, and a bounce that lasts less than this share of a sampling interval does.
SPEED_SHARE, SHORTEST_BOUNCE = 1e-11, 1e-3

#: Bouncing of a pair ends in contact after this many impacts in one sampling interval. With 25,
#: radii of pairs with a restitution of 0.95 were off by 1e-7; from 100 on they no longer change.
BOUNCES_OF_PAIRS = 400


def ground_motion(acceleration: ArrayLike) -> FloatArray:
    """Return checked north and east components, (2, n_samples), m/s²."""
    record = checks.finite("acceleration", acceleration)
    if record.ndim != 2 or record.shape[0] != 2 or record.size == 0:
        raise ValueError(
            f"acceleration must be north and east (2, n_samples) with azimuth, "
            f"got the shape {record.shape}"
        )
    return np.ascontiguousarray(record)


def both_components(north: ArrayLike, east: ArrayLike) -> FloatArray:
    """Return checked components of equal length, (2, n_samples), m/s²."""
    components = checks.record("north", north), checks.record("east", east)
    if components[0].size != components[1].size:
        raise ValueError(
            f"north and east must be equally long, got {components[0].size} and "
            f"{components[1].size} samples"
        )
    return np.stack(components)


def closed_record(acceleration: FloatArray) -> FloatArray:
    """
    Return a record that ends at zero: otherwise a sample of zero is appended (a ramp of dt).

    Both are (..., n_samples), m/s².
    """
    if not acceleration[..., -1].any():
        return acceleration
    return np.concatenate([acceleration, np.zeros((*acceleration.shape[:-1], 1))], axis=-1)


def largest_ground_velocity(acceleration: FloatArray, dt: float) -> float:
    """Return the largest velocity (m/s) of the ground, as the scale of speeds; at first at rest."""
    steps = 0.5 * dt * (acceleration[1:] + acceleration[:-1])
    return float(np.abs(np.cumsum(steps)).max(initial=0.0))


def structure_table(structures: Sequence[Structure]) -> FloatArray:
    """Return the kernels' table of structures from left to right, see `kernel_table`."""
    values = attrgetter(
        "damping", "frequency", "hardening", "yield_displacement", "participation", "mass"
    )
    return kernel_table(*np.array([values(one) for one in structures]).T)


def kernel_table(
    damping: FloatArray,
    frequency: FloatArray,
    hardening: FloatArray,
    yield_displacement: FloatArray,
    drive: FloatArray,
    mass: FloatArray,
) -> FloatArray:
    """
    Return the kernels' table of structures, (..., 6), from arrays of one shape.

    Half damping rate ``xi omega`` (1/s), squared frequency (rad²/s²), hardening, yield displacement
    (m), ``drive`` by the ground (the participation), mass (kg).
    """
    spring = damping * frequency, frequency**2, hardening, yield_displacement
    return np.stack([*spring, drive, mass], axis=-1)


def pair_table(pairs: Pairs) -> FloatArray:
    """Return the kernels' table of the structures of pairs, (n_pairs, 2, 6)."""
    walls = np.flatnonzero(np.isinf(pairs.mass).all(axis=0))
    if walls.size:
        raise ValueError(
            f"mass_1 and mass_2 must not both be infinite, got inf at index {walls[0]}"
        )
    springs = pairs.damping, pairs.frequency, pairs.hardening, pairs.yield_displacement
    return kernel_table(*springs, pairs.participation, pairs.mass).swapaxes(0, 1)


def refuse_pressed_walls(mass: FloatArray, gap: FloatArray, row: IntArray, named: str) -> None:
    """
    Refuse two walls (infinite masses) of a row with an interface or without a gap between them.

    ``row`` is the number of the row of each structure, ``gap`` (m) that after it.
    """
    for left, right in pairwise(np.flatnonzero(np.isinf(mass))):
        is_pressed = right == left + 1 or not gap[left:right].any()
        if row[left] == row[right] and is_pressed:
            raise ValueError(
                f"mass of {named} {left} and {right} is infinite, with no room to move between them"
            )


def row_at_rest(table: FloatArray, gaps: FloatArray, restitution: FloatArray) -> FloatArray:
    """
    Return the kernels' rows of structures at rest; structures without a gap start in contact.

    Of a table (..., n_structures, 6) and of gaps (m) and restitutions (..., n_structures - 1);
    when bounces end is still to be set.
    """
    row = np.zeros((*table.shape[:-1], columns.ROW_COLUMNS))
    row[..., :6] = table
    row[..., :-1, columns.GAP] = gaps
    row[..., :-1, columns.RESTITUTION] = restitution
    row[..., :-1, columns.IN_CONTACT] = gaps <= 0.0
    return row


def refinement(largest_frequency: ArrayLike, dt: float) -> IntArray:
    """
    Return the segments per sampling interval (dt, s) for which Taylor series are short.

    Powers of two, for circular frequencies in rad/s; 1 where the shortest period is above about 9
    dt.
    """
    angle = np.asarray(largest_frequency) * dt / columns.LARGEST_ANGLE
    return np.left_shift(1, np.maximum(np.ceil(np.log2(angle)), 0.0).astype(np.int64))


def free_samples(longest_period: ArrayLike, dt: float) -> IntArray:
    """
    Return the sampling intervals (dt, s) for which free vibration is followed at most.

    Multiples of the steps between two checks of whether a pair is settled, at least one such round,
    for periods in s.
    """
    rounds = PERIODS_AFTER_RECORD * np.asarray(longest_period) / (SETTLING_STEPS * dt)
    return SETTLING_STEPS * np.clip(rounds, 1.0, 1e12).astype(np.int64)


#: Bytes of a line of the processor's cache.
CACHE_LINE = 64

#: Impacts of a pair for which there is room at first. Pages that stay unused take no memory.
FIRST_ROOM = 4096


def aligned(size: int) -> FloatArray:
    """
    Return zeros that begin at a cache line.

    A step of vectors that straddle two lines takes a third longer.
    """
    numbers = np.zeros(size + CACHE_LINE // 8)
    first = -numbers.ctypes.data % CACHE_LINE // 8
    return numbers[first : first + size]


def records_in_steps(components: FloatArray, parts: ArrayLike, dt: float) -> dict[int, Record]:
    """
    Return a record (2, n_samples) for the kernels of histories, by its steps per sampling interval.

    One for each of the numbers ``parts`` into which sampling intervals (dt, s) are cut.
    """
    # integrals of the size, by the trapezoidal rule: an upper bound
    size = np.abs(components)
    over_steps = 0.5 * dt * (size[:, :-1] + size[:, 1:])
    starts = np.arange(0, over_steps.shape[1], GROUP_SAMPLES)
    sizes = np.add.reduceat(over_steps, starts, axis=1) if starts.size else np.zeros((2, 0))
    numbers = np.unique(parts).tolist()
    return {number: Record(components, number, dt / number, sizes) for number in numbers}


def pair_blocks(parts: IntArray, rows: FloatArray) -> list[IntArray]:
    """
    Return the pairs of each block: at most 32, of equal refinement.

    Pairs whose histories end at about the same time are in one block: with and without a gap, and
    by how long they remember.
    """
    blocks = []
    memory = rows[:, :, columns.DAMPING_RATE].min(axis=1)
    order = np.lexsort((memory, rows[:, 0, columns.GAP] > 0.0))
    for part in np.unique(parts):
        # in this order
        same = order[parts[order] == part]
        blocks += [same[start : start + PAIR_LANES] for start in range(0, same.size, PAIR_LANES)]
    return blocks


class KeptLogs:
    """
    Logs of impacts that are used by one block after another, in each thread others.

    The system clears new memory where it is first written, which takes longer than the impacts
    that are written there. Memory is kept for a number of logs (``rows``) and of lines of each
    (``impacts``): fewer logs have more lines. More are new each time.
    """

    def __init__(self, rows: int, impacts: int) -> None:
        """Begin without memory."""
        self._impacts, self._rows = impacts, rows
        self._free: list[FloatArray] = []

    def _lines(self, rows: int) -> int:
        """Return how many lines each of some logs has at first."""
        return self._impacts * max(self._rows // rows, 1)

    def room(self, rows: int, impacts: int) -> FloatArray:
        """Return logs (n_rows, n_lines, LOG_COLUMNS) of any content."""
        if rows > self._rows or impacts != self._lines(rows):
            return np.empty((rows, impacts, LOG_COLUMNS))
        # Threads share the list: another one may take its last
        try:
            whole = self._free.pop()
        except IndexError:
            whole = np.empty((self._rows * self._impacts, LOG_COLUMNS))
        return whole[: rows * impacts].reshape(rows, impacts, LOG_COLUMNS)

    def keep(self, logs: FloatArray) -> None:
        """Take back logs that are no longer used."""
        if logs.base is not None:
            self._free.append(logs.base)

    def fill(self, rows: int, run: Callable[[FloatArray], int]) -> FloatArray:
        """Return logs that a run has filled; it returns the most impacts that a log has to hold."""
        room = self._lines(rows)
        while (impacts := run(logs := self.room(rows, room))) > room:
            self.keep(logs)
            room = impacts
        return logs


def run_pairs(
    kernel: Callable[..., bool],
    lane_rows: int,
    components: FloatArray,
    dt: float,
    pairs: Pairs,
    free_vibration: bool,
    counted_speed: ArrayLike = 0.0,
) -> tuple[FloatArray, IntArray]:
    """
    Return the rows of pairs after a record, see `run_blocks`, and their impacts that count.

    Impacts count from `counted_speed` on, m/s. Kernels that follow openings know none; they look
    for larger openings than these, (n_pairs, 2), m.
    """
    table = pair_table(pairs)
    parts = refinement(pairs.frequency.max(axis=0, initial=0.0), dt)
    rows = row_at_rest(table, pairs.gap[:, np.newaxis], pairs.restitution[:, np.newaxis])

    # Bouncing ends in contact below a separation speed, a duration, or after many impacts
    velocity = SPEED_SHARE * sum(largest_ground_velocity(one, dt) for one in components)
    rows[:, 0, columns.STICKING_SPEED] = velocity * pairs.participation.max(axis=0)
    rows[:, 0, columns.STICKING_DELAY] = 0.5 * SHORTEST_BOUNCE * dt / parts
    rows[:, 0, columns.BOUNCE_LIMIT] = BOUNCES_OF_PAIRS
    rows[:, :, columns.COUNTED_SPEED] = counted_speed

    # Run the record and, where it is asked for, the free vibration after it
    free_steps = free_samples(pairs.period.max(axis=0), dt) * free_vibration
    steps = parts, free_steps, np.radians(pairs.azimuth)
    return rows, run_blocks(kernel, lane_rows, components, dt, rows, *steps)


def of_structures(numbers: FloatArray, shape: tuple[int, ...]) -> FloatArray:
    """Return numbers (n_pairs, 2) of both structures as (2, *shape)."""
    return numbers.T.reshape(2, *shape)


def rest_displacements(rows: FloatArray, shape: tuple[int, ...]) -> FloatArray:
    """Return where structures of rows of pairs come to rest after their motion, (2, *shape), m."""
    # Where the elastic force (1 - hardening) omega² (u - plastic) + hardening omega² u is zero
    elastic = 1.0 - rows[:, :, columns.HARDENING]
    return of_structures(elastic * rows[:, :, columns.PLASTIC], shape)


def run_blocks(
    kernel: Callable[..., bool],
    lane_rows: int,
    components: FloatArray,
    dt: float,
    rows: FloatArray,
    parts: IntArray,
    free_steps: IntArray,
    azimuth: FloatArray,
) -> IntArray:
    """
    Carry all pairs through a record and the free vibration after it, in blocks on all processors.

    By ``run_block``, of pairs that touch or never do, in lanes of ``lane_rows``. The components (2,
    n_samples) are in m/s², dt in s; ``rows`` (n_pairs, 2, ROW_COLUMNS) are at rest, then at the
    end. Each pair has its steps of a sampling interval, sampling intervals of free vibration at
    most, and azimuth (rad). Return impacts that count (`count_impacts`); ``RuntimeError`` if a step
    has more events than any record causes.
    """
    counts = np.zeros(len(rows), dtype=np.int64)
    records = records_in_steps(components, parts, dt)
    kept = KeptLogs(PAIR_LANES, FIRST_ROOM)
    cosine, sine = np.cos(azimuth), np.sin(azimuth)

    def run(block: IntArray) -> None:
        """Run one block of pairs, filled up with repetitions that have no free vibration."""
        filled, record = np.resize(block, PAIR_LANES), records[int(parts[block[0]])]
        free = np.where(np.arange(PAIR_LANES) < block.size, free_steps[filled], -1)
        # Results of the block, without the repetitions
        others = cosine[filled], sine[filled], free
        own, found = _run_block(kernel, lane_rows, record, rows[filled], others, kept)
        rows[block], counts[block] = own[: block.size], found[: block.size]

    # Blocks do not depend on each other
    map_in_threads(run, pair_blocks(parts, rows))
    return counts


def _run_block(
    kernel: Callable[..., bool],
    lane_rows: int,
    record: Record,
    start: FloatArray,
    others: tuple[NDArray[Any], ...],
    kept: KeptLogs,
) -> tuple[FloatArray, IntArray]:
    """Return rows of one block at the end, and impacts that count."""
    own, (cosine, sine, free) = start.copy(), others

    def fill(logs: FloatArray) -> int:
        """Run the block from rest; the kernel changes rows and steps of free vibration."""
        own[:] = start
        memory = *_working_memory(lane_rows), own, logs
        if not kernel(record, *memory, cosine, sine, free.copy()):
            raise RuntimeError("no end of events in a step of a pair")
        return int(own[:, 0, columns.IMPACTS].max())

    # Slower and rarer impacts are the chatter of structures that are pressed together
    logs = kept.fill(PAIR_LANES, fill)
    counts = count_impacts(own, logs)
    kept.keep(logs)
    return own, counts


def _working_memory(lane_rows: int) -> tuple[FloatArray | IntArray, ...]:
    """Return the memory of one block: lanes, flags, ground of two tiles, pairs, waiting tiles."""
    lanes = aligned(lane_rows * PAIR_LANES)
    flags = aligned(PAIR_LANES).view(np.int64)
    grounds, pairs = np.empty((2, 2, TILE_STEPS + 1)), np.empty((PAIR_LANES, LANE_ROWS))
    waiting = np.zeros((PAIR_LANES, 2, DEFERRED_COLUMNS))
    return lanes, flags, grounds, pairs, waiting
