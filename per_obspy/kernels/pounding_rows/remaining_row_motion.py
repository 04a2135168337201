r"""
Whether the rest of a record can still change a result of a row, by bounds of its energy.

Buildings without a gap between them are a *group*. As for a pair that touches at rest (see
``pounding_lanes.remaining_motion``) a linear group has the norm ``W² = sum m w²`` with one e for
all, its smallest ``xi omega``: a contact force F between neighbours changes the product ``e sum m u
v`` by ``e F (u_right - u_left) = 0``. W rises by the integral of the size of the ground
acceleration times the root of ``sum m q²`` at most, with participations q, and falls like ``exp(-e
t)``, less what the larger rates may take from it.

Groups are followed as if they did not touch each other. That holds as long as the displacements on
both sides of a gap together stay below it. Equal buildings of a group that have the same state move
as one, without an impact.
"""

import math

from per_obspy.kernels._jit import lean
from per_obspy.kernels.pounding_events.contact import COUNTED_SHARE
from per_obspy.kernels.pounding_events.motion import (
    APPROACH,
    DAMPING_RATE,
    GAP,
    LARGEST_DISPLACEMENT,
    MASS,
    OPENING,
    PARTICIPATION,
    STIFFNESS,
    YIELD,
    U,
    V,
)
from per_obspy.kernels.pounding_lanes.remaining_motion import CERTAIN, norm_of

#: Smallest approach speed that counts as an impact, m/s in the unit of the interface; the lanes do
#: not follow openings.
COUNTED_SPEED = OPENING
# columns of the bounds of a row, in the line of the first building of a group
#: norm now, norm above which a result may change, decay of the norm over a group of samples, and
#: its rise by the integral of the ground acceleration
NORM, LIMIT, DECAY, GAIN = 0, 1, 2, 3
#: largest displacement of each building over the norm of its group
REACH = 4


@lean
def row_remains_still(row, bounds, cosine, sine, sizes, duration, group):
    """
    Return whether the motion from a group of samples on can change no result of a row.

    Parameters
    ----------
    row : (n_buildings, ROW_COLUMNS) ndarray
        Row at the start of the group; see `motion` for its columns.
    bounds : (n_buildings, n_columns) ndarray
        Room for the bounds.
    cosine, sine : float
        Of the azimuth of the axis of the row.
    sizes : (2, n_groups) ndarray
        Integrals of the size of the north and east acceleration over the groups, m/s. The ground
        rests after them.
    duration : float
        Of a group, s.
    group : int
        Number of the first group of the rest of the record.

    Returns
    -------
    bool
        True is certain.
    """
    first = 0
    while first < row.shape[0]:
        last = _last_of_group(row, first)
        if not _write_bounds(row, bounds, first, last, duration):
            return False
        first = last + 1
    # group of samples after group of samples, and once more after the record
    for k in range(group, sizes.shape[1] + 1):
        size = 0.0
        if k < sizes.shape[1]:
            size = abs(cosine) * sizes[0, k] + abs(sine) * sizes[1, k]
        if not _stays_below(row, bounds, size):
            return False
    return True


@lean
def _last_of_group(row, first):
    """Return the last building of the group that begins with the first."""
    last = first
    while last < row.shape[0] - 1 and row[last, GAP] == 0.0:
        last += 1
    return last


@lean
def _write_bounds(row, bounds, first, last, duration):
    """Write the bounds of a group; return whether it has any, and is below its limit."""
    rate = math.inf
    for i in range(first, last + 1):
        rate = min(rate, row[i, DAMPING_RATE])
    is_one = _moves_as_one(row, first, last)
    # norm, force over acceleration, and limits
    total = force = excess = 0.0
    limit = math.inf
    for i in range(first, last + 1):
        mass = row[i, MASS]
        hidden = _hidden_share(row, i, rate)
        if mass == math.inf or row[i, YIELD] < math.inf or hidden > 0.5:
            return False
        total += mass * norm_of(row, i, 0.0, rate) ** 2
        force += mass * row[i, PARTICIPATION] * row[i, PARTICIPATION]
        excess = max(excess, (row[i, DAMPING_RATE] - rate) * hidden / (1.0 - hidden))
        # largest displacement, and with it the largest radius
        bounds[i, REACH] = 1.0 / math.sqrt(mass * (row[i, STIFFNESS] - rate * rate))
        reach = row[i, LARGEST_DISPLACEMENT] * math.sqrt(row[i, STIFFNESS])
        limit = min(limit, reach * math.sqrt(mass * (1.0 - math.sqrt(hidden))))
        # impacts
        if i < last and not is_one:
            limit = min(limit, _slow_norm(row, i, rate))
    # all of the group, in its first line
    bounds[first, NORM] = math.sqrt(total)
    bounds[first, LIMIT] = CERTAIN * limit
    bounds[first, DECAY] = math.exp(-(rate - 0.5 * excess) * duration)
    bounds[first, GAIN] = math.sqrt(force)
    return bounds[first, NORM] < bounds[first, LIMIT] and excess <= 2.0 * rate


@lean
def _hidden_share(row, i, rate):
    """Return the share of the velocity of a building that the product e u v may hide."""
    return rate * rate / row[i, STIFFNESS]


@lean
def _moves_as_one(row, first, last):
    """Return whether all buildings of a group have the same equation and the same state."""
    is_one = True
    # the others against the first
    for i in range(first + 1, last + 1):
        is_one &= row[i, STIFFNESS] == row[first, STIFFNESS]
        is_one &= row[i, DAMPING_RATE] == row[first, DAMPING_RATE]
        is_one &= row[i, PARTICIPATION] == row[first, PARTICIPATION]
        is_one &= (row[i, U] == row[first, U]) & (row[i, V] == row[first, V])
    return is_one


@lean
def _slow_norm(row, j, rate):
    """Return the norm below which no impact of an interface counts, and none is its fastest."""
    slowness = 0.0
    for i in range(j, j + 2):
        slowness += 1.0 / (row[i, MASS] * (1.0 - _hidden_share(row, i, rate)))
    # the slower limit of both
    fastest = row[j, APPROACH]
    speed = min(fastest, max(row[j, COUNTED_SPEED], COUNTED_SHARE * fastest))
    return speed / math.sqrt(slowness)


@lean
def _stays_below(row, bounds, size):
    """
    Return whether all groups stay below their limits, and apart, over a group of samples.

    ``size`` is the integral of the size of the ground acceleration; the norms are moved on.
    """
    before = 0.0
    first = 0
    while first < row.shape[0]:
        # highest inside the group of samples
        rise = bounds[first, GAIN] * size
        high = bounds[first, NORM] + rise
        if high > bounds[first, LIMIT]:
            return False
        # the gap to the group before
        if first > 0 and before + high * bounds[first, REACH] > CERTAIN * row[first - 1, GAP]:
            return False
        last = _last_of_group(row, first)
        before = high * bounds[last, REACH]
        bounds[first, NORM] = bounds[first, DECAY] * bounds[first, NORM] + rise
        first = last + 1
    return True
