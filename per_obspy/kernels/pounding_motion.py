r"""
Motion of a row of structures between two events, as Taylor polynomials of time.

Between events each structure, or each cluster of structures in contact, obeys one linear equation with a linear
right-hand side, ``x'' + 2 B x' + K x = P0 + P1 t``, where ``x`` is the displacement since the start of the piece. Its
Taylor coefficients follow from each other; with ``omega h`` at most 0.7 they fall below rounding within 24 terms,
whatever the sign of ``K - B²``, so elastic, yielding (even without hardening) and touching phases are one formula.
"""

import math
from typing import Any, NamedTuple

from ._jit import kernel

# columns of Row.structures
RATE, STIFFNESS, HARDENING, YIELD, PARTICIPATION, MASS = 0, 1, 2, 3, 4, 5
# columns of Row.state
U, V, PLASTIC = 0, 1, 2

#: Largest phase omega * h of one piece, and the Taylor terms that it may need (rates reach omega (1 + xi)).
LARGEST_PHASE = 0.7
MOST_TERMS = 24
#: What is dropped of a Taylor series, relative to the motion.
TRUNCATION = 1e-18
#: Below this share of its own terms a contact force is rounding, as is a clearance below the other share.
FORCE_ROUNDING = 1e-13
GAP_ROUNDING = 1e-15


class Segment(NamedTuple):
    """Ground acceleration (m/s²) with a slope (m/s³) from a start (s) over a duration (s), and the Taylor terms."""

    start: float
    duration: float
    acceleration: float
    slope: float
    terms: int


class Row(NamedTuple):
    """
    A row of N structures and its state, as arrays.

    ``structures`` (N, 6): xi omega, omega², hardening, yield displacement, participation, mass; ``gaps`` and
    ``restitution`` (N-1,); ``state`` (N, 3): displacement, velocity, plastic displacement; ``phase`` (N,): 0 elastic,
    1 or -1 yielding towards that side; ``stuck`` (N-1,): the interface is closed; ``lingering`` (N-1,): it may close
    at this instant; ``order`` (N-1,): how many derivatives of its clearance, from the 0th, are zero now; ``unloading``
    (N,): the same for the distance to yielding, with the sign of the side; ``curve`` (N, MOST_TERMS): Taylor
    coefficients of the displacements; ``guard`` (MOST_TERMS,): room for the function whose root is the next event.
    """

    structures: Any
    gaps: Any
    restitution: Any
    state: Any
    phase: Any
    stuck: Any
    lingering: Any
    order: Any
    unloading: Any
    curve: Any
    guard: Any


@kernel
def taylor_terms(structures, duration):
    """Return how many Taylor coefficients a piece of this duration needs."""
    largest = 0.0
    for i in range(structures.shape[0]):
        largest = max(largest, (math.sqrt(structures[i, STIFFNESS]) + structures[i, RATE]) * duration)
    terms, size = 4, largest**4 / 24.0
    while size > TRUNCATION and terms < MOST_TERMS:
        terms += 1
        size *= largest / terms
    return terms


@kernel
def restoring(structures, state, phase, i):
    """Return stiffness K and constant b of a structure's restoring force ``K u - b`` per unit mass in its phase."""
    stiffness = structures[i, STIFFNESS]
    if structures[i, YIELD] == math.inf:
        return stiffness, 0.0
    lost = (1.0 - structures[i, HARDENING]) * stiffness
    if phase[i] == 0:
        return stiffness, lost * state[i, PLASTIC]
    return stiffness - lost, -lost * phase[i] * structures[i, YIELD]


@kernel
def fill_taylor(curve, terms, velocity, damping, stiffness, force, force_rate):
    """Fill ``curve[1:terms]`` for ``x'' + damping x' + stiffness x = force + force_rate t`` from a velocity."""
    curve[1] = velocity
    curve[2] = 0.5 * (force - damping * velocity)
    curve[3] = (force_rate - 2.0 * damping * curve[2] - stiffness * velocity) / 6.0
    for n in range(4, terms):
        curve[n] = -(damping * (n - 1) * curve[n - 1] + stiffness * curve[n - 2]) / (n * (n - 1))


@kernel
def last_in_contact(stuck, first):
    """Return the last structure of the cluster that starts with the first."""
    last = first
    while last < stuck.size and stuck[last]:
        last += 1
    return last


