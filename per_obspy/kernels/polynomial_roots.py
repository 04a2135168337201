"""
First root of a polynomial, found so that no earlier root can be passed.

A polynomial is a stretch of a table's line: its coefficients, lowest first, start at a column.
(Passing views instead costs more in reference counts than the arithmetic.)
"""

import math

from per_obspy.kernels._jit import lean

#: A polynomial below this share of its own terms is zero.
ROUNDING = 1e-15
#: Where value and slope both vanish, a search goes on by this share of its interval.
LEAST_ADVANCE = 1e-7


@lean
def value_and_slope(table, line, column, terms, time):
    """Return the polynomial and its derivative at a time, by Horner's rule."""
    value = slope = 0.0
    for n in range(terms - 1, -1, -1):
        slope = slope * time + value
        value = value * time + table[line, column + n]
    return value, slope


@lean
def size_and_curvature(table, line, column, terms, end):
    """Return bounds on [0, end] of a polynomial less its constant and of its second derivative."""
    size = curvature = 0.0
    power = 1.0  # end**(n - 2)
    if terms > 1:
        size = abs(table[line, column + 1]) * end
    for n in range(2, terms):
        term = abs(table[line, column + n]) * power
        size += term * end * end
        curvature += n * (n - 1) * term
        power *= end
    return size, curvature


@lean
def first_fall(table, line, column, terms, sign, start, end, rounding):
    """
    Return the first time in [start, end] at which ``sign * polynomial`` falls to zero, else -1.

    With K >= -p'' the step ``2 p / (c + sqrt(c² + 2 K p))``, c = -p', never passes a root, and ends
    like Newton's. A start at zero that rises is not a fall: the same step, written for c < 0,
    leaves it by 2 p' / K at least.
    """
    size, curvature = size_and_curvature(table, line, column, terms, end)
    return fall_within(table, line, column, terms, sign, start, end, rounding, size, curvature)


@lean
def fall_within(table, line, column, terms, sign, start, end, rounding, size, curvature):
    """Return the result of ``first_fall`` from given bounds of ``size_and_curvature``."""
    # Too far from zero to fall to it anywhere
    if sign * table[line, column] > size + rounding:
        return -1.0
    if terms > 2:  # the second coefficient's share in the bound has a sign
        curvature -= 2.0 * (abs(table[line, column + 2]) + sign * table[line, column + 2])
    tolerance = rounding + ROUNDING * (abs(table[line, column]) + size)
    time = start
    while True:
        value, slope = value_and_slope(table, line, column, terms, time)
        value, closing = sign * value, -sign * slope
        if value <= tolerance and closing > 0.0:
            return time
        step = safe_step(max(value, 0.0), closing, curvature)
        # A start at zero that rises: leave it
        if value <= tolerance:
            step = max(step, LEAST_ADVANCE * end)
            if step == 0.0:  # the end of the interval
                return -1.0
        elif time + step == time:
            return time
        time += step
        if not time <= end:
            return -1.0


@lean
def safe_step(value, closing, curvature):
    """
    Return a step within which a function has no root.

    It is known by its value, its closing speed and its largest downward curvature.
    """
    squared = closing * closing + 2.0 * curvature * value
    if squared < 0.0:
        return math.inf
    root = math.sqrt(squared)
    if closing > 0.0:
        return 2.0 * value / (closing + root)
    return (root - closing) / curvature if curvature > 0.0 else math.inf


@lean
def is_last_root(table, line, column, terms, time, end):
    """Return whether a polynomial cannot turn between a root and the end of the interval."""
    _, curvature = size_and_curvature(table, line, column, terms, end)
    _, slope = value_and_slope(table, line, column, terms, time)
    return abs(slope) > curvature * (end - time)
