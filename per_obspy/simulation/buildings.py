"""
Simulated inventories of neighbouring buildings around given stations.

Shares and sizes follow street surveys of dense centres: low buildings dominate, many neighbours
have the same height, many touch, streets have a common direction. No real city is described.
"""

from typing import Any, NamedTuple

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

#: Shares of the systems in the order of ``SYSTEMS``: concrete frames and unknown ones dominate,
#: buildings with walls of concrete or masonry are left out.
SYSTEM_SHARES = (0.10, 0.50, 0.0, 0.0, 0.05, 0.0, 0.0, 0.35)

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

#: Share of pairs that go on from building 2 of the pair before: straight on, and around a corner.
#: Rows that go on with a share p have the share p² of their pairs between two others: here 0.6.
STRAIGHT, CORNER = 0.775, 0.045

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
    east = checks.between("longitudes", longitudes, -180, 180)
    north = checks.between("latitudes", latitudes, -85, 85)
    if east.ndim != 1 or east.size == 0 or east.shape != north.shape:
        raise ValueError(
            "longitudes and latitudes must be rows of equal length, "
            f"got {east.shape} and {north.shape}"
        )
    # Arguments of the town
    if count < 1:
        raise ValueError(f"count must be at least 1, got {count}")
    checks.positive("radius", radius)
    checks.between("touching", touching, 0, 1)
    # The order of the random numbers belongs to the seed
    generator, rows = np.random.default_rng(seed), _rows(seed, count)
    columns = _buildings(generator, rows)
    columns["gap"] = _gaps(generator, count, touching)
    columns |= _places(generator, columns, rows, np.column_stack([east, north]), radius)
    columns |= _names(rows)
    return pd.DataFrame({name: columns[name] for name in COLUMNS if name in columns})


class _Rows(NamedTuple):
    """Pairs as rows of buildings, one after the other; (count,) each."""

    goes_on: NDArray[np.bool_]  # building 1 of the pair is building 2 of the pair before
    turns: NDArray[np.bool_]  # and that around a corner
    start: NDArray[np.int64]  # first pair of its row


def _rows(seed: int, count: int) -> _Rows:
    """Return which pairs go on from the one before."""
    # Separate random numbers, so that those of buildings and places do not change
    chance = np.random.default_rng([seed, 1]).random(count)
    goes_on = chance < STRAIGHT + CORNER
    goes_on[0] = False
    start = np.maximum.accumulate(np.where(goes_on, 0, np.arange(count)))
    return _Rows(goes_on, goes_on & (chance >= STRAIGHT), start)


def _names(rows: _Rows) -> Columns:
    """Return identifiers of pairs and buildings, and whether a pair is at the end of its row."""
    # Each pair has a new building 2, and the first pair of each row a new building 1
    last = np.cumsum(np.where(rows.goes_on, 1, 2))
    numbers = {
        "pair_id": np.arange(last.size) + 1,
        "building_id_1": last - 1,
        "building_id_2": last,
    }
    straight = rows.goes_on & ~rows.turns
    inside = straight & np.append(straight[1:], False)
    names: Columns = {"position": np.where(inside, POSITIONS[1], POSITIONS[0])}
    for name, number in numbers.items():
        letter = name[0].upper()
        names[name] = np.array([f"{letter}{each:07d}" for each in number.tolist()])
    return names


def _lognormal(
    generator: np.random.Generator, count: int, median: float, log_std: float
) -> FloatArray:
    """Return (2, count) lognormal numbers, one row per building of the pair."""
    return np.asarray(median * np.exp(log_std * generator.standard_normal((2, count))))


def _buildings(generator: np.random.Generator, rows: _Rows) -> Columns:
    """Return sizes, systems, measured periods and dampings of both buildings of each pair."""
    count = rows.start.size
    buildings = _sizes(generator, rows)
    buildings["area"] = np.round(_lognormal(generator, count, *AREA))
    # Measured values, NaN where the building was not measured
    is_measured = generator.random((2, count)) < MEASURED
    scatter = _lognormal(generator, count, 1.0, PERIOD_SCATTER)
    period = np.round(asce7_period(buildings["height"], buildings["system"]) * scatter, 3)
    damping = np.round(generator.uniform(*DAMPINGS, (2, count)), 3)
    buildings["period"] = np.where(is_measured, period, np.nan)
    buildings["damping"] = np.where(is_measured, damping, np.nan)
    # Building 1 of a pair that goes on is building 2 of the one before
    on = np.flatnonzero(rows.goes_on)
    for values in buildings.values():
        values[0, on] = values[1, on - 1]
    return {f"{name}_{i}": values[i - 1] for name, values in buildings.items() for i in (1, 2)}


