"""Maxima of a row of more buildings than there are lanes, from event to event."""

import math

from per_obspy.kernels._jit import kernel, lean
from per_obspy.kernels.pounding_events.contact import has_room
from per_obspy.kernels.pounding_events.motion import (
    BOUNCES,
    LARGEST_ENERGY_RADIUS_SQUARED,
    TERM_COUNT,
    Segment,
    taylor_terms,
)
from per_obspy.kernels.pounding_events.row_history import is_settled
from per_obspy.kernels.pounding_lanes.run_block import SETTLING_STEPS
from per_obspy.kernels.pounding_lanes.step_by_step import run_events


@lean
def _advance_interval(row, log, time, start, slope, refinement, duration, terms):
    """Carry a row through one sampling interval; return whether it got through."""
    for part in range(refinement):
        shift = part * duration
        row[0, BOUNCES] = 0.0
        segment = Segment(time + shift, duration, start + slope * shift, slope, terms)
        if not run_events(row, log, segment, 0.0, False) or not has_room(row, log):
            return False
    return True


@kernel
def run_row_by_events(north, east, cosine, sine, dt, refinement, row, log, free_steps):
    """
    Run one row of buildings through a record and the free vibration after it.

    Parameters
    ----------
    north, east : (n_samples,) ndarray
        Ground acceleration, m/s². The ground rests after it.
    cosine, sine : float
        Of the azimuth of the row's axis, from its first to its last building.
    dt : float
        Sampling interval, s.
    refinement : int
        Number of segments into which each sampling interval is cut.
    row : (n_buildings, ROW_COLUMNS) ndarray
        Row at rest, then at the end; see `motion` for its columns. It holds the results:
        LARGEST_DISPLACEMENT (m), LARGEST_RADIUS_SQUARED (m²), IMPACTS and APPROACH (m/s).
    log : (n_lines, LOG_COLUMNS) ndarray
        Receives one line per impact; the run ends where there is no room. See `contact` for its
        columns.
    free_steps : int
        Sampling intervals of free vibration at most.

    Returns
    -------
    bool
        Whether it got through: no segment had too many events, and the log had room.
    """
    duration = dt / refinement
    row[0, TERM_COUNT] = terms = taylor_terms(row, duration)
    # the energy radius is not computed
    row[:, LARGEST_ENERGY_RADIUS_SQUARED] = math.inf
    # the record
    before = cosine * north[0] + sine * east[0]
    for k in range(1, north.size):
        after = cosine * north[k] + sine * east[k]
        time, slope = (k - 1) * dt, (after - before) / dt
        if not _advance_interval(row, log, time, before, slope, refinement, duration, terms):
            return False
        before = after
    # free vibration, until the row is settled
    for k in range(free_steps):
        if k % SETTLING_STEPS == 0 and is_settled(row):
            break
        time = (north.size - 1 + k) * dt
        if not _advance_interval(row, log, time, 0.0, 0.0, refinement, duration, terms):
            return False
    return True
