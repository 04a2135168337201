"""
Bounds of how far the relative displacement of a pair exceeds its samples, and their cubics.

Between samples a function exceeds the chord by ``dt²/8`` of its second derivative at most, and the
cubic through values and slopes by ``dt⁴/384`` of its fourth. Both are bounded in two ways, of which
the smaller counts: by the radii of both structures, and, for structures so alike that they hardly
separate, by the motion ``D = q1 u1 - q2 u2`` itself, which is that of structure 1 under the
remaining forces::

    D'' + c1 D' + k1 D = -(q1 - q2) a - q2 ((c1 - c2) v2 + (k1 - k2) u2)
"""

import math

import numpy as np

from per_obspy.kernels._aligned import aligned
from per_obspy.kernels._jit import kernel, lean, vectorised
from per_obspy.kernels.relative.relative_samples import STATE_PEAKS, shift_of
from per_obspy.kernels.spectra.tile_search import SIDE, TILE

#: Where the parts of a tile's largest size, largest change and sum of the sizes begin in a line.
PEAK, JUMP, SUM = 0, SIDE, 2 * SIDE


@kernel
def tile_inputs(ground, dt):
    """
    Return the strongest motion of both components in every tile, (n_tiles, 3, 2).

    Rows: largest acceleration, largest rate of change, and integral over the tile of the size.
    """
    tiles = (ground.shape[1] - 1) // TILE
    inputs, parts = np.empty((tiles, 3, 2)), aligned(1, 3 * SIDE)[0]
    for tile in range(tiles):
        for component in range(2):
            samples = ground[component, tile * TILE : (tile + 1) * TILE + 1]
            _gather_sizes(samples, parts)
            # The largest of all parts, and their sum
            peak, jump, total = abs(samples[0]), 0.0, 0.0
            for k in range(SIDE):
                peak, jump = max(peak, parts[PEAK + k]), max(jump, parts[JUMP + k])
                total += parts[SUM + k]
            # Integral of the size by the trapezoidal rule, an upper bound
            integral = total + 0.5 * (abs(samples[0]) - abs(samples[TILE]))
            inputs[tile, 0, component], inputs[tile, 1, component] = peak, jump / dt
            inputs[tile, 2, component] = integral * dt
    return inputs


@vectorised
def _gather_sizes(samples, parts):
    """
    Fill the largest size, largest change per step and sum of the sizes of a tile, in 8 parts each.

    Its first sample is left out.
    """
    for k in range(3 * SIDE):
        parts[k] = 0.0
    for i in range(0, TILE, 2 * SIDE):
        for k in range(SIDE):
            # Ends of two steps, one in each half of 16 steps
            start, end = samples[i + k], samples[i + k + 1]
            later, last = samples[i + SIDE + k], samples[i + SIDE + k + 1]
            parts[PEAK + k] = max(parts[PEAK + k], abs(end), abs(last))
            parts[JUMP + k] = max(parts[JUMP + k], abs(end - start), abs(last - later))
            parts[SUM + k] += abs(end) + abs(last)


@kernel
def strongest_inputs(inputs):
    """Return the strongest motion of both components in any tile, (3, 2)."""
    strongest = np.zeros((3, 2))
    for tile in range(inputs.shape[0]):
        for row in range(3):
            for component in range(2):
                size = inputs[tile, row, component]
                strongest[row, component] = max(strongest[row, component], size)
    return strongest


@lean
def largest_radii(pair, table, lane, inputs):
    """Return the largest radii of both structures, and of D, before any tile so far."""
    peak = abs(pair[6]) * inputs[0, 0] + abs(pair[7]) * inputs[0, 1]
    radius_1 = _radius(0, table, lane, peak)
    radius_2 = _radius(1, table, lane, peak)
    return radius_1, radius_2, math.sqrt(table[STATE_PEAKS + 2, lane])


@lean
def present_radii(pair, motion):
    """Return the radii of both structures, and of D, in a state ``u, z`` of 1, then of 2."""
    u1, z1, u2, z2 = motion
    distance = pair[2] * u1 - pair[5] * u2
    slope = pair[2] * z1 - pair[5] * z2 * pair[3] / pair[0]
    return math.hypot(u1, z1), math.hypot(u2, z2), math.hypot(distance, slope)


