"""
Largest relative displacement of many pairs against one record, exact for piecewise-linear ground acceleration.

Every pair is driven along its own azimuth. Pairs are the inner loop; the control points of the cubic through
displacements and slopes bound the relative displacement between samples. Only a tile of steps that could hold a new
maximum is walked again for that pair, and peaks are then found on the exact solution.
"""

import math

import numpy as np

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.oscillator import state_after, step

PAIRS, TILE = 64, 32  # of a block, and steps of a tile: all arrays stay in the first-level cache
FREE_PERIODS = 20.0  # free vibration is followed for at most this many of the longer period
CUBIC_ERROR = 4.0 / 384.0  # of a cubic through values and slopes: 1/384 of phase^4 times the amplitude, with a margin
LONGEST_PHASE = 0.7  # of a step in which a peak is sought by one cubic
STILL = 1e-140  # m; denormal numbers begin at 1e-308
NEWTON = 4  # exact steps from the cubic's peak


@kernel
def relative_maxima(north, east, dt, pairs, largest):
    """
    Fill ``largest`` (2, n) with the maxima of ``q1 u1 - q2 u2`` and of ``q2 u2 - q1 u1``, free vibration included.

    ``pairs`` (8, n): circular frequency, damping and participation of 1, then of 2; cosine and sine of the azimuth.
    The record ends with zero acceleration.
    """
    coefficients = np.zeros((22, PAIRS))
    motion, start, bounds = np.empty((6, PAIRS)), np.empty((6, PAIRS)), np.empty((4, PAIRS))
    ground = np.empty((2, TILE + 2))
    count, record = pairs.shape[1], north.size - 1
    largest[:] = 0.0
    for first in range(0, count, PAIRS):
        width = min(PAIRS, count - first)
        _load(pairs, first, width, dt, coefficients)
        _raise_to_samples(north, east, coefficients, ground, motion, bounds, largest[:, first : first + width])
        motion[:] = 0.0
        begin, going = 0, True
        while going:
            _copy_ground(north, east, begin, ground)
            start[:] = motion
            _advance(coefficients, ground, motion, bounds)
            for pair in range(width):
                index = first + pair
                slack = _slack(pairs, index, dt, start, motion, ground, pair)
                higher = bounds[0, pair] + slack > largest[0, index] or bounds[1, pair] + slack > largest[1, index]
                if higher and begin < _end(pairs, index, dt, record):
                    _search(pairs, index, dt, coefficients, start, ground, slack, pair, largest)
            begin += TILE
            _flush(motion)
            going = begin < record or _any_can_grow(pairs, first, width, dt, motion, begin, record, largest)


@kernel
def _raise_to_samples(north, east, coefficients, ground, motion, bounds, largest):
    """Raise the maxima of a block to the samples', so that few tiles are left to search in."""
    motion[:] = 0.0
    for begin in range(0, north.size - 1, TILE):
        _copy_ground(north, east, begin, ground)
        _advance(coefficients, ground, motion, bounds)
        _flush(motion)
        for pair in range(largest.shape[1]):
            largest[0, pair] = max(largest[0, pair], bounds[2, pair])
            largest[1, pair] = max(largest[1, pair], bounds[3, pair])


@kernel
def _load(pairs, first, width, dt, coefficients):
    """Gather the steps of both structures, the weights of displacement and slope, and the direction."""
    for pair in range(width):
        for body in range(2):
            omega, damping = pairs[3 * body, first + pair], pairs[3 * body + 1, first + pair]
            weight = pairs[3 * body + 2, first + pair] * (1.0 - 2.0 * body)
            parts = step(omega, damping, dt)
            for part in range(8):
                coefficients[8 * body + part, pair] = parts[part]
            coefficients[16 + body, pair] = weight
            coefficients[18 + body, pair] = weight * omega * dt / 3.0
            coefficients[20 + body, pair] = pairs[6 + body, first + pair]


@kernel
def _copy_ground(north, east, begin, ground):
    """Copy a tile of the record, and behind it its peaks; nothing moves after the record's end."""
    ground[:, TILE + 1] = 0.0
    for place in range(TILE + 1):
        inside = begin + place < north.size
        ground[0, place] = north[begin + place] if inside else 0.0
        ground[1, place] = east[begin + place] if inside else 0.0
        for component in range(2):
            ground[component, TILE + 1] = max(ground[component, TILE + 1], abs(ground[component, place]))


