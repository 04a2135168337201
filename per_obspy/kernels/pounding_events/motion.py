r"""
Motion of a row of structures between two events, as Taylor polynomials of time.

Between events each structure, or each cluster of structures in contact, obeys one linear equation
with a linear right-hand side, ``x'' + 2 B x' + K x = P0 + P1 t``, where ``x`` is the displacement
since the start of the piece. Its Taylor coefficients follow from each other; with ``omega h`` at
most 0.7 they fall below rounding within 24 terms, whatever the sign of ``K - B²``, so elastic,
yielding (even without hardening) and touching phases are one formula.

A row of structures is one table (n_structures, ROW_COLUMNS): a line per structure, which also
holds the interface to the next structure on its right. The constants below are its columns.
"""

import math
from typing import NamedTuple

import numpy as np

from per_obspy.kernels._jit import lean

# properties of a structure
#: xi omega (1/s), omega² (1/s²), hardening (dimensionless), yield displacement (m)
DAMPING_RATE, STIFFNESS, HARDENING, YIELD = 0, 1, 2, 3
#: participation (dimensionless), mass (kg)
PARTICIPATION, MASS = 4, 5

# state of a structure
#: displacement (m), velocity (m/s), plastic displacement (m)
U, V, PLASTIC = 6, 7, 8
#: 0 elastic, 1 or -1 yielding towards that side
PHASE = 9
#: number of derivatives of the distance to yielding, from the 0th, that are zero now, with the sign
#: of the side
UNLOADING = 10

# results of a structure so far
#: largest displacement (m), squared radius and squared energy radius (m²)
LARGEST_DISPLACEMENT, LARGEST_RADIUS_SQUARED, LARGEST_ENERGY_RADIUS_SQUARED = 11, 12, 13
#: energy given to the neighbours by impacts (J)
TRANSFERRED = 14

# interface
#: gap (m), coefficient of restitution (dimensionless)
GAP, RESTITUTION = 15, 16
#: 1 while the interface is closed, else 0
IN_CONTACT = 17
#: number of derivatives of the clearance, from the 0th, that are zero now
CLEARANCE_ORDER = 18
#: 1 where the interface separates so slowly that it may stay closed, else 0
LINGERING = 19
#: number of impacts and largest approach speed (m/s) so far
IMPACTS, APPROACH = 20, 21

# first line only: when bounces end (see `contact`)
#: separation speed (m/s), and separation speed over closing acceleration (s), below which they do
STICKING_SPEED, STICKING_DELAY = 22, 23
#: number of impacts in a segment after which bounces end, and number of impacts in it so far
BOUNCE_LIMIT, BOUNCES = 24, 25

# Taylor polynomials of a structure and its interface, MOST_TERMS columns each
#: displacement in the current piece
TAYLOR = 26
#: event function: the function whose root is the next event or the next maximum
EVENT_FUNCTION = 50

# numbers that only the lanes use
#: number of Taylor terms needed (first line only); 0 in single histories
TERM_COUNT = 74
#: displacement and velocity after one elastic or yielding step, from unit velocity, by unit force
#: and by unit ramp: six columns each
ELASTIC_RESPONSES, YIELDED_RESPONSES = 75, 81

#: interface: largest opening so far, beyond its gap (m)
OPENING = 87
#: smallest approach speed that counts as an impact (m/s in the unit of the interface); only the
#: lanes use it, which do not follow openings
COUNTED_SPEED = OPENING
#: Taylor coefficients of the displacement over the share of a step, from rest, with an acceleration
#: that starts at 0 and grows by 1 per step (lanes only)
RAMP_RESPONSE = 88
#: impacts of a row in all its steps so far (first line only; rows in lanes only)
ALL_IMPACTS = 112
#: lines that its log had when those that no longer count were last left out (likewise)
KEPT_LINES = 113
ROW_COLUMNS = 114

#: Largest angle omega * h of one piece, and the Taylor terms that it may need (rates reach omega (1
#: + xi)).
LARGEST_ANGLE = 0.7
MOST_TERMS = 24
#: 1 / n, from n = 1 on.
RECIPROCAL = np.array([0.0, *(1.0 / n for n in range(1, MOST_TERMS))])
#: 1 / (n (n - 1)), from n = 2 on.
RECIPROCAL_PRODUCT = np.array([0.0, 0.0, *(1.0 / (n * (n - 1)) for n in range(2, MOST_TERMS))])
#: Part of a Taylor series that is dropped, relative to the motion.
TRUNCATION = 1e-18
#: Below this share of its own terms a contact force is rounding.
FORCE_ROUNDING = 1e-13
#: Below this share of its own terms a clearance, or a distance to yielding, is rounding.
GAP_ROUNDING = 1e-15


