"""Tables of structures for the kernels, and pairs against one record in blocks of 32."""

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray
from per_obspy.kernels.pounding_events import motion
from per_obspy.kernels.pounding_events import motion as columns
from per_obspy.kernels.pounding_events.contact import LOG_COLUMNS, count_impacts
from per_obspy.kernels.pounding_lanes.deferred_maxima import DEFERRED_COLUMNS, Record
from per_obspy.kernels.pounding_lanes.lanes import LANE_ROWS, PAIR_LANES, TILE_STEPS
from per_obspy.kernels.pounding_lanes.remaining_motion import GROUP_SAMPLES
from per_obspy.kernels.pounding_lanes.run_block import SETTLING_STEPS
from per_obspy.pounding.structure import Structure
from per_obspy.threads import map_in_threads

#: Free vibration after the record is followed for this many of the longest period at most.
PERIODS_AFTER_RECORD = 20.0


def structure_table(structures: Sequence[Structure]) -> FloatArray:
    """
    Return the kernels' table of structures.

    Parameters
    ----------
    structures : sequence of Structure
        From left to right.

    Returns
    -------
    (n_structures, 6) ndarray
        Half damping rate ``xi omega`` (1/s), squared frequency (rad²/s²), hardening, yield
        displacement (m), participation, mass (kg).
    """
    rows = []
    for structure in structures:
        omega = structure.frequency
        spring = structure.damping * omega, omega**2, structure.hardening
        rows.append(
            (*spring, structure.yield_displacement, structure.participation, structure.mass)
        )
    return np.array(rows)


def row_at_rest(table: FloatArray, gaps: FloatArray, restitution: FloatArray) -> FloatArray:
    """
    Return the rows of structures at rest; structures without a gap start in contact.

    Parameters
    ----------
    table : (..., n_structures, 6) ndarray
        As from `structure_table`.
    gaps : (..., n_structures - 1) ndarray
        In m.
    restitution : (..., n_structures - 1) ndarray
        Dimensionless.

    Returns
    -------
    (..., n_structures, ROW_COLUMNS) ndarray
        For the kernels; when bounces end is still to be set.
    """
    row = np.zeros((*table.shape[:-1], motion.ROW_COLUMNS))
    row[..., :6] = table
    row[..., :-1, motion.GAP] = gaps
    row[..., :-1, motion.RESTITUTION] = restitution
    row[..., :-1, motion.IN_CONTACT] = gaps <= 0.0
    return row


def refinement(largest_frequency: float, dt: float) -> int:
    """
    Return the number of segments per sampling interval for which Taylor series are short.

    Parameters
    ----------
    largest_frequency : float
        Undamped circular frequency, rad/s.
    dt : float
        Sampling interval, s.

    Returns
    -------
    int
        A power of two; 1 where the shortest period is above about 9 dt.
    """
    doublings = max(0, math.ceil(math.log2(largest_frequency * dt / motion.LARGEST_ANGLE)))
    return 1 << doublings


def free_samples(longest_period: float, dt: float) -> int:
    """
    Return the sampling intervals for which free vibration is followed at most.

    Parameters
    ----------
    longest_period : float
        Of the structures, s.
    dt : float
        Sampling interval, s.

    Returns
    -------
    int
        A multiple of the steps between two checks of whether a pair is settled; at least one such
        round.
    """
    rounds = int(PERIODS_AFTER_RECORD * longest_period / (SETTLING_STEPS * dt))
    return SETTLING_STEPS * max(1, rounds)


def closed_record(acceleration: FloatArray) -> FloatArray:
    """
    Return a record that ends at zero: otherwise a sample of zero is appended (a ramp of dt).

    Parameters
    ----------
    acceleration : (..., n_samples) ndarray
        In m/s².

    Returns
    -------
    (..., n_samples or n_samples + 1) ndarray
        In m/s².
    """
    if not acceleration[..., -1].any():
        return acceleration
    return np.concatenate([acceleration, np.zeros((*acceleration.shape[:-1], 1))], axis=-1)


def largest_ground_velocity(acceleration: FloatArray, dt: float) -> float:
    """
    Return the largest velocity of the ground, as the scale against which speeds are small.

    Parameters
    ----------
    acceleration : (n_samples,) ndarray
        In m/s².
    dt : float
        Sampling interval, s.

    Returns
    -------
    float
        In m/s; the ground starts at rest.
    """
    steps = 0.5 * dt * (acceleration[1:] + acceleration[:-1])
    return float(np.abs(np.cumsum(steps)).max(initial=0.0))


#: Bytes of a line of the processor's cache.
CACHE_LINE = 64

#: Impacts of a pair for which there is room at first. Pages that stay unused take no memory.
FIRST_ROOM = 4096

