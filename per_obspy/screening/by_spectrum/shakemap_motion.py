"""Motion of a ShakeMap: spectral displacement between its nodes, periods and dampings."""

from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.screening.by_record.stored_spectra import LogSpectra
from per_obspy.screening.by_spectrum.demand import SpectralDemand, spectral_radius
from per_obspy.screening.ground_motion.kriging import on_grid
from per_obspy.screening.uncertainty.estimated import SD_DISPERSION, UncertainMotion
from per_obspy.screening.uncertainty.pair_motion import pair_motion
from per_obspy.screening.values import Table, both

#: Dampings between which the factor of EN 1998-1 is interpolated when dampings are resampled;
#: beyond it is kept.
DAMPINGS = np.geomspace(0.002, 0.4, 24)


class MapMotion(NamedTuple):
    """
    A ShakeMap at places, (n_places, n_periods).

    Attributes
    ----------
    periods : (n_periods,) ndarray
        s, rising.
    ln_sd : ndarray
        Logarithm of SD in m at 5 % damping; minus infinity where the map has no motion.
    log_std : ndarray
        Log-standard deviation.
    """

    periods: FloatArray
    ln_sd: FloatArray
    log_std: FloatArray


class _Nodes(NamedTuple):
    """Grid cells of places, (n_places,): south-western node, and fractions from it to the next."""

    column: NDArray[np.intp]
    east: FloatArray
    row: NDArray[np.intp]
    north: FloatArray


def seen_from(shakemap: xr.Dataset, longitude: FloatArray) -> FloatArray:
    """
    Return longitudes continuous with those of a map that crosses the date line, degrees.

    Parameters
    ----------
    shakemap : Dataset
        From :func:`per_obspy.records.shakemap.read_shakemap`.
    longitude : ndarray
        Degrees.
    """
    first, last = shakemap["longitude"].values[[0, -1]]
    middle = (first + last) / 2.0
    seen: FloatArray = (longitude - middle + 180.0) % 360.0 - 180.0 + middle
    return seen


def motion_on_map(
    shakemap: xr.Dataset, longitude: FloatArray, latitude: FloatArray, assumed_log_std: float
) -> MapMotion:
    """
    Interpolate a ShakeMap bilinearly at places inside it.

    Parameters
    ----------
    shakemap : Dataset
        From :func:`per_obspy.records.shakemap.read_shakemap`.
    longitude, latitude : (n_places,) ndarray
        Degrees.
    assumed_log_std : float
        Log-standard deviation of a map without any, dimensionless.
    """
    nodes = _Nodes(
        *_lower_neighbour(shakemap["longitude"].values, seen_from(shakemap, longitude)),
        *_lower_neighbour(shakemap["latitude"].values, latitude),
    )
    periods = shakemap["period"].values
    # SD = PSA (T / 2 pi)^2; no motion is minus infinity
    with np.errstate(divide="ignore"):
        psa = _at_places(shakemap["psa"].values, nodes)
        ln_sd = np.log(psa * (periods / (2.0 * np.pi)) ** 2)
    if "psa_log_std" in shakemap:
        return MapMotion(periods, ln_sd, _at_places(shakemap["psa_log_std"].values, nodes))
    return MapMotion(periods, ln_sd, np.full(ln_sd.shape, assumed_log_std))


def displacement_on_map(motion: MapMotion, period: FloatArray, damping: FloatArray) -> FloatArray:
    """
    Return SD of one oscillator per place, m.

    It is linear between the logarithms of the periods, times the factor of the damping.

    Parameters
    ----------
    motion : MapMotion
        At the places.
    period, damping : (n_places,) ndarray
        s; fraction of critical.
    """
    ln_sd = at_period(motion.periods, motion.ln_sd, period)
    displacement: FloatArray = np.exp(ln_sd) * damping_factor(damping)
    return displacement


