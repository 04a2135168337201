"""Histories of rows of 32 buildings in all, in adjacent lanes."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from per_obspy.kernels.pounding_lanes.deferred_maxima import Record
from per_obspy.kernels.pounding_lanes.lanes import ROWS
from per_obspy.kernels.pounding_lanes.run_block import run_lanes


def run_rows(
    record: Record,
    lanes: NDArray[np.float64],
    flags: NDArray[np.int64],
    grounds: NDArray[np.float64],
    memory: tuple[NDArray[np.float64], ...],
    *motion: NDArray[Any],
) -> bool:
    """
    Run rows of 32 buildings in all through a record and the free vibration after it.

    Parameters
    ----------
    record, lanes, flags, grounds
        As in `run_lanes`.
    memory : tuple of ndarray
        Room for lanes as lines (PAIR_LANES, LANE_ROWS); lines of all buildings (PAIR_LANES,
        ROW_COLUMNS); logs; room for states (PAIR_LANES, STATE_COLUMNS), deferred tiles (PAIR_LANES,
        DEFERRED_COLUMNS) and a window (WINDOW_SIZE,), as in `run_lanes`.
    *motion : ndarray
        ``firsts``, ``cosine``, ``sine`` and ``free_steps`` of `run_lanes`.

    Returns
    -------
    bool
        Whether all rows got through: no step had too many events.
    """
    members, lines, logs, states, deferred, window = memory
    rooms = members.reshape(-1), lines, logs, deferred, states, window
    return bool(run_lanes(ROWS, record, lanes, flags, grounds, rooms, *motion))
