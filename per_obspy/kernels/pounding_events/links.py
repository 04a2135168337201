"""
Two linear structures with an element between them: exact motion between samples.

The force of the element is piecewise linear. In each of its phases it pulls the structures together
with ``F = k z + c z' + f`` (``z = u1 - u2``), so that both displacements are Taylor polynomials
again, as in ``motion`` but coupled. A link is elastic or yields; a contact is open or closed,
without tension.

The row of structures has the columns of ``motion``; the event functions of the element are in line
0.
"""

import math
from typing import NamedTuple

from per_obspy.kernels._jit import lean
from per_obspy.kernels.polynomial_roots import first_fall, value_and_slope
from per_obspy.kernels.pounding_events.motion import (
    DAMPING_RATE,
    EVENT_FUNCTION,
    MASS,
    PARTICIPATION,
    STIFFNESS,
    TAYLOR,
    U,
    V,
)

# phases of an element
ELASTIC, PULLED, PUSHED, OPEN, CLOSED = 0, 1, -1, 2, 3
# columns of the maxima
#: largest displacement of structure 1, then of structure 2 (m)
MAXIMUM_DISPLACEMENT = 0
#: largest z and largest -z (m)
MAXIMUM_CLOSING, MAXIMUM_PARTING = 2, 3
#: largest size of the element's force (N)
MAXIMUM_FORCE = 4

#: Changes of phase in one segment, above which a history is given up.
MOST_PHASE_CHANGES = 1000


class Element(NamedTuple):
    """
    Properties of the element between two structures.

    Attributes
    ----------
    stiffness : float
        Of its spring, N/m.
    damping : float
        Of its dashpot, N s/m.
    yield_force : float
        Of its spring, N; infinite for an elastic one.
    hardening : float
        Stiffness after yielding over that before, dimensionless.
    gap : float
        Clear distance at rest, m; used by contacts.
    """

    stiffness: float
    damping: float
    yield_force: float
    hardening: float
    gap: float


@lean
def element_force(element, phase, plastic):
    """Return k, c and f of the element in a phase; ``plastic`` is the plastic part of z."""
    # contact
    if phase == OPEN:
        return 0.0, 0.0, 0.0
    if phase == CLOSED:
        return element.stiffness, element.damping, -element.stiffness * element.gap
    # link
    if element.yield_force == math.inf:
        return element.stiffness, element.damping, 0.0
    elastoplastic = (1.0 - element.hardening) * element.stiffness
    if phase == ELASTIC:
        return element.stiffness, element.damping, -elastoplastic * plastic
    yielded = element.hardening * element.stiffness
    return yielded, element.damping, phase * (1.0 - element.hardening) * element.yield_force


@lean
def fill_coupled_displacements(row, force, acceleration, slope, terms):
    """Fill the Taylor coefficients of both displacements; ``force`` is the element's k, c and f."""
    stiffness, damping, constant = force
    # force of the spring at the start of the piece
    constant += stiffness * (row[0, U] - row[1, U])
    for i in range(2):
        row[i, TAYLOR] = row[i, U]
        row[i, TAYLOR + 1] = row[i, V]
    # coefficient n + 2 from the equation of motion of order n
    for n in range(terms - 2):
        # force of the element, from coefficients of z and z'
        closing = row[0, TAYLOR + n] - row[1, TAYLOR + n] if n else 0.0
        rate = (n + 1) * (row[0, TAYLOR + n + 1] - row[1, TAYLOR + n + 1])
        pull = stiffness * closing + damping * rate + (constant if n == 0 else 0.0)
        # ground acceleration, linear in time
        ground = acceleration if n == 0 else (slope if n == 1 else 0.0)
        for i in range(2):
            dashpot = 2.0 * row[i, DAMPING_RATE] * (n + 1) * row[i, TAYLOR + n + 1]
            restoring = dashpot + row[i, STIFFNESS] * row[i, TAYLOR + n]
            drive = row[i, PARTICIPATION] * ground
            total = restoring + drive + (pull if i == 0 else -pull) / row[i, MASS]
            row[i, TAYLOR + n + 2] = -total / ((n + 2) * (n + 1))


@lean
def fill_element_force(row, force, terms):
    """Fill the event function with the element's force; ``force`` is k, c and f."""
    stiffness, damping, constant = force
    # k z + c z', coefficient by coefficient
    for n in range(terms - 1):
        closing = row[0, TAYLOR + n] - row[1, TAYLOR + n]
        rate = (n + 1) * (row[0, TAYLOR + n + 1] - row[1, TAYLOR + n + 1])
        row[0, EVENT_FUNCTION + n] = stiffness * closing + damping * rate
    row[0, EVENT_FUNCTION] += constant


