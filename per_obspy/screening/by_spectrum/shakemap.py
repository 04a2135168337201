"""
Pairs under a ShakeMap: motion at their places, and rows of pairs without a station in reach.

A map gives pseudo-spectral acceleration at 5 % damping and few periods. The radius is its spectral
displacement, with no factor for PER: PER is never below SD, but how far above it depends on the
record, which a map does not have, and on broad-band records the gap from SD and eq. (16) is within
a log-standard deviation of 0.14 of the exact one (median 0.97), that from PER within 0.35 (1.14).
Other dampings are reached by the factor of EN 1998-1. Flags of every row report these assumptions.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.config import Screening
from per_obspy.errors import Rejection
from per_obspy.inventory.suspicions import ODD
from per_obspy.screening.by_record.station_motion import LogSpectra
from per_obspy.screening.by_spectrum.demand import (
    SpectralDemand,
    spectral_columns,
    spectral_demand,
    spectral_radius,
)
from per_obspy.screening.columns import ORDER, RESULTS
from per_obspy.screening.flags import joined_flags, raised_by_pairs
from per_obspy.screening.ground_motion.field import on_grid
from per_obspy.screening.uncertainty.estimated import (
    SD_DISPERSION,
    UncertainMotion,
    estimated_population,
)
from per_obspy.screening.uncertainty.motion import pair_motion
from per_obspy.screening.values import Table, both, values

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


#: Longest way outside a map's edge that counts as on it: its coordinates have so many digits,
#: degrees.
EDGE = 1e-6


def shakemap_rows(
    shakemap: xr.Dataset, pairs: pd.DataFrame, screening: Screening
) -> tuple[pd.DataFrame, tuple[Rejection, ...]]:
    """
    Compute the rows of pairs that no station serves, and the rejections of those outside the map.

    Parameters
    ----------
    shakemap : Dataset
        From :func:`per_obspy.records.shakemap.read_shakemap`.
    pairs : DataFrame
        Completed pairs.
    screening : Screening
        Thresholds, risk classes and the region's values for code rules.

    Returns
    -------
    rows : DataFrame
        Not ranked, with the columns of :func:`~per_obspy.screening.rows.risk_rows`; those that need
        a record (``per_1``, ``impacts``, ``station``, ...) are empty. ``demand_rule`` is
        ``shakemap``.
    rejected : tuple of Rejection
        Pairs outside the map, without motion there, or with a period outside the map's, each with
        the value.
    """
    pairs = pairs.reset_index(drop=True)
    reasons = _outside(shakemap, pairs)
    inside = np.flatnonzero([not reason for reason in reasons])
    motion = _motion_at(shakemap, _taken(pairs, inside), screening.shakemap_log_std)
    # nodes of a map outside its data have no motion
    moves = np.isfinite(motion.ln_sd).all(axis=1)
    for row in inside[~moves]:
        reasons[row].append("the ShakeMap has no motion there")
    moving = MapMotion(motion.periods, motion.ln_sd[moves], motion.log_std[moves])
    rows = _rows(shakemap, moving, _taken(pairs, inside[moves]), screening)
    # one rejection per pair with a reason
    source = str(shakemap.attrs["source"])
    rejections = []
    for name, reason in zip(pairs["pair_id"], reasons, strict=True):
        if reason:
            rejections.append(Rejection("pair", name, source, None, tuple(reason)))
    return rows, tuple(rejections)


def shakemap_fallback(
    shakemap: xr.Dataset, pairs: pd.DataFrame, unreached: Sequence[Rejection], screening: Screening
) -> tuple[pd.DataFrame, tuple[Rejection, ...]]:
    """
    Compute the rows of pairs without a station; reject those outside the map with both reasons.

    Parameters
    ----------
    shakemap : Dataset
        From :func:`per_obspy.records.shakemap.read_shakemap`.
    pairs : DataFrame
        Completed pairs, those with a station among them.
    unreached : sequence of Rejection
        Of pairs, from :func:`per_obspy.screening.ground_motion.assignment.assigned`.
    screening : Screening
        As for :func:`shakemap_rows`.

    Returns
    -------
    rows, rejected : DataFrame, tuple of Rejection
        As from :func:`shakemap_rows`.
    """
    reasons = {rejection.name: rejection.reasons for rejection in unreached}
    without_station = pairs[pairs["pair_id"].isin(list(reasons))]
    rows, rejections = shakemap_rows(shakemap, without_station, screening)
    # the station's reason comes first
    rejected = []
    for rejection in rejections:
        both_reasons = (*reasons[rejection.name], *rejection.reasons)
        rejected.append(rejection._replace(reasons=both_reasons))
    return rows, tuple(rejected)


def _taken(pairs: pd.DataFrame, rows: NDArray[np.intp]) -> pd.DataFrame:
    """Return rows of pairs by position, renumbered."""
    return pairs.iloc[rows].reset_index(drop=True)


def _motion_at(shakemap: xr.Dataset, pairs: pd.DataFrame, assumed_log_std: float) -> MapMotion:
    """Return the motion of the map at pairs."""
    longitude, latitude = values(pairs, "longitude"), values(pairs, "latitude")
    return motion_on_map(shakemap, longitude, latitude, assumed_log_std)


def _rows(
    shakemap: xr.Dataset, motion: MapMotion, pairs: pd.DataFrame, screening: Screening
) -> pd.DataFrame:
    """Return the rows of pairs that have a motion on the map."""
    period_1, period_2 = both(pairs, "period")
    damping_1, damping_2 = both(pairs, "damping")
    # demand of SD, and the population
    sd_1 = displacement_on_map(motion, period_1, damping_1)
    sd_2 = displacement_on_map(motion, period_2, damping_2)
    demand = spectral_demand(pairs, (sd_1, sd_2))
    population = estimated_population(*uncertain_map_motion(motion, pairs, demand), pairs)
    # columns of a risk table with those of SD
    named = pairs.assign(demand_rule="shakemap")
    table = spectral_columns(named, (sd_1, sd_2), demand, population, screening)
    table = table.assign(flags=_flags(shakemap, table))
    empty = {name: _empty(name) for name in ORDER if name not in table and name != "rank"}
    return table.assign(**empty).drop(
        columns=["srss_gap_sd", "absolute_gap_sd", ODD], errors="ignore"
    )


def _flags(shakemap: xr.Dataset, table: pd.DataFrame) -> NDArray[np.object_]:
    """Return the flags of every row, those of the map included."""
    every = np.ones(len(table), dtype=bool)
    scenario = shakemap.attrs.get("shakemap_event_type", "").upper() == "SCENARIO"
    of_map = {
        "shakemap_demand": every,
        "shakemap_assumed_deviation": every & ("psa_log_std" not in shakemap),
        "simulated": every & scenario,
    }
    return joined_flags(raised_by_pairs(table) | of_map)


def _empty(name: str) -> str | float:
    """Return the empty value of a risk-table column without data from a map."""
    return "" if RESULTS[name].dtype == "str" else np.nan


def _outside(shakemap: xr.Dataset, pairs: pd.DataFrame) -> list[list[str]]:
    """Return one sentence per value outside the map, pair by pair."""
    reasons: list[list[str]] = [[] for _ in range(len(pairs))]
    # column of the pairs, axis of the map, unit, and distance from the edge that counts as on it
    longitude = seen_from(shakemap, values(pairs, "longitude"))
    ranges = {
        "longitude": (longitude, "longitude", "", EDGE),
        "latitude": (values(pairs, "latitude"), "latitude", "", EDGE),
        "period_1": (values(pairs, "period_1"), "period", " s", 0.0),
        "period_2": (values(pairs, "period_2"), "period", " s", 0.0),
    }
    for name, (column, axis, unit, edge) in ranges.items():
        first, last = shakemap[axis].values[[0, -1]]
        span = f"{first:g} to {last:g}{unit}"
        # every value outside is one reason
        for row in np.flatnonzero((column < first - edge) | (column > last + edge)):
            reason = f"{name} = {column[row]:g}{unit} is outside the ShakeMap's {span}"
            reasons[row].append(reason)
    return reasons