#: Check of each argument of a pair; those of one structure end with its number.
CHECKS: dict[str, Callable[[str, ArrayLike], FloatArray]] = {
    "period": checks.positive,
    "damping": checks.fraction_of_critical,
    "mass": checks.positive_or_infinite,
    "gap": checks.not_negative,
    "restitution": lambda name, values: checks.between(name, values, 0.0, 1.0),
    "participation": checks.not_negative,
    "azimuth": checks.finite,
    "yield_displacement": checks.positive_or_infinite,
    "hardening": checks.fraction_of_critical,
}


def pair_fields(**arguments: ArrayLike) -> tuple[dict[str, FloatArray], tuple[int, ...]]:
    """
    Return the arguments of all pairs by name, checked and flat, and their broadcast shape.

    Parameters
    ----------
    **arguments : array_like
        By the names of ``CHECKS``, for example ``period_1``, ``damping_1`` and ``gap``.

    Returns
    -------
    fields : dict of str to (n_pairs,) ndarray
        In the units of the arguments.
    shape : tuple of int
        Of the results.

    Raises
    ------
    ValueError
        If an argument is out of range.
    """
    checked = {}
    for name, values in arguments.items():
        checked[name] = CHECKS[name.rstrip("_12")](name, values)

    # One value per pair
    shapes = [values.shape for values in checked.values()]
    shape = np.broadcast_shapes(*shapes)
    flat = {name: np.broadcast_to(values, shape).ravel() for name, values in checked.items()}
    return flat, shape


def pair_table(fields: dict[str, FloatArray]) -> FloatArray:
    """Return the kernels' table of structures, (n_pairs, 2, 6)."""
    table = np.empty((fields["gap"].size, 2, 6))
    for structure in (1, 2):
        # Half damping rate, squared frequency, backbone, drive and mass
        columns = table[:, structure - 1]
        frequency = 2.0 * np.pi / fields[f"period_{structure}"]
        columns[:, 0] = fields[f"damping_{structure}"] * frequency
        columns[:, 1] = frequency**2
        columns[:, 2] = fields[f"hardening_{structure}"]
        columns[:, 3] = fields[f"yield_displacement_{structure}"]
        columns[:, 4] = fields[f"participation_{structure}"]
        columns[:, 5] = fields[f"mass_{structure}"]

    # Two walls cannot move towards each other
    walls = np.flatnonzero(np.isinf(table[:, :, 5]).all(axis=1))
    if walls.size:
        raise ValueError(
            f"mass_1 and mass_2 must not both be infinite, got inf at index {walls[0]}"
        )
    return table


