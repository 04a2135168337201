"""Largest relative displacement of pairs in a record, without contact: the exact critical gap."""

import math
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray
from per_obspy.kernels.pounding_events import motion as columns
from per_obspy.kernels.pounding_lanes.lanes import APART, LANE_ROWS_WITHOUT_CONTACT
from per_obspy.kernels.pounding_lanes.run_block import UNREACHABLE, run_block
from per_obspy.kernels.relative.relative_maxima import relative_maxima
from per_obspy.kernels.relative.yielding_approach import ROUND
from per_obspy.kernels.relative.yielding_approach import yielding_approach as fill_approach
from per_obspy.pounding.kernel_tables import (
    both_components,
    closed_record,
    ground_motion,
    of_structures,
    rest_displacements,
    run_pairs,
)
from per_obspy.pounding.structure import Pairs
from per_obspy.spectra.trace_arguments import takes_trace

#: Largest remainder of a motion that is not computed, over 0.4 % of its bound: of critical gaps a
#: thousandth of the promised exactness; of the approach, of which populations need hundreds, more.
FORGOTTEN, FORGOTTEN_OF_APPROACH = 1e-12, 1e-7

#: Part of the largest openings of linear structures that those which yield are expected to reach.
EXPECTED_OPENING = 0.1

#: Largest angle of a step of pairs that yield, rad, at which peaks between steps are missed by 1.5
#: % at most; longest free vibration after the record, s.
LARGEST_ANGLE, FREE_VIBRATION = 0.35, 60.0

#: Part of what the largest acceleration may do that pairs that yield are expected to reach: the
#: bound is wide; largest remainder of their motion before a start, over the bound of what counts.
EXPECTED_APPROACH, FORGOTTEN_BEFORE = 0.001, 1e-3

#: Dampings and sizes below this are zero, of which there is no ratio.
SMALLEST = 1e-30

#: Numbers of steps of the strides of pairs that yield, two of which divide a round; largest angle
#: of a stride, rad, whose half the kernel allows for; longest one, s, so that motion of less than
#: 12 Hz is seen.
STRIDES = np.array([1, 2, 3, 4, 6, 8, 12])
LARGEST_STRIDE, LONGEST_STRIDE = 1.05, 0.0401


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

    ``displacement`` is the largest ``q1 u1 - q2 u2``, m, exact to 1e-6 for linear structures;
    ``velocity`` the largest ``q1 v1 - q2 v2`` at the samples, m/s, which misses at most ``1 -
    cos(pi dt / T)`` of a vibration of the period T.
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
    record = checks.record("acceleration", acceleration)
    structures = period_1, damping_1, period_2, damping_2
    shares = participation_1, participation_2
    east = np.zeros_like(record)
    return directional_relative_displacement(record, east, dt, *structures, 0.0, *shares)


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
    pairs = Pairs.of(
        period_1=period_1,
        damping_1=damping_1,
        participation_1=participation_1,
        period_2=period_2,
        damping_2=damping_2,
        participation_2=participation_2,
        azimuth=azimuth,
    )
    one_before_two, two_before_one, _ = _maxima(north, east, dt, pairs, FORGOTTEN, both_sides=True)
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
    pairs = Pairs.of(
        period_1=period_1,
        damping_1=damping_1,
        participation_1=participation_1,
        period_2=period_2,
        damping_2=damping_2,
        participation_2=participation_2,
        azimuth=azimuth,
    )
    displacement, _, velocity = _maxima(
        north, east, dt, pairs, FORGOTTEN_OF_APPROACH, both_sides=False
    )
    return Approach(displacement, velocity)


def yielding_approach(
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
) -> Approach:
    """
    Compute by how far and how fast structure 1 approaches 2 at most, if they do not touch.

    For populations of structures that yield: the same as `yielding_relative_displacement`, at the
    samples and steps between them of 0.35 rad of the shorter period at most, in a small part of its
    time. Half of the displacements are exact to 3e-4, 99 % to 1 %, and so are velocities at the
    samples.

    Parameters
    ----------
    acceleration, dt, period_1, damping_1, period_2, damping_2, azimuth : array_like
        See `yielding_relative_displacement`.
    participation_1, participation_2, yield_displacement_1, yield_displacement_2 : array_like
        Likewise.
    hardening_1, hardening_2 : array_like
        Likewise.

    Returns
    -------
    Approach
        Arrays of the broadcast shape of the pairs, m and m/s.

    Raises
    ------
    ValueError
        If an argument is out of range.
    """
    pairs = Pairs.of(
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
    )
    # closed record, and rows of the kernel
    step = checks.number("dt", dt, checks.positive)
    record = closed_record(ground_motion(acceleration))
    structures = _structures(pairs)
    largest = np.empty_like(structures[:2])
    # each pair with its own steps
    parts, strides = _steps(pairs.frequency.max(axis=0), step)
    for number in np.unique(parts).tolist():
        ground = _in_steps(record, step, number)
        strongest = _strongest(ground)
        for stride in np.unique(strides[parts == number]).tolist():
            alike = (parts == number) & (strides == stride)
            arguments = step / number, stride, np.compress(alike, structures, axis=1)
            largest[:, alike] = _filled(ground, strongest, *arguments)
    return Approach(*largest.reshape(2, *pairs.shape))


