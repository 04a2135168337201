"""
Event by event through a segment of piecewise-linear ground acceleration: hits, releases, yielding, unloading.

``find_event`` fills the Taylor polynomials of a piece and returns how long it is smooth and what ends it;
``finish_piece`` moves the row to that instant and carries the event out.
"""

import math

from ._jit import kernel
from .polynomial_roots import first_fall, size_and_curvature, value_and_slope
from .pounding_contact import meet
from .pounding_motion import (
    HARDENING,
    PLASTIC,
    STIFFNESS,
    YIELD,
    U,
    V,
    fill_clearance,
    fill_curves,
    fill_force,
    restoring,
)

# what ends a piece
NOTHING, HIT, RELEASE, YIELDING, UNLOADING = 0, 1, 2, 3, 4
# columns of Tally.peaks
DISPLACEMENT, RADIUS, ENERGY_RADIUS = 0, 1, 2


@kernel
def find_event(row, segment, elapsed):
    """Return the time to the next event of a segment or to its end, the kind, and the interface or structure."""
    slope, terms = segment.slope, segment.terms
    acceleration, span = segment.acceleration + slope * elapsed, segment.duration - elapsed
    fill_curves(row, acceleration, slope, terms)
    kind, place = NOTHING, -1
    for j in range(row.stuck.size):
        if row.stuck[j]:
            rounding = fill_force(row, j, acceleration, slope, segment.duration, terms)
            row.guard[0] += rounding  # a force that is zero but for rounding does not open the interface
            time, found = first_fall(row.guard, terms, 1.0, 0.0, span, 0.0), RELEASE
        else:
            rounding = fill_clearance(row, j, terms)
            time, found = first_fall(row.guard, terms, 1.0, 0.0, span, rounding), HIT
        if time >= 0.0:
            span, kind, place = time, found, j
    for i in range(row.phase.size):
        if row.structures[i, YIELD] < math.inf:
            time, found = _change_of_stiffness(row, i, span, terms)
            if time >= 0.0:
                span, kind, place = time, found, i
    return span, kind, place


@kernel
def _change_of_stiffness(row, i, span, terms):
    """Return when a bilinear structure starts to yield or to unload within a span (-1: not), and which."""
    guard, curve, side = row.guard, row.curve[i], row.phase[i]
    if side != 0:
        for n in range(1, terms):
            guard[n - 1] = n * curve[n]
        return first_fall(guard, terms - 1, float(side), 0.0, span, 0.0), UNLOADING
    earliest = -1.0
    for sign in (1, -1):
        order = sign * row.unloading[i]
        if order <= 0:
            order = 0
        for n in range(order, terms):
            guard[n - order] = -sign * curve[n]
        rounding = 0.0
        if order == 0:
            guard[0] = row.structures[i, YIELD] - sign * (curve[0] - row.state[i, PLASTIC])
            rounding = 1e-15 * (row.structures[i, YIELD] + abs(curve[0]))
        time = first_fall(guard, terms - order, 1.0, 0.0, span, rounding)
        if time >= 0.0:
            earliest, span = time, time
    return earliest, YIELDING


@kernel
def finish_piece(row, tally, rules, segment, elapsed, span, kind, place):
    """Move the row to the end of a piece, by then so much of the segment has elapsed, and carry out its event."""
    terms = segment.terms
    for i in range(row.phase.size):
        row.state[i, U], row.state[i, V] = value_and_slope(row.curve[i], terms, span)
        side = row.phase[i]
        if side != 0:
            row.state[i, PLASTIC] = row.state[i, U] - side * row.structures[i, YIELD]
        if span > 0.0:
            row.unloading[i] = 0
    if span > 0.0:
        row.order[:] = 0
    if kind == HIT:
        meet(row, tally, rules, segment, elapsed, place)
    elif kind == RELEASE:
        row.stuck[place], row.order[place] = False, 2
    elif kind == YIELDING:
        row.phase[place] = 1 if row.state[place, U] > row.state[place, PLASTIC] else -1
    elif kind == UNLOADING:
        row.unloading[place], row.phase[place] = 2 * row.phase[place], 0


