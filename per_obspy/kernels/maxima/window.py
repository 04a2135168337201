r"""
Part of a record that can hold an oscillator's largest response, and the part to compute, by bounds.

The norm ``V = u² + 2 xi u z + z²`` of a free vibration falls exactly like ``exp(-2 xi phase)``, and
an acceleration a raises its root by at most ``|a|`` per unit of phase (displacements counted in ``a
/ omega²``), so that over a group of steps of the phase D whose accelerations do not exceed p::

    sqrt(V) <= exp(-xi D) sqrt(V) + p (1 - exp(-xi D)) / xi;   u² + z² <= V / (1 - xi)

Before and after the strong motion this shows that a response stays below a floor. Motion that is
forgotten until the response may reach the floor need not be computed: processed records have long
pads of almost zero motion.
"""

import math

import numpy as np

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.oscillator.strides import DAMPING, MAXIMA_LANES, PHASE, WEIGHTS

#: Largest remainder of a response that is not computed, over the floor: a thousandth of the
#: promised exactness.
FORGOTTEN = 1e-12
#: A window of more than this part of the record is taken for the whole of it.
WHOLE = 0.75


@kernel
def find_windows(groups, steps, table, floors, bounds, windows):
    """
    Fill the window of each oscillator, and zero floors of those that are the whole record.

    Rows of ``windows`` (3, lanes): the group to start before, the first and the last group that may
    reach the floor; where no group may, the last one is -1. ``groups`` (2, n) are the largest
    accelerations of both components over so many steps each; ``bounds`` (n, lanes) receives the
    bounds of the root of V before them.
    """
    number = groups.shape[1]
    rates = _rates(steps, table, floors)
    first = np.full(MAXIMA_LANES, float(number))
    last = np.full(MAXIMA_LANES, -1.0)
    bound = np.zeros(MAXIMA_LANES)
    # Bound of the root of V, group by group
    for group in range(number):
        north, east, group_number = groups[0, group], groups[1, group], float(group)
        for lane in range(MAXIMA_LANES):
            bounds[group, lane] = bound[lane]
            # Free decay and the strongest motion of the group
            raised = rates[1, lane] * north + rates[2, lane] * east
            reached = bound[lane] + raised >= rates[3, lane]
            first[lane] = min(first[lane], group_number if reached else np.inf)
            last[lane] = group_number if reached else last[lane]
            bound[lane] = rates[0, lane] * bound[lane] + raised
    for lane in range(MAXIMA_LANES):
        # Start where the motion before is negligible by the first group that counts
        negligible = FORGOTTEN * rates[3, lane]
        start = _start(int(first[lane]), bounds[:, lane], negligible, rates[0, lane])
        windows[0, lane] = start
        windows[1, lane] = first[lane]
        windows[2, lane] = last[lane]
        # A wide window becomes the whole record
        if last[lane] - start > WHOLE * number:
            windows[0, lane] = 0
            windows[1, lane] = 0
            windows[2, lane] = number - 1
            floors[lane] = 0.0


@kernel
def _rates(steps, table, floors):
    """Return decay over a group, gains of both components and floor of sqrt(V), (4, lanes)."""
    rates = np.empty((4, MAXIMA_LANES))
    for lane in range(MAXIMA_LANES):
        damping = table[DAMPING, lane]
        phase = table[PHASE, lane] * steps
        gain = -math.expm1(-damping * phase) / damping if damping > 0.0 else phase
        # Decay, gain of either component, and the root of V that a radius at the floor has
        rates[0, lane] = math.exp(-damping * phase)
        rates[1, lane] = gain * abs(table[WEIGHTS, lane])
        rates[2, lane] = gain * abs(table[WEIGHTS + 1, lane])
        rates[3, lane] = floors[lane] * math.sqrt(1.0 - damping)
    return rates


@kernel
def _start(first, bounds, negligible, decay):
    """Return the last group before which the motion is negligible by the first that counts."""
    start = first
    while 0 < start < bounds.size and bounds[start] > negligible:
        negligible /= decay
        start -= 1
    return start
