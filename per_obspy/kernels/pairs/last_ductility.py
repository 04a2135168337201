"""Interval of a scan over ductilities in which those of buildings that yield lie."""

import math

from per_obspy.kernels._jit import kernel


@kernel
def last_intervals(periods, dampings, radii, rows, buildings, scan, last):
    """
    Fill the last ductility at which the displacement of each equivalent building exceeds it.

    Parameters
    ----------
    periods, dampings : (n_periods,), (n_dampings,) ndarray
        Logarithms of the stored periods (s) and dampings (fractions of critical), rising.
    radii : (n_rows, n_dampings, n_periods) ndarray
        Logarithms of the stored displacements (m).
    rows : (n,) ndarray of int
        Row of each building in the stored displacements.
    buildings : (3, n) ndarray
        Logarithm of the period (s), damping (fraction of critical), and logarithm of the elastic
        ductility over the stored displacement (1/m).
    scan : (3, n_ductilities) ndarray
        Logarithm of the ductility, logarithm of the factor of the period and damping to add.
    last : (n,) ndarray of int
        Receives the number of the ductility: the first where there is none, never the last.
    """
    for index in range(rows.size):
        stored = radii[rows[index]]
        log_period, damping, level = buildings[:, index]
        column, plane = periods.size - 1, dampings.size - 1
        # Downwards, so that the places in both grids only fall
        number = scan.shape[1] - 2
        while number > 0:
            column, along = _place(periods, column, log_period + scan[1, number])
            plane, up = _place(dampings, plane, math.log(damping + scan[2, number]))
            right, above = min(column + 1, periods.size - 1), min(plane + 1, dampings.size - 1)
            # Stored displacement, linear in both logarithms
            lower = (1.0 - along) * stored[plane, column] + along * stored[plane, right]
            upper = (1.0 - along) * stored[above, column] + along * stored[above, right]
            if level + (1.0 - up) * lower + up * upper > scan[0, number]:
                break
            number -= 1
        last[index] = number


@kernel
def _place(grid, start, point):
    """Return the grid point below or, before the grid, its first, and the fraction to the next."""
    lower = start
    while lower > 0 and grid[lower] >= point:
        lower -= 1
    if lower == grid.size - 1:
        return lower, 0.0
    return lower, min(max((point - grid[lower]) / (grid[lower + 1] - grid[lower]), 0.0), 1.0)