@lean
def tile_margins(pair, dt, radii, inputs):
    """Return :func:`between_sample_margins` over a tile, from its strongest motion (3, 2)."""
    # Strongest motion along the pair's azimuth
    north, east = abs(pair[6]), abs(pair[7])
    peak = north * inputs[0, 0] + east * inputs[0, 1]
    rate = north * inputs[1, 0] + east * inputs[1, 1]
    integral = north * inputs[2, 0] + east * inputs[2, 1]
    return between_sample_margins(pair, dt, TILE * dt, radii, (peak, rate, integral))


@lean
def between_sample_margins(pair, dt, duration, radii, ground):
    """
    Return bounds of how far the relative displacement exceeds its samples, and their cubics.

    They hold for a time (s) from a state of the radii of both structures and of D, under a ground
    motion of largest acceleration, rate of change, and integral of the size.
    """
    peak, rate, integral = ground
    # Derivatives of either structure from its largest radius within the time
    radius_1 = radii[0] + integral / pair[0]
    radius_2 = radii[1] + integral / pair[3]
    second_1, _, fourth_1 = _derivatives(pair[0], pair[1], radius_1, peak, rate, 0.0)
    second_2, third_2, fourth_2 = _derivatives(pair[3], pair[4], radius_2, peak, rate, 0.0)

    # Force on the relative motion D and its first two derivatives
    unlike, viscosity, stiffness = differences(pair)
    force = unlike * peak + (viscosity * pair[3] + stiffness) * radius_2
    force_rate = unlike * rate + viscosity * second_2 + stiffness * pair[3] * radius_2
    force_bend = viscosity * third_2 + stiffness * second_2
    # Derivatives of D from its own radius
    radius = radii[2] + force * duration / pair[0]
    second, _, fourth = _derivatives(pair[0], pair[1], radius, force, force_rate, force_bend)
    # The smaller bound counts
    second = min(second, pair[2] * second_1 + pair[5] * second_2)
    fourth = min(fourth, pair[2] * fourth_1 + pair[5] * fourth_2)
    return dt**2 / 8.0 * second, dt**4 / 384.0 * fourth


@lean
def differences(pair):
    """Return the sizes of q1 - q2, q2 (c1 - c2) and q2 (k1 - k2) of two structures."""
    # c = 2 xi omega, k = omega²
    viscosity = 2.0 * abs(pair[1] * pair[0] - pair[4] * pair[3])
    stiffness = abs(pair[0] - pair[3]) * (pair[0] + pair[3])
    return abs(pair[2] - pair[5]), pair[5] * viscosity, pair[5] * stiffness


@lean
def _radius(body, table, lane, peak):
    """Return the largest radius of a structure before a tile."""
    shift_u, shift_z = shift_of(body, table, lane)
    shifted = math.sqrt(table[STATE_PEAKS + body, lane])
    return shifted + math.hypot(shift_u, shift_z) * peak


@lean
def _derivatives(omega, damping, radius, force, force_rate, force_bend):
    """Return bounds of an oscillator's second to fourth derivative, from radius and force."""
    viscosity = 2.0 * damping * omega
    stiffness = omega * omega
    second = stiffness * radius * math.sqrt(1.0 + 4.0 * damping * damping) + force
    third = viscosity * second + stiffness * omega * radius + force_rate
    fourth = viscosity * third + stiffness * second + force_bend
    return second, third, fourth


@lean
def may_grow(pair, motion, largest):
    """
    Return whether a free vibration may exceed one of the largest values.

    ``motion``: the states ``u, z`` of structure 1, then of 2.
    """
    # Sum of the radii, which never grow
    radius_1, radius_2, radius = present_radii(pair, motion)
    least = min(largest[0], largest[1])
    if pair[2] * radius_1 + pair[5] * radius_2 <= least:
        return False
    # Force on the relative motion D
    _, viscosity, stiffness = differences(pair)
    force = (viscosity * pair[3] + stiffness) * radius_2
    # The radius of a free vibration falls like exp(-xi omega t), but for this factor: its integral
    # over all time
    decay = pair[4] * pair[3] * math.sqrt((1.0 - pair[4]) / (1.0 + pair[4]))
    return radius > least or force > (least - radius) * decay * pair[0]
