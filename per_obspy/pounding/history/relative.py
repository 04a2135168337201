"""Largest relative displacement of two linear structures in a record: the exact counterpart of the critical gap."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.kernels.relative.relative_maxima import relative_maxima
from per_obspy.pounding.history.tables import closed_record


class RelativeDisplacement(NamedTuple):
    """
    Largest distances by which two structures approach each other at contact level, m.

    ``one_before_two`` is the largest ``q1 u1 - q2 u2`` (structure 1 stands left of 2: the critical
    gap of the record), ``two_before_one`` the largest ``q2 u2 - q1 u1`` (the other order),
    ``largest`` the larger of the two.
    """

    one_before_two: FloatArray
    two_before_one: FloatArray
    largest: FloatArray


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
    Largest relative displacement of pairs in one component of ground motion.

    Exact for acceleration that is linear between samples: peaks between samples count, and so does
    the free vibration after the record, followed while the radii could still exceed the maxima and
    for at most 20 of the longer period. A record that does not end at zero is closed by a ramp of
    one sampling interval.

    Parameters
    ----------
    acceleration : (n_samples,) array_like
        Ground acceleration, m/s².
    dt : float
        Sampling interval, s.
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
    directional_relative_displacement : pairs that each have their own azimuth.

    Examples
    --------
    >>> gap = relative_displacement([0.0, 1.0, -1.0, 0.0], 0.1, 0.5, 0.05, [0.5, 1.0], 0.05)
    >>> print(gap.largest[0], gap.largest[1] > 0)
    0.0 True
    """
    acceleration = checks.record("acceleration", acceleration)
    structures = period_1, damping_1, period_2, damping_2, participation_1, participation_2
    return directional_relative_displacement(acceleration, np.zeros_like(acceleration), dt, *structures[:4], 0.0,
                                             *structures[4:])  # fmt: skip


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
    Largest relative displacement of pairs in two horizontal components, each pair along its own azimuth.

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
    relative_displacement : what is exact about it.
    """
    components = checks.record("north", north), checks.record("east", east)
    if components[0].size != components[1].size:
        raise ValueError(
            f"north and east must be equally long, got {components[0].size} and {components[1].size}"
        )
    motion = closed_record(np.stack(components))
    dt = checks.number("dt", dt, checks.positive)
    first = _structure("1", period_1, damping_1, participation_1)
    second = _structure("2", period_2, damping_2, participation_2)
    angle = np.radians(checks.finite("azimuth", azimuth))
    broadcast = np.broadcast_arrays(*first, *second, np.cos(angle), np.sin(angle))
    pairs = np.stack([array.ravel() for array in broadcast])
    largest = np.empty((2, pairs.shape[1]))
    order = np.argsort(-np.minimum(pairs[0], pairs[3]))  # alike pairs share a block
    ordered = np.empty_like(largest)
    relative_maxima(motion[0], motion[1], dt, np.ascontiguousarray(pairs[:, order]), ordered)
    largest[:, order] = ordered
    one_before_two, two_before_one = largest.reshape(2, *broadcast[0].shape)
    return RelativeDisplacement(
        one_before_two, two_before_one, np.maximum(one_before_two, two_before_one)
    )


def critical_gap_surface(
    acceleration: ArrayLike,
    dt: float,
    periods_1: ArrayLike,
    periods_2: ArrayLike,
    damping_1: float = 0.05,
    damping_2: float = 0.05,
) -> FloatArray:
    """
    Largest ``|u1 - u2|`` of a record over a grid of two periods.

    Parameters
    ----------
    acceleration : (n_samples,) array_like
        Ground acceleration, m/s².
    dt : float
        Sampling interval, s.
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
    """
    periods_1, periods_2 = (
        checks.positive("periods_1", periods_1),
        checks.positive("periods_2", periods_2),
    )
    damping_1 = checks.number("damping_1", damping_1, checks.fraction_of_critical)
    damping_2 = checks.number("damping_2", damping_2, checks.fraction_of_critical)
    grid = np.meshgrid(periods_1, periods_2, indexing="ij")
    one = np.stack([grid[0].ravel(), np.full(grid[0].size, damping_1)])
    two = np.stack([grid[1].ravel(), np.full(grid[0].size, damping_2)])
    swap = (one[0] > two[0]) | ((one[0] == two[0]) & (one[1] > two[1]))
    pairs, place = np.unique(
        np.concatenate([np.where(swap, two, one), np.where(swap, one, two)]),
        axis=1,
        return_inverse=True,
    )
    gap = relative_displacement(acceleration, dt, *pairs).largest
    return gap[place.ravel()].reshape(grid[0].shape)


def _structure(
    which: str, period: ArrayLike, damping: ArrayLike, participation: ArrayLike
) -> tuple[FloatArray, ...]:
    """Return checked circular frequency, damping and participation."""
    return (
        2.0 * np.pi / checks.positive(f"period_{which}", period),
        checks.fraction_of_critical(f"damping_{which}", damping),
        checks.not_negative(f"participation_{which}", participation),
    )
