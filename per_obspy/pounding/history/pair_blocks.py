"""Many pairs against one record in blocks of 32: their table of structures, and the memory that a block works in."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.kernels.pounding_events.contact import LOG_COLUMNS
from per_obspy.kernels.pounding_lanes.deferred_maxima import WAITING_COLUMNS, Record
from per_obspy.kernels.pounding_lanes.lanes import LANES, ROWS, TILE
from per_obspy.pounding.history.tables import refinement
from per_obspy.threads import map_in_threads

#: Bytes of a line of the processor's cache.
CACHE_LINE = 64


def pair_table(fields: dict[str, FloatArray]) -> FloatArray:
    """Return the kernels' table of structures, (n_pairs, 2, 6)."""
    table = np.empty((fields["gap"].size, 2, 6))
    for i, name in enumerate(("1", "2")):
        frequency = 2.0 * np.pi / fields[f"period_{name}"]
        table[:, i, 0] = fields[f"damping_{name}"] * frequency
        table[:, i, 1] = frequency**2
        table[:, i, 2] = fields[f"hardening_{name}"]
        table[:, i, 3] = fields[f"yield_displacement_{name}"]
        table[:, i, 4] = fields[f"participation_{name}"]
        table[:, i, 5] = fields[f"mass_{name}"]
    walls = np.flatnonzero(np.isinf(table[:, :, 5]).all(axis=1))
    if walls.size:
        raise ValueError(
            f"mass_1 and mass_2 must not both be infinite, got inf at index {walls[0]}"
        )
    return table


def aligned(size: int) -> FloatArray:
    """Return zeros that begin at a cache line: a step of vectors that straddle two lines takes a third longer."""
    numbers = np.zeros(size + CACHE_LINE // 8)
    first = -numbers.ctypes.data % CACHE_LINE // 8
    return numbers[first : first + size]


def refinements(table: FloatArray, dt: float) -> NDArray[np.int64]:
    """Return into how many steps a sampling interval is cut for each pair of a table from `pair_table`."""
    return np.array(
        [refinement(one, dt) for one in np.sqrt(table[:, :, 1].max(axis=1))], dtype=np.int64
    )


def pair_blocks(parts: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Return the pairs of each block: at most 32, of equal refinement."""
    blocks = []
    for part in np.unique(parts):
        same = np.flatnonzero(parts == part)
        blocks += [same[start : start + LANES] for start in range(0, same.size, LANES)]
    return blocks


def run_blocks(
    kernel: Callable[..., bool],
    lane_rows: int,
    components: FloatArray,
    dt: float,
    rows: FloatArray,
    parts: NDArray[np.int64],
    free_steps: NDArray[np.int64],
    azimuth: FloatArray,
) -> None:
    """
    Carry all pairs through a record and the free vibration after it, in blocks on all processors.

    Parameters
    ----------
    kernel : callable
        ``run_block`` or ``run_apart``.
    lane_rows : int
        Rows of its lanes.
    components : (2, n_samples) ndarray
        North and east acceleration, m/s².
    dt : float
        Sampling interval, s.
    rows : (n_pairs, 2, COLUMNS) ndarray
        Of the pairs at rest; then at the end.
    parts : (n_pairs,) ndarray of int
        Steps of a sampling interval.
    free_steps : (n_pairs,) ndarray of int
        Sampling intervals of free vibration at most.
    azimuth : (n_pairs,) ndarray
        Of the axis from 1 to 2, rad.

    Raises
    ------
    RuntimeError
        If a step has more events than any record causes.
    """

    def run(block: NDArray[np.int64]) -> None:
        filled, steps = np.resize(block, LANES), int(parts[block[0]])
        record, own = Record(components, steps, dt / steps), rows[filled]
        lanes, flags = aligned(lane_rows * LANES), aligned(LANES).view(np.int64)
        room = np.empty((2, 2, TILE + 1)), np.empty(ROWS), np.zeros((LANES, 2, WAITING_COLUMNS))
        along = np.cos(azimuth[filled]), np.sin(azimuth[filled])
        free = np.where(np.arange(LANES) < block.size, free_steps[filled], -1)
        if not kernel(record, lanes, flags, *room, own, np.zeros((0, LOG_COLUMNS)), *along, free):
            raise RuntimeError(f"no end of events in a step among the pairs {block.tolist()}")
        rows[block] = own[: block.size]

    map_in_threads(run, pair_blocks(parts))
