"""
Largest displacement and radius of one structure inside the steps of a tile in which nothing else happens, exactly.

The steps are those of ``pounding_lanes``; the numbers of a lane are copied to one line, ``pair``, row for row. Where a
maximum may be passed between the samples the peak is found on the exact solution, a short Taylor polynomial.
"""

import math

from ._jit import lean
from .polynomial_roots import first_fall, is_last_root, value_and_slope
from .pounding_events import fill_power, fill_velocity
from .pounding_lanes import (
    ANGLE,
    COSINE,
    HIGH,
    LOW,
    PLACE_SAG,
    POWER_SAG,
    PULL,
    SINE,
    SPEED_SAG,
    START_PLACE,
    START_SPEED,
    STEP_PLACE,
    STEP_SPEED,
    STRUCTURE_ROWS,
    WIDE,
)
from .pounding_motion import CURVE, GUARD, HIGHEST, TERMS, WIDEST, fill_taylor


@lean
def _form(pair, row, place, speed, here, there):
    """Return what one step makes of place or speed."""
    form = pair[row + 2] * here + (pair[row + 3] * there + pair[row + 4])
    return pair[row] * place + (pair[row + 1] * speed + form)


@lean
def along(pair, ground, k):
    """Return the ground acceleration along a pair at a sample of the tile."""
    return pair[COSINE] * ground[0, k] + pair[SINE] * ground[1, k]


@lean
def pull(pair, first, place, speed, ground):
    """Return the acceleration of a structure over omega²."""
    form = pair[first + PULL + 2] * ground + pair[first + PULL + 3]
    return pair[first + PULL] * place + (pair[first + PULL + 1] * speed + form)


@lean
def step(pair, first, place, speed, here, there):
    """Return displacement, speed and acceleration of a structure after a step."""
    after = _form(pair, first + STEP_PLACE, place, speed, here, there)
    speed = _form(pair, first + STEP_SPEED, place, speed, here, there)
    return after, speed, pull(pair, first, after, speed, there)


@lean
def may_rise(pair, row, i, u0, z0, y0, u1, z1, y1, strength):
    """
    Raise the maxima of structure i to a step's end, and tell whether it may pass them inside.

    The radius grows with the angle by the power p = u'' + omega² u at most, which inside the step is within its chord
    and its sag: by ``growth`` from a root to the nearer end. And (r + e)² <= 33/32 r² + 33 e².
    """
    first = i * STRUCTURE_ROWS
    growth = 0.125 * pair[first + ANGLE] * (abs((u1 + y1) - (u0 + y0)) + 8.0 * pair[first + POWER_SAG] * strength)
    reach, radius = max(abs(u0), abs(u1)), max(u0 * u0 + z0 * z0, u1 * u1 + z1 * z1)
    highest, widest = max(row[i, HIGHEST], reach), max(row[i, WIDEST], radius)
    row[i, HIGHEST], row[i, WIDEST] = highest, widest
    further = reach + pair[first + PLACE_SAG] * strength > highest
    return further | (1.03125 * radius + 33.0 * growth * growth > widest)


@lean
def raise_step(pair, row, i, u0, z0, y0, u1, z1, y1, here, there):
    """Raise the maxima of structure i to those inside a step: at roots of its speed or of its power."""
    first, strength = i * STRUCTURE_ROWS, max(abs(y0), abs(y1))
    turns = abs(z0 + z1) <= abs(z1 - z0) + 2.0 * pair[first + SPEED_SAG] * strength
    turns &= max(abs(u0), abs(u1)) + pair[first + PLACE_SAG] * strength > row[i, HIGHEST]
    change, sag = abs((u1 + y1) - (u0 + y0)), pair[first + POWER_SAG] * strength
    radius = math.sqrt(max(u0 * u0 + z0 * z0, u1 * u1 + z1 * z1))
    radius += 0.125 * pair[first + ANGLE] * (change + 8.0 * sag)
    widens = abs(u0 + u1 + y0 + y1) <= change + 2.0 * sag
    widens &= radius * radius > row[i, WIDEST]
    if turns or widens:
        _raise_inside(pair, row, i, u0, z0, y0, here, there, turns, widens)


@lean
def _raise_inside(pair, row, i, place, speed, acceleration, here, there, turns, widens):
    """Raise the maxima of structure i at the roots of its speed or of its power inside a step."""
    first, terms, angle = i * STRUCTURE_ROWS, int(row[0, TERMS]), pair[i * STRUCTURE_ROWS + ANGLE]
    stiffness, damping = -pair[first + PULL], -pair[first + PULL + 1]
    rate = pair[first + PULL + 2] * (there - here) / angle
    row[0, CURVE] = place
    fill_taylor(row, 0, CURVE, terms, speed, damping, stiffness, acceleration + damping * speed, rate)
    if turns:
        fill_velocity(row, 0, terms)
        _raise_at_roots(row, i, terms - 1, angle)
    if widens:
        fill_power(row, 0, 1.0, 0.0, terms)
        _raise_at_roots(row, i, terms - 2, angle)


@lean
def _raise_at_roots(row, i, guard_terms, angle):
    """Raise the maxima of a structure at the roots of the guard in the first line of its row, within an angle."""
    value, slope = value_and_slope(row, 0, GUARD, guard_terms, 0.0)
    sign = 1.0 if value > 0.0 or (value == 0.0 and slope > 0.0) else -1.0
    time = first_fall(row, 0, GUARD, guard_terms, sign, 0.0, angle, 0.0)
    while time >= 0.0:
        place, speed = value_and_slope(row, 0, CURVE, int(row[0, TERMS]), time)
        row[i, HIGHEST] = max(row[i, HIGHEST], abs(place))
        row[i, WIDEST] = max(row[i, WIDEST], place * place + speed * speed)
        if is_last_root(row, 0, GUARD, guard_terms, time, angle):
            return
        sign = -sign
        time = first_fall(row, 0, GUARD, guard_terms, sign, time, angle, 0.0)


@lean
def search(pair, row, i, ground, count):
    """Find the maxima of structure i in a tile in which nothing else happens, from those at the samples on."""
    first = i * STRUCTURE_ROWS
    row[i, HIGHEST] = max(row[i, HIGHEST], pair[first + HIGH], -pair[first + LOW])
    row[i, WIDEST] = max(row[i, WIDEST], pair[first + WIDE])
    u0, z0 = pair[first + START_PLACE], pair[first + START_SPEED]
    here = along(pair, ground, 0)
    y0 = pull(pair, first, u0, z0, here)
    for k in range(1, count + 1):
        there = along(pair, ground, k)
        u1, z1, y1 = step(pair, first, u0, z0, here, there)
        if may_rise(pair, row, i, u0, z0, y0, u1, z1, y1, max(abs(y0), abs(y1))):
            raise_step(pair, row, i, u0, z0, y0, u1, z1, y1, here, there)
        u0, z0, y0, here = u1, z1, y1, there
