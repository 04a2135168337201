"""Whole history of a row of structures against one record, with its energies, sample by sample."""

import math

import numpy as np

from ._jit import kernel
from .polynomial_roots import value_and_slope
from .pounding_contact import IN_SEGMENT
from .pounding_events import DISPLACEMENT, find_event, finish_piece, raise_peaks
from .pounding_motion import (
    HARDENING,
    MASS,
    PARTICIPATION,
    PLASTIC,
    RATE,
    STIFFNESS,
    YIELD,
    Segment,
    U,
    V,
    fill_force,
    taylor_terms,
)

# columns of the work done on each structure since the start
INPUT, DAMPING, HYSTERETIC, TRANSFER = 0, 1, 2, 3
#: Gauss-Legendre with 10 nodes is exact for polynomials of degree 19; what remains of v² at omega h = 0.7 is < 1e-18.
NODES, WEIGHTS = np.polynomial.legendre.leggauss(10)

#: A displacement has reached its maximum when what it can still reach exceeds it by no more than this share.
SETTLED = 1e-13


@kernel
def _velocity_at(row, i, terms, time):
    """Return the velocity of a structure at a time of the piece."""
    return value_and_slope(row.curve[i], terms, time)[1]


@kernel
def _add_ground_and_damping(row, work, acceleration, slope, span, terms):
    """Add input (per participation), viscous and hysteretic energy of a piece."""
    half = 0.5 * span
    for i in range(row.phase.size):
        mass, drive = row.structures[i, MASS], row.structures[i, PARTICIPATION]
        if mass == math.inf:
            continue  # the energies of a wall are not defined
        for node in range(NODES.size):
            time = half * (1.0 + NODES[node])
            velocity = _velocity_at(row, i, terms, time)
            weight = half * WEIGHTS[node] * mass * velocity
            work[i, INPUT] -= weight * drive * (acceleration + slope * time)
            work[i, DAMPING] += weight * 2.0 * row.structures[i, RATE] * velocity
        if row.phase[i] != 0:
            moved = value_and_slope(row.curve[i], terms, span)[0] - row.curve[i, 0]
            lost = (1.0 - row.structures[i, HARDENING]) * row.structures[i, STIFFNESS] * row.structures[i, YIELD]
            work[i, HYSTERETIC] += mass * lost * abs(moved)


@kernel
def _add_contact_work(row, work, acceleration, slope, span, terms):
    """Add the work of the contact forces of a piece to the energy that each structure has transferred."""
    half = 0.5 * span
    for j in range(row.stuck.size):
        if row.stuck[j]:
            fill_force(row, j, acceleration, slope, span, terms)
            for node in range(NODES.size):
                time = half * (1.0 + NODES[node])
                force = value_and_slope(row.guard, terms - 2, time)[0]
                done = half * WEIGHTS[node] * force * _velocity_at(row, j, terms, time)
                work[j, TRANSFER] += done
                work[j + 1, TRANSFER] -= done


@kernel
def advance(row, tally, rules, work, segment):
    """Carry the row through one segment, event by event; tell whether it got through."""
    tally.counts[IN_SEGMENT] = 0
    elapsed, slope, terms = 0.0, segment.slope, segment.terms
    for _ in range(2 * rules.bounces):
        span, kind, place = find_event(row, segment, elapsed)
        raise_peaks(row, tally, span, terms)
        acceleration = segment.acceleration + slope * elapsed
        _add_ground_and_damping(row, work, acceleration, slope, span, terms)
        _add_contact_work(row, work, acceleration, slope, span, terms)
        elapsed = elapsed + span if kind else segment.duration
        finish_piece(row, tally, rules, segment, elapsed, span, kind, place)
        if elapsed >= segment.duration:
            return True
    return False


@kernel
def reach_in_free_vibration(structures, state, i):
    """
    Return the least and largest displacement that a structure can still reach in undisturbed free vibration.

    The radius about the place without force only falls. Infinite if the structure can still yield.
    """
    stiffness = structures[i, STIFFNESS]
    centre = 0.0
    if structures[i, YIELD] < math.inf:
        centre = (1.0 - structures[i, HARDENING]) * state[i, PLASTIC]
    radius = math.sqrt((state[i, U] - centre) ** 2 + state[i, V] ** 2 / stiffness)
    low, high = centre - radius, centre + radius
    if high > state[i, PLASTIC] + structures[i, YIELD] or low < state[i, PLASTIC] - structures[i, YIELD]:
        return -math.inf, math.inf
    return low, high


@kernel
def is_settled(row, tally):
    """Tell whether in free vibration no gap can close any more and no displacement can exceed its maximum."""
    left_high = -math.inf
    for i in range(row.phase.size):
        low, high = reach_in_free_vibration(row.structures, row.state, i)
        if max(high, -low) > (1.0 + SETTLED) * tally.peaks[i, DISPLACEMENT]:
            return False
        if i > 0 and left_high - low >= row.gaps[i - 1]:
            return False
        left_high = high
    return True


@kernel
def run_history(acceleration, dt, refinement, row, tally, rules, motion, work):
    """
    Fill motion (n_time, N, 3) and work (n_time, N, 4) at every sample; return how many samples were used.

    A negative number says at which sample a segment had too many events to get through.

    After the record the ground rests, and the history goes on until it is settled or its arrays are full.
    """
    duration = dt / refinement
    terms = taylor_terms(row.structures, duration)
    done = work[0].copy()
    motion[0] = row.state
    for k in range(1, motion.shape[0]):
        slope = start = 0.0
        if k < acceleration.size:
            start, slope = acceleration[k - 1], (acceleration[k] - acceleration[k - 1]) / dt
        elif is_settled(row, tally):
            return k
        for part in range(refinement):
            shift = part * duration
            segment = Segment((k - 1) * dt + shift, duration, start + slope * shift, slope, terms)
            if not advance(row, tally, rules, done, segment):
                return -k
        motion[k] = row.state
        work[k] = done
        work[k, :, TRANSFER] += tally.transfer
    return motion.shape[0]
