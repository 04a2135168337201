"""Whole history of a row of structures against one record, with its energies, sample by sample."""

import math

import numpy as np

from per_obspy.kernels._jit import kernel, lean
from per_obspy.kernels.polynomial_roots import first_fall, size_and_curvature, value_and_slope
from per_obspy.kernels.pounding_events.motion import (
    BOUNCES,
    CURVE,
    GAP,
    GIVEN,
    GUARD,
    HARDENING,
    HIGHEST,
    MASS,
    MOST_BOUNCES,
    OPENING,
    PARTICIPATION,
    PHASE,
    PLASTIC,
    RATE,
    STIFFNESS,
    STUCK,
    YIELD,
    Segment,
    U,
    V,
    fill_force,
    taylor_terms,
)
from per_obspy.kernels.pounding_events.next_event import find_event, finish_piece

# columns of the work done on each structure since the start
INPUT, DAMPING, HYSTERETIC, TRANSFER = 0, 1, 2, 3
#: Gauss-Legendre with 10 nodes is exact for polynomials of degree 19; what remains of v² at omega h
#: = 0.7 is < 1e-18.
NODES, WEIGHTS = np.polynomial.legendre.leggauss(10)

#: A displacement has reached its maximum when what it can still reach exceeds it by no more than
#: this share.
SETTLED = 1e-13


@lean
def _velocity_at(row, i, terms, time):
    """Return the velocity of a structure at a time of the piece."""
    return value_and_slope(row, i, CURVE, terms, time)[1]


@lean
def _add_ground_and_damping(row, work, acceleration, slope, span, terms):
    """Add input (per participation), viscous and hysteretic energy of a piece."""
    half = 0.5 * span
    for i in range(row.shape[0]):
        mass, drive = row[i, MASS], row[i, PARTICIPATION]
        if mass == math.inf:
            continue  # the energies of a wall are not defined
        for node in range(NODES.size):
            time = half * (1.0 + NODES[node])
            velocity = _velocity_at(row, i, terms, time)
            weight = half * WEIGHTS[node] * mass * velocity
            work[i, INPUT] -= weight * drive * (acceleration + slope * time)
            work[i, DAMPING] += weight * 2.0 * row[i, RATE] * velocity
        if row[i, PHASE] != 0.0:
            moved = value_and_slope(row, i, CURVE, terms, span)[0] - row[i, U]
            lost = (1.0 - row[i, HARDENING]) * row[i, STIFFNESS] * row[i, YIELD]
            work[i, HYSTERETIC] += mass * lost * abs(moved)


@lean
def _add_contact_work(row, work, acceleration, slope, span, terms):
    """Add the work of the contact forces of a piece to the energy that each structure has transferred."""
    half = 0.5 * span
    for j in range(row.shape[0] - 1):
        if row[j, STUCK]:
            fill_force(row, j, acceleration, slope, span, terms)
            for node in range(NODES.size):
                time = half * (1.0 + NODES[node])
                force = value_and_slope(row, j, GUARD, terms - 2, time)[0]
                done = half * WEIGHTS[node] * force * _velocity_at(row, j, terms, time)
                work[j, TRANSFER] += done
                work[j + 1, TRANSFER] -= done


@lean
def raise_openings(row, span, terms):
    """Raise the largest opening of every interface to that of a piece, exact between its ends."""
    for j in range(row.shape[0] - 1):
        start, end = row[j + 1, U] - row[j, U], _opening_at(row, j, terms, span)
        row[j, OPENING] = max(row[j, OPENING], start, end)
        for n in range(1, terms):
            row[j, GUARD + n - 1] = n * (row[j + 1, CURVE + n] - row[j, CURVE + n])
        size, _ = size_and_curvature(row, j, GUARD, terms - 1, span)
        if max(start, end) + span * (size + abs(row[j, GUARD])) > row[j, OPENING]:
            _raise_opening_at_roots(row, j, span, terms)


