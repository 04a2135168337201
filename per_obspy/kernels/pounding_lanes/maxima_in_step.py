"""
One structure through the steps of a tile: its states at the samples, and its maxima inside steps, exactly.

The steps are those of ``pounding_lanes``; the numbers of a lane are copied to one line, ``pair``,
row for row. A state is displacement, speed and acceleration, all as displacements. Where a maximum
may be passed between two states the peak is found on the exact solution, a short Taylor polynomial
over the share of a step.
"""

import math

from per_obspy.kernels._jit import inlined, lean
from per_obspy.kernels.polynomial_roots import first_fall, is_last_root, value_and_slope
from per_obspy.kernels.pounding_events.motion import (
    CURVE,
    GUARD,
    HIGHEST,
    TERMS,
    WIDEST,
    fill_taylor,
)
from per_obspy.kernels.pounding_events.next_event import fill_power, fill_velocity
from per_obspy.kernels.pounding_lanes.lanes import (
    ANGLE,
    CENTRE,
    COSINE,
    LIMIT,
    PLACE_SAG,
    POWER_SAG,
    PULL,
    SIDE,
    SINE,
    SPEED_SAG,
    STEP_PLACE,
    STEP_SPEED,
    STRUCTURE_ROWS,
)


@inlined
def _form(pair, row, place, speed, here, there):
    """Return what one step makes of place or speed."""
    form = pair[row + 2] * here + (pair[row + 3] * there + pair[row + 4])
    return pair[row] * place + (pair[row + 1] * speed + form)


@inlined
def along(pair, ground, k):
    """Return the ground acceleration along a pair at a sample of the tile."""
    return pair[COSINE] * ground[0, k] + pair[SINE] * ground[1, k]


@inlined
def state(pair, first, place, speed, ground):
    """Return displacement, speed and acceleration of a structure."""
    form = pair[first + PULL + 2] * ground + pair[first + PULL + 3]
    return place, speed, pair[first + PULL] * place + (pair[first + PULL + 1] * speed + form)


@inlined
def step(pair, first, before, here, there):
    """Return the state of a structure after a step."""
    place = _form(pair, first + STEP_PLACE, before[0], before[1], here, there)
    speed = _form(pair, first + STEP_SPEED, before[0], before[1], here, there)
    return state(pair, first, place, speed, there)


@inlined
def may_yield(pair, first, start, end):
    """Tell whether a bilinear structure may yield or unload inside a step or a part of it, between two states."""
    (u0, z0, y0), (u1, z1, y1) = start, end
    strength, side, centre = max(abs(y0), abs(y1)), pair[first + SIDE], pair[first + CENTRE]
    if side != 0.0:
        return min(side * z0, side * z1) < pair[first + SPEED_SAG] * strength
    return (
        max(abs(u0 - centre), abs(u1 - centre)) + pair[first + PLACE_SAG] * strength
        > pair[first + LIMIT]
    )


@inlined
def may_rise(pair, row, i, start, end):
    """
    Raise the maxima of structure i to two states, and tell whether it may pass them in the step or less between.

    The radius grows with the angle by the power p = u'' + omega² u at most, which in a step is
    within its chord and its sag: by ``growth`` from a root to the nearer end. And its square by
    growth (2 r + growth), with r below |u| + |z|.
    """
    first = i * STRUCTURE_ROWS
    (u0, z0, y0), (u1, z1, y1) = start, end
    strength = max(abs(y0), abs(y1))
    growth = (
        0.125
        * pair[first + ANGLE]
        * (abs((u1 + y1) - (u0 + y0)) + 8.0 * pair[first + POWER_SAG] * strength)
    )
    reach, radius = max(abs(u0), abs(u1)), max(u0 * u0 + z0 * z0, u1 * u1 + z1 * z1)
    highest, widest = max(row[i, HIGHEST], reach), max(row[i, WIDEST], radius)
    row[i, HIGHEST], row[i, WIDEST] = highest, widest
    longest = 2.0 * max(abs(u0) + abs(z0), abs(u1) + abs(z1))
    further = reach + pair[first + PLACE_SAG] * strength > highest
    return further | (radius + growth * (longest + growth) > widest)