class Segment(NamedTuple):
    """
    A stretch of time over which the ground acceleration is linear.

    Attributes
    ----------
    start, duration : float
        Time at its start since the first sample, and its length, s.
    acceleration : float
        Ground acceleration at its start, m/s².
    slope : float
        Rate of the ground acceleration, m/s³.
    terms : int
        Number of Taylor terms that a piece of this duration needs.
    """

    start: float
    duration: float
    acceleration: float
    slope: float
    terms: int


@lean
def taylor_terms(row, duration):
    """Return how many Taylor coefficients a piece of this duration needs."""
    # largest rate omega (1 + xi) of the row, times the duration
    largest = 0.0
    for i in range(row.shape[0]):
        largest = max(largest, (math.sqrt(row[i, STIFFNESS]) + row[i, DAMPING_RATE]) * duration)
    # the n-th term is below largest**n / n!
    terms = 4
    size = largest**4 / 24.0
    while size > TRUNCATION and terms < MOST_TERMS:
        terms += 1
        size *= largest / terms
    return terms


@lean
def restoring_force(row, i):
    """Return stiffness K and constant b of the restoring force ``K u - b`` per unit mass."""
    stiffness = row[i, STIFFNESS]
    if row[i, YIELD] == math.inf:
        return stiffness, 0.0
    # bilinear: the elastoplastic part (1 - hardening) omega² is missing from the slope while it
    # yields, and is measured from the plastic displacement while elastic
    elastoplastic = (1.0 - row[i, HARDENING]) * stiffness
    if row[i, PHASE] == 0:
        return stiffness, elastoplastic * row[i, PLASTIC]
    return stiffness - elastoplastic, -elastoplastic * row[i, PHASE] * row[i, YIELD]


@lean
def fill_taylor(row, i, column, terms, velocity, damping, stiffness, force, force_rate):
    """
    Fill the coefficients from the first on of ``x'' + damping x' + stiffness x = force + rate t``.

    ``x`` starts at zero with a velocity; ``force_rate`` is the rate of the force.
    """
    # x' and x'' / 2 at the start
    before = velocity
    last = 0.5 * (force - damping * velocity)
    row[i, column + 1] = before
    row[i, column + 2] = last
    # x''' / 6: the only coefficient that the ramp of the force enters
    third = (force_rate - 2.0 * damping * last - stiffness * before) / 6.0
    before = last
    last = third
    row[i, column + 3] = last
    # recurrence of the homogeneous equation
    for n in range(4, terms):
        following = -(damping * RECIPROCAL[n]) * last - (stiffness * RECIPROCAL_PRODUCT[n]) * before
        before = last
        last = following
        row[i, column + n] = last


@lean
def last_of_cluster(row, first):
    """Return the last structure of the cluster in contact that starts with the first."""
    last = first
    while last < row.shape[0] - 1 and row[last, IN_CONTACT]:
        last += 1
    return last


@lean
def mass_share(row, first, last, i):
    """Return the share of structure i in the mass of a cluster; a wall (infinite mass) has all."""
    total = 0.0
    walls = 0
    for k in range(first, last + 1):
        total += row[k, MASS]
        walls += row[k, MASS] == math.inf
    if walls:
        return (row[i, MASS] == math.inf) / walls
    return row[i, MASS] / total


@lean
def cluster_equation(row, first, last, acceleration, slope):
    """
    Return velocity, damping, stiffness, force and force rate of the equation of a cluster.

    These are the means of its structures' coefficients, weighted by mass: the contact forces inside
    the cluster cancel.
    """
    velocity = damping = stiffness = force = force_rate = 0.0
    for i in range(first, last + 1):
        share = 1.0 if first == last else mass_share(row, first, last, i)
        k, constant = restoring_force(row, i)
        velocity += share * row[i, V]
        damping += share * 2.0 * row[i, DAMPING_RATE]
        stiffness += share * k
        # with x measured from the displacement at the start of the piece
        force += share * (constant - k * row[i, U] - row[i, PARTICIPATION] * acceleration)
        force_rate -= share * row[i, PARTICIPATION] * slope
    return velocity, damping, stiffness, force, force_rate