def _filled(
    ground: NDArray[np.float32],
    strongest: FloatArray,
    dt: float,
    stride: int,
    structures: FloatArray,
) -> FloatArray:
    """Return what the kernel fills, (2, n_pairs)."""
    until, after = strongest
    motion = ground, *_shapes(stride), dt, after
    # what an acceleration of 1 moves a pair at most, in distance and speed
    reach = structures[[5, 11]]
    together = np.stack([reach.sum(axis=0), (structures[[0, 6]] * reach).sum(axis=0)])
    expected = EXPECTED_APPROACH * until[-1] * together
    largest = np.zeros_like(together)
    fill_approach(
        *motion, structures, expected, _starts(structures, expected / together, until, dt), largest
    )
    # pairs that do not reach what is expected run again, from what they have reached
    short = (largest < expected).any(axis=0)
    if short.any():
        pairs, floor = np.compress(short, structures, axis=1), np.compress(short, largest, axis=1)
        counts, own = floor / np.compress(short, together, axis=1), floor.copy()
        fill_approach(*motion, pairs, floor, _starts(pairs, counts, until, dt), own)
        largest[:, short] = own
    return largest


def _starts(structures: FloatArray, counts: FloatArray, until: FloatArray, dt: float) -> FloatArray:
    """Return the rounds before which pairs rest, for accelerations from which maxima count."""
    # nor may it yield
    counts = np.minimum(counts.min(axis=0), (structures[[3, 9]] / structures[[5, 11]]).min(axis=0))
    # what came before must be forgotten
    rate = np.maximum((structures[[0, 6]] * structures[[1, 7]]).min(axis=0), SMALLEST)
    memory = np.ceil(-math.log(FORGOTTEN_BEFORE) / (ROUND * dt * rate))
    starts: FloatArray = np.maximum(np.searchsorted(until, counts, "right") - memory, 0.0)
    return starts


def _strongest(ground: NDArray[np.float32]) -> FloatArray:
    """Return the largest acceleration until the end of each round, and after its start."""
    square = ground[0] ** 2 + ground[1] ** 2
    rounds = np.maximum(square[:-1].reshape(-1, ROUND).max(axis=1), square[ROUND::ROUND])
    # single precision may be off by some units of its last digit
    rounds = 1.000001 * np.sqrt(rounds.astype(float))
    after = np.maximum.accumulate(rounds[::-1])[::-1]
    return np.stack([np.maximum.accumulate(rounds), after])


def _shapes(stride: int) -> tuple[FloatArray, FloatArray]:
    """
    Return accelerations in a stride, and by which sums over its samples it has them, (3, samples).

    They are a constant, a line and a parabola, which are orthogonal by the trapezoidal rule.
    """
    line, weight = np.arange(stride + 1) - 0.5 * stride, np.ones(stride + 1)
    weight[[0, -1]] = 0.5
    parabola = line**2 - np.sum(weight * line**2) / stride
    shapes = np.stack([np.ones(stride + 1), line, parabola])
    # a stride of one step has no parabola
    sizes = np.maximum(np.sum(weight * shapes**2, axis=1, keepdims=True), SMALLEST)
    return shapes, weight * shapes / sizes


def _structures(pairs: Pairs) -> FloatArray:
    """Return pairs that may yield in the rows of the kernel, (14, n_pairs)."""
    angle, damping = np.radians(pairs.azimuth), np.clip(pairs.damping, SMALLEST, 0.999)
    # ratio of two peaks of free vibration in succession, less 1
    fading = np.expm1(-math.pi * damping / np.sqrt(1.0 - damping**2))
    reach = pairs.participation * -2.0 / fading / pairs.frequency**2
    fields = pairs.frequency, pairs.damping, pairs.participation, pairs.yield_displacement
    numbers = np.stack([*fields, pairs.hardening, reach], axis=1)
    return np.concatenate([numbers.reshape(12, -1), [np.cos(angle), np.sin(angle)]])


