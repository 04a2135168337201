r"""
Whether the rest of a record can still change a result of a pair, by bounds of its energy.

A structure has the norm ``w² = v² + 2 e u v + omega² u²``, with its displacement u from where it
rests. With ``e = xi omega`` the root w falls like ``exp(-e t)`` in free vibration, and rises by the
integral of the size of its force per unit mass at most.

Two linear structures that touch at rest have the norm ``w² = m1 w1² + m2 w2²`` with one e for both,
the smaller ``xi omega``. A contact force F, an impulse too, changes the product ``e m u v`` of both
by ``e F (u2 - u1) = 0``, and never adds kinetic energy. So w falls and rises alike, whatever
impacts there are; the rate of the structure of larger ``xi omega`` leaves ``2 e`` by ``e² (xi omega
- e) / (omega² - e²)`` of w² at most.

A pair with a gap is followed as two structures that do not touch. That holds as long as the sum of
both displacements stays below the gap. Two equal linear structures with the same state move as one
without any contact force: each is followed alone, and there is no impact.
"""

import math

from per_obspy.kernels._jit import lean
from per_obspy.kernels.pounding_events.contact import COUNTED_SHARE, SLOWEST_COUNTED
from per_obspy.kernels.pounding_events.motion import (
    APPROACH,
    DAMPING_RATE,
    GAP,
    HARDENING,
    LARGEST_DISPLACEMENT,
    MASS,
    PARTICIPATION,
    PHASE,
    PLASTIC,
    STIFFNESS,
    YIELD,
    U,
    V,
)

#: Samples of a group, of which the size of the acceleration is integrated.
GROUP_SAMPLES = 64
#: Part of a limit, so that rounding does not matter.
CERTAIN = 1.0 - 1e-9