@kernel
def _advance(coefficients, ground, motion, bounds):
    """
    Step a block over a tile; keep the largest and the smallest control point of each pair, and the same of the samples.

    The copies are local and of constant size, so that the compiler sees that nothing overlaps and makes vectors.
    """
    c, m, largest, smallest = np.empty((22, PAIRS)), np.empty((6, PAIRS)), np.zeros(PAIRS), np.zeros(PAIRS)
    highest, lowest = np.zeros(PAIRS), np.zeros(PAIRS)
    c[:], m[:] = coefficients, motion
    for place in range(TILE):
        north_0, east_0, north_1, east_1 = (
            ground[0, place],
            ground[1, place],
            ground[0, place + 1],
            ground[1, place + 1],
        )
        for pair in range(PAIRS):
            a0 = c[20, pair] * north_0 + c[21, pair] * east_0
            a1 = c[20, pair] * north_1 + c[21, pair] * east_1
            u1, z1, u2, z2 = m[0, pair], m[1, pair], m[2, pair], m[3, pair]
            leaving = m[4, pair] + m[5, pair]
            m[0, pair] = c[0, pair] * u1 + c[1, pair] * z1 + (c[4, pair] * a0 + c[5, pair] * a1)
            m[1, pair] = c[2, pair] * u1 + c[3, pair] * z1 + (c[6, pair] * a0 + c[7, pair] * a1)
            m[2, pair] = c[8, pair] * u2 + c[9, pair] * z2 + (c[12, pair] * a0 + c[13, pair] * a1)
            m[3, pair] = c[10, pair] * u2 + c[11, pair] * z2 + (c[14, pair] * a0 + c[15, pair] * a1)
            distance = c[16, pair] * m[0, pair] + c[17, pair] * m[2, pair]
            slope = c[18, pair] * m[1, pair] + c[19, pair] * m[3, pair]
            m[4, pair], m[5, pair] = distance, slope
            largest[pair] = max(largest[pair], distance, leaving, distance - slope)
            smallest[pair] = min(smallest[pair], distance, leaving, distance - slope)
            highest[pair] = max(highest[pair], distance)
            lowest[pair] = min(lowest[pair], distance)
    motion[:] = m
    for pair in range(PAIRS):
        bounds[0, pair], bounds[1, pair] = largest[pair], -smallest[pair]
        bounds[2, pair], bounds[3, pair] = highest[pair], -lowest[pair]


@kernel
def _flush(motion):
    """Set what is left of a motion that has died out to zero: denormal numbers are slow."""
    for row in range(6):
        for pair in range(PAIRS):
            if abs(motion[row, pair]) < STILL:
                motion[row, pair] = 0.0


@kernel
def _slack(pairs, index, dt, start, motion, ground, pair):
    """Return by how much the true relative displacement may exceed the cubic's control points in a tile."""
    strongest = abs(pairs[6, index]) * ground[0, TILE + 1] + abs(pairs[7, index]) * ground[1, TILE + 1]
    slack = 0.0
    for body in range(2):
        omega, participation = pairs[3 * body, index], pairs[3 * body + 2, index]
        before = abs(start[2 * body, pair]) + abs(start[2 * body + 1, pair])
        after = abs(motion[2 * body, pair]) + abs(motion[2 * body + 1, pair])
        radius = before + after + strongest / (omega * omega)
        slack += CUBIC_ERROR * participation * (omega * dt) ** 4 * radius
    return slack


@kernel
def _end(pairs, index, dt, record):
    """Return the number of steps after which a pair is no longer followed."""
    return record + FREE_PERIODS * 2.0 * math.pi / min(pairs[0, index], pairs[3, index]) / dt


@kernel
def _any_can_grow(pairs, first, width, dt, motion, begin, record, largest):
    """Tell whether the radii of a pair that vibrates freely still reach beyond one of its maxima."""
    for pair in range(width):
        index = first + pair
        reach = pairs[2, index] * math.hypot(motion[0, pair], motion[1, pair])
        reach += pairs[5, index] * math.hypot(motion[2, pair], motion[3, pair])
        if reach > min(largest[0, index], largest[1, index]) and begin < _end(pairs, index, dt, record):
            return True
    return False


