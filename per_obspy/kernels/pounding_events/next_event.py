"""
Piecewise motion through a segment of linear ground acceleration, from one event to the next.

Events are impacts, releases of contact, yielding and unloading. ``find_event`` fills the Taylor
polynomials of a piece and returns how long it is smooth and which event ends it; ``finish_piece``
moves the row to that instant and carries the event out.
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
from per_obspy.kernels.pounding_events.contact import resolve_contact
from per_obspy.kernels.pounding_events.motion import (
    CLEARANCE_ORDER,
    EVENT_FUNCTION,
    GAP_ROUNDING,
    HARDENING,
    IN_CONTACT,
    LARGEST_DISPLACEMENT,
    LARGEST_ENERGY_RADIUS_SQUARED,
    LARGEST_RADIUS_SQUARED,
    PHASE,
    PLASTIC,
    STIFFNESS,
    TAYLOR,
    UNLOADING,
    YIELD,
    U,
    V,
    fill_clearance,
    fill_contact_force,
    fill_displacements,
    restoring_force,
)

# kinds of events that end a piece
SEGMENT_END, HIT, RELEASE, YIELDING, REVERSAL = 0, 1, 2, 3, 4


@lean
def find_event(row, segment, elapsed):
    """
    Find the next event of a segment of ground acceleration.

    Parameters
    ----------
    row : (n_structures, ROW_COLUMNS) ndarray
        Row of structures now; see `motion` for its columns. Its Taylor polynomials are filled.
    segment : Segment
        Current segment of the ground acceleration.
    elapsed : float
        Time since the start of the segment, s.

    Returns
    -------
    span : float
        Time to the event, or to the end of the segment, s.
    kind : int
        SEGMENT_END, HIT, RELEASE, YIELDING or REVERSAL.
    index : int
        Interface of a HIT or RELEASE, structure of YIELDING or REVERSAL, else -1.
    """
    slope = segment.slope
    terms = segment.terms
    acceleration = segment.acceleration + slope * elapsed
    span = segment.duration - elapsed
    fill_displacements(row, acceleration, slope, terms)
    kind = SEGMENT_END
    index = -1
    # interfaces: the contact force of a closed one, the clearance of an open one falls to zero
    for j in range(row.shape[0] - 1):
        if row[j, IN_CONTACT]:
            rounding = fill_contact_force(row, j, acceleration, slope, segment.duration, terms)
            # a force that is zero but for rounding does not open the interface
            row[j, EVENT_FUNCTION] += rounding
            time = first_fall(row, j, EVENT_FUNCTION, terms, 1.0, 0.0, span, 0.0)
            event = RELEASE
        else:
            rounding, size, curvature = fill_clearance(row, j, terms, span)
            time = fall_within(
                row, j, EVENT_FUNCTION, terms, 1.0, 0.0, span, rounding, size, curvature
            )
            event = HIT
        if time >= 0.0:
            span = time
            kind = event
            index = j
    # structures: a bilinear one starts to yield or to unload
    for i in range(row.shape[0]):
        if row[i, YIELD] < math.inf:
            time, event = _next_change_of_stiffness(row, i, span, terms)
            if time >= 0.0:
                span = time
                kind = event
                index = i
    return span, kind, index


@lean
def _next_change_of_stiffness(row, i, span, terms):
    """Return the time within a span at which a structure starts to yield or unload, and which."""
    # a yielding structure unloads when its velocity falls to zero
    side = row[i, PHASE]
    if side != 0.0:
        fill_velocity(row, i, terms)
        return first_fall(row, i, EVENT_FUNCTION, terms - 1, side, 0.0, span, 0.0), REVERSAL
    # an elastic one yields when its distance to either side falls to zero; -1 if it does not
    earliest = -1.0
    size, _ = size_and_curvature(row, i, TAYLOR, terms, span)
    for sign in (1, -1):
        # just after unloading the first derivatives of this distance are zero: divide by t**order
        order = max(0, int(sign * row[i, UNLOADING]))
        distance = row[i, YIELD] - sign * (row[i, U] - row[i, PLASTIC])
        rounding = GAP_ROUNDING * (row[i, YIELD] + abs(row[i, U]))
        # too far from this side to reach it
        if order == 0 and distance > size + rounding:
            continue
        for n in range(order, terms):
            row[i, EVENT_FUNCTION + n - order] = -sign * row[i, TAYLOR + n]
        if order == 0:
            row[i, EVENT_FUNCTION] = distance
        else:
            rounding = 0.0
        time = first_fall(row, i, EVENT_FUNCTION, terms - order, 1.0, 0.0, span, rounding)
        if time >= 0.0:
            earliest = time
            span = time
    return earliest, YIELDING


@lean
def finish_piece(row, log, segment, elapsed, span, kind, index):
    """
    Move the row to the end of a piece and carry out its event.

    Largest displacements and radii are raised to those of the piece, exact between its ends.

    Parameters
    ----------
    row : (n_structures, ROW_COLUMNS) ndarray
        Row of structures at the start of the piece, with the polynomials of `find_event`; then at
        its end.
    log : (n_lines, LOG_COLUMNS) ndarray
        Log of impacts.
    segment : Segment
        Current segment of the ground acceleration.
    elapsed : float
        Time between the start of the segment and the end of the piece, s.
    span : float
        Duration of the piece, s.
    kind, index : int
        Event that ends it, as from `find_event`.
    """
    for i in range(row.shape[0]):
        # largest values and state at the end
        u, v = value_and_slope(row, i, TAYLOR, segment.terms, span)
        _raise_peaks(row, i, u, v, span, segment.terms)
        row[i, U] = u
        row[i, V] = v
        # plastic displacement of a yielding structure
        side = row[i, PHASE]
        if side != 0.0:
            row[i, PLASTIC] = row[i, U] - side * row[i, YIELD]
        # clearance and distance to yielding are no longer zero
        if span > 0.0:
            row[i, UNLOADING] = 0.0
            row[i, CLEARANCE_ORDER] = 0.0
    # the event
    if kind == HIT:
        resolve_contact(row, log, segment, elapsed, index)
    elif kind == RELEASE:
        row[index, IN_CONTACT] = 0.0
        row[index, CLEARANCE_ORDER] = 2.0
    elif kind == YIELDING:
        row[index, PHASE] = 1.0 if row[index, U] > row[index, PLASTIC] else -1.0
    elif kind == REVERSAL:
        row[index, UNLOADING] = 2.0 * row[index, PHASE]
        row[index, PHASE] = 0.0


@lean
def _raise_peaks(row, i, end, end_velocity, span, terms):
    """Raise the peaks of a structure to those of a piece, while its row has the start of it."""
    _raise_peaks_to(row, i, row[i, U], row[i, V])
    _raise_peaks_to(row, i, end, end_velocity)
    if _may_exceed_peaks(row, i, end, end_velocity, span, terms):
        # displacement: roots of the velocity
        fill_velocity(row, i, terms)
        _raise_peaks_at_roots(row, i, span, terms, terms - 1)
        # radius: roots of u'' + omega² u
        fill_power(row, i, row[i, STIFFNESS], 0.0, terms)
        _raise_peaks_at_roots(row, i, span, terms, terms - 2)
        if row[i, YIELD] < math.inf:
            # energy radius: while yielding, the elastoplastic part does not store more
            stiffness, constant = restoring_force(row, i)
            fill_power(row, i, stiffness, constant if row[i, PHASE] == 0.0 else 0.0, terms)
            _raise_peaks_at_roots(row, i, span, terms, terms - 2)


@lean
def _may_exceed_peaks(row, i, end, end_velocity, span, terms):
    """
    Return whether a structure may pass its peaks inside a piece, by the largest |u''| in it.

    A displacement leaves its chord by an eighth of span² times it at most, a velocity is that of
    the nearer end but for half the span times it: together they bound the radii.
    """
    _, curvature = size_and_curvature(row, i, TAYLOR, terms, span)
    # bounds of displacement and velocity
    reach = max(abs(row[i, U]), abs(end)) + 0.125 * span * span * curvature
    velocity = max(abs(row[i, V]), abs(end_velocity)) + 0.5 * span * curvature
    # bounds of radius and energy radius, squared
    kinetic = velocity * velocity / row[i, STIFFNESS]
    radius_squared = reach * reach + kinetic
    if reach > row[i, LARGEST_DISPLACEMENT] or radius_squared > row[i, LARGEST_RADIUS_SQUARED]:
        return True
    stretch = reach + abs(row[i, PLASTIC])
    return stretch * stretch + kinetic > row[i, LARGEST_ENERGY_RADIUS_SQUARED]


@lean
def fill_velocity(row, i, terms):
    """Fill the event function with the velocity of a structure."""
    for n in range(1, terms):
        row[i, EVENT_FUNCTION + n - 1] = n * row[i, TAYLOR + n]


@lean
def fill_power(row, i, stiffness, constant, terms):
    """Fill the event function with ``u'' + K u - b``, the rate of a radius² over 2 v / omega²."""
    for n in range(terms - 2):
        inertia = (n + 2) * (n + 1) * row[i, TAYLOR + n + 2]
        row[i, EVENT_FUNCTION + n] = inertia + stiffness * row[i, TAYLOR + n]
    row[i, EVENT_FUNCTION] -= constant


@lean
def _raise_peaks_at_roots(row, i, span, terms, function_terms):
    """Raise the peaks of a structure at every root of the event function within a piece."""
    # sign of the function just after the start
    value, slope = value_and_slope(row, i, EVENT_FUNCTION, function_terms, 0.0)
    sign = 1.0 if value > 0.0 or (value == 0.0 and slope > 0.0) else -1.0
    # roots one after another; the sign changes at each
    time = first_fall(row, i, EVENT_FUNCTION, function_terms, sign, 0.0, span, 0.0)
    while time >= 0.0:
        _raise_peaks_at(row, i, time, terms)
        if is_last_root(row, i, EVENT_FUNCTION, function_terms, time, span):
            return
        sign = -sign
        time = first_fall(row, i, EVENT_FUNCTION, function_terms, sign, time, span, 0.0)


@lean
def _raise_peaks_at(row, i, time, terms):
    """Raise the peaks of a structure to the state at a time of the piece."""
    u, v = value_and_slope(row, i, TAYLOR, terms, time)
    _raise_peaks_to(row, i, u, v)


@lean
def _raise_peaks_to(row, i, u, v):
    """Raise the peaks of a structure to a state."""
    # displacement, and radius of (11), (12)
    kinetic = v * v / row[i, STIFFNESS]
    row[i, LARGEST_DISPLACEMENT] = max(row[i, LARGEST_DISPLACEMENT], abs(u))
    row[i, LARGEST_RADIUS_SQUARED] = max(row[i, LARGEST_RADIUS_SQUARED], u * u + kinetic)
    # radius of the recoverable energy: alpha u² + (1 - alpha) y² + v² / omega²
    yield_displacement = row[i, YIELD]
    hardening = row[i, HARDENING]
    if yield_displacement < math.inf:
        stretch = yield_displacement if row[i, PHASE] != 0.0 else u - row[i, PLASTIC]
        energy = hardening * u * u + (1 - hardening) * stretch**2 + kinetic
        row[i, LARGEST_ENERGY_RADIUS_SQUARED] = max(row[i, LARGEST_ENERGY_RADIUS_SQUARED], energy)
    else:
        row[i, LARGEST_ENERGY_RADIUS_SQUARED] = row[i, LARGEST_RADIUS_SQUARED]
