"""Complete history of a row of structures against one record, with its energies."""

import math

import numpy as np

from per_obspy.kernels._jit import kernel, lean
from per_obspy.kernels.polynomial_roots import first_fall, size_and_curvature, value_and_slope
from per_obspy.kernels.pounding_events.motion import (
    BOUNCE_LIMIT,
    BOUNCES,
    DAMPING_RATE,
    EVENT_FUNCTION,
    GAP,
    HARDENING,
    IN_CONTACT,
    LARGEST_DISPLACEMENT,
    MASS,
    OPENING,
    PARTICIPATION,
    PHASE,
    PLASTIC,
    STIFFNESS,
    TAYLOR,
    TRANSFERRED,
    YIELD,
    Segment,
    U,
    V,
    fill_contact_force,
    taylor_terms,
)
from per_obspy.kernels.pounding_events.next_event import find_event, finish_piece

# columns of the work done on each structure since the start, J (a wall has none)
WORK_INPUT, WORK_DAMPING, WORK_HYSTERETIC, WORK_TRANSFER = 0, 1, 2, 3
#: Gauss-Legendre with 10 nodes is exact for polynomials of degree 19; what remains of v² at omega h
#: = 0.7 is < 1e-18.
NODES, WEIGHTS = np.polynomial.legendre.leggauss(10)

#: A displacement has reached its maximum when its reach exceeds that by no more than this share.
SETTLED = 1e-13


@lean
def _velocity_at(row, i, terms, time):
    """Return the velocity of a structure at a time of the piece."""
    return value_and_slope(row, i, TAYLOR, terms, time)[1]


@lean
def _add_ground_and_damping(row, work, acceleration, slope, span, terms):
    """Add the input (per participation), viscous and hysteretic energy of a piece."""
    half = 0.5 * span
    for i in range(row.shape[0]):
        mass = row[i, MASS]
        participation = row[i, PARTICIPATION]
        if mass == math.inf:
            continue  # the energies of a wall are not defined
        # -∫ m q a v dt and ∫ 2 m xi omega v² dt, by Gauss-Legendre
        for node in range(NODES.size):
            time = half * (1.0 + NODES[node])
            velocity = _velocity_at(row, i, terms, time)
            weight = half * WEIGHTS[node] * mass * velocity
            work[i, WORK_INPUT] -= weight * participation * (acceleration + slope * time)
            work[i, WORK_DAMPING] += weight * 2.0 * row[i, DAMPING_RATE] * velocity
        # yield force times plastic displacement
        if row[i, PHASE] != 0.0:
            moved = value_and_slope(row, i, TAYLOR, terms, span)[0] - row[i, U]
            yield_force = (1.0 - row[i, HARDENING]) * row[i, STIFFNESS] * row[i, YIELD]
            work[i, WORK_HYSTERETIC] += mass * yield_force * abs(moved)


@lean
def _add_contact_work(row, work, acceleration, slope, span, terms):
    """Add the work of the contact forces of a piece to the transferred energies."""
    half = 0.5 * span
    for j in range(row.shape[0] - 1):
        if row[j, IN_CONTACT]:
            # ∫ f v dt, by Gauss-Legendre
            fill_contact_force(row, j, acceleration, slope, span, terms)
            for node in range(NODES.size):
                time = half * (1.0 + NODES[node])
                force = value_and_slope(row, j, EVENT_FUNCTION, terms - 2, time)[0]
                transferred = half * WEIGHTS[node] * force * _velocity_at(row, j, terms, time)
                work[j, WORK_TRANSFER] += transferred
                work[j + 1, WORK_TRANSFER] -= transferred


@lean
def raise_openings(row, span, terms):
    """Raise the largest opening of every interface to that of a piece, exact between its ends."""
    for j in range(row.shape[0] - 1):
        # both ends
        start = row[j + 1, U] - row[j, U]
        end = _opening_at(row, j, terms, span)
        row[j, OPENING] = max(row[j, OPENING], start, end)
        # roots of the rate of the opening, unless its bound excludes a larger opening inside
        for n in range(1, terms):
            rate = n * (row[j + 1, TAYLOR + n] - row[j, TAYLOR + n])
            row[j, EVENT_FUNCTION + n - 1] = rate
        size, _ = size_and_curvature(row, j, EVENT_FUNCTION, terms - 1, span)
        largest_rate = size + abs(row[j, EVENT_FUNCTION])
        if max(start, end) + span * largest_rate > row[j, OPENING]:
            _raise_opening_at_roots(row, j, span, terms)


@lean
def _opening_at(row, j, terms, time):
    """Return the opening of an interface at a time of the piece."""
    left = value_and_slope(row, j, TAYLOR, terms, time)
    right = value_and_slope(row, j + 1, TAYLOR, terms, time)
    return right[0] - left[0]


