"""
Ground motion at the site of a pair, relative to the record assigned to the pair.

The record decides the demand; the columns made here state how far the motion at the site is
expected to be from it, and how well that is known. The measure of a station's motion is PER at 5 %
damping, the median over horizontal azimuths (RotD50) where there are two horizontals, else that of
the only one; its ratio serves every damping and azimuth. The spatial correlation was published for
spectral acceleration.
"""

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.config import Interpolation
from per_obspy.constants import REFERENCE_DAMPING
from per_obspy.screening.assignment import Sites, Stations, site_class_of, sites
from per_obspy.screening.motion_field import (
    MotionField,
    fitted_field,
    great_circle,
    motion_at,
    on_grid,
)
from per_obspy.screening.values import IndexArray, number, values

if TYPE_CHECKING:
    from per_obspy.screening.station_amplitudes import AmplitudeField

#: Largest distance between epicentres of one earthquake, m: agencies differ by less.
SAME_EARTHQUAKE = 50_000.0

#: Shortest distance from the hypocentre that the trend uses, m.
SHORTEST_DISTANCE = 1000.0


class Hypocentre(NamedTuple):
    """Point at which the earthquake started: degrees east and north, depth in m."""

    longitude: float
    latitude: float
    depth: float


#: Attributes of a station's Dataset that hold the hypocentre.
HYPOCENTRE = tuple(f"hypocentre_{name}" for name in Hypocentre._fields)


class StationField(NamedTuple):
    """
    Motion of all stations of a run, computed once and passed to every worker.

    Attributes
    ----------
    field : MotionField
        Trend and residuals.
    ln_per : (n_stations, n_periods) ndarray
        ln PER of the stations in the order in which they came, PER in m.
    source : Hypocentre or None
        Hypocentre of the earthquake, if it is known.
    """

    field: MotionField
    ln_per: FloatArray
    source: Hypocentre | None


class RegionalMotion(NamedTuple):
    """
    Ground motion of a region: stations, motion between them, and a ShakeMap beyond.

    Attributes
    ----------
    stations : Stations
        Stations whose records are assigned to pairs.
    field : StationField or None
        The motion between the stations; None if there are no stations.
    shakemap : Dataset or None
        ShakeMap for pairs without a station in reach.
    amplitudes : AmplitudeField or None
        Motion of stations of which only amplitudes are known.
    """

    stations: Stations
    field: StationField | None
    shakemap: xr.Dataset | None
    amplitudes: "AmplitudeField | None" = None


def hypocentre_of(attributes: Iterable[Mapping[Any, Any]]) -> Hypocentre | None:
    """
    Return the hypocentre of the earthquake that stations recorded.

    Parameters
    ----------
    attributes : iterable of mapping
        Attributes of the stations' Datasets; ``hypocentre_longitude``, ``hypocentre_latitude`` and
        ``hypocentre_depth`` (degrees, m) where they are known.

    Returns
    -------
    Hypocentre or None
        The median where agencies place it a little apart; None if no station knows it, or if
        stations recorded different earthquakes.
    """
    known = [station for station in attributes if HYPOCENTRE[0] in station]
    if not known:
        return None
    # Epicentres of one earthquake are near to each other
    longitude, latitude, depth = (
        np.array([station[name] for station in known], dtype=np.float64) for name in HYPOCENTRE
    )
    apart = great_circle(longitude[0], latitude[0], longitude, latitude)
    if (apart > SAME_EARTHQUAKE).any():
        return None
    return Hypocentre(_middle(longitude), _middle(latitude), _middle(depth))


