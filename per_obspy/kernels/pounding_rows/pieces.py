"""
States of the buildings of a row, and their exact maxima in a piece of a step.

A piece lasts from one event of the row to the next, often a thousandth of a step: its bounds are
those of a step times its share.
"""

from per_obspy.kernels._jit import inlined, lean
from per_obspy.kernels.pounding_events.motion import (
    LARGEST_DISPLACEMENT,
    LARGEST_RADIUS_SQUARED,
)
from per_obspy.kernels.pounding_lanes.lanes import (
    ANGLE,
    DISPLACEMENT_ERROR,
    POWER_ERROR,
    VELOCITY_ERROR,
)
from per_obspy.kernels.pounding_lanes.maxima_in_step import raise_maxima_inside
from per_obspy.kernels.pounding_lanes.pair_rows import fill_ramp_response

# columns of the states of a row in a step: displacement, velocity over omega and acceleration over
# omega² (m), at its start and at its end
START, END = 0, 3
STATE_COLUMNS = 6


@inlined
def state(states, i, column):
    """Return the state of building i at the start or the end of a step."""
    return states[i, column], states[i, column + 1], states[i, column + 2]


@inlined
def set_state(states, i, column, value):
    """Set the state of building i at the start or the end of a step."""
    states[i, column] = value[0]
    states[i, column + 1] = value[1]
    states[i, column + 2] = value[2]


@inlined
def _may_exceed(member, row, i, start, end, share):
    """
    Raise the maxima of building i to two states; return whether it may pass them in between.

    As ``may_exceed_maxima`` over the share of a step between the states: the errors of displacement
    and power grow at least as fast as this share.
    """
    u0, z0, y0 = start
    u1, z1, y1 = end
    strength = max(abs(y0), abs(y1))
    radius_squared = max(u0 * u0 + z0 * z0, u1 * u1 + z1 * z1)
    # far below the maxima
    quarter = 0.25 * share * member[ANGLE]
    power_error = share * member[POWER_ERROR]
    widening = 1.0 + quarter
    by_strength = quarter * (1.0 + 4.0 * power_error)
    room = row[i, LARGEST_DISPLACEMENT] - by_strength * strength
    if (room > 0.0) & (widening * widening * radius_squared < room * room):
        return False
    # growth of the radius between the states
    power_change = abs((u1 + y1) - (u0 + y0))
    growth = 0.5 * quarter * (power_change + 8.0 * power_error * strength)
    # maxima at the states
    reach = max(abs(u0), abs(u1))
    largest = max(row[i, LARGEST_DISPLACEMENT], reach)
    largest_squared = max(row[i, LARGEST_RADIUS_SQUARED], radius_squared)
    row[i, LARGEST_DISPLACEMENT] = largest
    row[i, LARGEST_RADIUS_SQUARED] = largest_squared
    # the displacement turns where the velocity, within its error, has a root
    velocity_error = 2.0 * share * member[VELOCITY_ERROR] * strength
    turns = abs(z0 + z1) <= abs(z1 - z0) + velocity_error
    turns &= reach + share * share * member[DISPLACEMENT_ERROR] * strength > largest
    # the radius turns where the power, within its error, has a root
    widens = abs(u0 + u1 + y0 + y1) <= power_change + 2.0 * power_error * strength
    twice_radius = 2.0 * max(abs(u0) + abs(z0), abs(u1) + abs(z1))
    widens &= radius_squared + growth * (twice_radius + growth) > largest_squared
    return turns | widens


@lean
def raise_maximum(member, row, i, start, end, change, share):
    """Raise the maxima of building i to those between two states, a share of the step apart."""
    if _may_exceed(member, row, i, start, end, share):
        # Turning points need the response to a ramp
        line = row[i : i + 1]
        fill_ramp_response(member, line, 0)
        raise_maxima_inside(member, line, 0, start, end, change, share)
