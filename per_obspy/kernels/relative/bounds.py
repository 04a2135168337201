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

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.relative.relative_samples import STATE_PEAKS, frame_of
from per_obspy.kernels.spectra.tile_search import TILE


@kernel
def strongest_inputs(ground, dt):
    """
    Return the strongest motion of both components in any tile, (3, 2).

    Rows: largest acceleration, largest rate of change, and integral over a tile of the size.
    """
    inputs = np.zeros((3, 2))
    for component in range(2):
        for first in range(0, ground.shape[1] - 1, TILE):
            integral = 0.0
            # Integral of the size by the trapezoidal rule, an upper bound
            for i in range(first, first + TILE):
                start, end = ground[component, i], ground[component, i + 1]
                integral += 0.5 * (abs(start) + abs(end))
                # Largest acceleration and rate of change
                inputs[0, component] = max(inputs[0, component], abs(start), abs(end))
                inputs[1, component] = max(inputs[1, component], abs(end - start) / dt)
            inputs[2, component] = max(inputs[2, component], integral * dt)
    return inputs


@kernel
def between_sample_margins(pair, dt, table, lane, inputs):
    """Return bounds of how far the relative displacement exceeds its samples, and their cubics."""
    # Strongest motion along the pair's azimuth
    north, east = abs(pair[6]), abs(pair[7])
    peak = north * inputs[0, 0] + east * inputs[0, 1]
    rate = north * inputs[1, 0] + east * inputs[1, 1]
    integral = north * inputs[2, 0] + east * inputs[2, 1]
    # Derivatives of either structure from its largest radius within a tile
    radius_1 = _radius(0, table, lane, peak) + integral / pair[0]
    radius_2 = _radius(1, table, lane, peak) + integral / pair[3]
    second_1, _, fourth_1 = _derivatives(pair[0], pair[1], radius_1, peak, rate, 0.0)
    second_2, third_2, fourth_2 = _derivatives(pair[3], pair[4], radius_2, peak, rate, 0.0)

    # Force on the relative motion D and its first two derivatives
    unlike, viscosity, stiffness = differences(pair)
    force = unlike * peak + (viscosity * pair[3] + stiffness) * radius_2
    force_rate = unlike * rate + viscosity * second_2 + stiffness * pair[3] * radius_2
    force_bend = viscosity * third_2 + stiffness * second_2
    # Derivatives of D from its own radius
    radius = math.sqrt(table[STATE_PEAKS + 2, lane]) + force * TILE * dt / pair[0]
    second, _, fourth = _derivatives(pair[0], pair[1], radius, force, force_rate, force_bend)
    # The smaller bound counts
    second = min(second, pair[2] * second_1 + pair[5] * second_2)
    fourth = min(fourth, pair[2] * fourth_1 + pair[5] * fourth_2)
    return dt**2 / 8.0 * second, dt**4 / 384.0 * fourth


@kernel
def differences(pair):
    """Return the sizes of q1 - q2, q2 (c1 - c2) and q2 (k1 - k2) of two structures."""
    # c = 2 xi omega, k = omega²
    viscosity = 2.0 * abs(pair[1] * pair[0] - pair[4] * pair[3])
    stiffness = abs(pair[0] - pair[3]) * (pair[0] + pair[3])
    return abs(pair[2] - pair[5]), pair[5] * viscosity, pair[5] * stiffness


@kernel
def _radius(body, table, lane, peak):
    """Return the largest radius of a structure before a tile."""
    scale, _, _, shift_u, shift_z = frame_of(body, table, lane)
    shifted = math.sqrt(table[STATE_PEAKS + body, lane])
    return scale * shifted + math.hypot(shift_u, shift_z) * peak


@kernel
def _derivatives(omega, damping, radius, force, force_rate, force_bend):
    """Return bounds of an oscillator's second to fourth derivative, from radius and force."""
    viscosity = 2.0 * damping * omega
    stiffness = omega * omega
    second = stiffness * radius * math.sqrt(1.0 + 4.0 * damping * damping) + force
    third = viscosity * second + stiffness * omega * radius + force_rate
    fourth = viscosity * third + stiffness * second + force_bend
    return second, third, fourth


@kernel
def may_grow(pair, motion, largest):
    """
    Return whether a free vibration may exceed one of the largest values.

    ``motion``: the states ``u, z`` of structure 1, then of 2.
    """
    # Sum of the radii, which never grow
    u1, z1, u2, z2 = motion
    radius_1, radius_2 = math.hypot(u1, z1), math.hypot(u2, z2)
    least = min(largest[0], largest[1])
    if pair[2] * radius_1 + pair[5] * radius_2 <= least:
        return False
    # Radius of the relative motion D, and the force on it
    _, viscosity, stiffness = differences(pair)
    force = (viscosity * pair[3] + stiffness) * radius_2
    distance = pair[2] * u1 - pair[5] * u2
    slope = pair[2] * z1 - pair[5] * z2 * pair[3] / pair[0]
    radius = math.hypot(distance, slope)
    # The radius of a free vibration falls like exp(-xi omega t), but for this factor: its integral
    # over all time
    decay = pair[4] * pair[3] * math.sqrt((1.0 - pair[4]) / (1.0 + pair[4]))
    return radius > least or force > (least - radius) * decay * pair[0]