def aligned(size: int) -> FloatArray:
    """
    Return zeros that begin at a cache line.

    A step of vectors that straddle two lines takes a third longer.
    """
    numbers = np.zeros(size + CACHE_LINE // 8)
    first = -numbers.ctypes.data % CACHE_LINE // 8
    return numbers[first : first + size]


def refinements(table: FloatArray, dt: float) -> NDArray[np.int64]:
    """Return the number of steps per sampling interval for each pair of a table."""
    frequencies = np.sqrt(table[:, :, 1].max(axis=1))
    return np.array([refinement(omega, dt) for omega in frequencies], dtype=np.int64)


def free_vibration_steps(fields: dict[str, FloatArray], dt: float) -> NDArray[np.int64]:
    """Return the sampling intervals of free vibration at most, for each pair."""
    longest = np.maximum(fields["period_1"], fields["period_2"])
    return np.array([free_samples(period, dt) for period in longest], dtype=np.int64)


def records_in_steps(components: FloatArray, parts: ArrayLike, dt: float) -> dict[int, Record]:
    """
    Return a record for the kernels of histories, by its steps per sampling interval.

    Parameters
    ----------
    components : (2, n_samples) ndarray
        North and east acceleration, m/s².
    parts : array_like of int
        Numbers of steps into which each sampling interval is cut.
    dt : float
        Sampling interval, s.
    """
    # integrals of the size, by the trapezoidal rule: an upper bound
    size = np.abs(components)
    over_steps = 0.5 * dt * (size[:, :-1] + size[:, 1:])
    starts = np.arange(0, over_steps.shape[1], GROUP_SAMPLES)
    sizes = np.add.reduceat(over_steps, starts, axis=1) if starts.size else np.zeros((2, 0))
    numbers = np.unique(parts).tolist()
    return {number: Record(components, number, dt / number, sizes) for number in numbers}


def pair_blocks(parts: NDArray[np.int64], rows: FloatArray) -> list[NDArray[np.int64]]:
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
    that are written there.

    Parameters
    ----------
    rows, impacts : int
        Number of logs, and of lines of each, for which memory is kept; more are new each time.
    """

    def __init__(self, rows: int, impacts: int) -> None:
        """Begin without memory."""
        self.impacts = impacts
        self._rows = rows
        self._free: list[FloatArray] = []

    def room(self, rows: int, impacts: int) -> FloatArray:
        """Return logs (n_rows, n_lines, LOG_COLUMNS) of any content."""
        if rows > self._rows or impacts != self.impacts:
            return np.empty((rows, impacts, LOG_COLUMNS))
        # Threads share the list: another one may take its last
        try:
            whole = self._free.pop()
        except IndexError:
            whole = np.empty((self._rows, impacts, LOG_COLUMNS))
        return whole[:rows]

    def keep(self, logs: FloatArray) -> None:
        """Take back logs that are no longer used."""
        if logs.base is not None:
            self._free.append(logs.base)


def run_blocks(
    kernel: Callable[..., bool],
    lane_rows: int,
    components: FloatArray,
    dt: float,
    rows: FloatArray,
    parts: NDArray[np.int64],
    free_steps: NDArray[np.int64],
    azimuth: FloatArray,
) -> NDArray[np.int64]:
    """
    Carry all pairs through a record and the free vibration after it, in blocks on all processors.

    Parameters
    ----------
    kernel : callable
        ``run_block`` or ``run_without_contact``.
    lane_rows : int
        Rows of its lanes.
    components : (2, n_samples) ndarray
        North and east acceleration, m/s².
    dt : float
        Sampling interval, s.
    rows : (n_pairs, 2, ROW_COLUMNS) ndarray
        Of the pairs at rest; then at the end.
    parts : (n_pairs,) ndarray of int
        Steps of a sampling interval.
    free_steps : (n_pairs,) ndarray of int
        Sampling intervals of free vibration at most.
    azimuth : (n_pairs,) ndarray
        Of the axis from 1 to 2, rad.

    Returns
    -------
    (n_pairs,) ndarray of int
        Impacts that count, see `count_impacts`.

    Raises
    ------
    RuntimeError
        If a step has more events than any record causes.
    """
    counts = np.zeros(len(rows), dtype=np.int64)
    records = records_in_steps(components, parts, dt)
    kept = KeptLogs(PAIR_LANES, FIRST_ROOM)

    def run(block: NDArray[np.int64]) -> None:
        """Run one block of pairs, filled up with repetitions that have no free vibration."""
        filled, steps = np.resize(block, PAIR_LANES), int(parts[block[0]])

        # Their free vibration and direction
        free = np.where(np.arange(PAIR_LANES) < block.size, free_steps[filled], -1)
        direction = np.cos(azimuth[filled]), np.sin(azimuth[filled])
        record = records[steps]

        # Results of the block, without the repetitions
        others = *direction, free
        found = _run_logged(kernel, lane_rows, record, rows[filled], others, kept)
        if found is None:
            raise RuntimeError(f"no end of events in a step among the pairs {block.tolist()}")
        rows[block], counts[block] = (result[: block.size] for result in found)

    map_in_threads(run, pair_blocks(parts, rows))
    return counts


def _run_logged(
    kernel: Callable[..., bool],
    lane_rows: int,
    record: Record,
    rows: FloatArray,
    others: tuple[FloatArray, FloatArray, NDArray[np.int64]],
    kept: KeptLogs,
) -> tuple[FloatArray, NDArray[np.int64]] | None:
    """Return rows at the end and impacts that count of one block; None without end of events."""
    room = kept.impacts
    # Grow the logs until all impacts of every pair have room
    while True:
        logs = kept.room(PAIR_LANES, room)
        # The kernel changes its rows and the steps of free vibration
        own, (cosine, sine, free) = rows.copy(), others
        memory = *_working_memory(lane_rows), own, logs
        if not kernel(record, *memory, cosine, sine, free.copy()):
            return None
        impacts = int(own[:, 0, columns.IMPACTS].max())
        counts = count_impacts(own, logs) if impacts <= room else None
        kept.keep(logs)
        if counts is not None:
            return own, counts
        room = impacts


def _working_memory(lane_rows: int) -> tuple[FloatArray | NDArray[np.int64], ...]:
    """Return the memory of one block: lanes, flags, ground of two tiles, pairs, waiting tiles."""
    lanes = aligned(lane_rows * PAIR_LANES)
    flags = aligned(PAIR_LANES).view(np.int64)
    grounds, pairs = np.empty((2, 2, TILE_STEPS + 1)), np.empty((PAIR_LANES, LANE_ROWS))
    waiting = np.zeros((PAIR_LANES, 2, DEFERRED_COLUMNS))
    return lanes, flags, grounds, pairs, waiting
