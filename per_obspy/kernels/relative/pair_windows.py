"""
Part of a record that can hold the largest relative motion of a pair, by bounds.

The bounds of one oscillator are those of ``maxima/window.py``: over tiles of the phase D whose
acceleration does not exceed p, the root of the norm V falls like ``exp(-xi D)`` and rises by at
most ``p (1 - exp(-xi D)) / xi``, nor by more than the integral of the size over the phase. The
radius does not exceed ``sqrt(V / (1 - xi))``. Relative displacement and velocity of a pair do not
exceed the sums of both radii, and of both times their frequencies. Tiles whose bounds stay below a
displacement and a velocity that the pair reaches elsewhere need not be computed.
"""

import math

import numpy as np

from per_obspy.kernels._jit import kernel, lean
from per_obspy.kernels.relative.relative_samples import PAIR_LANES

#: Tiles of a group, whose bounds are computed together.
GROUP = 4
#: A window of more than this part of the record is taken for the whole of it.
WHOLE = 0.75


@kernel
def grouped_inputs(inputs):
    """Return the strongest motion of groups of tiles, (n_groups, 3, 2), from that of the tiles."""
    groups = np.zeros((-(-inputs.shape[0] // GROUP), 3, 2))
    for tile in range(inputs.shape[0]):
        for component in range(2):
            group, one = groups[tile // GROUP, :, component], inputs[tile, :, component]
            # Largest of acceleration and rate, sum of the integrals
            group[0], group[1] = max(group[0], one[0]), max(group[1], one[1])
            group[2] += one[2]
    return groups


@kernel
def bound_motion(inputs, duration, block, bounds):
    """
    Fill bounds of the radii of a block of pairs, group by group.

    Parameters
    ----------
    inputs : (n_groups, 3, 2) ndarray
        See ``bounds.tile_inputs``, of groups.
    duration : float
        Of a group, s.
    block : (PAIR_LANES, 8) ndarray
        Pairs, see ``relative_maxima``.
    bounds : (4, n_groups, PAIR_LANES) ndarray
        Receives the largest contact displacement of structure 1 and 2 before each group, and up to
        its end, m.
    """
    rates = _rates(duration, block)
    bound = np.zeros((2, PAIR_LANES))
    for group in range(inputs.shape[0]):
        north, east = inputs[group, 0, 0], inputs[group, 0, 1]
        north_sum, east_sum = inputs[group, 2, 0], inputs[group, 2, 1]
        for body in range(2):
            for lane in range(PAIR_LANES):
                # The smaller rise: by the largest acceleration, or by the integral of the size
                by_peak = rates[6, lane] * north + rates[7, lane] * east
                by_sum = rates[6, lane] * north_sum + rates[7, lane] * east_sum
                by_peak *= rates[3 * body + 1, lane]
                raised = min(by_peak, rates[3 * body + 2, lane] * by_sum)
                # Before the group and up to its end
                bounds[body, group, lane] = bound[body, lane]
                bounds[2 + body, group, lane] = bound[body, lane] + raised
                bound[body, lane] = rates[3 * body, lane] * bound[body, lane] + raised


@kernel
def _rates(duration, block):
    """Return decay and both gains of structure 1 and of 2 over a group, and the azimuth."""
    rates = np.empty((8, PAIR_LANES))
    for lane in range(PAIR_LANES):
        for body in range(2):
            # Structure of the pair, and phase of a group
            row = 3 * body
            omega, damping, share = block[lane, row], block[lane, row + 1], block[lane, row + 2]
            phase = omega * duration
            # Decay over a group, and gains from the largest acceleration and from the integral of
            # the size, of the root of V over that of 1 - xi
            gain = -math.expm1(-damping * phase) / damping if damping > 0.0 else phase
            unit = share / (omega * math.sqrt(1.0 - damping))
            rates[3 * body, lane] = math.exp(-damping * phase)
            rates[3 * body + 1, lane], rates[3 * body + 2, lane] = gain * unit / omega, unit
        rates[6, lane], rates[7, lane] = abs(block[lane, 6]), abs(block[lane, 7])
    return rates


@kernel
def expected_motion(block, bounds, part, floors):
    """Fill a part of the largest bounds of displacement (m) and velocity (m/s), (2, lanes)."""
    floors[:] = 0.0
    for group in range(bounds.shape[1]):
        for lane in range(PAIR_LANES):
            # Bounds of displacement and velocity in the group
            first, second = bounds[2, group, lane], bounds[3, group, lane]
            speed = block[lane, 0] * first + block[lane, 3] * second
            floors[0, lane] = max(floors[0, lane], part * (first + second))
            floors[1, lane] = max(floors[1, lane], part * speed)


@kernel
def find_pair_windows(duration, block, bounds, floors, forgotten, windows):
    """
    Fill the windows of a block, and zero floors of pairs of which all of the record counts.

    Rows of ``windows`` (2, lanes): the group before which the pair may be taken to be at rest, and
    the last group that may reach a floor. ``forgotten`` is the largest remainder of a motion that
    is not computed, over the floor.
    """
    number = bounds.shape[1]
    first, last = np.full(PAIR_LANES, float(number)), np.full(PAIR_LANES, -1.0)
    for group in range(number):
        this = float(group)
        for lane in range(PAIR_LANES):
            # Bounds of displacement and velocity in the group
            distance = bounds[2, group, lane] + bounds[3, group, lane]
            speed = (
                block[lane, 0] * bounds[2, group, lane] + block[lane, 3] * bounds[3, group, lane]
            )
            # Whether one reaches its floor
            reached = distance >= floors[0, lane] or speed >= floors[1, lane]
            first[lane] = min(first[lane], this if reached else np.inf)
            last[lane] = this if reached else last[lane]
    _fill_windows(first, last, duration, block, bounds, floors, forgotten, windows)


@lean
def _fill_windows(first, last, duration, block, bounds, floors, forgotten, windows):
    """Fill windows that begin where the motion before is forgotten; widen those that are wide."""
    number = bounds.shape[1]
    for lane in range(PAIR_LANES):
        negligible = forgotten * floors[0, lane], forgotten * floors[1, lane]
        start = _start(int(first[lane]), duration, block[lane], bounds[:, :, lane], negligible)
        windows[0, lane], windows[1, lane] = start, int(last[lane])
        # A wide window becomes the whole record
        if last[lane] - start > WHOLE * number:
            windows[0, lane], windows[1, lane] = 0, number - 1
            floors[:, lane] = 0.0


@lean
def _start(first, duration, pair, bounds, negligible):
    """Return the last group before which the motion is forgotten by the first one that counts."""
    decay_1 = math.exp(-pair[1] * pair[0] * duration)
    decay_2 = math.exp(-pair[4] * pair[3] * duration)
    left_1 = left_2 = 1.0
    start = first
    while 0 < start < bounds.shape[1]:
        # What is left of the motion before, at the first group that counts
        rest_1, rest_2 = left_1 * bounds[0, start], left_2 * bounds[1, start]
        is_near = rest_1 + rest_2 <= negligible[0]
        if is_near and pair[0] * rest_1 + pair[3] * rest_2 <= negligible[1]:
            break
        left_1 *= decay_1
        left_2 *= decay_2
        start -= 1
    return start
