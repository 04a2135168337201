"""Assignment of a station to each pair: the nearest on its site class, else the nearest."""

from collections.abc import Callable, Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.constants import EARTH_RADIUS
from per_obspy.errors import Rejection
from per_obspy.screening.station_motion import StationMotion, station_motion
from per_obspy.screening.values import BoolArray, IndexArray, TextArray, number, values


class Sites(NamedTuple):
    """
    Places, (n_places,).

    Attributes
    ----------
    longitude, latitude : ndarray
        Degrees east and north.
    site_class : ndarray of str
        Name of the site class, free text; ``""`` where it is unknown.
    source_distance : ndarray
        Distance to the source of the earthquake, m; NaN where it is unknown.
    vs30 : ndarray
        Mean shear-wave velocity of the upper 30 m, m/s; NaN where it is unknown.
    """

    longitude: FloatArray
    latitude: FloatArray
    site_class: TextArray
    source_distance: FloatArray
    vs30: FloatArray

    def at(self, rows: IndexArray | BoolArray) -> "Sites":
        """Return some of the places."""
        return Sites._make(column[rows] for column in self)


def sites(
    longitude: ArrayLike,
    latitude: ArrayLike,
    site_class: ArrayLike = "",
    source_distance: ArrayLike = np.nan,
    vs30: ArrayLike = np.nan,
) -> Sites:
    """Return places with their ground; a single value holds for all (see :class:`Sites`)."""
    # Contiguous: functions of NumPy may differ in the last bit between strides
    east = np.ascontiguousarray(checks.between("longitude", longitude, -180.0, 180.0))
    north = np.ascontiguousarray(checks.between("latitude", latitude, -90.0, 90.0))
    distance = np.broadcast_to(np.asarray(source_distance, dtype=np.float64), east.shape)
    velocity = np.broadcast_to(np.asarray(vs30, dtype=np.float64), east.shape)
    return Sites(
        longitude=east,
        latitude=north,
        site_class=np.broadcast_to(np.asarray(site_class, dtype=object), east.shape),
        source_distance=np.ascontiguousarray(distance),
        vs30=np.ascontiguousarray(velocity),
    )


class Stations(NamedTuple):
    """
    Stations that can serve pairs.

    Attributes
    ----------
    names : (n_stations,) ndarray of str
        ``NETWORK.STATION``.
    longitude, latitude : (n_stations,) ndarray
        Degrees east and north.
    site_class : (n_stations,) ndarray of str
        Site class of the ground; empty if unknown.
    read : callable
        Function that returns the Dataset of a station, given its index.
    motion : callable
        Likewise its motion, decoded once.
    """

    names: TextArray
    longitude: FloatArray
    latitude: FloatArray
    site_class: TextArray
    read: Callable[[int], xr.Dataset]
    motion: Callable[[int], StationMotion]


def stations_of(datasets: Sequence[xr.Dataset]) -> tuple[Stations, tuple[Rejection, ...]]:
    """Return the stations that have coordinates, and rejections of those that have none."""
    located, rejections = list[xr.Dataset](), list[Rejection]()
    for station in datasets:
        # Without coordinates a station cannot be the nearest to any pair
        if np.isfinite(station["latitude"].item()):
            located.append(station)
        else:
            reasons = ("its coordinates are unknown: it serves no pair",)
            rejections.append(Rejection("station", station["station"].item(), "", None, reasons))
    # a station is decoded at its first use
    stations = Stations(
        names=np.array([station["station"].item() for station in located], dtype=object),
        longitude=np.array([number(station, "longitude") for station in located]),
        latitude=np.array([number(station, "latitude") for station in located]),
        site_class=np.array([site_class_of(station) for station in located], dtype=object),
        read=located.__getitem__,
        motion=cache(lambda index: station_motion(located[index])),
    )
    return stations, tuple(rejections)


def site_class_of(station: xr.Dataset) -> str:
    """Return the site class of a station, empty if unknown."""
    return str(station["site_class"].item()) if "site_class" in station else ""


def assigned(
    pairs: pd.DataFrame, stations: Stations, reach: float
) -> tuple[pd.DataFrame, tuple[Rejection, ...]]:
    """
    Assign a station to each pair: index, name and distance; reject pairs without one in reach, m.

    The station is the nearest one of the pair's site class; where none of these is in reach, or the
    class of the pair is unknown, the nearest of all. ``other_site_class`` is true where both
    classes are known and differ.
    """
    if not stations.names.size:
        no = pairs.iloc[:0].assign(
            station="", station_index=0, distance=0.0, other_site_class=False
        )
        reasons = ("no station has coordinates",)
        return no, tuple(Rejection("pair", name, "", None, reasons) for name in pairs["pair_id"])
    unknown = np.full(len(pairs), "", dtype=object)
    site_class = pairs["site_class"].to_numpy(object) if "site_class" in pairs else unknown
    # The station of every pair, and whether its ground is of another class
    longitude, latitude = values(pairs, "longitude"), values(pairs, "latitude")
    index, distance = _serving_station(longitude, latitude, site_class, stations, reach)
    station_class = stations.site_class[index]
    known = (site_class != "") & (station_class != "")
    placed = pairs.assign(
        station=stations.names[index],
        station_index=index,
        distance=distance,
        other_site_class=known & (site_class != station_class),
    )

    # Pairs beyond the reach are left out
    return placed[distance <= reach], _out_of_reach(placed[distance > reach], stations, reach)


