"""
The ground motion at a pair of buildings, compared with that of the record which the pair is given.

The record decides the demand; the columns made here tell how far the motion at the site is expected
to be from it, and how well that is known. The measure of a station's motion is PER at 5 % damping,
the median over horizontal azimuths (RotD50) where there are two horizontals, else that of the only
one; its ratio serves every damping and azimuth. The spatial correlation was published for spectral
acceleration.
"""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.config import Interpolation
from per_obspy.screening.ground_motion.kriging import Field, fitted_field, motion_at, on_grid
from per_obspy.screening.ground_motion.sites import Sites, sites
from per_obspy.screening.ground_motion.spatial_correlation import great_circle
from per_obspy.screening.values import number, values

#: Damping at which stations are compared; where it is not stored, between the stored ones or the
#: next of them.
DAMPING = 0.05


class Source(NamedTuple):
    """Where the earthquake started: degrees east and north, depth in m."""

    longitude: float
    latitude: float
    depth: float


class StationField(NamedTuple):
    """
    The motion of all stations of a run: made once, small, and given to every worker.

    Attributes
    ----------
    field : Field
        Trend and residuals.
    ln_per : (n_stations, n_periods) ndarray
        Of the stations in the order in which they came, PER in m.
    source : Source or None
        Where the earthquake started, if that is known.
    """

    field: Field
    ln_per: FloatArray
    source: Source | None


def prepared_field(
    stations: Iterable[xr.Dataset], settings: Interpolation, source: Source | None = None
) -> StationField:
    """
    Prepare what the motion at every site is told from.

    Parameters
    ----------
    stations : iterable of Dataset
        From :func:`per_obspy.station_spectra`, with coordinates, one after the other;
        ``site_class`` (text) and ``vs30`` (m/s) are used where a station has them.
    settings : Interpolation
        What is assumed of the deviation, and the case of the correlation.
    source : Source, optional
        The hypocentre, from which the trend's distances are measured.

    Raises
    ------
    ValueError
        If there is no station, or one without coordinates.
    """
    told = [_told(station) for station in stations]
    if not told:
        raise ValueError("stations must be one at least, got none")
    periods = told[0].periods
    ln_per = np.array([np.interp(np.log(periods), np.log(one.periods), one.ln_per) for one in told])
    usable = np.array([one.usable for one in told])
    still = ~np.isfinite(ln_per).all(axis=1)
    ln_per[still], usable[still] = (
        np.nan,
        (np.inf, -np.inf),
    )  # a station that did not move knows nothing
    places = sites(
        [one.longitude for one in told],
        [one.latitude for one in told],
        np.array([one.site_class for one in told], dtype=object),
        vs30=[one.vs30 for one in told],
    )
    field = fitted_field(
        _seen_from(source, places), np.nan_to_num(ln_per), usable, periods, settings
    )
    return StationField(field, ln_per, source)


def motion_at_pairs(
    prepared: StationField, pairs: pd.DataFrame, station: ArrayLike
) -> dict[str, NDArray[np.generic]]:
    """
    Return the motion at pairs of buildings relative to their record, as columns of the risk table.

    Parameters
    ----------
    prepared : StationField
        From :func:`prepared_field`.
    pairs : DataFrame
        Completed pairs; ``site_class`` and ``vs30`` are used where the table has them.
    station : (n_pairs,) array_like of int
        Which station's record each pair is given, counted as :func:`prepared_field` was given them;
        one for all if it is a single number.

    Returns
    -------
    dict
        ``ln_per_ratio_i``: ln(PER at the site / PER of the record) at the period of building i;
        ``ln_per_std_i``: its log-standard deviation; both 0 at the station's own place where the
        record supports the period, both NaN where no station does.
        ``motion_from_other_site_class``: whether stations of another site class, or of one nobody
        knows, had to serve.

    Raises
    ------
    ValueError
        If a station's index is out of range.
    """
    longitude, latitude = values(pairs, "longitude"), values(pairs, "latitude")
    count = len(pairs)
    index = np.broadcast_to(
        checks.between("station", station, 0, len(prepared.ln_per) - 1), count
    ).astype(np.intp)
    vs30 = values(pairs, "vs30") if "vs30" in pairs else np.nan
    site_class = pairs["site_class"].to_numpy(dtype=object) if "site_class" in pairs else ""
    places = _seen_from(prepared.source, sites(longitude, latitude, site_class, np.nan, vs30))
    columns: dict[str, NDArray[np.generic]] = {}
    crossed = np.zeros(count, dtype=bool)
    for i in (1, 2):
        period = values(pairs, f"period_{i}")
        motion = motion_at(prepared.field, places, period)
        columns[f"ln_per_ratio_{i}"] = motion.ln_median - _stored(prepared, index, period)
        columns[f"ln_per_std_{i}"] = motion.log_std
        crossed |= motion.fallback
    return columns | {"motion_from_other_site_class": crossed}


def _stored(prepared: StationField, index: NDArray[np.intp], period: FloatArray) -> FloatArray:
    """Return ln PER of the pairs' records at their periods."""
    lower, share = on_grid(prepared.field.periods, period)
    stored: FloatArray = (1.0 - share) * prepared.ln_per[index, lower] + share * prepared.ln_per[
        index, lower + 1
    ]
    return stored


def _seen_from(source: Source | None, places: Sites) -> Sites:
    """Return the places with their distances from the hypocentre, of which a kilometre is the shortest."""
    if source is None:
        return places
    along = great_circle(source.longitude, source.latitude, places.longitude, places.latitude)
    return places._replace(source_distance=np.maximum(np.hypot(along, source.depth), 1000.0))


class _Told(NamedTuple):
    """What the field takes of a station."""

    longitude: float
    latitude: float
    site_class: str
    vs30: float
    usable: tuple[float, float]
    periods: FloatArray
    ln_per: FloatArray


def _told(station: xr.Dataset) -> _Told:
    return _Told(
        number(station, "longitude"),
        number(station, "latitude"),
        str(station["site_class"].item()) if "site_class" in station else "",
        number(station, "vs30") if "vs30" in station else np.nan,
        (number(station, "shortest_usable_period"), number(station, "longest_usable_period")),
        np.asarray(station["period"], dtype=np.float64),
        _ln_per(station),
    )


def _ln_per(station: xr.Dataset) -> FloatArray:
    """Return ln PER at 5 % damping, minus infinity where there was no motion."""
    stored = station["per_rotd50"] if "per_rotd50" in station else station["per"][0]
    dampings = np.asarray(station["damping"], dtype=np.float64)
    with np.errstate(divide="ignore"):
        radii = np.log(np.asarray(stored, dtype=np.float64))
    order = np.argsort(dampings)
    return np.array([np.interp(DAMPING, dampings[order], column) for column in radii[order].T])
