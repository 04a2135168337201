"""
Two linear structures with an element between them whose force is piecewise linear, exact between samples.

In each of its phases the element pulls the structures together with ``F = k z + c z' + f`` (z = u1
- u2), so that both displacements are Taylor polynomials again, ``pounding_motion`` with coupling. A
link is elastic or yields; a contact is open or closed, without tension.
"""

import math
from typing import NamedTuple

from per_obspy.kernels._jit import lean
from per_obspy.kernels.polynomial_roots import first_fall, value_and_slope
from per_obspy.kernels.pounding_events.motion import (
    CURVE,
    GUARD,
    MASS,
    PARTICIPATION,
    RATE,
    STIFFNESS,
    U,
    V,
)

# phases of an element
ELASTIC, PULLED, PUSHED, OPEN, CLOSED = 0, 1, -1, 2, 3
# columns of the maxima: both displacements, largest z, largest -z, largest |F|
PLACE_1, PLACE_2, CLOSING, PARTING, FORCE = 0, 1, 2, 3, 4


#: Changes of phase in one segment, above which a history is given up.
MOST_CHANGES = 1000


class Element(NamedTuple):
    """Stiffness (N/m), damping (N s/m), yield force (N), hardening; gap (m), used by contacts."""

    stiffness: float
    damping: float
    yield_force: float
    hardening: float
    gap: float


@lean
def element_form(element, phase, plastic):
    """Return k, c and f of an element in a phase; ``plastic`` is the plastic part of z."""
    if phase == OPEN:
        return 0.0, 0.0, 0.0
    if phase == CLOSED:
        return element.stiffness, element.damping, -element.stiffness * element.gap
    if element.yield_force == math.inf:
        return element.stiffness, element.damping, 0.0
    lost = (1.0 - element.hardening) * element.stiffness
    if phase == ELASTIC:
        return element.stiffness, element.damping, -lost * plastic
    soft = element.hardening * element.stiffness
    return soft, element.damping, phase * (1.0 - element.hardening) * element.yield_force


@lean
def fill_linked(row, form, acceleration, slope, terms):
    """Fill the Taylor coefficients of both displacements."""
    stiffness, damping, force = form
    force += stiffness * (row[0, U] - row[1, U])
    for i in range(2):
        row[i, CURVE], row[i, CURVE + 1] = row[i, U], row[i, V]
    for n in range(terms - 2):
        closing = row[0, CURVE + n] - row[1, CURVE + n] if n else 0.0
        rate = (n + 1) * (row[0, CURVE + n + 1] - row[1, CURVE + n + 1])
        pull = stiffness * closing + damping * rate + (force if n == 0 else 0.0)
        for i in range(2):
            own = (
                2.0 * row[i, RATE] * (n + 1) * row[i, CURVE + n + 1]
                + row[i, STIFFNESS] * row[i, CURVE + n]
            )
            ground = acceleration if n == 0 else (slope if n == 1 else 0.0)
            total = (
                own + row[i, PARTICIPATION] * ground + (pull if i == 0 else -pull) / row[i, MASS]
            )
            row[i, CURVE + n + 2] = -total / ((n + 2) * (n + 1))


@lean
def fill_force_of(row, form, terms):
    """Fill the guard of line 0 with the element's force."""
    stiffness, damping, force = form
    for n in range(terms - 1):
        closing = row[0, CURVE + n] - row[1, CURVE + n]
        rate = (n + 1) * (row[0, CURVE + n + 1] - row[1, CURVE + n + 1])
        row[0, GUARD + n] = stiffness * closing + damping * rate
    row[0, GUARD] += force


@lean
def fill_difference(row, sign, constant, terms):
    """Fill the guard of line 0 with ``constant + sign * z``."""
    for n in range(terms):
        row[0, GUARD + n] = sign * (row[0, CURVE + n] - row[1, CURVE + n])
    row[0, GUARD] += constant


@lean
def fill_rate(row, sign, terms):
    """Fill the guard of line 0 with ``sign * z'``."""
    for n in range(terms - 1):
        row[0, GUARD + n] = sign * (n + 1) * (row[0, CURVE + n + 1] - row[1, CURVE + n + 1])


@lean
def divide_by_square(row, terms):
    """Divide the guard of line 0 by t², its first two coefficients being zero but for rounding."""
    for n in range(terms - 2):
        row[0, GUARD + n] = row[0, GUARD + n + 2]
    row[0, GUARD + terms - 2] = row[0, GUARD + terms - 1] = 0.0