@kernel
def raise_peaks(row, tally, span, terms):
    """Raise the largest displacement and the largest radii to those of a piece, exact between its ends."""
    for i in range(row.phase.size):
        _raise_at(row, tally, i, 0.0, terms)
        _raise_at(row, tally, i, span, terms)
        if _may_exceed(row, tally, i, span, terms):
            _fill_velocity(row, i, terms)
            _raise_at_roots(row, tally, i, span, terms, terms - 1)
            _fill_power(row, i, row.structures[i, STIFFNESS], 0.0, terms)
            _raise_at_roots(row, tally, i, span, terms, terms - 2)
            if row.structures[i, YIELD] < math.inf:
                stiffness, constant = restoring(row.structures, row.state, row.phase, i)
                # while yielding, the elastoplastic part does not store more
                _fill_power(row, i, stiffness, constant if row.phase[i] == 0 else 0.0, terms)
                _raise_at_roots(row, tally, i, span, terms, terms - 2)


@kernel
def _may_exceed(row, tally, i, span, terms):
    """Tell whether a bound on displacement and velocity of a piece is above what was reached before."""
    curve, peaks = row.curve[i], tally.peaks[i]
    reach, _ = size_and_curvature(curve, terms, span)
    reach += abs(curve[0])
    _fill_velocity(row, i, terms)
    speed, _ = size_and_curvature(row.guard, terms - 1, span)
    squared = (speed + abs(row.guard[0])) ** 2 / row.structures[i, STIFFNESS]
    stretch = reach + abs(row.state[i, PLASTIC])
    if reach > peaks[DISPLACEMENT] or reach**2 + squared > peaks[RADIUS]:
        return True
    return stretch**2 + squared > peaks[ENERGY_RADIUS]


@kernel
def _fill_velocity(row, i, terms):
    """Fill the guard with the velocity of a structure."""
    for n in range(1, terms):
        row.guard[n - 1] = n * row.curve[i, n]


@kernel
def _fill_power(row, i, stiffness, constant, terms):
    """Fill the guard with ``u'' + stiffness u - constant``: what makes a squared radius grow, over 2 v / omega²."""
    guard, curve = row.guard, row.curve[i]
    for n in range(terms - 2):
        guard[n] = (n + 2) * (n + 1) * curve[n + 2] + stiffness * curve[n]
    guard[0] -= constant


@kernel
def _raise_at_roots(row, tally, i, span, terms, guard_terms):
    """Raise the peaks of a structure at every root of the guard within a piece."""
    value, slope = value_and_slope(row.guard, guard_terms, 0.0)
    sign = 1.0 if value > 0.0 or (value == 0.0 and slope > 0.0) else -1.0
    time = first_fall(row.guard, guard_terms, sign, 0.0, span, 0.0)
    while time >= 0.0:
        _raise_at(row, tally, i, time, terms)
        sign = -sign
        time = first_fall(row.guard, guard_terms, sign, time, span, 0.0)


@kernel
def _raise_at(row, tally, i, time, terms):
    """Raise the peaks of a structure to the state at a time of the piece."""
    u, v = value_and_slope(row.curve[i], terms, time)
    peaks, stiffness = tally.peaks[i], row.structures[i, STIFFNESS]
    speed = v * v / stiffness
    peaks[DISPLACEMENT] = max(peaks[DISPLACEMENT], abs(u))
    peaks[RADIUS] = max(peaks[RADIUS], u * u + speed)
    limit, hardening = row.structures[i, YIELD], row.structures[i, HARDENING]
    if limit < math.inf:
        stretch = limit if row.phase[i] != 0 else u - row.state[i, PLASTIC]
        peaks[ENERGY_RADIUS] = max(peaks[ENERGY_RADIUS], hardening * u * u + (1 - hardening) * stretch**2 + speed)
    else:
        peaks[ENERGY_RADIUS] = peaks[RADIUS]
