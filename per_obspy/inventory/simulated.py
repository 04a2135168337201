"""
Simulated inventories of neighbouring buildings around given stations.

Shares and sizes follow street surveys of dense centres: low buildings dominate, many neighbours
have the same height, many touch, streets have a common direction. No real city is described.
"""

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.constants import METRES_PER_DEGREE
from per_obspy.inventory.periods import asce7_period
from per_obspy.inventory.schema import COLUMNS, POSITIONS, SYSTEMS

#: Simulated columns by name, each (count,); numbers or text.
Columns = dict[str, Any]

#: Shares of the systems in the order of ``SYSTEMS``: concrete frames and masonry ("other")
#: dominate, buildings with concrete walls are left out.
SYSTEM_SHARES = (0.10, 0.50, 0.0, 0.0, 0.05, 0.35)

#: Median and log-standard deviation of the number of storeys, and its largest value.
STOREYS, MOST_STOREYS = (4.0, 0.6), 35

#: Mean, standard deviation and range of the height of a storey, m.
STOREY_HEIGHT, STOREY_HEIGHTS = (3.0, 0.2), (2.5, 4.0)

#: Median and log-standard deviation of the floor area, m2.
AREA = (200.0, 0.5)

#: Median and log-standard deviation of a gap that is not zero, and its range, m.
GAP, GAPS = (0.08, 0.9), (0.01, 1.5)

#: Share of neighbours that are equally high, and of those that share a system.
EQUAL, SAME_SYSTEM = 0.45, 0.7

#: Share of pairs inside a row.
INSIDE = 0.6

#: Share of buildings with a measured period and damping.
MEASURED = 0.5

#: Log-standard deviation of a measured period about the formula's median; range of measured
#: damping.
PERIOD_SCATTER, DAMPINGS = 0.3, (0.02, 0.08)

#: Standard deviation of walls about the direction of their street, degrees.
STREET_SCATTER = 2.0


def simulated_pairs(
    longitudes: ArrayLike,
    latitudes: ArrayLike,
    count: int,
    seed: int,
    radius: float,
    touching: float,
) -> pd.DataFrame:
    """
    Simulate pairs of neighbouring buildings around stations.

    Parameters
    ----------
    longitudes, latitudes : (n_stations,) array_like
        Positions of the stations, degrees east and north.
    count : int
        Number of pairs.
    seed : int
        Of every random number; the same seed gives the same table.
    radius : float
        Largest distance of a pair from its station, m.
    touching : float
        Share of pairs without a gap.

    Returns
    -------
    pairs : DataFrame
        A pair table by the schema. About half the buildings have a measured period and damping;
        those of the others are left to be derived.

    Raises
    ------
    ValueError
        If there is no station, positions differ in number or an argument is out of range.

    Examples
    --------
    >>> table = simulated_pairs([-67.95], [-20.35], 3, seed=20, radius=2000.0, touching=0.5)
    >>> list(table["pair_id"])
    ['P0000001', 'P0000002', 'P0000003']
    """
    stations = _checked_stations(longitudes, latitudes)
    if count < 1:
        raise ValueError(f"count must be at least 1, got {count}")
    checks.positive("radius", radius)
    checks.between("touching", touching, 0, 1)
    # The order of the random numbers belongs to the seed
    generator = np.random.default_rng(seed)
    columns = _buildings(generator, count)
    columns["gap"] = _gaps(generator, count, touching)
    columns |= _places(generator, columns, stations, radius)
    columns["position"] = np.where(generator.random(count) < INSIDE, POSITIONS[1], POSITIONS[0])
    columns["pair_id"] = np.array([f"P{number:07d}" for number in range(1, count + 1)])
    return pd.DataFrame({name: columns[name] for name in COLUMNS if name in columns})


def _checked_stations(longitudes: ArrayLike, latitudes: ArrayLike) -> FloatArray:
    """Return positions in degrees, one row per station: longitude and latitude."""
    east = checks.between("longitudes", longitudes, -180, 180)
    north = checks.between("latitudes", latitudes, -85, 85)
    if east.ndim != 1 or east.size == 0 or east.shape != north.shape:
        raise ValueError(
            "longitudes and latitudes must be rows of equal length, "
            f"got {east.shape} and {north.shape}"
        )
    return np.column_stack([east, north])


def _lognormal(
    generator: np.random.Generator, count: int, median: float, log_std: float
) -> FloatArray:
    """Return (2, count) lognormal numbers, one row per building of the pair."""
    values: FloatArray = median * np.exp(log_std * generator.standard_normal((2, count)))
    return values


