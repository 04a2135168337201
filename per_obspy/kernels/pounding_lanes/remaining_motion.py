r"""
Whether the rest of a record can still change a result of a row, by bounds of its energy.

A building has the norm ``w² = v² + 2 e u v + omega² u²``, with its displacement u from where it
rests. With ``e = xi omega`` the root w falls like ``exp(-e t)`` in free vibration, and rises by the
integral of the size of its force per unit mass at most.

Buildings without a gap between them that rest in one place are a *group*, with the norm
``W² = sum m w²`` and one e for all, the smallest ``xi omega``. A contact force F between
neighbours, an impulse too, changes the product ``e sum m u v`` by ``e F (u_right - u_left) = 0``,
and never adds kinetic energy. So W rises by the integral of the size of the ground acceleration
times the root of ``sum m q²`` at most, with participations q, and falls like ``exp(-e t)``; the
rate of a building of larger ``xi omega`` leaves ``2 e`` by ``e² (xi omega - e) / (omega² - e²)`` of
W² at most.

Groups are followed as if they did not touch each other. That holds as long as the displacements on
both sides of a gap together stay below it. Equal buildings that have the same state move as one
without any contact force: they are followed as one, and there is no impact between them.

A building that may yield is linear about where it rests as long as it stays in its elastic range.
"""

import math

from per_obspy.kernels._jit import lean
from per_obspy.kernels.pounding_events.contact import COUNTED_SHARE
from per_obspy.kernels.pounding_events.motion import (
    APPROACH,
    COUNTED_SPEED,
    DAMPING_RATE,
    GAP,
    HARDENING,
    LARGEST_DISPLACEMENT,
    MASS,
    PARTICIPATION,
    PHASE,
    PLASTIC,
    STIFFNESS,
    TAYLOR,
    YIELD,
    U,
    V,
)

#: Samples of a group, of which the size of the acceleration is integrated.
GROUP_SAMPLES = 64
#: Part of a limit, so that rounding does not matter.
CERTAIN = 1.0 - 1e-9
# bounds, in columns that are free between events; in the line of the first building of a group:
#: norm now, norm above which a result may change, decay of the norm over a group of samples, its
#: rise by the integral of the ground acceleration, and clearance at rest on the left of the group
NORM, LIMIT, DECAY, GAIN, CLEARANCE = range(TAYLOR, TAYLOR + 5)
#: largest displacement of each building over the norm of its group
REACH = TAYLOR + 5