def _middle(numbers: FloatArray) -> float:
    """Return the lower median, an element of the numbers."""
    return float(np.sort(numbers)[(numbers.size - 1) // 2])


def prepared_field(
    stations: Iterable[xr.Dataset], settings: Interpolation, source: Hypocentre | None = None
) -> StationField:
    """
    Fit the field from which the motion at every site is estimated.

    Parameters
    ----------
    stations : iterable of Dataset
        From :func:`per_obspy.station_spectra`, with coordinates, one after the other;
        ``site_class`` (text) and ``vs30`` (m/s) are used where a station has them.
    settings : Interpolation
        Assumed deviation, and the case of the spatial correlation.
    source : Hypocentre, optional
        The hypocentre, from which the trend's distances are measured.

    Raises
    ------
    ValueError
        If there is no station, or one without coordinates.
    """
    motions = [_station_motion(station) for station in stations]
    if not motions:
        raise ValueError("stations must be one at least, got none")

    # The periods of the first station are the grid of all
    periods = motions[0].periods
    ln_per = np.array(
        [np.interp(np.log(periods), np.log(motion.periods), motion.ln_per) for motion in motions]
    )
    usable = np.array([motion.usable for motion in motions])

    # A station that did not move has no ln PER: it supports no period
    still = ~np.isfinite(ln_per).all(axis=1)
    ln_per[still] = np.nan
    usable[still] = (np.inf, -np.inf)

    places = with_source_distance(source, _places_of(motions))
    field = fitted_field(places, np.nan_to_num(ln_per), usable, periods, settings)
    return StationField(field, ln_per, source)


def motion_at_pairs(
    prepared: StationField, pairs: pd.DataFrame, station: ArrayLike
) -> dict[str, NDArray[np.generic]]:
    """
    Estimate the motion at pairs relative to their records, as columns of the risk table.

    Parameters
    ----------
    prepared : StationField
        From :func:`prepared_field`.
    pairs : DataFrame
        Completed pairs; ``site_class`` and ``vs30`` are used where the table has them.
    station : (n_pairs,) array_like of int
        Index of the station whose record each pair uses, in the order of
        :func:`prepared_field`; a single number serves all pairs.

    Returns
    -------
    dict
        ``ln_per_ratio_i``: ln(PER at the site / PER of the record) at the period of building i;
        ``ln_per_std_i``: its log-standard deviation; both 0 at the place of the station where the
        record supports the period, both NaN where no station does.
        ``motion_from_other_site_class``: whether stations of another or of an unknown site class
        had to serve.

    Raises
    ------
    ValueError
        If a station's index is out of range.
    """
    record = np.broadcast_to(
        checks.between("station", station, 0, len(prepared.ln_per) - 1), len(pairs)
    ).astype(np.intp)
    places = with_source_distance(prepared.source, places_of_pairs(pairs))

    columns: dict[str, NDArray[np.generic]] = {}
    fallback = np.zeros(len(pairs), dtype=bool)
    # Both buildings share one place, but have different periods
    for i in (1, 2):
        period = values(pairs, f"period_{i}")
        motion = motion_at(prepared.field, places, period)
        columns[f"ln_per_ratio_{i}"] = motion.ln_median - _stored_ln_per(prepared, record, period)
        columns[f"ln_per_std_{i}"] = motion.log_std
        fallback |= motion.fallback
    return columns | {"motion_from_other_site_class": fallback}


def places_of_pairs(pairs: pd.DataFrame) -> Sites:
    """Return the places of pairs, with site class and Vs30 where the table has them."""
    site_class = pairs["site_class"].to_numpy(dtype=object) if "site_class" in pairs else ""
    vs30 = values(pairs, "vs30") if "vs30" in pairs else np.nan
    return sites(values(pairs, "longitude"), values(pairs, "latitude"), site_class, np.nan, vs30)


def _stored_ln_per(prepared: StationField, record: IndexArray, period: FloatArray) -> FloatArray:
    """Interpolate ln PER of the pairs' records at their periods."""
    lower, share = on_grid(prepared.field.periods, period)
    below = prepared.ln_per[record, lower]
    above = prepared.ln_per[record, lower + 1]
    stored: FloatArray = (1.0 - share) * below + share * above
    return stored


def with_source_distance(source: Hypocentre | None, places: Sites) -> Sites:
    """Return the places with their distances from the hypocentre."""
    if source is None:
        return places
    along = great_circle(source.longitude, source.latitude, places.longitude, places.latitude)
    distance = np.maximum(np.hypot(along, source.depth), SHORTEST_DISTANCE)
    return places._replace(source_distance=distance)


class _StationMotion(NamedTuple):
    """Place, ground and ln PER of one station; usable periods as shortest and longest, s."""

    longitude: float
    latitude: float
    site_class: str
    vs30: float
    usable: tuple[float, float]
    periods: FloatArray
    ln_per: FloatArray


def _station_motion(station: xr.Dataset) -> _StationMotion:
    """Extract the values of the motion field from a station's Dataset."""
    return _StationMotion(
        longitude=number(station, "longitude"),
        latitude=number(station, "latitude"),
        site_class=site_class_of(station),
        vs30=number(station, "vs30") if "vs30" in station else np.nan,
        usable=(
            number(station, "shortest_usable_period"),
            number(station, "longest_usable_period"),
        ),
        periods=np.asarray(station["period"], dtype=np.float64),
        ln_per=_ln_per(station),
    )


def _places_of(motions: list[_StationMotion]) -> Sites:
    """Return the places of stations."""
    return sites(
        [motion.longitude for motion in motions],
        [motion.latitude for motion in motions],
        np.array([motion.site_class for motion in motions], dtype=object),
        vs30=[motion.vs30 for motion in motions],
    )


def _ln_per(station: xr.Dataset) -> FloatArray:
    """Return ln PER at 5 % damping, minus infinity where there was no motion."""
    stored = station["per_rotd50"] if "per_rotd50" in station else station["per"][0]
    return ln_at_reference_damping(station, np.asarray(stored))


def ln_at_reference_damping(station: xr.Dataset, stored: ArrayLike) -> FloatArray:
    """Return the logarithm of radii (n_dampings, n_periods) of a station at 5 % damping."""
    with np.errstate(divide="ignore"):
        radii = np.log(np.asarray(stored, dtype=np.float64))

    # Between the stored dampings if 5 % is not one of them; np.interp needs them ascending
    dampings = np.asarray(station["damping"], dtype=np.float64)
    order = np.argsort(dampings)
    return np.array(
        [np.interp(REFERENCE_DAMPING, dampings[order], column) for column in radii[order].T]
    )
