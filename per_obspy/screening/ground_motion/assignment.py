"""Which station's record a pair of buildings is given: the nearest on its kind of ground, else the nearest."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from per_obspy.checks import FloatArray
from per_obspy.constants import EARTH_RADIUS
from per_obspy.errors import Rejection
from per_obspy.screening.values import number, values

#: Mean radius of the earth (IUGG), m. On the sphere distances are within 0.6 % of the ellipsoid's.


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
        Of the ground; empty if unknown.
    read : callable
        Return the Dataset of a station, given its index.
    """

    names: NDArray[np.object_]
    longitude: FloatArray
    latitude: FloatArray
    site_class: NDArray[np.object_]
    read: Callable[[int], xr.Dataset]


def stations_of(datasets: Sequence[xr.Dataset]) -> tuple[Stations, tuple[Rejection, ...]]:
    """Return the stations that have coordinates, and those that have none."""
    located = [one for one in datasets if np.isfinite(one["latitude"].item())]
    nowhere = tuple(
        Rejection(
            "station",
            one["station"].item(),
            "",
            None,
            ("its coordinates are unknown: it serves no pair",),
        )
        for one in datasets
        if not np.isfinite(one["latitude"].item())
    )
    names = np.array([one["station"].item() for one in located], dtype=object)
    longitude, latitude = (
        [number(one, name) for one in located] for name in ("longitude", "latitude")
    )
    ground = np.array([site_class_of(one) for one in located], dtype=object)
    return Stations(
        names, np.array(longitude), np.array(latitude), ground, located.__getitem__
    ), nowhere


def site_class_of(station: xr.Dataset) -> str:
    """Return the site class of a station, empty if unknown."""
    return str(station["site_class"].item()) if "site_class" in station else ""


def assigned(
    pairs: pd.DataFrame, stations: Stations, reach: float
) -> tuple[pd.DataFrame, tuple[Rejection, ...]]:
    """
    Return the pairs with their station, its index and its distance, and those that have none in reach.

    The station is the nearest one of the pair's own site class; where none of these is in reach, or
    the class of the pair is unknown, the nearest of all. ``other_site_class`` tells that both
    classes are known and differ.

    Parameters
    ----------
    pairs : DataFrame
        With ``pair_id, longitude, latitude``, and ``site_class`` if it is known.
    stations : Stations
        Which there are.
    reach : float
        Largest distance, m.
    """
    if not stations.names.size:
        lost = (
            Rejection("pair", name, "", None, ("no station has coordinates",))
            for name in pairs["pair_id"]
        )
        return pairs.iloc[:0].assign(
            station="", station_index=0, distance=0.0, other_site_class=False
        ), tuple(lost)
    ground = (
        pairs["site_class"].to_numpy(object)
        if "site_class" in pairs
        else np.full(len(pairs), "", dtype=object)
    )
    index, distance = _serving(
        values(pairs, "longitude"), values(pairs, "latitude"), ground, stations, reach
    )
    there = stations.site_class[index]
    placed = pairs.assign(
        station=stations.names[index],
        station_index=index,
        distance=distance,
        other_site_class=(ground != "") & (there != "") & (ground != there),
    )
    far = placed[distance > reach]
    told = zip(
        far["pair_id"],
        far["station"],
        far["distance"],
        _if_swapped(far, stations, reach),
        strict=True,
    )
    rejected = tuple(
        Rejection(
            "pair",
            name,
            "",
            None,
            (f"nearest station {station} is {metres:.0f} m away, beyond {reach:.0f} m{hint}",),
        )
        for name, station, metres, hint in told
    )
    return placed[distance <= reach], rejected


def _if_swapped(pairs: pd.DataFrame, stations: Stations, reach: float) -> list[str]:
    """Return, pair by pair, what to add if exchanged coordinates would bring a station into reach; empty if not."""
    longitude, latitude = values(pairs, "longitude"), values(pairs, "latitude")
    on_earth = np.abs(longitude) <= 90.0
    index, distance = nearest_station(
        latitude, np.where(on_earth, longitude, 0.0), stations.longitude, stations.latitude
    )
    return [
        f"; with longitude = {east:g} and latitude = {north:g} exchanged, {stations.names[station]} would be "
        f"{metres:.0f} m away: are they swapped?"
        if near
        else ""
        for east, north, station, metres, near in zip(
            longitude, latitude, index, distance, on_earth & (distance <= reach), strict=True
        )
    ]


def _serving(
    longitude: FloatArray,
    latitude: FloatArray,
    ground: NDArray[np.object_],
    stations: Stations,
    reach: float,
) -> tuple[NDArray[np.intp], FloatArray]:
    """Return the station of every place and the distance to it."""
    index, distance = nearest_station(longitude, latitude, stations.longitude, stations.latitude)
    for name in set(ground.tolist()) & set(stations.site_class.tolist()) - {""}:
        alike, rows = np.flatnonzero(stations.site_class == name), np.flatnonzero(ground == name)
        near, metres = nearest_station(
            longitude[rows], latitude[rows], stations.longitude[alike], stations.latitude[alike]
        )
        within = metres <= reach
        index[rows[within]], distance[rows[within]] = alike[near[within]], metres[within]
    return index, distance


def nearest_station(
    longitude: FloatArray,
    latitude: FloatArray,
    station_longitude: FloatArray,
    station_latitude: FloatArray,
) -> tuple[NDArray[np.intp], FloatArray]:
    """
    Return the nearest station of every place and the great-circle distance to it.

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
        On the sphere, m.

    Examples
    --------
    >>> nearest_station(np.array([0.1]), np.array([0.0]), np.array([180.0, 0.0]), np.array([0.0, 0.0]))[1].round()
    array([11120.])
    """
    tree = cKDTree(on_sphere(station_longitude, station_latitude))
    chord, station = tree.query(on_sphere(longitude, latitude))
    return np.asarray(station, dtype=np.intp), 2.0 * EARTH_RADIUS * np.arcsin(
        np.clip(chord / 2.0, 0.0, 1.0)
    )


def on_sphere(longitude: FloatArray, latitude: FloatArray) -> FloatArray:
    """Return points on the unit sphere, (n, 3)."""
    east, north = np.radians(longitude), np.radians(latitude)
    return np.stack(
        [np.cos(north) * np.cos(east), np.cos(north) * np.sin(east), np.sin(north)], axis=-1
    )