@lean
def fill_displacements(row, acceleration, slope, terms):
    """Fill the Taylor coefficients of every displacement of the row."""
    first = 0
    while first < row.shape[0]:
        # solve the equation of the cluster, in the line of its first structure
        last = last_of_cluster(row, first)
        velocity, damping, stiffness, force, force_rate = cluster_equation(
            row, first, last, acceleration, slope
        )
        fill_taylor(row, first, TAYLOR, terms, velocity, damping, stiffness, force, force_rate)
        row[first, TAYLOR] = row[first, U]
        # its other structures move alike
        for i in range(first + 1, last + 1):
            row[i, TAYLOR] = row[i, U]
            for n in range(1, terms):
                row[i, TAYLOR + n] = row[first, TAYLOR + n]
        first = last + 1


@lean
def fill_clearance(row, j, terms, span):
    """
    Fill the event function with an open interface's clearance over t**order.

    Return the rounding of its first coefficient, and its bounds as ``size_and_curvature`` does: in
    the same loop, because a vector of numbers just written one by one is slow to read.
    """
    order = int(row[j, CLEARANCE_ORDER])
    size = curvature = 0.0
    power = 1.0  # span**(n - 2)
    for n in range(terms - order):
        # coefficient of u_right - u_left
        coefficient = row[j + 1, TAYLOR + n + order] - row[j, TAYLOR + n + order]
        row[j, EVENT_FUNCTION + n] = coefficient
        # its part in the bounds of the function without its constant, and of its second derivative
        if n == 1:
            size = abs(coefficient) * span
        elif n > 1:
            term = abs(coefficient) * power
            size += term * span * span
            curvature += n * (n - 1) * term
            power *= span
    for n in range(terms - order, terms):
        row[j, EVENT_FUNCTION + n] = 0.0
    if order:
        return 0.0, size, curvature
    # clearance = gap + u_right - u_left; below the rounding of these terms it is zero
    row[j, EVENT_FUNCTION] += row[j, GAP]
    terms_size = abs(row[j, U]) + abs(row[j + 1, U]) + row[j, GAP]
    return GAP_ROUNDING * terms_size, size, curvature


@lean
def size_of_forces(row, i, acceleration, slope, duration):
    """Return a bound of the forces on a structure per unit mass over a duration: sum of sizes."""
    stiffness, constant = restoring_force(row, i)
    u = abs(row[i, U])
    v = abs(row[i, V])
    # constant, spring, dashpot and ground
    spring = stiffness * (u + v * duration)
    drive = row[i, PARTICIPATION] * (abs(acceleration) + abs(slope) * duration)
    return abs(constant) + spring + 2.0 * row[i, DAMPING_RATE] * v + drive


@lean
def _add_outer_force(row, i, j, factor, acceleration, slope, terms):
    """
    Add the outer force that structure i needs for its motion to the event function of interface j.

    The force ``m (u'' + 2 xi omega u' + K u - b + q a)`` is multiplied by the factor.
    """
    factor *= row[i, MASS]
    damping = 2.0 * row[i, DAMPING_RATE]
    stiffness, constant = restoring_force(row, i)
    # inertia, dashpot and spring, coefficient by coefficient
    for n in range(terms - 2):
        inertia = (n + 2) * (n + 1) * row[i, TAYLOR + n + 2]
        dashpot = damping * (n + 1) * row[i, TAYLOR + n + 1]
        spring = stiffness * row[i, TAYLOR + n]
        row[j, EVENT_FUNCTION + n] += factor * (inertia + dashpot + spring)
    # constant of the restoring force, and linear ground acceleration
    row[j, EVENT_FUNCTION] += factor * (row[i, PARTICIPATION] * acceleration - constant)
    row[j, EVENT_FUNCTION + 1] += factor * row[i, PARTICIPATION] * slope


@lean
def fill_contact_force(row, j, acceleration, slope, duration, terms):
    """
    Fill the event function with a closed interface's force, positive in compression.

    Return its rounding. The force is the one that the cluster's structures on one side need.
    """
    # the cluster of which j is an interface
    first = j
    last = last_of_cluster(row, j)
    while first > 0 and row[first - 1, IN_CONTACT]:
        first -= 1
    size = 0.0
    for i in range(first, last + 1):
        size = max(size, size_of_forces(row, i, acceleration, slope, duration))
    # structures on the left; on the right if a wall (infinite mass) is among those
    begin = first
    end = j
    factor = -1.0
    for i in range(first, j + 1):
        if row[i, MASS] == math.inf:
            begin = j + 1
            end = last
            factor = 1.0
    # sum of their outer forces
    for n in range(terms):
        row[j, EVENT_FUNCTION + n] = 0.0
    mass = 0.0
    for i in range(begin, end + 1):
        _add_outer_force(row, i, j, factor, acceleration, slope, terms)
        mass += row[i, MASS]
    return FORCE_ROUNDING * mass * size