def _steps(frequency: FloatArray, dt: float) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return steps per sampling interval and per stride of pairs of their own frequencies."""
    angle = frequency * dt
    parts = 2 ** np.ceil(np.log2(np.maximum(angle / LARGEST_ANGLE, 1.0))).astype(int)
    longest = parts * np.minimum(LARGEST_STRIDE / angle, LONGEST_STRIDE / dt)
    return parts, STRIDES[np.searchsorted(STRIDES[1:], longest, "right")]


def _in_steps(record: FloatArray, dt: float, parts: int) -> NDArray[np.float32]:
    """Return a record in equal parts of its sampling intervals, and zeros after it."""
    last = record.shape[1] - 1
    # whole rounds of the kernel
    rounds = -(-(last + int(FREE_VIBRATION / dt)) * parts // ROUND)
    motion = np.zeros((2, rounds * ROUND + 1), np.float32)
    for part in range(parts):
        share = part / parts
        motion[:, part : last * parts : parts] = record[:, :-1] + share * np.diff(record)
    return motion


def _maxima(
    north: ArrayLike, east: ArrayLike, dt: float, pairs: Pairs, forgotten: float, both_sides: bool
) -> FloatArray:
    """
    Return the largest displacements in both directions and velocity, (3, *shape of pairs).

    That of 2 before 1 is infinite unless ``both_sides`` is set.
    """
    motion = closed_record(both_components(north, east))
    step, angle = checks.number("dt", dt, checks.positive), np.radians(pairs.azimuth)
    numbers = np.concatenate([pairs.oscillators, [np.cos(angle), np.sin(angle)]])

    # Sorted by the rate at which free vibration fades, so that alike pairs share a block
    order = np.argsort((pairs.frequency * pairs.damping).min(axis=0))
    ascending = np.ascontiguousarray(numbers[:, order])
    ordered = np.empty((3, order.size))
    relative_maxima(*motion, step, ascending, forgotten, both_sides, ordered)

    # Back to the order of the arguments
    largest = np.empty_like(ordered)
    largest[:, order] = ordered
    return largest.reshape(3, *pairs.shape)


def _rows_apart(record: FloatArray, dt: float, pairs: Pairs) -> FloatArray:
    """
    Return the rows of pairs that never touch, see `run_pairs`.

    Openings far below those of linear structures are not followed, nor those of twins: none.
    """
    kernel = partial(run_block, kind=APART), LANE_ROWS_WITHOUT_CONTACT
    run = partial(run_pairs, *kernel, closed_record(record), dt, free_vibration=True)
    linear = _maxima(record[0], record[1], dt, pairs, FORGOTTEN_OF_APPROACH, both_sides=True)
    # u2 - u1, then u1 - u2
    expected = EXPECTED_OPENING * linear[1::-1].reshape(2, -1).T
    twins = pairs.are_twins
    rows, _ = run(pairs, counted_speed=np.where(twins[:, None], UNREACHABLE, expected))
    rows[twins, :, columns.OPENING] = 0.0
    # what falls short of it again
    short = np.flatnonzero((rows[:, :, columns.OPENING] <= expected).any(axis=1) & ~twins)
    if short.size:
        rows[short], _ = run(pairs.chosen(short))
    return rows


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
    residual : (2, n_pairs) ndarray
        Displacement at contact level at which both structures come to rest, m.
    """

    one_before_two: FloatArray
    two_before_one: FloatArray
    largest: FloatArray
    per: FloatArray
    displacement_maxima: FloatArray
    residual: FloatArray


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
    record = ground_motion(acceleration)
    pairs = Pairs.of(
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
        gap=UNREACHABLE,
    )

    rows = _rows_apart(record, step, pairs)
    # Opening of line 1 is u1 - u2, that of line 0 u2 - u1
    openings = of_structures(rows[:, :, columns.OPENING], pairs.shape)
    return YieldingRelativeDisplacement(
        one_before_two=openings[1, ...],
        two_before_one=openings[0, ...],
        largest=openings.max(axis=0),
        per=of_structures(np.sqrt(rows[:, :, columns.LARGEST_RADIUS_SQUARED]), pairs.shape),
        displacement_maxima=of_structures(rows[:, :, columns.LARGEST_DISPLACEMENT], pairs.shape),
        residual=rest_displacements(rows, pairs.shape),
    )