@lean
def raise_inside(pair, row, i, start, end, change, share):
    """
    Raise the maxima of structure i to those between two states: at roots of its speed or of its power.

    They are this share of a step apart, over all of which the ground changes by so much.
    """
    (u0, z0, y0), (u1, z1, y1) = start, end
    first, strength, terms = i * STRUCTURE_ROWS, max(abs(y0), abs(y1)), int(row[0, TERMS])
    angle = pair[first + ANGLE]
    turns = abs(z0 + z1) <= abs(z1 - z0) + 2.0 * pair[first + SPEED_SAG] * strength
    turns &= max(abs(u0), abs(u1)) + pair[first + PLACE_SAG] * strength > row[i, HIGHEST]
    bend, sag = abs((u1 + y1) - (u0 + y0)), pair[first + POWER_SAG] * strength
    radius = math.sqrt(max(u0 * u0 + z0 * z0, u1 * u1 + z1 * z1)) + 0.125 * angle * (
        bend + 8.0 * sag
    )
    widens = (abs(u0 + u1 + y0 + y1) <= bend + 2.0 * sag) & (radius * radius > row[i, WIDEST])
    if turns | widens:
        fill_step(pair, row, 0, first, start, change)
    if turns:
        fill_velocity(row, 0, terms)
        _raise_at_roots(row, i, terms - 1, angle, share)
    if widens:
        fill_power(row, 0, angle * angle, 0.0, terms)
        _raise_at_roots(row, i, terms - 2, angle, share)


@lean
def fill_step(pair, row, line, first, start, change):
    """Fill a line's Taylor coefficients of a displacement over the share of a step, from a state on."""
    angle = pair[first + ANGLE]
    square, speed, damping = angle * angle, angle * start[1], -angle * pair[first + PULL + 1]
    row[line, CURVE] = start[0]
    force, rate = square * start[2] + damping * speed, square * pair[first + PULL + 2] * change
    fill_taylor(
        row,
        line,
        CURVE,
        int(row[0, TERMS]),
        speed,
        damping,
        -square * pair[first + PULL],
        force,
        rate,
    )


@lean
def _raise_at_roots(row, i, guard_terms, angle, share):
    """Raise the maxima of a structure at the roots of the guard in the first line of its row, within a share."""
    value, slope = value_and_slope(row, 0, GUARD, guard_terms, 0.0)
    sign = 1.0 if value > 0.0 or (value == 0.0 and slope > 0.0) else -1.0
    time = first_fall(row, 0, GUARD, guard_terms, sign, 0.0, share, 0.0)
    while time >= 0.0:
        place, speed = value_and_slope(row, 0, CURVE, int(row[0, TERMS]), time)
        speed /= angle
        row[i, HIGHEST] = max(row[i, HIGHEST], abs(place))
        row[i, WIDEST] = max(row[i, WIDEST], place * place + speed * speed)
        if is_last_root(row, 0, GUARD, guard_terms, time, share):
            return
        sign = -sign
        time = first_fall(row, 0, GUARD, guard_terms, sign, time, share, 0.0)


@lean
def search(pair, row, i, place, speed, ground, count):
    """Find the maxima of structure i in a tile in which nothing else happens, from its start on."""
    first = i * STRUCTURE_ROWS
    here = along(pair, ground, 0)
    before = state(pair, first, place, speed, here)
    for k in range(1, count + 1):
        there = along(pair, ground, k)
        after = step(pair, first, before, here, there)
        if may_rise(pair, row, i, before, after):
            raise_inside(pair, row, i, before, after, there - here, 1.0)
        before, here = after, there
