"""
A simulated inventory of neighbouring buildings around given stations.

Shares and sizes follow what street surveys of dense centres show: low buildings dominate, many
neighbours have the same height, many touch, streets have a common direction. None of it describes a
real city.
"""

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.constants import METRES_PER_DEGREE
from per_obspy.inventory.periods import asce7_period
from per_obspy.inventory.schema import COLUMNS, POSITIONS, SYSTEMS

#: Columns of the table under work, each (count,); numbers or text.
Columns = dict[str, Any]

#: Shares of the systems in the order of ``SYSTEMS``: concrete frames and masonry ("other")
#: dominate.
SYSTEM_SHARES = (0.10, 0.50, 0.05, 0.35)

#: Median and log-standard deviation of storeys, of floor area (m2), of a gap that is not zero (m).
STOREYS, AREA, GAP = (4.0, 0.6), (200.0, 0.5), (0.08, 0.9)
MOST_STOREYS, GAPS = 35, (0.01, 1.5)

#: Share of neighbours that are equally high, that share a system, of pairs inside a row, and of
#: measured buildings.
EQUAL, SAME_SYSTEM, INSIDE, MEASURED = 0.45, 0.7, 0.6, 0.5

#: Log-standard deviation of a measured period about the formula's median; range of measured
#: damping.
PERIOD_SCATTER, DAMPINGS = 0.3, (0.02, 0.08)


def simulated_pairs(
    longitudes: ArrayLike,
    latitudes: ArrayLike,
    count: int,
    seed: int,
    radius: float = 2000.0,
    touching: float = 0.5,
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
    radius : float, optional
        Largest distance of a pair from its station, m.
    touching : float, optional
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
    >>> list(simulated_pairs([-67.95], [-20.35], 3, seed=20)["pair_id"])
    ['P0000001', 'P0000002', 'P0000003']
    """
    east, north = (
        checks.between("longitudes", longitudes, -180, 180),
        checks.between("latitudes", latitudes, -85, 85),
    )
    if east.ndim != 1 or east.size == 0 or east.shape != north.shape:
        raise ValueError(
            f"longitudes and latitudes must be rows of equal length, got {east.shape} and {north.shape}"
        )
    if count < 1:
        raise ValueError(f"count must be at least 1, got {count}")
    checks.positive("radius", radius)
    checks.between("touching", touching, 0, 1)
    generator = np.random.default_rng(seed)
    columns = _buildings(generator, count)
    columns["gap"] = _gaps(generator, count, touching)
    columns |= _places(generator, columns, np.column_stack([east, north]), radius)
    columns["position"] = np.where(generator.random(count) < INSIDE, POSITIONS[1], POSITIONS[0])
    columns["pair_id"] = np.array([f"P{number:07d}" for number in range(1, count + 1)])
    return pd.DataFrame({name: columns[name] for name in COLUMNS if name in columns})


def _lognormal(
    generator: np.random.Generator, count: int, median: float, log_std: float
) -> FloatArray:
    """Return (2, count) numbers, one row a building."""
    values: FloatArray = median * np.exp(log_std * generator.standard_normal((2, count)))
    return values


def _buildings(generator: np.random.Generator, count: int) -> Columns:
    """Return sizes, systems, measured periods and dampings; building 2 often repeats the size or system of 1."""
    storeys = np.clip(np.rint(_lognormal(generator, count, *STOREYS)), 1, MOST_STOREYS)
    storey_height = np.clip(np.round(generator.normal(3.0, 0.2, (2, count)), 1), 2.5, 4.0)
    system = generator.choice(SYSTEMS, (2, count), p=SYSTEM_SHARES)
    equal, same_system = generator.random(count) < EQUAL, generator.random(count) < SAME_SYSTEM
    for values, same in ((storeys, equal), (storey_height, equal), (system, same_system)):
        values[1, same] = values[0, same]
    height = np.round(storeys * storey_height, 1)
    area = np.round(_lognormal(generator, count, *AREA))
    measured = generator.random((2, count)) < MEASURED
    period = np.round(
        asce7_period(height, system) * _lognormal(generator, count, 1.0, PERIOD_SCATTER), 3
    )
    damping = np.round(generator.uniform(*DAMPINGS, (2, count)), 3)
    sizes = {"storeys": storeys, "height": height, "system": system, "area": area}
    measurements = {
        "period": np.where(measured, period, np.nan),
        "damping": np.where(measured, damping, np.nan),
    }
    rows = (sizes | measurements).items()
    return {f"{name}_{i}": values[i - 1] for name, values in rows for i in (1, 2)}


def _gaps(generator: np.random.Generator, count: int, touching: float) -> FloatArray:
    """Return gaps to the centimetre, m: a share of zeros, the rest lognormal."""
    gap = np.round(np.clip(_lognormal(generator, count, *GAP)[0], *GAPS), 2)
    return np.where(generator.random(count) < touching, 0.0, gap)


def _places(
    generator: np.random.Generator, columns: Columns, stations: FloatArray, radius: float
) -> Columns:
    """Return positions in degrees and the azimuth: each neighbourhood has a street grid of its own."""
    count = columns["gap"].size
    station = generator.integers(len(stations), size=count)
    streets = generator.uniform(0.0, 90.0, len(stations))[station]
    azimuth = (
        np.round(
            streets + 90.0 * generator.integers(4, size=count) + generator.normal(0.0, 2.0, count)
        )
        % 360.0
    )
    bearing = np.deg2rad(generator.uniform(0.0, 360.0, count))
    distance = radius * np.sqrt(generator.random(count))
    longitude, latitude = _moved(stations[station, 0], stations[station, 1], distance, bearing)
    apart = (np.sqrt(columns["area_1"]) + np.sqrt(columns["area_2"])) / 2.0 + columns["gap"]
    longitude_2, latitude_2 = _moved(longitude, latitude, apart, np.deg2rad(azimuth))
    places = {
        "longitude_1": longitude,
        "latitude_1": latitude,
        "longitude_2": longitude_2,
        "latitude_2": latitude_2,
    }
    return {name: np.round(degrees, 7) for name, degrees in places.items()} | {"azimuth": azimuth}


def _moved(
    longitude: FloatArray, latitude: FloatArray, distance: FloatArray, bearing: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return positions a few kilometres away on a sphere taken as flat; longitudes stay between -180 and 180."""
    north = latitude + distance * np.cos(bearing) / METRES_PER_DEGREE
    east = longitude + distance * np.sin(bearing) / METRES_PER_DEGREE / np.cos(np.deg2rad(latitude))
    return (east + 180.0) % 360.0 - 180.0, north