@lean
def fill_distance(row, sign, constant, terms):
    """Fill the event function with ``constant + sign * z``."""
    for n in range(terms):
        row[0, EVENT_FUNCTION + n] = sign * (row[0, TAYLOR + n] - row[1, TAYLOR + n])
    row[0, EVENT_FUNCTION] += constant


@lean
def fill_closing_rate(row, sign, terms):
    """Fill the event function with ``sign * z'``."""
    for n in range(terms - 1):
        closing = row[0, TAYLOR + n + 1] - row[1, TAYLOR + n + 1]
        row[0, EVENT_FUNCTION + n] = sign * (n + 1) * closing


@lean
def divide_by_square(row, terms):
    """Divide the event function by t²; its first two coefficients are zero but for rounding."""
    for n in range(terms - 2):
        row[0, EVENT_FUNCTION + n] = row[0, EVENT_FUNCTION + n + 2]
    row[0, EVENT_FUNCTION + terms - 2] = 0.0
    row[0, EVENT_FUNCTION + terms - 1] = 0.0


@lean
def next_phase(row, element, phase, previous, plastic, span, terms):
    """
    Return the time at which the element changes phase within a span (-1: none), and the new phase.

    ``previous`` is the phase that ended at the start of the piece: if it was yielding, distance and
    rate are zero there.
    """
    limit = element.yield_force / element.stiffness if element.stiffness > 0.0 else math.inf
    # a yielding link unloads when z' changes its sign
    if phase in (PULLED, PUSHED):
        fill_closing_rate(row, float(phase), terms)
        return first_fall(row, 0, EVENT_FUNCTION, terms - 1, 1.0, 0.0, span, 0.0), ELASTIC
    # an elastic link yields at either end of its elastic range
    if phase == ELASTIC:
        earliest = -1.0
        following = ELASTIC
        if limit < math.inf:
            for side in (PULLED, PUSHED):
                fill_distance(row, -float(side), limit + side * plastic, terms)
                if side == previous:
                    divide_by_square(row, terms)
                time = first_fall(row, 0, EVENT_FUNCTION, terms, 1.0, 0.0, span, 1e-15 * limit)
                if time >= 0.0:
                    earliest = time
                    following = side
                    span = time
        return earliest, following
    # a contact opens when its force falls to zero
    if phase == CLOSED:
        fill_element_force(row, element_force(element, CLOSED, 0.0), terms)
        return first_fall(row, 0, EVENT_FUNCTION, terms - 1, 1.0, 0.0, span, 0.0), OPEN
    return _closing_time(row, element, previous, span, terms), CLOSED


@lean
def _closing_time(row, element, previous, span, terms):
    """Return the time at which a contact closes: overlap and its force are then both positive."""
    fill_distance(row, -1.0, element.gap, terms)
    rounding = 1e-14 * (abs(row[0, U]) + abs(row[1, U]) + element.gap)
    # open: the clearance falls to zero
    if row[0, EVENT_FUNCTION] > -rounding:
        if previous == CLOSED:  # the clearance is zero but for rounding
            row[0, EVENT_FUNCTION] = max(row[0, EVENT_FUNCTION], 0.0)
            rounding = 0.0
        return first_fall(row, 0, EVENT_FUNCTION, terms, 1.0, 0.0, span, 0.1 * rounding)
    # overlapping without force: the force would rise above zero
    fill_element_force(row, element_force(element, CLOSED, 0.0), terms)
    return first_fall(row, 0, EVENT_FUNCTION, terms - 1, -1.0, 0.0, span, 0.0)


@lean
def extremes_in_piece(row, i, column, terms, span):
    """Return the least and the largest value of a polynomial on [0, span]."""
    start = row[i, column]
    end = value_and_slope(row, i, column, terms, span)[0]
    low = min(start, end)
    high = max(start, end)
    # derivative, in the event function of line 1, which the element does not use
    for n in range(1, terms):
        row[1, EVENT_FUNCTION + n - 1] = n * row[i, column + n]
    # values at its roots
    sign = 1.0 if row[1, EVENT_FUNCTION] > 0.0 else -1.0
    time = first_fall(row, 1, EVENT_FUNCTION, terms - 1, sign, 0.0, span, 0.0)
    while time >= 0.0:
        value = value_and_slope(row, i, column, terms, time)[0]
        low = min(low, value)
        high = max(high, value)
        sign = -sign
        time = first_fall(row, 1, EVENT_FUNCTION, terms - 1, sign, time, span, 0.0)
    return low, high


