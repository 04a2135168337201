"""Largest relative displacement of two linear structures in a record: the exact critical gap."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

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


@takes_trace
def critical_gap_surface(
    acceleration: ArrayLike,
    dt: float,
    periods_1: ArrayLike,
    periods_2: ArrayLike,
    damping_1: float = 0.05,
    damping_2: float = 0.05,
) -> FloatArray:
    """
    Compute the largest ``|u1 - u2|`` of a record over a grid of two periods.

    Parameters
    ----------
    acceleration : (n_samples,) array_like or obspy Trace
        Ground acceleration, m/s².
    dt : float
        Sampling interval, s; not given with a Trace.
    periods_1, periods_2 : (n_1,), (n_2,) array_like
        Undamped periods, s.
    damping_1, damping_2 : float, optional
        Fractions of critical, dimensionless.

    Returns
    -------
    gap : (n_1, n_2) ndarray
        Exact critical gap for either order of the structures, m.

    Raises
    ------
    ValueError
        If an argument is out of range.

    Notes
    -----
    ``|u1 - u2|`` does not change when the structures change places, so equal pairs are computed
    once.

    References
    ----------
    Valles-Mattox & Reinhorn (1996), An energy approach to pounding of structures, 11WCEE, eq. (15),
    the estimate of which this is the exact counterpart.

    Examples
    --------
    >>> pulse = np.sin(np.linspace(0.0, 6.0 * np.pi, 301))
    >>> print(critical_gap_surface(pulse, 0.01, [0.5, 1.0], [0.5, 1.0, 2.0]).round(3))
    [[0.    0.154 0.101]
     [0.154 0.    0.234]]
    """
    periods_1 = checks.positive("periods_1", periods_1)
    periods_2 = checks.positive("periods_2", periods_2)
    damping_1 = checks.number("damping_1", damping_1, checks.fraction_of_critical)
    damping_2 = checks.number("damping_2", damping_2, checks.fraction_of_critical)

    # Period and damping of both structures of every pair of the grid
    grid_1, grid_2 = np.meshgrid(periods_1, periods_2, indexing="ij")
    first = np.stack([grid_1.ravel(), np.full(grid_1.size, damping_1)])
    second = np.stack([grid_2.ravel(), np.full(grid_2.size, damping_2)])

    # Compute each pair once
    pairs, index = _unordered_pairs(first, second)
    gap = relative_displacement(acceleration, dt, *pairs).largest
    return gap[index].reshape(grid_1.shape)


def _unordered_pairs(first: FloatArray, second: FloatArray) -> tuple[FloatArray, NDArray[np.int64]]:
    """Return distinct pairs of structures (rows: period, damping of both), and their indices."""
    # Sort both structures of a pair by period, then by damping
    swap = (first[0] > second[0]) | ((first[0] == second[0]) & (first[1] > second[1]))
    shorter, longer = np.where(swap, second, first), np.where(swap, first, second)
    pairs, index = np.unique(np.concatenate([shorter, longer]), axis=1, return_inverse=True)
    return pairs, index.ravel()
