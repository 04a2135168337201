"""
Largest displacement of a structure inside a step in which it turns once, on the exact solution.

A state is displacement, velocity over omega and acceleration over omega² (m); times are shares of
a step.
"""

import math

from per_obspy.kernels._jit import inlined, lean
from per_obspy.kernels.pounding_lanes.free_impacts import acceleration_rate, state_inside_step
from per_obspy.kernels.pounding_lanes.lanes import ACCELERATION_ERROR, ANGLE, STRUCTURE_ROWS

#: Share of a step over which a cubic has the largest displacement but for rounding.
NEAR = 3e-4
#: Estimates of the time of a turning point, above which it is left to the polynomials.
MOST_ESTIMATES = 4
#: Of the third Taylor coefficient.
SIXTH = 1.0 / 6.0


@inlined
def _accelerates_one_way(pair, first, start, end):
    """Return whether the acceleration has one sign between two states, by the bound of its rest."""
    bend = pair[first + ACCELERATION_ERROR] * max(abs(start[2]), abs(end[2]))
    return (min(start[2], end[2]) > bend) | (max(start[2], end[2]) < -bend)


@inlined
def _first_estimate(angle, start, end, rate, share):
    """
    Return where a velocity is zero, by the cubic with its first two rates and both ends.

    One step of Newton with curvature, from the chord.
    """
    slope = angle * start[2]
    bend = 0.5 * angle * rate
    chord = (end[1] - start[1]) / share
    twist = (chord - slope - share * bend) / (share * share)
    time = -start[1] / chord
    # value, rate and half the second rate there
    here = start[1] + time * (slope + time * (bend + time * twist))
    inverse = 1.0 / (slope + time * (2.0 * bend + time * 3.0 * twist))
    step = -here * inverse
    better = time + step - step * step * (bend + 3.0 * time * twist) * inverse
    return better if 0.0 < better < share else time


@lean
def turning_point(pair, row, i, start, end, change, share):
    """
    Return the displacement at which structure i turns between two states.

    Parameters
    ----------
    pair : (LANE_ROWS,) ndarray
        Numbers of its lane; see `lanes` for its rows.
    row : (n_structures, ROW_COLUMNS) ndarray
        Its row of structures; see `motion` for its columns.
    i : int
        Number of the structure.
    start, end : tuple of float
        Both states.
    change : float
        Change of the ground acceleration over a complete step, m/s².
    share : float
        Time between both states, as a share of the step.

    Returns
    -------
    float
        The displacement, m; that at the start where the structure certainly does not turn; NaN
        where neither is certain.
    """
    first = i * STRUCTURE_ROWS
    if not _accelerates_one_way(pair, first, start, end):
        return math.nan
    # the velocity rises or falls all through: its signs at the ends decide
    if start[1] * end[1] >= 0.0:
        return start[0]
    angle = pair[first + ANGLE]
    rate = acceleration_rate(pair, first, start, change)
    time = _first_estimate(angle, start, end, rate, share)
    for _ in range(MOST_ESTIMATES):
        # state at the estimate, and Newton's step with curvature from there
        u, z, y = state_inside_step(pair, row, i, start, change, time)
        rate = acceleration_rate(pair, first, (u, z, y), change)
        step = -z / (angle * y)
        step -= 0.5 * step * step * rate / y
        time += step
        if abs(step) <= NEAR:
            return u + angle * step * (z + angle * step * (0.5 * y + SIXTH * step * rate))
    return math.nan