@lean
def next_phase(row, element, phase, left, plastic, span, terms):
    """
    Return when the element changes phase within a span (-1: not) and to which.

    ``left`` is the phase that ended at the start of the piece: if it was yielding, distance and
    rate are zero there.
    """
    limit = element.yield_force / element.stiffness if element.stiffness > 0.0 else math.inf
    if phase in (PULLED, PUSHED):
        fill_rate(row, float(phase), terms)
        return first_fall(row, 0, GUARD, terms - 1, 1.0, 0.0, span, 0.0), ELASTIC
    if phase == ELASTIC:
        earliest, to = -1.0, ELASTIC
        if limit < math.inf:
            for side in (PULLED, PUSHED):
                fill_difference(row, -float(side), limit + side * plastic, terms)
                if side == left:
                    divide_by_square(row, terms)
                time = first_fall(row, 0, GUARD, terms, 1.0, 0.0, span, 1e-15 * limit)
                if time >= 0.0:
                    earliest, to, span = time, side, time
        return earliest, to
    if phase == CLOSED:
        fill_force_of(row, element_form(element, CLOSED, 0.0), terms)
        return first_fall(row, 0, GUARD, terms - 1, 1.0, 0.0, span, 0.0), OPEN
    return _closing_time(row, element, left, span, terms), CLOSED


@lean
def _closing_time(row, element, left, span, terms):
    """Return when an open contact closes: overlap and the force it would have are both positive."""
    fill_difference(row, -1.0, element.gap, terms)
    rounding = 1e-14 * (abs(row[0, U]) + abs(row[1, U]) + element.gap)
    if row[0, GUARD] > -rounding:
        if left == CLOSED:  # the clearance is zero but for rounding
            row[0, GUARD] = max(row[0, GUARD], 0.0)
            rounding = 0.0
        return first_fall(row, 0, GUARD, terms, 1.0, 0.0, span, 0.1 * rounding)
    fill_force_of(row, element_form(element, CLOSED, 0.0), terms)
    return first_fall(row, 0, GUARD, terms - 1, -1.0, 0.0, span, 0.0)


@lean
def largest_on(row, i, column, terms, span):
    """Return the largest and the least value of a polynomial on [0, span]."""
    start, end = row[i, column], value_and_slope(row, i, column, terms, span)[0]
    low, high = min(start, end), max(start, end)
    line, rate = 1, GUARD  # room that the element does not use
    for n in range(1, terms):
        row[line, rate + n - 1] = n * row[i, column + n]
    sign = 1.0 if row[line, rate] > 0.0 else -1.0
    time = first_fall(row, line, rate, terms - 1, sign, 0.0, span, 0.0)
    while time >= 0.0:
        value = value_and_slope(row, i, column, terms, time)[0]
        low, high, sign = min(low, value), max(high, value), -sign
        time = first_fall(row, line, rate, terms - 1, sign, time, span, 0.0)
    return low, high


@lean
def raise_linked(row, form, maxima, span, terms):
    """Raise the maxima to those of a piece, exact between its ends."""
    for i in range(2):
        low, high = largest_on(row, i, CURVE, terms, span)
        maxima[PLACE_1 + i] = max(maxima[PLACE_1 + i], high, -low)
    fill_difference(row, 1.0, 0.0, terms)
    low, high = largest_on(row, 0, GUARD, terms, span)
    maxima[CLOSING], maxima[PARTING] = max(maxima[CLOSING], high), max(maxima[PARTING], -low)
    fill_force_of(row, form, terms)
    low, high = largest_on(row, 0, GUARD, terms - 1, span)
    maxima[FORCE] = max(maxima[FORCE], high, -low)


@lean
def advance_linked(row, element, phase, plastic, maxima, duration, acceleration, slope, terms):
    """Carry both structures through a segment; return the element's phase, plastic part, and whether it got through."""
    elapsed, left = 0.0, phase
    for _ in range(MOST_CHANGES):
        form = element_form(element, phase, plastic)
        fill_linked(row, form, acceleration + slope * elapsed, slope, terms)
        span = duration - elapsed
        time, to = next_phase(row, element, phase, left, plastic, span, terms)
        if time >= 0.0:
            span = time
        raise_linked(row, form, maxima, span, terms)
        for i in range(2):
            row[i, U], row[i, V] = value_and_slope(row, i, CURVE, terms, span)
        if time < 0.0:
            return phase, plastic, True
        if to == ELASTIC:
            plastic = row[0, U] - row[1, U] - phase * element.yield_force / element.stiffness
        left, phase, elapsed = phase, to, elapsed + span
    return phase, plastic, False


@lean
def run_linked(acceleration, dt, refinement, row, element, phase, terms, motion, force, maxima):
    """Fill motion (n_time, 2, 2) and force (n_time,) at the samples; tell whether the history got to its end."""
    duration, plastic = dt / refinement, 0.0
    for k in range(1, force.size):
        start = slope = 0.0
        if k < acceleration.size:
            start, slope = acceleration[k - 1], (acceleration[k] - acceleration[k - 1]) / dt
        for part in range(refinement):
            begin = start + slope * part * duration
            phase, plastic, through = advance_linked(
                row, element, phase, plastic, maxima, duration, begin, slope, terms
            )
            if not through:
                return False
        stiffness, damping, constant = element_form(element, phase, plastic)
        force[k] = (
            stiffness * (row[0, U] - row[1, U]) + damping * (row[0, V] - row[1, V]) + constant
        )
        for i in range(2):
            motion[k, i, 0], motion[k, i, 1] = row[i, U], row[i, V]
    return True
