"""Largest relative displacement of many pairs of bilinear structures in a record: exact, without contact."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.kernels.pounding_events import motion as columns
from per_obspy.kernels.pounding_lanes.run_without_contact import (
    LANE_ROWS_WITHOUT_CONTACT,
    UNREACHABLE,
    run_without_contact,
)
from per_obspy.pounding.history.pair_blocks import pair_table, refinements, run_blocks
from per_obspy.pounding.history.tables import closed_record, free_samples, row_at_rest


class YieldingRelativeDisplacement(NamedTuple):
    """
    What a record does to pairs of bilinear structures that do not touch.

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
    Largest relative displacement of pairs of bilinear structures, each pair along its own azimuth.

    The counterpart of `directional_relative_displacement` for structures that yield, exact as
    `pounding_histories` is: peaks between samples count, and so does the free vibration after the
    record. The result of a pair does not depend on the others.

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
        One entry a pair, in the shape to which the arguments broadcast.

    Raises
    ------
    ValueError
        If an argument is outside its range.

    Examples
    --------
    >>> pulse = np.stack([np.sin(np.linspace(0.0, 6.0 * np.pi, 301)), np.zeros(301)])
    >>> pair = yielding_relative_displacement(pulse, 0.01, 1.5, 0.05, 0.4, 0.05, 0.0, 1.0, 1.0, [math.inf, 0.05], 0.1)
    >>> print(pair.one_before_two.round(3), pair.displacement_maxima[0].round(3))
    [0.098 0.083] [0.094 0.08 ]
    """
    step = checks.number("dt", dt, checks.positive)
    record = checks.finite("acceleration", acceleration)
    if record.ndim != 2 or record.shape[0] != 2 or record.size == 0:
        raise ValueError(
            f"acceleration must be north and east (2, n_samples), got shape {record.shape}"
        )
    fields = {
        "period_1": checks.positive("period_1", period_1),
        "damping_1": checks.fraction_of_critical("damping_1", damping_1),
        "period_2": checks.positive("period_2", period_2),
        "damping_2": checks.fraction_of_critical("damping_2", damping_2),
        "azimuth": checks.finite("azimuth", azimuth),
        "participation_1": checks.not_negative("participation_1", participation_1),
        "participation_2": checks.not_negative("participation_2", participation_2),
        "yield_displacement_1": checks.positive_or_infinite(
            "yield_displacement_1", yield_displacement_1
        ),
        "hardening_1": checks.fraction_of_critical("hardening_1", hardening_1),
        "yield_displacement_2": checks.positive_or_infinite(
            "yield_displacement_2", yield_displacement_2
        ),
        "hardening_2": checks.fraction_of_critical("hardening_2", hardening_2),
        "mass_1": np.ones(()),  # without contact no mass matters
        "mass_2": np.ones(()),
        "gap": np.full((), UNREACHABLE),
    }
    shape = np.broadcast_shapes(*(values.shape for values in fields.values()))
    flat = {name: np.broadcast_to(values, shape).ravel() for name, values in fields.items()}
    rows = _run(np.ascontiguousarray(closed_record(record)), step, flat)
    towards, away = (
        rows[:, 1, columns.OPENING].reshape(shape),
        rows[:, 0, columns.OPENING].reshape(shape),
    )
    return YieldingRelativeDisplacement(
        one_before_two=towards,
        two_before_one=away,
        largest=np.maximum(towards, away),
        per=np.sqrt(rows[:, :, columns.LARGEST_RADIUS_SQUARED]).T.reshape(2, *shape),
        displacement_maxima=rows[:, :, columns.LARGEST_DISPLACEMENT].T.reshape(2, *shape),
    )


def _run(components: FloatArray, dt: float, fields: dict[str, FloatArray]) -> FloatArray:
    """Return the rows of all pairs after the record, run in blocks of equal refinement on all processors."""
    table = pair_table(fields)
    rows = row_at_rest(table, fields["gap"][:, np.newaxis], np.zeros((len(table), 1)))
    longest = np.maximum(fields["period_1"], fields["period_2"])
    free_steps = np.array([free_samples(period, dt) for period in longest], dtype=np.int64)
    angles = np.radians(fields["azimuth"])
    run_blocks(
        run_without_contact,
        LANE_ROWS_WITHOUT_CONTACT,
        components,
        dt,
        rows,
        refinements(table, dt),
        free_steps,
        angles,
    )
    return rows
