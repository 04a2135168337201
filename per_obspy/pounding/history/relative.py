"""Largest relative displacement of two linear structures in a record: the exact critical gap."""

from typing import NamedTuple

import numpy as np

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray
from per_obspy.kernels.relative.relative_maxima import relative_maxima
from per_obspy.pounding.history.tables import closed_record
from per_obspy.pounding.structure import checked_oscillators
from per_obspy.spectra.trace_arguments import takes_trace

#: Largest remainder of a motion that is not computed, over 0.4 % of its bound: of critical gaps a
#: thousandth of the promised exactness; of the approach, of which populations need hundreds, more.
FORGOTTEN, FORGOTTEN_OF_APPROACH = 1e-12, 1e-7


class RelativeDisplacement(NamedTuple):
    """
    Largest distances by which two structures approach each other at contact level, m.

    ``one_before_two`` is the largest ``q1 u1 - q2 u2`` (structure 1 is left of 2: the critical
    gap of the record), ``two_before_one`` the largest ``q2 u2 - q1 u1`` (the other order),
    ``largest`` the larger of the two.
    """

    one_before_two: FloatArray
    two_before_one: FloatArray
    largest: FloatArray


class Approach(NamedTuple):
    """
    Largest relative motion of two structures at contact level without contact, 1 towards 2.

    ``displacement`` is the largest ``q1 u1 - q2 u2``, m, exact to 1e-6; ``velocity`` the largest
    ``q1 v1 - q2 v2`` at the samples, m/s, which misses at most ``1 - cos(pi dt / T)`` of a
    vibration of the period T.
    """

    displacement: FloatArray
    velocity: FloatArray


@takes_trace
def relative_displacement(
    acceleration: ArrayLike,
    dt: float,
    period_1: ArrayLike,
    damping_1: ArrayLike,
    period_2: ArrayLike,
    damping_2: ArrayLike,
    participation_1: ArrayLike = 1.0,
    participation_2: ArrayLike = 1.0,
) -> RelativeDisplacement:
    """
    Compute the largest relative displacement of pairs in one component of ground motion.

    Exact for acceleration that is linear between samples: peaks between samples count, and so does
    the free vibration after the record, followed while the radii could still exceed the maxima and
    for at most 20 of the longer period. A record that does not end at zero is closed by a ramp of
    one sampling interval.

    Parameters
    ----------
    acceleration : (n_samples,) array_like or obspy Trace
        Ground acceleration, m/s².
    dt : float
        Sampling interval, s; not given with a Trace.
    period_1, period_2 : array_like
        Undamped periods, s.
    damping_1, damping_2 : array_like
        Fractions of critical, dimensionless.
    participation_1, participation_2 : array_like, optional
        Contact displacement over oscillator displacement, dimensionless.

    Returns
    -------
    RelativeDisplacement
        Arrays of the broadcast shape of the pairs, m; never negative, because both structures start
        at rest.

    Raises
    ------
    ValueError
        If an argument is out of range.

    See Also
    --------
    directional_relative_displacement : Pairs along individual azimuths.

    Examples
    --------
    >>> gap = relative_displacement([0.0, 1.0, -1.0, 0.0], 0.1, 0.5, 0.05, [0.5, 1.0], 0.05)
    >>> print(gap.largest[0], gap.largest[1] > 0)
    0.0 True
    """
    acceleration = checks.record("acceleration", acceleration)
    east = np.zeros_like(acceleration)
    structures = period_1, damping_1, period_2, damping_2
    participations = participation_1, participation_2
    return directional_relative_displacement(
        acceleration, east, dt, *structures, 0.0, *participations
    )