def _buildings(generator: np.random.Generator, count: int) -> Columns:
    """Return sizes, systems, measured periods and dampings of both buildings of each pair."""
    storeys, height, system = _sizes(generator, count)
    area = np.round(_lognormal(generator, count, *AREA))
    # Measured values, NaN where the building was not measured
    is_measured = generator.random((2, count)) < MEASURED
    scatter = _lognormal(generator, count, 1.0, PERIOD_SCATTER)
    period = np.round(asce7_period(height, system) * scatter, 3)
    damping = np.round(generator.uniform(*DAMPINGS, (2, count)), 3)
    rows = {
        "storeys": storeys,
        "height": height,
        "system": system,
        "area": area,
        "period": np.where(is_measured, period, np.nan),
        "damping": np.where(is_measured, damping, np.nan),
    }
    return {f"{name}_{i}": values[i - 1] for name, values in rows.items() for i in (1, 2)}


def _sizes(generator: np.random.Generator, count: int) -> tuple[FloatArray, FloatArray, Any]:
    """
    Return storeys, heights in m and systems, (2, count) each.

    Building 2 often repeats the size or the system of building 1.
    """
    storeys = np.clip(np.rint(_lognormal(generator, count, *STOREYS)), 1, MOST_STOREYS)
    drawn = np.round(generator.normal(*STOREY_HEIGHT, (2, count)), 1)
    storey_height = np.clip(drawn, *STOREY_HEIGHTS)
    system = generator.choice(SYSTEMS, (2, count), p=SYSTEM_SHARES)
    # Neighbours of equal height have equal storeys
    is_equal = generator.random(count) < EQUAL
    has_same_system = generator.random(count) < SAME_SYSTEM
    storeys[1, is_equal] = storeys[0, is_equal]
    storey_height[1, is_equal] = storey_height[0, is_equal]
    system[1, has_same_system] = system[0, has_same_system]
    return storeys, np.round(storeys * storey_height, 1), system


def _gaps(generator: np.random.Generator, count: int, touching: float) -> FloatArray:
    """Return gaps to the centimetre, m: a share of zeros, the rest lognormal."""
    gap = np.round(np.clip(_lognormal(generator, count, *GAP)[0], *GAPS), 2)
    return np.where(generator.random(count) < touching, 0.0, gap)


def _places(
    generator: np.random.Generator, columns: Columns, stations: FloatArray, radius: float
) -> Columns:
    """Return positions and azimuths in degrees; each station's neighbourhood has a street grid."""
    count = columns["gap"].size
    station = generator.integers(len(stations), size=count)
    azimuth = _azimuths(generator, station, len(stations))
    # Building 1 anywhere on the disc around its station
    bearing = np.deg2rad(generator.uniform(0.0, 360.0, count))
    distance = radius * np.sqrt(generator.random(count))
    longitude, latitude = _moved(stations[station, 0], stations[station, 1], distance, bearing)
    # Building 2 along the axis, by the half sides of two square buildings and the gap
    half_sides = (np.sqrt(columns["area_1"]) + np.sqrt(columns["area_2"])) / 2.0
    separation = half_sides + columns["gap"]
    longitude_2, latitude_2 = _moved(longitude, latitude, separation, np.deg2rad(azimuth))
    return {
        "longitude_1": np.round(longitude, 7),
        "latitude_1": np.round(latitude, 7),
        "longitude_2": np.round(longitude_2, 7),
        "latitude_2": np.round(latitude_2, 7),
        "azimuth": azimuth,
    }


def _azimuths(
    generator: np.random.Generator, station: NDArray[np.int64], n_stations: int
) -> FloatArray:
    """Return azimuths along or across the streets around each pair's station, degrees."""
    street = generator.uniform(0.0, 90.0, n_stations)[station]
    side = 90.0 * generator.integers(4, size=station.size)
    azimuth = np.round(street + side + generator.normal(0.0, STREET_SCATTER, station.size))
    return azimuth % 360.0


def _moved(
    longitude: FloatArray, latitude: FloatArray, distance: FloatArray, bearing: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return positions moved by a few kilometres (m) along a bearing (radians), Earth as flat."""
    north = latitude + distance * np.cos(bearing) / METRES_PER_DEGREE
    east = longitude + distance * np.sin(bearing) / METRES_PER_DEGREE / np.cos(np.deg2rad(latitude))
    # Longitudes between -180 and 180 degrees
    return (east + 180.0) % 360.0 - 180.0, north
