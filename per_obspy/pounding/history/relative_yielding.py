"""Largest relative displacement of pairs of bilinear structures in a record, without contact."""

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
from per_obspy.pounding.history.pair_blocks import (
    free_vibration_steps,
    pair_fields,
    pair_table,
    refinements,
    run_blocks,
)
from per_obspy.pounding.history.tables import closed_record, row_at_rest


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
