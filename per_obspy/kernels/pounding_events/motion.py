r"""
Motion of a row of structures between two events, as Taylor polynomials of time.

Between events each structure, or each cluster of structures in contact, obeys one linear equation
with a linear right-hand side, ``x'' + 2 B x' + K x = P0 + P1 t``, where ``x`` is the displacement
since the start of the piece. Its Taylor coefficients follow from each other; with ``omega h`` at
most 0.7 they fall below rounding within 24 terms, whatever the sign of ``K - B²``, so elastic,
yielding (even without hardening) and touching phases are one formula.
"""

import math
from typing import NamedTuple

import numpy as np

from per_obspy.kernels._jit import lean

# A row of structures is one table, a line for each structure and for the interface to the next one
# on its right:
#: xi omega, omega², hardening, yield displacement, participation, mass
RATE, STIFFNESS, HARDENING, YIELD, PARTICIPATION, MASS = 0, 1, 2, 3, 4, 5
#: displacement, velocity, plastic displacement; phase: 0 elastic, 1 or -1 yielding towards that
#: side; how many derivatives of the distance to yielding, from the 0th, are zero now, with the sign
#: of the side
U, V, PLASTIC, PHASE, UNLOADING = 6, 7, 8, 9, 10
#: largest displacement, squared radius and squared energy radius so far; energy given to the
#: neighbours by impacts
HIGHEST, WIDEST, RICHEST, GIVEN = 11, 12, 13, 14
#: interface: gap, restitution, is it closed, how many derivatives of the clearance are zero now,
#: may it close now
GAP, RESTITUTION, STUCK, ORDER, LINGERING = 15, 16, 17, 18, 19
#: interface: number of impacts and largest approach speed so far
IMPACTS, APPROACH = 20, 21
#: first line only: when bounces end (see pounding_contact), and impacts in the current segment
STILL, DELAY, MOST_BOUNCES, BOUNCES = 22, 23, 24, 25
#: Taylor coefficients of the displacement, and of the function whose root is the next event
CURVE, GUARD = 26, 50
#: Taylor terms needed (first line only), and what one elastic or yielding step makes of speed,
#: force and ramp
TERMS, ELASTIC, YIELDED = 74, 75, 81
#: interface: how far it opened at most, beyond its gap
OPENING = 87
#: Taylor coefficients of the displacement over the share of a step whose acceleration starts at 0
#: and grows by 1 a step
SHAPE = 88
COLUMNS = 112

#: Largest phase omega * h of one piece, and the Taylor terms that it may need (rates reach omega (1
#: + xi)).
LARGEST_PHASE = 0.7
MOST_TERMS = 24
#: 1 / (n (n - 1)), from n = 2 on.
INVERSE = np.array([0.0, 0.0, *(1.0 / (n * (n - 1)) for n in range(2, MOST_TERMS))])
#: 1 / n, from n = 1 on.
RECIPROCAL = np.array([0.0, *(1.0 / n for n in range(1, MOST_TERMS))])
#: What is dropped of a Taylor series, relative to the motion.
TRUNCATION = 1e-18
#: Below this share of its own terms a contact force is rounding, as is a clearance below the other
#: share.
FORCE_ROUNDING = 1e-13
GAP_ROUNDING = 1e-15


class Segment(NamedTuple):
    """Ground acceleration (m/s²) with a slope (m/s³) from a start (s) over a duration (s), and the Taylor terms."""

    start: float
    duration: float
    acceleration: float
    slope: float
    terms: int


@lean
def taylor_terms(row, duration):
    """Return how many Taylor coefficients a piece of this duration needs."""
    largest = 0.0
    for i in range(row.shape[0]):
        largest = max(largest, (math.sqrt(row[i, STIFFNESS]) + row[i, RATE]) * duration)
    terms, size = 4, largest**4 / 24.0
    while size > TRUNCATION and terms < MOST_TERMS:
        terms += 1
        size *= largest / terms
    return terms


@lean
def restoring(row, i):
    """Return stiffness K and constant b of a structure's restoring force ``K u - b`` per unit mass in its phase."""
    stiffness = row[i, STIFFNESS]
    if row[i, YIELD] == math.inf:
        return stiffness, 0.0
    lost = (1.0 - row[i, HARDENING]) * stiffness
    if row[i, PHASE] == 0:
        return stiffness, lost * row[i, PLASTIC]
    return stiffness - lost, -lost * row[i, PHASE] * row[i, YIELD]


@lean
def fill_taylor(row, i, column, terms, velocity, damping, stiffness, force, force_rate):
    """Fill the coefficients from the first on of ``x'' + damping x' + stiffness x = force + force_rate t``."""
    before, last = velocity, 0.5 * (force - damping * velocity)
    row[i, column + 1], row[i, column + 2] = before, last
    before, last = last, (force_rate - 2.0 * damping * last - stiffness * before) / 6.0
    row[i, column + 3] = last
    for n in range(4, terms):
        before, last = last, -(damping * RECIPROCAL[n]) * last - (stiffness * INVERSE[n]) * before
        row[i, column + n] = last


