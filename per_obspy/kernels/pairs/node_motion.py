"""
Estimated motion of pairs without contact at nodes of their buildings.

Periods and dampings are lognormal, the periods of both buildings correlated. A radius changes as
the stored spectrum does, which is bilinear in ln period and ln damping; eq. (15) and (16) give the
relative motion. The nodes of a pair share one row, so that loops without branches over them become
vectors.
"""

import math

import numpy as np

from per_obspy.kernels._jit import inlined, kernel
from per_obspy.kernels.vector_functions import exponentials

#: Rows of the oscillators of a pair, those of building 1, then those of building 2: median period
#: (s), its log-standard deviation, median damping (fraction of critical), its log-standard
#: deviation, largest damping, and radius (m) where the logarithm of the stored spectrum is 0.
PERIOD, PERIOD_STD, DAMPING, DAMPING_STD, LARGEST_DAMPING, RADIUS, OSCILLATOR_ROWS = range(7)
#: Rows of the motion at the nodes: relative displacement (m) and velocity (m/s), circular frequency
#: times radius of both oscillators (m/s), correlation.
DEMAND, VELOCITY, SPEED_1, SPEED_2, CORRELATION, MOTION_ROWS = range(6)
#: Gap over the sum of the radii that the rounding of a correlation of 1 leaves in eq. (15).
ROUND_OFF = 1e-7
#: Instead of a damping of zero, where a logarithm is taken.
SMALLEST = 1e-300


@kernel
def estimate_motion(periods, dampings, stored, rows, oscillators, correlations, deviates, motion):
    """
    Fill the motion of pairs at all nodes.

    Parameters
    ----------
    periods, dampings : (n_periods,), (n_dampings,) ndarray
        Logarithms of the grid of the stored spectra, increasing; at the edge beyond it.
    stored : (n_rows, n_dampings, n_periods) ndarray
        Logarithms of stored radii in m.
    rows : (n_pairs,) ndarray of int
        Row of the stored spectra of each pair.
    oscillators : (2 * OSCILLATOR_ROWS, n_pairs) ndarray
        See ``PERIOD`` and the following constants.
    correlations : (2, n_pairs) ndarray
        What is added to the correlation of eq. (16) in eq. (15); correlation of both ln periods.
    deviates : (4, n_nodes) ndarray
        Standard normal: ln period and ln damping of building 1, then of 2.
    motion : (MOTION_ROWS, n_pairs, n_nodes) ndarray
        Receives the motion, see ``DEMAND`` and the following constants.
    """
    count = deviates.shape[1]
    # of both buildings: ln period, damping, radius; 1 / period of building 1, root of T1 / T2
    work = np.empty((8, count))
    normal = np.empty((2, count))
    integers = np.empty(count, np.int64)
    for pair in range(rows.size):
        spectrum = stored[rows[pair]]
        # Both buildings at all nodes
        for i in range(2):
            building = oscillators[i * OSCILLATOR_ROWS : (i + 1) * OSCILLATOR_ROWS, pair]
            # building 2 shares a part of the deviate of building 1
            shared = correlations[1, pair] if i == 1 else 0.0
            own = math.sqrt(1.0 - shared * shared)
            for node in range(count):
                normal[0, node] = shared * deviates[0, node] + own * deviates[2 * i, node]
                normal[1, node] = deviates[2 * i + 1, node]
            _oscillators(
                building, normal, periods, dampings, spectrum, work[3 * i : 3 * i + 3], integers
            )
        # Frequency of building 1, and the ratio of both
        for node in range(count):
            work[6, node] = -work[0, node]
            work[7, node] = 0.5 * (work[0, node] - work[3, node])
        exponentials(work[6], integers)
        exponentials(work[7], integers)
        for node in range(count):
            _relative_motion(work, node, correlations[0, pair], motion[:, pair])


@kernel
def _oscillators(building, normal, periods, dampings, spectrum, out, integers):
    """Fill ln period, damping and radius of a building at all nodes, (3, n_nodes)."""
    log_period, log_damping = math.log(building[0]), math.log(max(building[2], SMALLEST))
    # Logarithms, and the stored spectrum there
    largest = math.log(building[4])
    for node in range(normal.shape[1]):
        period = log_period + building[1] * normal[0, node]
        change = building[3] * normal[1, node]
        damping = min(log_damping + change, largest)
        out[0, node] = period
        out[1, node] = change
        out[2, node] = _interpolated(periods, dampings, spectrum, period, damping)
    # Damping, and radius
    exponentials(out[1], integers)
    exponentials(out[2], integers)
    for node in range(normal.shape[1]):
        out[1, node] = min(building[2] * out[1, node], building[4])
        out[2, node] *= building[5]


@inlined
def _interpolated(periods, dampings, spectrum, period, damping):
    """Return a stored logarithm, bilinear within the grid and that of the edge beyond it."""
    column, along = _cell(periods, period)
    plane, across = _cell(dampings, damping)
    right, above = min(column + 1, periods.size - 1), min(plane + 1, dampings.size - 1)
    # Along the period at both dampings, then from one to the other
    lower = (1.0 - along) * spectrum[plane, column] + along * spectrum[plane, right]
    upper = (1.0 - along) * spectrum[above, column] + along * spectrum[above, right]
    return (1.0 - across) * lower + across * upper


@inlined
def _cell(grid, point):
    """Return the cell of a grid that holds a point, and the share of the way through it, 0 to 1."""
    last = grid.size - 2
    if last < 0:
        return 0, 0.0
    # where it is on an even grid, then on to where it is
    share = (point - grid[0]) / (grid[last + 1] - grid[0])
    cell = int(min(share, 1.0) * last) if share > 0.0 else 0
    while cell < last and grid[cell + 1] < point:
        cell += 1
    while cell > 0 and grid[cell] > point:
        cell -= 1
    share = (point - grid[cell]) / (grid[cell + 1] - grid[cell])
    return cell, min(max(share, 0.0), 1.0)


@inlined
def _relative_motion(work, node, shift, motion):
    """Fill the motion at one node."""
    damping_1, radius_1 = work[1, node], work[2, node]
    damping_2, radius_2 = work[4, node], work[5, node]
    root = work[7, node]
    ratio = root * root
    # eq. (16), numerator and denominator divided by the square of the ratio of the periods
    product, detuning = damping_1 * damping_2, ratio - 1.0 / ratio
    above = 8.0 * math.sqrt(product) * (damping_2 * root + damping_1 / root)
    below = detuning * detuning + 4.0 * product * (ratio + 1.0 / ratio)
    below += 4.0 * (damping_1 * damping_1 + damping_2 * damping_2)
    by_noise = min(above / below, 1.0) if below > 0.0 else 1.0
    # critical gap, and the relative velocity as the gap of the velocities
    correlation = min(max(by_noise + shift, -1.0), 1.0)
    # Speeds of both oscillators at their frequencies
    frequency = 2.0 * math.pi * work[6, node]
    speed_1, speed_2 = frequency * radius_1, frequency * ratio * radius_2
    motion[DEMAND, node] = _difference(radius_1, radius_2, correlation)
    motion[VELOCITY, node] = _difference(speed_1, speed_2, correlation)
    motion[SPEED_1, node], motion[SPEED_2, node] = speed_1, speed_2
    motion[CORRELATION, node] = by_noise


@inlined
def _difference(first, second, correlation):
    """Return eq. (15), 0 where two equal motions leave the round-off of their difference."""
    apart = first - second
    difference = math.sqrt(apart * apart + 2.0 * (1.0 - correlation) * first * second)
    return difference if difference > ROUND_OFF * (first + second) else 0.0
