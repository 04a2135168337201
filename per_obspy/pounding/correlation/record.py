"""Correlation of the two responses of a pair to one component of a record."""

import numpy as np

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray
from per_obspy.pounding.correlation.by_azimuth import directional_correlation
from per_obspy.spectra.trace_arguments import takes_trace


@takes_trace
def record_correlation(
    acceleration: ArrayLike,
    dt: float,
    period_1: ArrayLike,
    damping_1: ArrayLike,
    period_2: ArrayLike,
    damping_2: ArrayLike,
) -> FloatArray:
    """
    Compute the correlation of two displacements under a record and the free vibration after it.

    Parameters
    ----------
    acceleration : (n_samples,) array_like or obspy Trace
        Ground acceleration, linear between samples, m/s². A record that does not end at zero is
        closed by a ramp of dt.
    dt : float
        Sampling interval, s; not given with a Trace.
    period_1, period_2 : array_like
        Undamped periods, s.
    damping_1, damping_2 : array_like
        Fractions of critical, dimensionless.

    Returns
    -------
    correlation : ndarray
        ``∫ u1 u2 dt / sqrt(∫ u1² dt ∫ u2² dt)``, broadcast shape of the pairs, dimensionless, from
        -1 to 1. Undamped structures vibrate for ever: 1 for equal ones, 0 for others.

    Raises
    ------
    ValueError
        If an argument is out of range or the record is zero everywhere.

    See Also
    --------
    per_obspy.pounding.correlation.by_azimuth.directional_correlation :
        The formula, for pairs along individual azimuths.

    Examples
    --------
    >>> print(record_correlation([0.0, 1.0, 0.0], 0.01, 1.0, 0.05, [1.0, 1.2], 0.05).round(3))
    [1.   0.23]
    """
    acceleration = checks.record("acceleration", acceleration)
    if not acceleration.any():
        raise ValueError("acceleration is 0 everywhere: there is no correlation")
    pairs = np.broadcast_arrays(
        checks.positive("period_1", period_1),
        checks.fraction_of_critical("damping_1", damping_1),
        checks.positive("period_2", period_2),
        checks.fraction_of_critical("damping_2", damping_2),
    )
    period_1, damping_1, period_2, damping_2 = (array.ravel() for array in pairs)

    # One component: the record is that along north, and so is the axis of every pair
    east = np.zeros_like(acceleration)
    correlation = directional_correlation(
        acceleration, east, dt, period_1, damping_1, period_2, damping_2, azimuths=[[0.0]]
    )
    shaped: FloatArray = correlation[:, 0].reshape(pairs[0].shape)
    return shaped