def _sizes(generator: np.random.Generator, rows: _Rows) -> Columns:
    """Return storeys, heights, m, and systems, (2, count) each; building 2 often repeats them."""
    count = rows.start.size
    storeys = np.clip(np.rint(_lognormal(generator, count, *STOREYS)), 1, MOST_STOREYS)
    storey_height = np.round(generator.normal(*STOREY_HEIGHT, (2, count)), 1)
    storey_height = storey_height.clip(*STOREY_HEIGHTS)
    system = generator.choice(SYSTEMS, (2, count), p=SYSTEM_SHARES)
    # Neighbours of equal height have equal storeys
    is_equal = generator.random(count) < EQUAL
    has_same_system = generator.random(count) < SAME_SYSTEM
    alike = ((storeys, is_equal), (storey_height, is_equal), (system, has_same_system))
    # The last pair of the row that chose, whose building the following repeat
    for values, is_alike in alike:
        chosen = np.where(rows.goes_on & is_alike, 0, np.arange(count))
        origin = np.maximum.accumulate(chosen)
        values[1] = np.where(is_alike[origin], values[0, origin], values[1, origin])
    return {"storeys": storeys, "height": (storeys * storey_height).round(1), "system": system}


def _gaps(generator: np.random.Generator, count: int, touching: float) -> FloatArray:
    """Return gaps to the centimetre, m: a share of zeros, the rest lognormal."""
    gap = np.round(np.clip(_lognormal(generator, count, *GAP)[0], *GAPS), 2)
    return np.where(generator.random(count) < touching, 0.0, gap)


def _places(
    generator: np.random.Generator,
    columns: Columns,
    rows: _Rows,
    stations: FloatArray,
    radius: float,
) -> Columns:
    """Return positions and azimuths in degrees; each station's neighbourhood has a street grid."""
    count = rows.start.size
    # Pairs of a row are around one station
    station = generator.integers(len(stations), size=count)[rows.start]
    azimuth = _azimuths(generator, station, len(stations), rows)
    # Building 1 of each row anywhere on the disc around its station
    bearing = np.deg2rad(generator.uniform(0.0, 360.0, count))
    distance = radius * np.sqrt(generator.random(count))
    first = (distance * _direction(bearing))[:, rows.start]
    # From building 1 to 2 along the axis; buildings are square
    half_sides = (np.sqrt(columns["area_1"]) + np.sqrt(columns["area_2"])) / 2.0
    steps = (half_sides + columns["gap"]) * _direction(np.deg2rad(azimuth))
    places = {"azimuth": azimuth}
    for i, offset in enumerate(_offsets(first, steps, rows, radius), start=1):
        places[f"longitude_{i}"], places[f"latitude_{i}"] = _move(stations[station], offset)
    return places


def _move(place: FloatArray, offset: FloatArray) -> FloatArray:
    """Return places, degrees (count, 2), moved east and north, m (2, count), Earth as flat."""
    longitude, latitude = place.T
    degrees = longitude + offset[0] / METRES_PER_DEGREE / np.cos(np.deg2rad(latitude))
    # Longitudes between -180 and 180 degrees
    northward = latitude + offset[1] / METRES_PER_DEGREE
    return np.round([(degrees + 180.0) % 360.0 - 180.0, northward], 7)


def _direction(azimuth: FloatArray) -> FloatArray:
    """Return (2, count) unit vectors to the east and north along azimuths, radians."""
    return np.stack([np.sin(azimuth), np.cos(azimuth)])


def _offsets(
    first: FloatArray, steps: FloatArray, rows: _Rows, radius: float
) -> tuple[FloatArray, FloatArray]:
    """Return buildings 1 and 2 of all pairs from their stations, (2, count) each, m."""
    begins = np.cumsum(steps, axis=1) - steps
    one = first + begins - begins[:, rows.start]
    # A row that would leave the disc is moved towards its station
    starts = np.flatnonzero(~rows.goes_on)
    distance = np.hypot(*one)
    excess = np.maximum(np.maximum.reduceat(distance, starts) - radius, 0.0)
    sizes = np.diff(starts, append=distance.size)
    last = one[:, starts + sizes - 1]
    inwards = last / np.maximum(np.hypot(*last), 1e-9)
    one = one - np.repeat(excess * inwards, sizes, axis=1)
    two = one + steps
    # The same building has the same place, to the last digit
    on = np.flatnonzero(rows.goes_on)
    one[:, on] = two[:, on - 1]
    return one, two


def _azimuths(
    generator: np.random.Generator, station: NDArray[np.int64], n_stations: int, rows: _Rows
) -> FloatArray:
    """Return azimuths along or across the streets around each pair's station, degrees."""
    street = generator.uniform(0.0, 90.0, n_stations)[station]
    side = 90.0 * generator.integers(4, size=station.size)[rows.start]
    # Corners of a row turn to the right
    turns = np.cumsum(rows.turns)
    side += 90.0 * (turns - turns[rows.start])
    azimuth = np.round(street + side + generator.normal(0.0, STREET_SCATTER, station.size))
    return azimuth % 360.0