@lean
def last_in_contact(row, first):
    """Return the last structure of the cluster that starts with the first."""
    last = first
    while last < row.shape[0] - 1 and row[last, STUCK]:
        last += 1
    return last


@lean
def mass_share(row, first, last, i):
    """Return the share of structure i in the mass of a cluster; a wall (infinite mass) has it all."""
    total, walls = 0.0, 0
    for k in range(first, last + 1):
        total += row[k, MASS]
        walls += row[k, MASS] == math.inf
    if walls:
        return (row[i, MASS] == math.inf) / walls
    return row[i, MASS] / total


@lean
def cluster_equation(row, first, last, acceleration, slope):
    """Return velocity, damping, stiffness, force and force rate of the equation of a cluster."""
    velocity = damping = stiffness = force = force_rate = 0.0
    for i in range(first, last + 1):
        share = 1.0 if first == last else mass_share(row, first, last, i)
        k, constant = restoring(row, i)
        velocity += share * row[i, V]
        damping += share * 2.0 * row[i, RATE]
        stiffness += share * k
        force += share * (constant - k * row[i, U] - row[i, PARTICIPATION] * acceleration)
        force_rate -= share * row[i, PARTICIPATION] * slope
    return velocity, damping, stiffness, force, force_rate


@lean
def fill_curves(row, acceleration, slope, terms):
    """Fill the Taylor coefficients of every displacement of the row."""
    first = 0
    while first < row.shape[0]:
        last = last_in_contact(row, first)
        velocity, damping, stiffness, force, force_rate = cluster_equation(
            row, first, last, acceleration, slope
        )
        fill_taylor(row, first, CURVE, terms, velocity, damping, stiffness, force, force_rate)
        row[first, CURVE] = row[first, U]
        for i in range(first + 1, last + 1):
            row[i, CURVE] = row[i, U]
            for n in range(1, terms):
                row[i, CURVE + n] = row[first, CURVE + n]
        first = last + 1


@lean
def fill_clearance(row, j, terms, span):
    """
    Fill the guard with an open interface's clearance over t**order.

    Return the rounding of its first coefficient, and its bounds as ``size_and_curvature`` does: in
    the same loop, because a vector of numbers just written one by one is slow to read.
    """
    order = int(row[j, ORDER])
    size = curvature = 0.0
    power = 1.0  # span**(n - 2)
    for n in range(terms - order):
        coefficient = row[j + 1, CURVE + n + order] - row[j, CURVE + n + order]
        row[j, GUARD + n] = coefficient
        if n == 1:
            size = abs(coefficient) * span
        elif n > 1:
            term = abs(coefficient) * power
            size += term * span * span
            curvature += n * (n - 1) * term
            power *= span
    for n in range(terms - order, terms):
        row[j, GUARD + n] = 0.0
    if order:
        return 0.0, size, curvature
    row[j, GUARD] += row[j, GAP]
    return GAP_ROUNDING * (abs(row[j, U]) + abs(row[j + 1, U]) + row[j, GAP]), size, curvature


@lean
def size_of_forces(row, i, acceleration, slope, duration):
    """Return the sum of the sizes of the forces on a structure per unit mass, and of their changes in a duration."""
    stiffness, constant = restoring(row, i)
    drive = row[i, PARTICIPATION] * (abs(acceleration) + abs(slope) * duration)
    u, v = abs(row[i, U]), abs(row[i, V])
    return abs(constant) + stiffness * (u + v * duration) + 2.0 * row[i, RATE] * v + drive


@lean
def _add_force(row, i, j, factor, acceleration, slope, terms):
    """Add the outer force that structure i's motion needs, times a factor, to the guard of interface j."""
    factor *= row[i, MASS]
    damping = 2.0 * row[i, RATE]
    stiffness, constant = restoring(row, i)
    for n in range(terms - 2):
        pull = (n + 2) * (n + 1) * row[i, CURVE + n + 2] + damping * (n + 1) * row[i, CURVE + n + 1]
        row[j, GUARD + n] += factor * (pull + stiffness * row[i, CURVE + n])
    row[j, GUARD] += factor * (row[i, PARTICIPATION] * acceleration - constant)
    row[j, GUARD + 1] += factor * row[i, PARTICIPATION] * slope


@lean
def fill_force(row, j, acceleration, slope, duration, terms):
    """Fill the guard with a closed interface's force, positive in compression; return its rounding."""
    first, last = j, last_in_contact(row, j)
    while first > 0 and row[first - 1, STUCK]:
        first -= 1
    size = 0.0
    for i in range(first, last + 1):
        size = max(size, size_of_forces(row, i, acceleration, slope, duration))
    begin, end, factor = first, j, -1.0
    for i in range(first, j + 1):
        if row[i, MASS] == math.inf:  # then the force follows from the structures on the other side
            begin, end, factor = j + 1, last, 1.0
    for n in range(terms):
        row[j, GUARD + n] = 0.0
    mass = 0.0
    for i in range(begin, end + 1):
        _add_force(row, i, j, factor, acceleration, slope, terms)
        mass += row[i, MASS]
    return FORCE_ROUNDING * mass * size