@lean
def raise_linked_maxima(row, force, maxima, span, terms):
    """Raise the maxima to those of a piece, exact between its ends."""
    for i in range(2):
        low, high = extremes_in_piece(row, i, TAYLOR, terms, span)
        maxima[MAXIMUM_DISPLACEMENT + i] = max(maxima[MAXIMUM_DISPLACEMENT + i], high, -low)
    # z to either side
    fill_distance(row, 1.0, 0.0, terms)
    low, high = extremes_in_piece(row, 0, EVENT_FUNCTION, terms, span)
    maxima[MAXIMUM_CLOSING] = max(maxima[MAXIMUM_CLOSING], high)
    maxima[MAXIMUM_PARTING] = max(maxima[MAXIMUM_PARTING], -low)
    # force of the element
    fill_element_force(row, force, terms)
    low, high = extremes_in_piece(row, 0, EVENT_FUNCTION, terms - 1, span)
    maxima[MAXIMUM_FORCE] = max(maxima[MAXIMUM_FORCE], high, -low)


@lean
def advance_linked(row, element, phase, plastic, maxima, duration, acceleration, slope, terms):
    """
    Carry both structures through a segment, from one change of the element's phase to the next.

    Return the element's phase, its plastic part, and whether the end of the segment was reached.
    """
    elapsed = 0.0
    previous = phase
    for _ in range(MOST_PHASE_CHANGES):
        # motion with the element in its phase, until this changes or the segment ends
        force = element_force(element, phase, plastic)
        fill_coupled_displacements(row, force, acceleration + slope * elapsed, slope, terms)
        span = duration - elapsed
        time, following = next_phase(row, element, phase, previous, plastic, span, terms)
        if time >= 0.0:
            span = time
        raise_linked_maxima(row, force, maxima, span, terms)
        # state at the end of the piece
        for i in range(2):
            row[i, U], row[i, V] = value_and_slope(row, i, TAYLOR, terms, span)
        if time < 0.0:
            return phase, plastic, True
        if following == ELASTIC:
            plastic = row[0, U] - row[1, U] - phase * element.yield_force / element.stiffness
        previous = phase
        phase = following
        elapsed += span
    return phase, plastic, False


@lean
def run_linked(acceleration, dt, refinement, row, element, phase, terms, motion, force, maxima):
    """
    Run two structures with an element between them through a record and the time after it.

    Parameters
    ----------
    acceleration : (n_samples,) ndarray
        Ground acceleration, positive from structure 1 to 2, m/s². The ground rests after it.
    dt : float
        Sampling interval, s.
    refinement : int
        Number of segments into which each sampling interval is cut.
    row : (2, ROW_COLUMNS) ndarray
        Both structures at rest, then at the end; see `motion` for its columns.
    element : Element
        Link or contact.
    phase : int
        Of the element at the start: ELASTIC or OPEN.
    terms : int
        Number of Taylor terms.
    motion : (n_time, 2, 2) ndarray
        Receives displacement (m) and velocity (m/s) of both structures at every sample.
    force : (n_time,) ndarray
        Receives the force of the element at every sample, N, positive in compression.
    maxima : (5,) ndarray
        Receives the largest displacements, closing, parting (m) and force (N), exact between
        samples.

    Returns
    -------
    bool
        Whether the end was reached; a segment with too many changes of phase ends the history.
    """
    duration = dt / refinement
    plastic = 0.0
    for k in range(1, force.size):
        # ground acceleration and its slope in this sampling interval; zero after the record
        start = slope = 0.0
        if k < acceleration.size:
            start = acceleration[k - 1]
            slope = (acceleration[k] - acceleration[k - 1]) / dt
        # the interval, segment by segment
        for part in range(refinement):
            begin = start + slope * part * duration
            phase, plastic, is_through = advance_linked(
                row, element, phase, plastic, maxima, duration, begin, slope, terms
            )
            if not is_through:
                return False
        # results at the sample
        stiffness, damping, constant = element_force(element, phase, plastic)
        spring = stiffness * (row[0, U] - row[1, U])
        force[k] = spring + damping * (row[0, V] - row[1, V]) + constant
        for i in range(2):
            motion[k, i, 0] = row[i, U]
            motion[k, i, 1] = row[i, V]
    return True