def _out_of_reach(pairs: pd.DataFrame, stations: Stations, reach: float) -> tuple[Rejection, ...]:
    """Return rejections of pairs whose station is too far away, with its name and distance."""
    # Exchanged coordinates and lost signs are the usual reasons of a pair far from every station
    rejections = []
    hints = _place_hints(pairs, stations, reach)
    rows = zip(pairs["pair_id"], pairs["station"], pairs["distance"], hints, strict=True)
    for name, station, metres, hint in rows:
        reason = f"nearest station {station} is {metres:.0f} m away, beyond {reach:.0f} m{hint}"
        rejections.append(Rejection("pair", name, "", None, (reason,)))
    return tuple(rejections)


#: Usual mistakes in positions: what was meant, and the factors of longitude and latitude; exchanged
#: ones have none.
_MISTAKES = {
    "longitude = {0:g} and latitude = {1:g} exchanged": None,
    "longitude = {0:g} of the other sign": (-1.0, 1.0),
    "latitude = {1:g} of the other sign": (1.0, -1.0),
    "longitude = {0:g} and latitude = {1:g} of the other signs": (-1.0, -1.0),
}


def _place_hints(pairs: pd.DataFrame, stations: Stations, reach: float) -> list[str]:
    """Return a hint per pair that would reach a station at another place, else empty."""
    longitude, latitude = values(pairs, "longitude"), values(pairs, "latitude")
    hints = [""] * len(pairs)
    for mistake, signs in _MISTAKES.items():
        east, north = (
            (signs[0] * longitude, signs[1] * latitude) if signs else (latitude, longitude)
        )
        # A longitude beyond 90 degrees cannot be a latitude
        possible = np.abs(north) <= 90.0
        place = east, np.where(possible, north, 0.0)
        index, distance = nearest_station(*place, stations.longitude, stations.latitude)
        # The first mistake that explains it
        question = "has a sign been lost?" if signs else "are they swapped?"
        for i in np.flatnonzero(possible & (distance <= reach)).tolist():
            meant = mistake.format(longitude[i], latitude[i])
            station = f"{stations.names[index[i]]} would be {distance[i]:.0f} m away"
            hints[i] = hints[i] or f"; with {meant}, {station}: {question}"
    return hints


def _serving_station(
    longitude: FloatArray,
    latitude: FloatArray,
    site_class: TextArray,
    stations: Stations,
    reach: float,
) -> tuple[IndexArray, FloatArray]:
    """Return the index of the station that serves each place, and the distance to it."""
    index, distance = nearest_station(longitude, latitude, stations.longitude, stations.latitude)
    # A station of the same class goes before a nearer one if it is in reach
    common = set(site_class.tolist()) & set(stations.site_class.tolist()) - {""}
    for name in common:
        alike = np.flatnonzero(stations.site_class == name)
        rows = np.flatnonzero(site_class == name)
        nearest, metres = nearest_station(
            longitude[rows], latitude[rows], stations.longitude[alike], stations.latitude[alike]
        )
        within = metres <= reach
        index[rows[within]] = alike[nearest[within]]
        distance[rows[within]] = metres[within]
    return index, distance


def nearest_station(
    longitude: FloatArray,
    latitude: FloatArray,
    station_longitude: FloatArray,
    station_latitude: FloatArray,
) -> tuple[IndexArray, FloatArray]:
    """
    Find the nearest station of every place and the great-circle distance to it.

    Parameters
    ----------
    longitude, latitude : (n_places,) ndarray
        Degrees east and north.
    station_longitude, station_latitude : (n_stations,) ndarray
        Degrees east and north, at least one station.

    Returns
    -------
    station : (n_places,) ndarray of int
        Index of the station.
    distance : (n_places,) ndarray
        Distance on the sphere, m, within 0.6 % of the distance on the ellipsoid.

    Examples
    --------
    >>> stations = np.array([180.0, 0.0]), np.array([0.0, 0.0])
    >>> nearest_station(np.array([0.1]), np.array([0.0]), *stations)[1].round()
    array([11120.])
    """
    tree = cKDTree(on_sphere(station_longitude, station_latitude))
    chord, station = tree.query(on_sphere(longitude, latitude))
    angle = 2.0 * np.arcsin(np.clip(chord / 2.0, 0.0, 1.0))
    return np.asarray(station, dtype=np.intp), EARTH_RADIUS * angle


def on_sphere(longitude: FloatArray, latitude: FloatArray) -> FloatArray:
    """Return points on the unit sphere, (n, 3)."""
    east, north = np.radians(longitude), np.radians(latitude)
    x = np.cos(north) * np.cos(east)
    y = np.cos(north) * np.sin(east)
    return np.stack([x, y, np.sin(north)], axis=-1)