@lean
def _opening_at(row, j, terms, time):
    """Return the opening of an interface at a time of the piece."""
    left, right = (
        value_and_slope(row, j, CURVE, terms, time),
        value_and_slope(row, j + 1, CURVE, terms, time),
    )
    return right[0] - left[0]


@lean
def _raise_opening_at_roots(row, j, span, terms):
    """Raise the largest opening where its rate, which the guard holds, falls through zero."""
    sign = 1.0 if row[j, GUARD] > 0.0 else -1.0
    time = first_fall(row, j, GUARD, terms - 1, sign, 0.0, span, 0.0)
    while time >= 0.0:
        row[j, OPENING] = max(row[j, OPENING], _opening_at(row, j, terms, time))
        sign = -sign
        time = first_fall(row, j, GUARD, terms - 1, sign, time, span, 0.0)


@lean
def advance(row, log, work, segment):
    """Carry the row through one segment, event by event; tell whether it got through."""
    row[0, BOUNCES] = 0.0
    elapsed, slope, terms = 0.0, segment.slope, segment.terms
    for _ in range(int(2 * row[0, MOST_BOUNCES])):
        span, kind, place = find_event(row, segment, elapsed)
        raise_openings(row, span, terms)
        acceleration = segment.acceleration + slope * elapsed
        _add_ground_and_damping(row, work, acceleration, slope, span, terms)
        _add_contact_work(row, work, acceleration, slope, span, terms)
        elapsed = elapsed + span if kind else segment.duration
        finish_piece(row, log, segment, elapsed, span, kind, place)
        if elapsed >= segment.duration:
            return True
    return False


@lean
def reach_in_free_vibration(row, i):
    """
    Return the least and largest displacement that a structure can still reach in undisturbed free vibration.

    The radius about the place without force only falls. Infinite if the structure can still yield.
    """
    stiffness = row[i, STIFFNESS]
    centre = 0.0
    if row[i, YIELD] < math.inf:
        centre = (1.0 - row[i, HARDENING]) * row[i, PLASTIC]
    radius = math.sqrt((row[i, U] - centre) ** 2 + row[i, V] ** 2 / stiffness)
    low, high = centre - radius, centre + radius
    if high > row[i, PLASTIC] + row[i, YIELD] or low < row[i, PLASTIC] - row[i, YIELD]:
        return -math.inf, math.inf
    return low, high


@lean
def is_settled(row):
    """Tell whether in free vibration no gap can close any more and no displacement can exceed its maximum."""
    left_high = -math.inf
    for i in range(row.shape[0]):
        low, high = reach_in_free_vibration(row, i)
        if max(high, -low) > (1.0 + SETTLED) * row[i, HIGHEST]:
            return False
        if i > 0 and left_high - low >= row[i - 1, GAP]:
            return False
        left_high = high
    return True


@kernel
def run_history(acceleration, dt, refinement, row, log, motion, work):
    """
    Fill motion (n_time, N, 3) and work (n_time, N, 4) at every sample; return how many samples were used.

    A negative number says at which sample a segment had too many events to get through.

    After the record the ground rests, and the history goes on until it is settled or its arrays are
    full.
    """
    duration = dt / refinement
    terms = taylor_terms(row, duration)
    done = work[0].copy()
    motion[0] = row[:, U : PLASTIC + 1]
    for k in range(1, motion.shape[0]):
        slope = start = 0.0
        if k < acceleration.size:
            start, slope = acceleration[k - 1], (acceleration[k] - acceleration[k - 1]) / dt
        elif is_settled(row):
            return k
        for part in range(refinement):
            shift = part * duration
            segment = Segment((k - 1) * dt + shift, duration, start + slope * shift, slope, terms)
            if not advance(row, log, done, segment):
                return -k
        motion[k] = row[:, U : PLASTIC + 1]
        work[k] = done
        work[k, :, TRANSFER] += row[:, GIVEN]
    return motion.shape[0]
