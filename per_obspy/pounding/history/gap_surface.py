"""Critical gap over a grid of two periods, for the worst azimuth of each pair."""

import numpy as np

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray
from per_obspy.pounding.correlation.by_azimuth import worst_azimuth
from per_obspy.pounding.history.relative import directional_relative_displacement
from per_obspy.spectra.trace_arguments import takes_traces


@takes_traces
def azimuthal_gap_surface(
    north: ArrayLike,
    east: ArrayLike,
    dt: float,
    periods_1: ArrayLike,
    periods_2: ArrayLike,
    damping_1: float = 0.05,
    damping_2: float = 0.05,
) -> FloatArray:
    """
    Compute the largest relative displacement of every pair of periods over all azimuths.

    Parameters
    ----------
    north, east : (n_samples,) array_like or obspy Trace
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
        Critical gap, m; exact along the worst azimuth, which is found at the samples.

    Raises
    ------
    ValueError
        If an argument is out of range.

    See Also
    --------
    per_obspy.critical_gap_surface : Critical gaps along one azimuth.

    Notes
    -----
    The relative displacement of a pair along the axis with azimuth α is ``d(α) = dn cos α +
    de sin α``, the components of a vector. Its largest length over time is the largest over all α.

    References
    ----------
    Boore (2010), Orientation-independent, nongeometric-mean measures of seismic intensity from two
    horizontal components of motion, BSSA 100(4), for the largest value over all azimuths.

    Examples
    --------
    Motion along one line, whatever its azimuth, is that of one component:

    >>> import numpy as np
    >>> pulse = np.sin(np.linspace(0.0, 6.0 * np.pi, 301))
    >>> gap = azimuthal_gap_surface(0.6 * pulse, 0.8 * pulse, 0.01, [0.5, 1.0], [1.0, 2.0])
    >>> print(gap.round(3))
    [[0.154 0.101]
     [0.    0.234]]
    """
    grid_1, grid_2 = np.meshgrid(
        np.atleast_1d(checks.positive("periods_1", periods_1)),
        np.atleast_1d(checks.positive("periods_2", periods_2)),
        indexing="ij",
    )
    unit = np.ones(grid_1.size)
    xi_1 = checks.number("damping_1", damping_1, checks.fraction_of_critical) * unit
    xi_2 = checks.number("damping_2", damping_2, checks.fraction_of_critical) * unit
    pairs = grid_1.ravel(), xi_1, grid_2.ravel(), xi_2

    # Find the worst azimuth at the samples, then the exact demand along it
    azimuth = worst_azimuth(north, east, dt, *pairs, unit, unit)
    demand = directional_relative_displacement(north, east, dt, *pairs, azimuth)
    surface: FloatArray = demand.largest.reshape(grid_1.shape)
    return surface