@kernel
def _search(pairs, index, dt, c, start, ground, slack, pair, largest):
    """Walk a tile again and look for peaks in the steps whose control points reach beyond the maxima."""
    u1, z1, u2, z2 = start[0, pair], start[1, pair], start[2, pair], start[3, pair]
    distance, slope = start[4, pair], start[5, pair]
    for place in range(TILE):
        a0 = c[20, pair] * ground[0, place] + c[21, pair] * ground[1, place]
        a1 = c[20, pair] * ground[0, place + 1] + c[21, pair] * ground[1, place + 1]
        state = (u1, z1, u2, z2)
        leaving = distance + slope
        u1 = c[0, pair] * state[0] + c[1, pair] * state[1] + c[4, pair] * a0 + c[5, pair] * a1
        z1 = c[2, pair] * state[0] + c[3, pair] * state[1] + c[6, pair] * a0 + c[7, pair] * a1
        u2 = c[8, pair] * state[2] + c[9, pair] * state[3] + c[12, pair] * a0 + c[13, pair] * a1
        z2 = c[10, pair] * state[2] + c[11, pair] * state[3] + c[14, pair] * a0 + c[15, pair] * a1
        distance = c[16, pair] * u1 + c[17, pair] * u2
        slope = c[18, pair] * z1 + c[19, pair] * z2
        arriving = distance - slope
        largest[0, index] = max(largest[0, index], distance)
        largest[1, index] = max(largest[1, index], -distance)
        high, low = max(leaving, arriving) + slack, min(leaving, arriving) - slack
        if high > largest[0, index] or -low > largest[1, index]:
            _peaks(pairs, index, dt, state, a0, (a1 - a0) / dt, largest)


@kernel
def _peaks(pairs, index, dt, state, acceleration, rate, largest):
    """Raise the maxima to the peaks inside one step, cut so that one cubic sees each of them."""
    parts = math.ceil(max(pairs[0, index], pairs[3, index]) * dt / LONGEST_PHASE)
    width = dt / parts
    distance_0, slope_0, _ = _relative(pairs, index, state, 0.0, acceleration, rate)
    for part in range(parts):
        distance_1, slope_1, _ = _relative(pairs, index, state, (part + 1) * width, acceleration, rate)
        largest[0, index] = max(largest[0, index], distance_1)
        largest[1, index] = max(largest[1, index], -distance_1)
        # derivative of the cubic over the part, b + 2 m x + k x²
        change, b, end = distance_1 - distance_0, slope_0 * width, slope_1 * width
        middle, k = 3.0 * change - 2.0 * b - end, 3.0 * (b + end - 2.0 * change)
        root = math.sqrt(max(middle * middle - k * b, 0.0))
        q = -(middle + math.copysign(root, middle))
        for x in (q / k if k != 0.0 else -1.0, b / q if q != 0.0 else -1.0):
            if -0.2 <= x <= 1.2:
                time = (part + min(max(x, 0.0), 1.0)) * width
                _climb(pairs, index, state, time, dt, acceleration, rate, largest)
        distance_0, slope_0 = distance_1, slope_1


@kernel
def _climb(pairs, index, state, time, dt, acceleration, rate, largest):
    """Raise the maxima to the stationary value near a time of the step."""
    for _ in range(NEWTON):
        _, slope, bend = _relative(pairs, index, state, time, acceleration, rate)
        time = min(max(time - slope / bend, 0.0), dt) if bend != 0.0 else time
    distance, _, _ = _relative(pairs, index, state, time, acceleration, rate)
    largest[0, index] = max(largest[0, index], distance)
    largest[1, index] = max(largest[1, index], -distance)


@kernel
def _relative(pairs, index, state, time, acceleration, rate):
    """Return relative displacement, velocity and acceleration at a time after the start of the step."""
    distance = slope = bend = 0.0
    for body in range(2):
        omega, damping = pairs[3 * body, index], pairs[3 * body + 1, index]
        weight = pairs[3 * body + 2, index] * (1.0 - 2.0 * body)
        u, v = state_after(time, state[2 * body], state[2 * body + 1] * omega, omega, damping, acceleration, rate)
        distance += weight * u
        slope += weight * v
        bend -= weight * (acceleration + rate * time + 2.0 * damping * omega * v + omega * omega * u)
    return distance, slope, bend
