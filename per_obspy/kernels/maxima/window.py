r"""
Where in a record the largest response of an oscillator can lie, and from where on it must be computed, by bounds.

The norm ``V = u² + 2 xi u z + z²`` of a free vibration falls exactly like ``exp(-2 xi phase)``, and
an acceleration a raises its root by at most ``|a|`` a phase (displacements counted in ``a /
omega²``), so that over a group of steps of
the phase D whose accelerations do not exceed p::

    sqrt(V) <= exp(-xi D) sqrt(V) + p (1 - exp(-xi D)) / xi;   u² + z² <= V / (1 - xi)

Before and after the strong motion this tells that a response stays below a floor. What is forgotten
until it may reach the floor need not be computed: processed records have long pads of almost
nothing.
"""

import math

import numpy as np

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.maxima.samples import DAMPING, LANES, PHASE, WEIGHTS

#: What may be left of a response that is not computed, over the floor: a thousandth of the promised
#: exactness.
FORGOTTEN = 1e-12
#: A window of more than this part of the record is taken for the whole of it.
WHOLE = 0.75


@kernel
def find_windows(groups, steps, table, floors, bounds, windows):
    """
    Fill the windows (3, LANES): the group to start before, the first and the last group that may reach the floor.

    ``groups`` (2, n) are the largest accelerations of both components over so many steps each;
    ``bounds`` (n, LANES) takes what the root of V cannot exceed before them. Floors of windows that
    are the whole record become zero. Where no group may reach the floor, the last one is -1.
    """
    number = groups.shape[1]
    rates = _rates(steps, table, floors)
    first, last, bound = np.full(LANES, float(number)), np.full(LANES, -1.0), np.zeros(LANES)
    for group in range(number):
        north, east, here = groups[0, group], groups[1, group], float(group)
        for lane in range(LANES):
            bounds[group, lane] = bound[lane]
            raised = rates[1, lane] * north + rates[2, lane] * east
            reached = bound[lane] + raised >= rates[3, lane]
            first[lane] = min(first[lane], here if reached else np.inf)
            last[lane] = here if reached else last[lane]
            bound[lane] = rates[0, lane] * bound[lane] + raised
    for lane in range(LANES):
        start = _start(
            int(first[lane]), bounds[:, lane], FORGOTTEN * rates[3, lane], rates[0, lane]
        )
        windows[0, lane], windows[1, lane], windows[2, lane] = start, first[lane], last[lane]
        if last[lane] - start > WHOLE * number:
            windows[0, lane], windows[1, lane], windows[2, lane], floors[lane] = (
                0,
                0,
                number - 1,
                0.0,
            )


@kernel
def _rates(steps, table, floors):
    """Return decay over a group, gains of both components, and what the root of V must reach, (4, LANES)."""
    rates = np.empty((4, LANES))
    for lane in range(LANES):
        damping, phase = table[DAMPING, lane], table[PHASE, lane] * steps
        gain = -math.expm1(-damping * phase) / damping if damping > 0.0 else phase
        rates[0, lane], rates[3, lane] = (
            math.exp(-damping * phase),
            floors[lane] * math.sqrt(1.0 - damping),
        )
        rates[1, lane] = gain * abs(table[WEIGHTS, lane])
        rates[2, lane] = gain * abs(table[WEIGHTS + 1, lane])
    return rates


@kernel
def _start(first, bounds, negligible, decay):
    """Return the last group before which the bound has fallen to what is negligible before the first that counts."""
    start = first
    while 0 < start < bounds.size and bounds[start] > negligible:
        negligible /= decay
        start -= 1
    return start