@lean
def remains_still(row, cosine, sine, sizes, duration, group):
    """
    Return whether the motion from a group of samples on can change no result of a row.

    Parameters
    ----------
    row : (n_buildings, ROW_COLUMNS) ndarray
        Row at the start of the group; see `motion` for its columns. Its Taylor polynomials are
        overwritten.
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
    before = first = 0
    while first < row.shape[0]:
        last = _last_of_group(row, first)
        if not _write_bounds(row, first, last, duration):
            return False
        # two buildings that move as one keep their gap
        row[first, CLEARANCE] = math.inf
        if first > 0 and not (before == last - 1 and _moves_as_one(row, before, last)):
            shift = _centre(row, first) - _centre(row, first - 1)
            row[first, CLEARANCE] = CERTAIN * (row[first - 1, GAP] + shift)
        before = first
        first = last + 1
    # group of samples after group of samples, and once more after the record
    for k in range(group, sizes.shape[1] + 1):
        size = 0.0
        if k < sizes.shape[1]:
            size = abs(cosine) * sizes[0, k] + abs(sine) * sizes[1, k]
        if not _stays_below(row, size):
            return False
    return True


@lean
def _last_of_group(row, first):
    """Return the last building of the group that begins with the first."""
    last = first
    while last < row.shape[0] - 1 and row[last, GAP] == 0.0:
        if _centre(row, last + 1) != _centre(row, first):
            break
        last += 1
    return last


@lean
def _centre(row, i):
    """Return the displacement at which a building rests in its elastic phase."""
    return (1.0 - row[i, HARDENING]) * row[i, PLASTIC] if row[i, YIELD] < math.inf else 0.0


@lean
def _moves_as_one(row, first, last):
    """Return whether buildings have the same equation and the same state."""
    is_one = True
    for i in range(first + 1, last + 1):
        for column in (STIFFNESS, DAMPING_RATE, PARTICIPATION, YIELD, HARDENING, PLASTIC, U, V):
            is_one &= row[i, column] == row[first, column]
    return is_one


@lean
def _square_of_norm(row, i, rate):
    """Return the norm of a building squared, over its mass, m²/s²."""
    u = row[i, U] - _centre(row, i)
    v = row[i, V]
    return max(v * v + 2.0 * rate * u * v + row[i, STIFFNESS] * u * u, 0.0)


@lean
def _room(row, i):
    """Return by how far a building may leave its centre so that it passes no maximum or yields."""
    centre = _centre(row, i)
    within_range = row[i, YIELD] - abs(row[i, PLASTIC] - centre)
    return min(row[i, LARGEST_DISPLACEMENT] - abs(centre), within_range)


@lean
def _slow_norm(row, j, rate):
    """Return the norm below which no impact of an interface counts, and none is its fastest."""
    slowness = 0.0
    for i in range(j, j + 2):
        slowness += 1.0 / (row[i, MASS] * (1.0 - rate * rate / row[i, STIFFNESS]))
    # the slower limit of both
    fastest = row[j, APPROACH]
    speed = min(fastest, max(row[j, COUNTED_SPEED], COUNTED_SHARE * fastest))
    return speed / math.sqrt(slowness)


@lean
def _write_bounds(row, first, last, duration):
    """Write the bounds of a group; return whether it has any, and is below its limit."""
    rate = math.inf
    for i in range(first, last + 1):
        rate = min(rate, row[i, DAMPING_RATE])
    is_one = _moves_as_one(row, first, last)
    # norm, force over acceleration, and limits; what moves as one is bounded without its mass
    square = force = excess = 0.0
    limit = math.inf
    for i in range(first, last + 1):
        stiffness = row[i, STIFFNESS]
        mass = 1.0 if is_one else row[i, MASS]
        # share of the velocity that the product e u v may hide
        hidden = rate * rate / stiffness
        if row[i, PHASE] != 0.0 or mass == math.inf or (hidden > 0.5 and not is_one):
            return False
        own = mass * _square_of_norm(row, i, rate)
        drive = mass * row[i, PARTICIPATION] * row[i, PARTICIPATION]
        square = own if is_one else square + own
        force = drive if is_one else force + drive
        excess = max(excess, (row[i, DAMPING_RATE] - rate) * hidden / (1.0 - hidden))
        # largest displacement, and with it the largest radius
        room = _room(row, i)
        limit = min(limit, room * math.sqrt(stiffness * mass * (1.0 - math.sqrt(hidden))))
        row[i, REACH] = 1.0 / math.sqrt(mass * (stiffness - rate * rate))
        if i < last and not is_one:
            limit = min(limit, _slow_norm(row, i, rate))
    # all of the group, in its first line
    row[first, NORM] = math.sqrt(square)
    row[first, LIMIT] = CERTAIN * limit
    if not row[first, NORM] < row[first, LIMIT] or excess > 2.0 * rate:
        return False
    row[first, DECAY] = math.exp(-(rate - 0.5 * excess) * duration)
    row[first, GAIN] = math.sqrt(force)
    return True


@lean
def _stays_below(row, size):
    """
    Return whether all groups stay below their limits, and apart, over a group of samples.

    ``size`` is the integral of the size of the ground acceleration; the norms are moved on.
    """
    before = 0.0
    first = 0
    while first < row.shape[0]:
        # highest inside the group of samples, and the gap to the group before
        rise = row[first, GAIN] * size
        high = row[first, NORM] + rise
        if high > row[first, LIMIT] or before + high * row[first, REACH] >= row[first, CLEARANCE]:
            return False
        last = _last_of_group(row, first)
        before = high * row[last, REACH]
        row[first, NORM] = row[first, DECAY] * row[first, NORM] + rise
        first = last + 1
    return True
