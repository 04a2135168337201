"""Whether the free vibration of a row can still change one of its results."""

import math

from per_obspy.kernels._jit import lean
from per_obspy.kernels.pounding_events.contact import COUNTED_SHARE
from per_obspy.kernels.pounding_events.motion import (
    APPROACH,
    GAP,
    LARGEST_DISPLACEMENT,
    MASS,
    STIFFNESS,
    YIELD,
    U,
    V,
)


@lean
def recoverable_energy(row):
    """Return the energy of a linear row, J; infinite if a building may yield or is a wall."""
    energy = 0.0
    for i in range(row.shape[0]):
        if row[i, YIELD] < math.inf or row[i, MASS] == math.inf:
            return math.inf
        # kinetic and potential energy
        radius_squared = row[i, V] * row[i, V] + row[i, STIFFNESS] * row[i, U] * row[i, U]
        energy += 0.5 * row[i, MASS] * radius_squared
    return energy


@lean
def is_over(row):
    """
    Return whether free vibration can no longer change a maximum, a count or an impact velocity.

    Damping and impacts only take energy from the row, so that no building can be faster, or
    further out, than with all of it. Impacts below a share of the fastest do not count.
    """
    twice = 2.0 * recoverable_energy(row)
    if twice == math.inf:
        return False
    for i in range(row.shape[0]):
        # a larger displacement, and with it a larger radius
        speed = math.sqrt(twice / row[i, MASS])
        reach = speed / math.sqrt(row[i, STIFFNESS])
        if reach > row[i, LARGEST_DISPLACEMENT]:
            return False
        # an impact on the next building that counts, or a first one
        if i < row.shape[0] - 1:
            next_speed = math.sqrt(twice / row[i + 1, MASS])
            next_reach = next_speed / math.sqrt(row[i + 1, STIFFNESS])
            is_out_of_reach = reach + next_reach < row[i, GAP]
            is_slow = speed + next_speed < COUNTED_SHARE * row[i, APPROACH]
            if not (is_out_of_reach or is_slow):
                return False
    return True
