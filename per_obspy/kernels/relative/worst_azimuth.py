"""The azimuth along which two oscillators under two components of motion separate most."""

import numpy as np

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.oscillator.exact_step import step_coefficients
from per_obspy.kernels.relative.relative_samples import PAIR_LANES


@kernel
def largest_separation(north, east, dt, pairs, separation):
    """
    Fill the largest vector between the two oscillators of each pair at the samples.

    Parameters
    ----------
    north, east : (n_samples,) ndarray
        Components of the ground acceleration, m/s².
    dt : float
        Time between samples, s.
    pairs : (6, n) ndarray
        Rows: circular frequency (rad/s), damping (fraction of critical) and participation
        (dimensionless) of structure 1, then of 2.
    separation : (2, n) ndarray
        Receives north and east part of the longest vector ``q1 u1 - q2 u2``, m.
    """
    for first in range(0, pairs.shape[1], PAIR_LANES):
        count = min(PAIR_LANES, pairs.shape[1] - first)
        coefficients = np.zeros((18, PAIR_LANES))
        best = np.zeros((2, PAIR_LANES))
        # Rows of the block: eight coefficients of a step of either structure, participations
        for lane in range(count):
            for body in range(2):
                omega = pairs[3 * body, first + lane]
                damping = pairs[3 * body + 1, first + lane]
                step = step_coefficients(omega, damping, dt)
                for row in range(8):
                    coefficients[8 * body + row, lane] = step[row]
                coefficients[16 + body, lane] = pairs[3 * body + 2, first + lane]
        # Pass over the record
        _run(north, east, coefficients, best)
        for lane in range(count):
            separation[0, first + lane] = best[0, lane]
            separation[1, first + lane] = best[1, lane]


@kernel
def _run(north, east, coefficients, best):
    """Advance a block over the record; fill the two parts of the largest separation."""
    c = coefficients.copy()
    s = np.zeros((8, PAIR_LANES))
    squared = np.zeros(PAIR_LANES)
    along_north = np.zeros(PAIR_LANES)
    along_east = np.zeros(PAIR_LANES)
    # States (u, z) of both structures under either component, step by step
    for i in range(north.size - 1):
        n0, n1, e0, e1 = north[i], north[i + 1], east[i], east[i + 1]
        for lane in range(PAIR_LANES):
            # Structure 1 under north (Nigam & Jennings)
            u, z = s[0, lane], s[1, lane]
            s[0, lane] = c[0, lane] * u + c[1, lane] * z + (c[4, lane] * n0 + c[5, lane] * n1)
            s[1, lane] = c[2, lane] * u + c[3, lane] * z + (c[6, lane] * n0 + c[7, lane] * n1)
            # Structure 1 under east
            u, z = s[2, lane], s[3, lane]
            s[2, lane] = c[0, lane] * u + c[1, lane] * z + (c[4, lane] * e0 + c[5, lane] * e1)
            s[3, lane] = c[2, lane] * u + c[3, lane] * z + (c[6, lane] * e0 + c[7, lane] * e1)
            # Structure 2 under north
            u, z = s[4, lane], s[5, lane]
            s[4, lane] = c[8, lane] * u + c[9, lane] * z + (c[12, lane] * n0 + c[13, lane] * n1)
            s[5, lane] = c[10, lane] * u + c[11, lane] * z + (c[14, lane] * n0 + c[15, lane] * n1)
            # Structure 2 under east
            u, z = s[6, lane], s[7, lane]
            s[6, lane] = c[8, lane] * u + c[9, lane] * z + (c[12, lane] * e0 + c[13, lane] * e1)
            s[7, lane] = c[10, lane] * u + c[11, lane] * z + (c[14, lane] * e0 + c[15, lane] * e1)
            # Parts of the separation q1 u1 - q2 u2
            x = c[16, lane] * s[0, lane] - c[17, lane] * s[4, lane]
            y = c[16, lane] * s[2, lane] - c[17, lane] * s[6, lane]
            # Squared length
            distance = x * x + y * y
            further = distance > squared[lane]
            # Store the parts where it is the longest so far
            squared[lane] = distance if further else squared[lane]
            along_north[lane] = x if further else along_north[lane]
            along_east[lane] = y if further else along_east[lane]
    # Parts of the longest separation of each pair
    for lane in range(PAIR_LANES):
        best[0, lane], best[1, lane] = along_north[lane], along_east[lane]