def directional_relative_displacement(
    north: ArrayLike,
    east: ArrayLike,
    dt: float,
    period_1: ArrayLike,
    damping_1: ArrayLike,
    period_2: ArrayLike,
    damping_2: ArrayLike,
    azimuth: ArrayLike,
    participation_1: ArrayLike = 1.0,
    participation_2: ArrayLike = 1.0,
) -> RelativeDisplacement:
    """
    Compute the largest relative displacement of pairs, each along the azimuth of its axis.

    Parameters
    ----------
    north, east : (n_samples,) array_like
        Ground acceleration, m/s².
    dt : float
        Sampling interval, s.
    period_1, period_2 : array_like
        Undamped periods, s.
    damping_1, damping_2 : array_like
        Fractions of critical, dimensionless.
    azimuth : array_like
        Direction from structure 1 to structure 2, degrees clockwise from north.
    participation_1, participation_2 : array_like, optional
        Contact displacement over oscillator displacement, dimensionless.

    Returns
    -------
    RelativeDisplacement
        Arrays of the broadcast shape of the pairs, m.

    Raises
    ------
    ValueError
        If an argument is out of range or the components differ in length.

    See Also
    --------
    relative_displacement : One component, and notes on exactness.
    """
    oscillators = period_1, damping_1, period_2, damping_2
    shares = participation_1, participation_2
    largest = _directional_maxima(north, east, dt, *oscillators, azimuth, *shares)
    one_before_two, two_before_one, _ = largest
    either = np.maximum(one_before_two, two_before_one)
    return RelativeDisplacement(one_before_two, two_before_one, either)


def approach(
    north: ArrayLike,
    east: ArrayLike,
    dt: float,
    period_1: ArrayLike,
    damping_1: ArrayLike,
    period_2: ArrayLike,
    damping_2: ArrayLike,
    azimuth: ArrayLike,
    participation_1: ArrayLike = 1.0,
    participation_2: ArrayLike = 1.0,
) -> Approach:
    """
    Compute by how far and how fast structure 1 approaches 2 at most, if they do not touch.

    Parameters
    ----------
    north, east, dt, period_1, damping_1, period_2, damping_2, azimuth : array_like
        See :func:`directional_relative_displacement`.
    participation_1, participation_2 : array_like, optional
        Contact displacement over oscillator displacement, dimensionless.

    Returns
    -------
    Approach
        Arrays of the broadcast shape of the pairs, m and m/s.

    Raises
    ------
    ValueError
        If an argument is out of range or the components differ in length.
    """
    oscillators = period_1, damping_1, period_2, damping_2
    shares = participation_1, participation_2
    largest = _directional_maxima(north, east, dt, *oscillators, azimuth, *shares, both_sides=False)
    return Approach(largest[0], largest[2])


def _directional_maxima(
    north: ArrayLike,
    east: ArrayLike,
    dt: float,
    period_1: ArrayLike,
    damping_1: ArrayLike,
    period_2: ArrayLike,
    damping_2: ArrayLike,
    azimuth: ArrayLike,
    participation_1: ArrayLike,
    participation_2: ArrayLike,
    both_sides: bool = True,
) -> FloatArray:
    """
    Return the largest displacements in both directions and velocity, (3, *shape of pairs).

    That of 2 before 1 is infinite unless ``both_sides`` is set.
    """
    components = checks.record("north", north), checks.record("east", east)
    if components[0].size != components[1].size:
        raise ValueError(
            f"north and east must be equally long, got {components[0].size} and "
            f"{components[1].size}"
        )
    motion = closed_record(np.stack(components))
    dt = checks.number("dt", dt, checks.positive)

    # One column of arguments per pair: both structures, and the direction of the axis
    first = checked_oscillators(1, period_1, damping_1, participation_1)
    second = checked_oscillators(2, period_2, damping_2, participation_2)
    angle = np.radians(checks.finite("azimuth", azimuth))
    broadcast = np.broadcast_arrays(*first, *second, np.cos(angle), np.sin(angle))
    pairs = np.stack([array.ravel() for array in broadcast])

    # Largest q1 u1 - q2 u2, q2 u2 - q1 u1, and q1 v1 - q2 v2 of each pair
    return _maxima(motion, dt, pairs, both_sides).reshape(3, *broadcast[0].shape)


def _maxima(motion: FloatArray, dt: float, pairs: FloatArray, both_sides: bool) -> FloatArray:
    """Run the kernel on pairs sorted by their memory, so that alike pairs share a block."""
    # rate at which the free vibration of the more persistent structure fades
    order = np.argsort(np.minimum(pairs[0] * pairs[1], pairs[3] * pairs[4]))
    ordered = np.empty((3, pairs.shape[1]))
    ascending = np.ascontiguousarray(pairs[:, order])
    forgotten = FORGOTTEN if both_sides else FORGOTTEN_OF_APPROACH
    relative_maxima(motion[0], motion[1], dt, ascending, forgotten, both_sides, ordered)

    # Back to the order of the arguments
    largest = np.empty_like(ordered)
    largest[:, order] = ordered
    return largest