@kernel
def mass_share(structures, first, last, i):
    """Return the share of structure i in the mass of a cluster; a wall (infinite mass) has it all."""
    total, walls = 0.0, 0
    for k in range(first, last + 1):
        total += structures[k, MASS]
        walls += structures[k, MASS] == math.inf
    if walls:
        return (structures[i, MASS] == math.inf) / walls
    return structures[i, MASS] / total


@kernel
def cluster_equation(row, first, last, acceleration, slope):
    """Return velocity, damping, stiffness, force and force rate of the equation of a cluster."""
    structures, state = row.structures, row.state
    velocity = damping = stiffness = force = force_rate = 0.0
    for i in range(first, last + 1):
        share = 1.0 if first == last else mass_share(structures, first, last, i)
        k, constant = restoring(structures, state, row.phase, i)
        velocity += share * state[i, V]
        damping += share * 2.0 * structures[i, RATE]
        stiffness += share * k
        force += share * (constant - k * state[i, U] - structures[i, PARTICIPATION] * acceleration)
        force_rate -= share * structures[i, PARTICIPATION] * slope
    return velocity, damping, stiffness, force, force_rate


@kernel
def fill_curves(row, acceleration, slope, terms):
    """Fill the Taylor coefficients of every displacement of the row."""
    curve, count = row.curve, row.phase.size
    first = 0
    while first < count:
        last = last_in_contact(row.stuck, first)
        velocity, damping, stiffness, force, force_rate = cluster_equation(row, first, last, acceleration, slope)
        fill_taylor(curve[first], terms, velocity, damping, stiffness, force, force_rate)
        for i in range(first, last + 1):
            curve[i, 0] = row.state[i, U]
            for n in range(1, terms):
                curve[i, n] = curve[first, n]
        first = last + 1


@kernel
def fill_clearance(row, interface, terms):
    """Fill the guard with an open interface's clearance over t**order; return the rounding of its first coefficient."""
    guard, left, right = row.guard, row.curve[interface], row.curve[interface + 1]
    order = row.order[interface]
    for n in range(order, terms):
        guard[n - order] = right[n] - left[n]
    for n in range(terms - order, terms):
        guard[n] = 0.0
    if order:
        return 0.0
    guard[0] += row.gaps[interface]
    return GAP_ROUNDING * (abs(left[0]) + abs(right[0]) + row.gaps[interface])


@kernel
def size_of_forces(row, i, acceleration, slope, duration):
    """Return the sum of the sizes of the forces on a structure per unit mass, and of their changes in a duration."""
    stiffness, constant = restoring(row.structures, row.state, row.phase, i)
    drive = row.structures[i, PARTICIPATION] * (abs(acceleration) + abs(slope) * duration)
    u, v = abs(row.state[i, U]), abs(row.state[i, V])
    return abs(constant) + stiffness * (u + v * duration) + 2.0 * row.structures[i, RATE] * v + drive


@kernel
def _add_force(row, i, factor, acceleration, slope, terms):
    """Add the outer force that structure i's motion needs, times a factor, to the guard."""
    guard, curve, structures = row.guard, row.curve[i], row.structures
    factor *= structures[i, MASS]
    damping = 2.0 * structures[i, RATE]
    stiffness, constant = restoring(structures, row.state, row.phase, i)
    for n in range(terms - 2):
        guard[n] += factor * (
            (n + 2) * (n + 1) * curve[n + 2] + damping * (n + 1) * curve[n + 1] + stiffness * curve[n]
        )
    guard[0] += factor * (structures[i, PARTICIPATION] * acceleration - constant)
    guard[1] += factor * structures[i, PARTICIPATION] * slope


@kernel
def fill_force(row, interface, acceleration, slope, duration, terms):
    """Fill the guard with a closed interface's force, positive in compression; return its rounding."""
    first, last = interface, last_in_contact(row.stuck, interface)
    while first > 0 and row.stuck[first - 1]:
        first -= 1
    size = 0.0
    for i in range(first, last + 1):
        size = max(size, size_of_forces(row, i, acceleration, slope, duration))
    begin, end, factor = first, interface, -1.0
    for i in range(first, interface + 1):
        if row.structures[i, MASS] == math.inf:  # then the force follows from the structures on the other side
            begin, end, factor = interface + 1, last, 1.0
    row.guard[:] = 0.0
    mass = 0.0
    for i in range(begin, end + 1):
        _add_force(row, i, factor, acceleration, slope, terms)
        mass += row.structures[i, MASS]
    return FORCE_ROUNDING * mass * size
