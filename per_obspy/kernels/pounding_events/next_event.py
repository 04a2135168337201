"""
Event by event through a segment of piecewise-linear ground acceleration: hits, releases, yielding, unloading.

``find_event`` fills the Taylor polynomials of a piece and returns how long it is smooth and what
ends it; ``finish_piece`` moves the row to that instant and carries the event out.
"""

import math

from per_obspy.kernels._jit import lean
from per_obspy.kernels.polynomial_roots import (
    fall_within,
    first_fall,
    is_last_root,
    size_and_curvature,
    value_and_slope,
)
from per_obspy.kernels.pounding_events.contact import meet
from per_obspy.kernels.pounding_events.motion import (
    CURVE,
    GAP_ROUNDING,
    GUARD,
    HARDENING,
    HIGHEST,
    ORDER,
    PHASE,
    PLASTIC,
    RICHEST,
    STIFFNESS,
    STUCK,
    UNLOADING,
    WIDEST,
    YIELD,
    U,
    V,
    fill_clearance,
    fill_curves,
    fill_force,
    restoring,
)

# what ends a piece
NOTHING, HIT, RELEASE, YIELDING, REVERSAL = 0, 1, 2, 3, 4


@lean
def find_event(row, segment, elapsed):
    """Return the time to the next event of a segment or to its end, the kind, and the interface or structure."""
    slope, terms = segment.slope, segment.terms
    acceleration, span = segment.acceleration + slope * elapsed, segment.duration - elapsed
    fill_curves(row, acceleration, slope, terms)
    kind, place = NOTHING, -1
    for j in range(row.shape[0] - 1):
        if row[j, STUCK]:
            rounding = fill_force(row, j, acceleration, slope, segment.duration, terms)
            row[j, GUARD] += (
                rounding  # a force that is zero but for rounding does not open the interface
            )
            time, found = first_fall(row, j, GUARD, terms, 1.0, 0.0, span, 0.0), RELEASE
        else:
            rounding, size, curvature = fill_clearance(row, j, terms, span)
            time, found = (
                fall_within(row, j, GUARD, terms, 1.0, 0.0, span, rounding, size, curvature),
                HIT,
            )
        if time >= 0.0:
            span, kind, place = time, found, j
    for i in range(row.shape[0]):
        if row[i, YIELD] < math.inf:
            time, found = _change_of_stiffness(row, i, span, terms)
            if time >= 0.0:
                span, kind, place = time, found, i
    return span, kind, place


@lean
def _change_of_stiffness(row, i, span, terms):
    """Return when a bilinear structure starts to yield or to unload within a span (-1: not), and which."""
    side = row[i, PHASE]
    if side != 0.0:
        fill_velocity(row, i, terms)
        return first_fall(row, i, GUARD, terms - 1, side, 0.0, span, 0.0), REVERSAL
    earliest = -1.0
    for sign in (1, -1):
        order = max(0, int(sign * row[i, UNLOADING]))
        for n in range(order, terms):
            row[i, GUARD + n - order] = -sign * row[i, CURVE + n]
        rounding = 0.0
        if order == 0:
            row[i, GUARD] = row[i, YIELD] - sign * (row[i, U] - row[i, PLASTIC])
            rounding = GAP_ROUNDING * (row[i, YIELD] + abs(row[i, U]))
        time = first_fall(row, i, GUARD, terms - order, 1.0, 0.0, span, rounding)
        if time >= 0.0:
            earliest, span = time, time
    return earliest, YIELDING


@lean
def finish_piece(row, log, segment, elapsed, span, kind, place):
    """
    Move the row to the end of a piece, by then so much of the segment has elapsed, and carry out its event.

    Largest displacements and radii are raised to those of the piece, exact between its ends.
    """
    for i in range(row.shape[0]):
        u, v = value_and_slope(row, i, CURVE, segment.terms, span)
        _raise_peaks(row, i, u, v, span, segment.terms)
        row[i, U], row[i, V] = u, v
        side = row[i, PHASE]
        if side != 0.0:
            row[i, PLASTIC] = row[i, U] - side * row[i, YIELD]
        if span > 0.0:
            row[i, UNLOADING] = row[i, ORDER] = 0.0
    if kind == HIT:
        meet(row, log, segment, elapsed, place)
    elif kind == RELEASE:
        row[place, STUCK], row[place, ORDER] = 0.0, 2.0
    elif kind == YIELDING:
        row[place, PHASE] = 1.0 if row[place, U] > row[place, PLASTIC] else -1.0
    elif kind == REVERSAL:
        row[place, UNLOADING], row[place, PHASE] = 2.0 * row[place, PHASE], 0.0


