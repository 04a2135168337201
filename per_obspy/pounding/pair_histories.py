"""Largest responses and impacts of many pairs against one record, by the exact history of each."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray
from per_obspy.kernels.pounding_events import motion as columns
from per_obspy.kernels.pounding_events.contact import SLOWEST_COUNTED
from per_obspy.kernels.pounding_lanes.lanes import LANE_ROWS
from per_obspy.kernels.pounding_lanes.run_block import run_block
from per_obspy.pounding.kernel_tables import (
    closed_record,
    ground_motion,
    of_structures,
    rest_displacements,
    run_pairs,
)
from per_obspy.pounding.structure import Pairs
from per_obspy.spectra.trace_arguments import takes_trace


class PoundingMaxima(NamedTuple):
    """
    Largest responses of each pair with pounding, and its impacts.

    Attributes
    ----------
    per : (2, n_pairs) ndarray
        Largest radius ``sqrt(u² + (v / omega)²)`` of both structures with pounding, exact between
        samples, m.
    displacement_maxima : (2, n_pairs) ndarray
        Largest displacement to either side of both structures, exact between samples, m.
    impacts : (n_pairs,) ndarray of int
        Number of impacts faster than 1 mm/s and than 1 % of the pair's fastest; slower ones are the
        chatter of structures that are pressed together. 0 where structures only touch: whether
        they meet at all is ``impact_velocity > 0``.
    impact_velocity : (n_pairs,) ndarray
        Largest approach speed of an impact, m/s; 0 without impact.
    residual : (2, n_pairs) ndarray
        Displacement at which both structures come to rest, m; 0 for linear ones. Where the second
        less the first is below minus the gap, they rest against each other.
    """

    per: FloatArray
    displacement_maxima: FloatArray
    impacts: NDArray[np.int64]
    impact_velocity: FloatArray
    residual: FloatArray


@takes_trace
def pounding_histories(
    acceleration: ArrayLike,
    dt: float,
    period_1: ArrayLike,
    damping_1: ArrayLike,
    mass_1: ArrayLike,
    period_2: ArrayLike,
    damping_2: ArrayLike,
    mass_2: ArrayLike,
    gap: ArrayLike,
    restitution: ArrayLike,
    participation_1: ArrayLike = 1.0,
    participation_2: ArrayLike = 1.0,
    azimuth: ArrayLike | None = None,
    yield_displacement_1: ArrayLike = math.inf,
    hardening_1: ArrayLike = 0.0,
    yield_displacement_2: ArrayLike = math.inf,
    hardening_2: ArrayLike = 0.0,
    free_vibration: bool = True,
) -> PoundingMaxima:
    """
    Compute the maxima of the exact pounding histories of many pairs.

    The same physics as `pounding_history`, many pairs at once on all processors; the result of a
    pair does not depend on the others. Bouncing ends in contact a little earlier: when a bounce
    would last less than a thousandth of a sampling interval, or after 400 impacts in one.

    Parameters
    ----------
    acceleration : (n_samples,) or (2, n_samples) array_like, or obspy Trace
        Ground acceleration along the pairs, positive from structure 1 to 2; or its north and east
        components, m/s².
    dt : float
        Sampling interval, s; not given with a Trace.
    period_1, period_2 : (n_pairs,) array_like
        Undamped natural periods, s.
    damping_1, damping_2 : (n_pairs,) array_like
        Fractions of critical.
    mass_1, mass_2 : (n_pairs,) array_like
        Generalised masses at the contact level, kg; one of the two may be infinite.
    gap : (n_pairs,) array_like
        Clear distance at rest, m; 0 starts in contact.
    restitution : (n_pairs,) array_like
        Coefficient of restitution, between 0 and 1.
    participation_1, participation_2 : (n_pairs,) array_like
        Contact displacement over that of the plain oscillator, dimensionless.
    azimuth : (n_pairs,) array_like, optional
        Of the axis from structure 1 to 2, degrees clockwise from north; required for two
        components.
    yield_displacement_1, yield_displacement_2 : (n_pairs,) array_like
        At contact level, m; infinite for linear structures.
    hardening_1, hardening_2 : (n_pairs,) array_like
        Stiffness after yielding over elastic stiffness, at least 0 and below 1.
    free_vibration : bool
        As in `pounding_history`.

    Returns
    -------
    PoundingMaxima
        One entry per pair, in the shape to which the arguments broadcast.

    Raises
    ------
    ValueError
        If an argument is outside its range, or the azimuth does not go with the number of
        components.

    References
    ----------
    Valles-Mattox & Reinhorn (1996), An energy approach to pounding of structures, 11WCEE, eq. (7),
    (8).

    Examples
    --------
    >>> pulse = np.sin(np.linspace(0.0, 6.0 * np.pi, 301))
    >>> maxima = pounding_histories(pulse, 0.01, 1.5, 0.05, 4e5, 0.4, 0.05, 2e5, [0.02, 5.0], 0.6)
    >>> bool(maxima.impacts[0] > 0), bool(maxima.impacts[1] > 0)
    (True, False)
    """
    step = checks.number("dt", dt, checks.positive)
    pairs = Pairs.of(
        period_1=period_1,
        damping_1=damping_1,
        mass_1=mass_1,
        period_2=period_2,
        damping_2=damping_2,
        mass_2=mass_2,
        gap=gap,
        restitution=restitution,
        participation_1=participation_1,
        participation_2=participation_2,
        azimuth=0.0 if azimuth is None else azimuth,
        yield_displacement_1=yield_displacement_1,
        hardening_1=hardening_1,
        yield_displacement_2=yield_displacement_2,
        hardening_2=hardening_2,
    )

    # A single component is the north one, at azimuth 0
    if azimuth is None:
        record = checks.record("acceleration", acceleration)
        components = np.stack([record, np.zeros_like(record)])
    else:
        components = ground_motion(acceleration)
    if free_vibration:
        components = closed_record(components)

    # Rows of the kernels hold the squares of the largest radii
    rows, impacts = run_pairs(
        run_block, LANE_ROWS, components, step, pairs, free_vibration, SLOWEST_COUNTED
    )
    shape = pairs.shape
    return PoundingMaxima(
        per=of_structures(np.sqrt(rows[:, :, columns.LARGEST_RADIUS_SQUARED]), shape),
        displacement_maxima=of_structures(rows[:, :, columns.LARGEST_DISPLACEMENT], shape),
        impacts=impacts.reshape(shape),
        impact_velocity=rows[:, 0, columns.APPROACH].reshape(shape),
        residual=rest_displacements(rows, shape),
    )