@lean
def remains_still(row, cosine, sine, sizes, duration, group):
    """
    Return whether the motion from a group on can change no maximum, count or impact velocity.

    Parameters
    ----------
    row : (2, ROW_COLUMNS) ndarray
        Row of structures of the pair at the start of the group; see `motion` for its columns.
    cosine, sine : float
        Of the azimuth of the axis from structure 1 to 2.
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
    direction = abs(cosine), abs(sine)
    # linear pairs that never hit each other, or do from the start
    if row[0, YIELD] == math.inf and row[1, YIELD] == math.inf:
        if _moves_as_one(row):
            return _free_pair_remains_still(row, direction, sizes, duration, group, math.inf)
        if row[0, GAP] == 0.0:
            return _touching_pair_remains_still(row, direction, sizes, duration, group)
    return _free_pair_remains_still(row, direction, sizes, duration, group, row[0, GAP])


@lean
def _moves_as_one(row):
    """Return whether both linear structures have the same equation and the same state."""
    return (
        (row[0, STIFFNESS] == row[1, STIFFNESS])
        & (row[0, DAMPING_RATE] == row[1, DAMPING_RATE])
        & (row[0, PARTICIPATION] == row[1, PARTICIPATION])
        & (row[0, U] == row[1, U])
        & (row[0, V] == row[1, V])
    )


@lean
def norm_of(row, i, centre, rate):
    """Return the root of the norm of structure i about a centre, over the root of its mass, m/s."""
    u = row[i, U] - centre
    v = row[i, V]
    return math.sqrt(max(v * v + 2.0 * rate * u * v + row[i, STIFFNESS] * u * u, 0.0))


@lean
def _stay_below(norms, decays, gains, limits, direction, sizes, group):
    """Return whether two norms stay below their limits, and their weighted sum below 1."""
    first, second = norms
    for k in range(group, sizes.shape[1] + 1):
        # the rise over this group; none after the record
        size = 0.0
        if k < sizes.shape[1]:
            size = direction[0] * sizes[0, k] + direction[1] * sizes[1, k]
        rise = gains[0] * size
        other_rise = gains[1] * size
        # highest inside the group
        high = first + rise
        other_high = second + other_rise
        if high > limits[0] or other_high > limits[1]:
            return False
        if high * limits[2] + other_high * limits[3] > 1.0:
            return False
        first = decays[0] * first + rise
        second = decays[1] * second + other_rise
    return True


@lean
def _touching_pair_remains_still(row, direction, sizes, duration, group):
    """Return whether a linear pair without gap changes no result any more."""
    # norm, force over acceleration, and limits of both structures
    rate = min(row[0, DAMPING_RATE], row[1, DAMPING_RATE])
    total = force = slowness = excess = 0.0
    limit = math.inf
    for i in range(2):
        mass = row[i, MASS]
        # share of the velocity that the product e u v may hide
        hidden = rate * rate / row[i, STIFFNESS]
        if mass == math.inf or hidden > 0.5:
            return False
        norm = norm_of(row, i, 0.0, rate)
        total += mass * norm * norm
        force += mass * row[i, PARTICIPATION] * row[i, PARTICIPATION]
        slowness += 1.0 / (mass * (1.0 - hidden))
        excess = max(excess, (row[i, DAMPING_RATE] - rate) * hidden / (1.0 - hidden))
        # largest displacement, and with it the largest radius
        reach = row[i, LARGEST_DISPLACEMENT] * math.sqrt(row[i, STIFFNESS])
        limit = min(limit, reach * math.sqrt(mass * (1.0 - math.sqrt(hidden))))
    # impacts: none that counts, and none faster
    fastest = row[0, APPROACH]
    speed = min(fastest, max(SLOWEST_COUNTED, COUNTED_SHARE * fastest))
    limit = CERTAIN * min(limit, speed / math.sqrt(slowness))
    if not math.sqrt(total) < limit or excess > 2.0 * rate:
        return False
    decay = math.exp(-(rate - 0.5 * excess) * duration)
    norms, gains = (math.sqrt(total), 0.0), (math.sqrt(force), 0.0)
    return _stay_below(norms, (decay, 1.0), gains, (limit, 1.0, 0.0, 0.0), direction, sizes, group)


@lean
def _free_limits(row, i):
    """Return centre of structure i, and the largest norm at which it changes no result, m/s."""
    centre = 0.0
    room = math.inf
    if row[i, YIELD] < math.inf:
        # it yields no more
        centre = (1.0 - row[i, HARDENING]) * row[i, PLASTIC]
        room = row[i, YIELD] - abs(row[i, PLASTIC] - centre)
    room = CERTAIN * min(room, row[i, LARGEST_DISPLACEMENT] - abs(centre))
    # radius, by its norm
    omega = math.sqrt(row[i, STIFFNESS])
    hidden = row[i, DAMPING_RATE] / omega
    return centre, room * omega * math.sqrt(max(1.0 - hidden, 0.0))


@lean
def _free_pair_remains_still(row, direction, sizes, duration, group, gap):
    """Return whether a pair never closes a gap or yields again, nor exceeds its maxima."""
    if row[0, PHASE] != 0.0 or row[1, PHASE] != 0.0:
        return False
    left, limit = _free_limits(row, 0)
    right, other_limit = _free_limits(row, 1)
    norm = norm_of(row, 0, left, row[0, DAMPING_RATE])
    other_norm = norm_of(row, 1, right, row[1, DAMPING_RATE])
    # clearance at rest
    room = CERTAIN * (gap - left + right)
    if not (norm < limit and other_norm < other_limit and room > 0.0):
        return False
    # displacement over the clearance, by the norm
    shares = _reach_by_norm(row, 0) / room, _reach_by_norm(row, 1) / room
    decays = (
        math.exp(-row[0, DAMPING_RATE] * duration),
        math.exp(-row[1, DAMPING_RATE] * duration),
    )
    gains = abs(row[0, PARTICIPATION]), abs(row[1, PARTICIPATION])
    limits = limit, other_limit, shares[0], shares[1]
    return _stay_below((norm, other_norm), decays, gains, limits, direction, sizes, group)


@lean
def _reach_by_norm(row, i):
    """Return the largest displacement of structure i from its centre over its norm, s."""
    return 1.0 / math.sqrt(row[i, STIFFNESS] - row[i, DAMPING_RATE] * row[i, DAMPING_RATE])