@lean
def _raise_opening_at_roots(row, j, span, terms):
    """Raise the largest opening at the roots of its rate, which is the event function."""
    # roots one after another; the sign changes at each
    sign = 1.0 if row[j, EVENT_FUNCTION] > 0.0 else -1.0
    time = first_fall(row, j, EVENT_FUNCTION, terms - 1, sign, 0.0, span, 0.0)
    while time >= 0.0:
        row[j, OPENING] = max(row[j, OPENING], _opening_at(row, j, terms, time))
        sign = -sign
        time = first_fall(row, j, EVENT_FUNCTION, terms - 1, sign, time, span, 0.0)


@lean
def advance_segment(row, log, work, segment):
    """Carry the row through one segment, event by event; return whether it reached the end."""
    row[0, BOUNCES] = 0.0
    elapsed = 0.0
    slope = segment.slope
    terms = segment.terms
    for _ in range(int(2 * row[0, BOUNCE_LIMIT])):
        # the piece until the next event, with its openings and its work
        span, kind, index = find_event(row, segment, elapsed)
        raise_openings(row, span, terms)
        acceleration = segment.acceleration + slope * elapsed
        _add_ground_and_damping(row, work, acceleration, slope, span, terms)
        _add_contact_work(row, work, acceleration, slope, span, terms)
        # state at its end
        elapsed = elapsed + span if kind else segment.duration
        finish_piece(row, log, segment, elapsed, span, kind, index)
        if elapsed >= segment.duration:
            return True
    return False


@lean
def reach_in_free_vibration(row, i):
    """
    Return the least and largest displacement of a structure in undisturbed free vibration from now.

    Its radius about the displacement without force never grows. Infinite if it can still yield.
    """
    stiffness = row[i, STIFFNESS]
    # displacement at which there is no restoring force
    centre = 0.0
    if row[i, YIELD] < math.inf:
        centre = (1.0 - row[i, HARDENING]) * row[i, PLASTIC]
    # radius of (11), (12) about it
    radius = math.sqrt((row[i, U] - centre) ** 2 + row[i, V] ** 2 / stiffness)
    low = centre - radius
    high = centre + radius
    if high > row[i, PLASTIC] + row[i, YIELD] or low < row[i, PLASTIC] - row[i, YIELD]:
        return -math.inf, math.inf
    return low, high


@lean
def is_settled(row):
    """Return whether free vibration can no longer close a gap or raise a largest displacement."""
    left_high = -math.inf
    for i in range(row.shape[0]):
        low, high = reach_in_free_vibration(row, i)
        # a larger displacement
        if max(high, -low) > (1.0 + SETTLED) * row[i, LARGEST_DISPLACEMENT]:
            return False
        # contact with the neighbour on the left
        if i > 0 and left_high - low >= row[i - 1, GAP]:
            return False
        left_high = high
    return True


@lean
def _write_sample(row, total, motion, work, k):
    """Write the state of the row and the work done on it at a sample."""
    for i in range(row.shape[0]):
        for column in range(motion.shape[2]):
            motion[k, i, column] = row[i, U + column]
        for column in range(work.shape[2]):
            work[k, i, column] = total[i, column]
        # impacts transfer energy too
        work[k, i, WORK_TRANSFER] += row[i, TRANSFERRED]


@kernel
def run_history(acceleration, dt, refinement, row, log, motion, work):
    """
    Run a row of structures through a record, and through free vibration until it is settled.

    Parameters
    ----------
    acceleration : (n_samples,) ndarray
        Ground acceleration, positive from the first structure towards the last, m/s². The ground
        rests after it.
    dt : float
        Sampling interval, s.
    refinement : int
        Number of segments into which each sampling interval is cut.
    row : (n_structures, ROW_COLUMNS) ndarray
        Row of structures at rest, then at the end; see `motion` for its columns.
    log : (n_lines, LOG_COLUMNS) ndarray
        Receives one line per impact as long as there is room; see `contact` for its columns.
    motion : (n_time, n_structures, 3) ndarray
        Receives displacement (m), velocity (m/s) and plastic displacement (m) at every sample.
    work : (n_time, n_structures, 4) ndarray
        Receives input, viscous, hysteretic and transferred energy until every sample, J.

    Returns
    -------
    int
        Number of samples used: n_time, or fewer where the row was settled earlier. Negative (the
        sample) where a segment had too many events.
    """
    duration = dt / refinement
    terms = taylor_terms(row, duration)
    total = np.zeros((row.shape[0], work.shape[2]))
    _write_sample(row, total, motion, work, 0)
    for k in range(1, motion.shape[0]):
        # ground acceleration and its slope in this sampling interval; zero after the record
        slope = start = 0.0
        if k < acceleration.size:
            start = acceleration[k - 1]
            slope = (acceleration[k] - acceleration[k - 1]) / dt
        elif is_settled(row):
            return k
        # the interval, segment by segment
        for part in range(refinement):
            shift = part * duration
            time = (k - 1) * dt + shift
            segment = Segment(time, duration, start + slope * shift, slope, terms)
            if not advance_segment(row, log, total, segment):
                return -k
        # results at the sample
        _write_sample(row, total, motion, work, k)
    return motion.shape[0]
