"""Largest relative displacement of pairs in a record, without contact: the exact critical gap."""

import math
from typing import NamedTuple

import numpy as np

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray
from per_obspy.kernels.pounding_events import motion as columns
from per_obspy.kernels.pounding_lanes.run_without_contact import (
    LANE_ROWS_WITHOUT_CONTACT,
    UNREACHABLE,
    run_without_contact,
)
from per_obspy.kernels.relative.relative_maxima import relative_maxima
from per_obspy.pounding.kernel_tables import (
    closed_record,
    free_vibration_steps,
    pair_fields,
    pair_table,
    refinements,
    row_at_rest,
    run_blocks,
)
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


class YieldingRelativeDisplacement(NamedTuple):
    """
    Largest responses of pairs of bilinear structures that do not touch.

    Attributes
    ----------
    one_before_two, two_before_one, largest : (n_pairs,) ndarray
        As in `RelativeDisplacement`, m.
    per : (2, n_pairs) ndarray
        Largest radius ``sqrt(u² + (v / omega)²)`` of both structures at contact level, m.
    displacement_maxima : (2, n_pairs) ndarray
        Largest displacement to either side at contact level, m.
    """

    one_before_two: FloatArray
    two_before_one: FloatArray
    largest: FloatArray
    per: FloatArray
    displacement_maxima: FloatArray


def yielding_relative_displacement(
    acceleration: ArrayLike,
    dt: float,
    period_1: ArrayLike,
    damping_1: ArrayLike,
    period_2: ArrayLike,
    damping_2: ArrayLike,
    azimuth: ArrayLike,
    participation_1: ArrayLike = 1.0,
    participation_2: ArrayLike = 1.0,
    yield_displacement_1: ArrayLike = math.inf,
    hardening_1: ArrayLike = 0.0,
    yield_displacement_2: ArrayLike = math.inf,
    hardening_2: ArrayLike = 0.0,
) -> YieldingRelativeDisplacement:
    """
    Compute the largest relative displacement of pairs of structures that yield.

    Each pair moves along the azimuth of its axis. The counterpart of
    `directional_relative_displacement` for structures that yield, exact as `pounding_histories` is:
    peaks between samples count, and so does the free vibration after the record. The result of a
    pair does not depend on the others.

    Parameters
    ----------
    acceleration : (2, n_samples) array_like
        North and east component of the ground acceleration, m/s².
    dt : float
        Sampling interval, s.
    period_1, period_2 : (n_pairs,) array_like
        Undamped elastic periods, s.
    damping_1, damping_2 : (n_pairs,) array_like
        Fractions of critical.
    azimuth : (n_pairs,) array_like
        Of the axis from structure 1 to 2, degrees clockwise from north.
    participation_1, participation_2 : (n_pairs,) array_like
        Contact displacement over that of the plain oscillator, dimensionless.
    yield_displacement_1, yield_displacement_2 : (n_pairs,) array_like
        At contact level, m; infinite for linear structures.
    hardening_1, hardening_2 : (n_pairs,) array_like
        Stiffness after yielding over elastic stiffness, at least 0 and below 1.

    Returns
    -------
    YieldingRelativeDisplacement
        One entry per pair, in the shape to which the arguments broadcast.

    Raises
    ------
    ValueError
        If an argument is outside its range.

    Examples
    --------
    >>> pulse = np.stack([np.sin(np.linspace(0.0, 6.0 * np.pi, 301)), np.zeros(301)])
    >>> pair = yielding_relative_displacement(
    ...     pulse, 0.01, 1.5, 0.05, 0.4, 0.05, azimuth=0.0,
    ...     yield_displacement_1=[math.inf, 0.05], hardening_1=0.1,
    ... )
    >>> print(pair.one_before_two.round(3), pair.displacement_maxima[0].round(3))
    [0.098 0.083] [0.094 0.08 ]
    """
    step = checks.number("dt", dt, checks.positive)
    record = _two_components(acceleration)
    fields, shape = pair_fields(
        period_1=period_1,
        damping_1=damping_1,
        period_2=period_2,
        damping_2=damping_2,
        azimuth=azimuth,
        participation_1=participation_1,
        participation_2=participation_2,
        yield_displacement_1=yield_displacement_1,
        hardening_1=hardening_1,
        yield_displacement_2=yield_displacement_2,
        hardening_2=hardening_2,
        mass_1=1.0,  # without contact no mass matters
        mass_2=1.0,
        gap=UNREACHABLE,
    )

    # Run the record and the free vibration after it
    rows = _run(np.ascontiguousarray(closed_record(record)), step, fields)

    # Opening of line 1 is u1 - u2, that of line 0 u2 - u1
    one_before_two = rows[:, 1, columns.OPENING].reshape(shape)
    two_before_one = rows[:, 0, columns.OPENING].reshape(shape)
    return YieldingRelativeDisplacement(
        one_before_two=one_before_two,
        two_before_one=two_before_one,
        largest=np.maximum(one_before_two, two_before_one),
        per=np.sqrt(rows[:, :, columns.LARGEST_RADIUS_SQUARED]).T.reshape(2, *shape),
        displacement_maxima=rows[:, :, columns.LARGEST_DISPLACEMENT].T.reshape(2, *shape),
    )


def _two_components(acceleration: ArrayLike) -> FloatArray:
    """Return checked north and east components, (2, n_samples)."""
    record = checks.finite("acceleration", acceleration)
    if record.ndim != 2 or record.shape[0] != 2 or record.size == 0:
        raise ValueError(
            f"acceleration must be north and east (2, n_samples), got shape {record.shape}"
        )
    return record


def _run(components: FloatArray, dt: float, fields: dict[str, FloatArray]) -> FloatArray:
    """Return the rows of all pairs after the record, run in blocks on all processors."""
    table = pair_table(fields)
    rows = row_at_rest(table, fields["gap"][:, np.newaxis], np.zeros((len(table), 1)))
    parts, free_steps = refinements(table, dt), free_vibration_steps(fields, dt)

    # Pairs without contact have separate kernels
    angles = np.radians(fields["azimuth"])
    run_blocks(
        run_without_contact,
        LANE_ROWS_WITHOUT_CONTACT,
        components,
        dt,
        rows,
        parts,
        free_steps,
        angles,
    )
    return rows