@lean
def _raise_peaks(row, i, end, end_speed, span, terms):
    """Raise the peaks of a structure to those of a piece of which its row holds the start."""
    _raise_to(row, i, row[i, U], row[i, V])
    _raise_to(row, i, end, end_speed)
    if _may_exceed(row, i, end, end_speed, span, terms):
        fill_velocity(row, i, terms)
        _raise_at_roots(row, i, span, terms, terms - 1)
        fill_power(row, i, row[i, STIFFNESS], 0.0, terms)
        _raise_at_roots(row, i, span, terms, terms - 2)
        if row[i, YIELD] < math.inf:
            stiffness, constant = restoring(row, i)
            # while yielding, the elastoplastic part does not store more
            fill_power(row, i, stiffness, constant if row[i, PHASE] == 0.0 else 0.0, terms)
            _raise_at_roots(row, i, span, terms, terms - 2)


@lean
def _may_exceed(row, i, end, end_speed, span, terms):
    """
    Tell whether a structure may pass its peaks inside a piece, by the largest |u''| in it.

    A displacement leaves its chord by an eighth of span² times it at most, a speed is that of the
    nearer end but for half the span times it: together they bound the radii.
    """
    _, curvature = size_and_curvature(row, i, CURVE, terms, span)
    reach = max(abs(row[i, U]), abs(end)) + 0.125 * span * span * curvature
    speed = max(abs(row[i, V]), abs(end_speed)) + 0.5 * span * curvature
    squared = speed * speed / row[i, STIFFNESS]
    stretch = reach + abs(row[i, PLASTIC])
    if reach > row[i, HIGHEST] or reach * reach + squared > row[i, WIDEST]:
        return True
    return stretch * stretch + squared > row[i, RICHEST]


@lean
def fill_velocity(row, i, terms):
    """Fill the guard with the velocity of a structure."""
    for n in range(1, terms):
        row[i, GUARD + n - 1] = n * row[i, CURVE + n]


@lean
def fill_power(row, i, stiffness, constant, terms):
    """Fill the guard with ``u'' + stiffness u - constant``: what makes a squared radius grow, over 2 v / omega²."""
    for n in range(terms - 2):
        row[i, GUARD + n] = (n + 2) * (n + 1) * row[i, CURVE + n + 2] + stiffness * row[
            i, CURVE + n
        ]
    row[i, GUARD] -= constant


@lean
def _raise_at_roots(row, i, span, terms, guard_terms):
    """Raise the peaks of a structure at every root of the guard within a piece."""
    value, slope = value_and_slope(row, i, GUARD, guard_terms, 0.0)
    sign = 1.0 if value > 0.0 or (value == 0.0 and slope > 0.0) else -1.0
    time = first_fall(row, i, GUARD, guard_terms, sign, 0.0, span, 0.0)
    while time >= 0.0:
        _raise_at(row, i, time, terms)
        if is_last_root(row, i, GUARD, guard_terms, time, span):
            return
        sign = -sign
        time = first_fall(row, i, GUARD, guard_terms, sign, time, span, 0.0)


@lean
def _raise_at(row, i, time, terms):
    """Raise the peaks of a structure to the state at a time of the piece."""
    u, v = value_and_slope(row, i, CURVE, terms, time)
    _raise_to(row, i, u, v)


@lean
def _raise_to(row, i, u, v):
    """Raise the peaks of a structure to a state."""
    speed = v * v / row[i, STIFFNESS]
    row[i, HIGHEST] = max(row[i, HIGHEST], abs(u))
    row[i, WIDEST] = max(row[i, WIDEST], u * u + speed)
    limit, hardening = row[i, YIELD], row[i, HARDENING]
    if limit < math.inf:
        stretch = limit if row[i, PHASE] != 0.0 else u - row[i, PLASTIC]
        row[i, RICHEST] = max(
            row[i, RICHEST], hardening * u * u + (1 - hardening) * stretch**2 + speed
        )
    else:
        row[i, RICHEST] = row[i, WIDEST]