def at_period(periods: FloatArray, ordinates: FloatArray, period: FloatArray) -> FloatArray:
    """
    Interpolate ordinates at one period per place in log period; constant beyond the ends.

    Parameters
    ----------
    periods : (n_periods,) ndarray
        s, rising.
    ordinates : (n_places, n_periods) ndarray
        At these periods.
    period : (n_places,) ndarray
        s.
    """
    lower, share = on_grid(periods, period)
    place = np.arange(period.size)
    low, high = ordinates[place, lower], ordinates[place, lower + 1]
    result: FloatArray = (1.0 - share) * low + share * high
    return result


def damping_factor(damping: FloatArray) -> FloatArray:
    """
    Return SD at a damping over that at 5 %.

    Parameters
    ----------
    damping : ndarray
        Fraction of critical.

    References
    ----------
    EN 1998-1:2004, 3.2.2.2 (3), equation (3.6): ``sqrt(10 / (5 + ξ)) >= 0.55``, ξ in per cent.

    Examples
    --------
    >>> print(damping_factor(np.array([0.05, 0.02, 0.5])).round(3))
    [1.    1.195 0.55 ]
    """
    factor: FloatArray = np.maximum(
        np.sqrt(10.0 / (5.0 + 100.0 * checks.fraction_of_critical("damping", damping))), 0.55
    )
    return factor


def uncertain_map_motion(
    motion: MapMotion, pairs: Table, demand: SpectralDemand
) -> tuple[UncertainMotion, LogSpectra]:
    """
    Return the uncertain motion of pairs, and the spectrum of each.

    The motion of a map is uncertain once for both buildings, with the correlation of their periods.

    Parameters
    ----------
    motion : MapMotion
        At the pairs. Beyond its periods, which only resampled ones reach, SD at the end is kept.
    pairs : Table
        Completed pairs with their log-standard deviations, medians inside the map's periods.
    demand : SpectralDemand
        Radii at contact height and their correlation.
    """
    first, second = (spectral_radius(pairs, demand, i) for i in (1, 2))
    period_1, period_2 = both(pairs, "period")
    log_stds = (
        at_period(motion.periods, motion.log_std, period_1),
        at_period(motion.periods, motion.log_std, period_2),
    )
    ratios = first.ln_ratio, second.ln_ratio
    _, pair_log_std = pair_motion(
        (first.radius, second.radius), ratios, log_stds, (period_1, period_2)
    )
    # every pair has a separate spectrum
    uncertain = UncertainMotion(
        first,
        second,
        correlation=demand.correlation,
        log_std=np.hypot(pair_log_std, SD_DISPERSION),
        row=np.arange(period_1.size),
    )
    return uncertain, _log_spectra(motion.periods, motion.ln_sd)


def _log_spectra(periods: FloatArray, ln_sd: FloatArray) -> LogSpectra:
    """Return spectra at 5 % damping (n, n_periods) at all ``DAMPINGS``."""
    factors = np.log(damping_factor(DAMPINGS))[None, :, None]
    spectra = np.ascontiguousarray(ln_sd[:, None, :] + factors)
    return LogSpectra(np.log(periods), np.log(DAMPINGS), spectra)


def _at_places(grid: FloatArray, nodes: _Nodes) -> FloatArray:
    """Interpolate a grid (n_periods, n_latitudes, n_longitudes) to (n_places, n_periods)."""
    column, east, row, north = nodes
    # along the parallel south of a place, then along the one north of it
    south_west, south_east = grid[:, row, column], grid[:, row, column + 1]
    south = (1.0 - east) * south_west + east * south_east
    north_west, north_east = grid[:, row + 1, column], grid[:, row + 1, column + 1]
    further = (1.0 - east) * north_west + east * north_east
    return np.ascontiguousarray(((1.0 - north) * south + north * further).T)


def _lower_neighbour(axis: FloatArray, points: FloatArray) -> tuple[NDArray[np.intp], FloatArray]:
    """Return the lower neighbour on an axis, and the fraction towards the next one."""
    lower = np.clip(np.searchsorted(axis, points, side="right") - 1, 0, axis.size - 2)
    return lower, np.clip((points - axis[lower]) / (axis[lower + 1] - axis[lower]), 0.0, 1.0)
