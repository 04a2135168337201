"""Relevance of earthquakes: their magnitude by the distance from epicentre to inventory."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from per_obspy.checks import FloatArray
from per_obspy.config import Reach, Run, TableForm
from per_obspy.constants import METRES_PER_DEGREE
from per_obspy.errors import CatalogError
from per_obspy.files import read_json, reading, write_json
from per_obspy.inventory.catalogue import Box, stored_inventories
from per_obspy.inventory.files.reading import PairInventory, checked_chunk
from per_obspy.screening.motion_field import great_circle

#: Side of the cells that stand for the pairs in them, degrees.
CELL = 0.05

#: Half the diagonal of a cell at the equator, m.
RADIUS = CELL * METRES_PER_DEGREE / math.sqrt(2.0)

#: Rows of the pair table that are read at once.
ROWS = 100_000

#: Values of the table of distances that is computed at once.
AT_ONCE = 1_000_000

#: Cells of a stored inventory along each side of its box.
STEPS = 20

#: File of the places of the inventory in a watched folder.
PLACES = "places.json"


class Places(NamedTuple):
    """Places that represent an inventory."""

    #: Degrees.
    longitude: FloatArray
    latitude: FloatArray
    #: Of the circle around each that its buildings are in, m.
    radius: float


class Circle(NamedTuple):
    """Circle on the Earth: centre and radius in degrees."""

    longitude: float
    latitude: float
    radius: float


def inventory_places(settings: Run, folder: Path) -> Places:
    """
    Return the places of the inventory of a configuration.

    Parameters
    ----------
    settings : Run
        With a section ``watch``: its region, or else its pairs.
    folder : Path
        Watched folder, which keeps the places of a pair table that has not changed.

    Raises
    ------
    CatalogError
        If the configuration has neither a region nor pairs of known places.
    """
    assert settings.watch is not None  # the watcher demands it
    region, pairs = settings.watch.region, settings.pairs
    if region is not None:
        one = (np.array([region.longitude]), np.array([region.latitude]))
        return Places(*one, region.radius)
    if pairs is not None and pairs.file is not None:
        return _kept_places(pairs.file, settings, folder)
    if pairs is not None and pairs.catalog is not None:
        stored = stored_inventories(pairs.catalog)
        boxes = [
            entry.bounding_box for entry in stored if entry.name in (pairs.names or [entry.name])
        ]
        return _places_of_boxes(boxes, pairs.catalog)
    problem = "the places of these pairs are not known before their run: give watch.region"
    raise CatalogError("watch", problem)


def _kept_places(file: Path, settings: Run, folder: Path) -> Places:
    """Return the places of a pair table, from the watched folder if the table has not changed."""
    assert settings.pairs is not None
    with reading(file):
        facts = file.stat()
    # The table is read again if it has changed
    form = settings.pairs.form
    key = [str(file), facts.st_size, facts.st_mtime_ns, form.model_dump_json()]
    kept = read_json(folder / PLACES)
    try:
        longitude, latitude = np.array(kept["places"], dtype=np.float64)
        if kept["key"] == key:
            return Places(longitude, latitude, RADIUS)
    except (ValueError, KeyError, TypeError):
        pass
    places = _places_of_table(file, form)
    lists = [places.longitude.tolist(), places.latitude.tolist()]
    write_json(folder / PLACES, {"key": key, "places": lists})
    return places


def _places_of_table(file: Path, form: TableForm) -> Places:
    """Return the centres of the cells that hold a pair of a table."""
    cells = np.empty((0, 2), dtype=np.int64)
    # Chunk by chunk, so that memory does not grow with the table
    for chunk in PairInventory([file], form).chunks(ROWS):
        pairs = checked_chunk(chunk)
        position = pairs[["longitude_1", "latitude_1"]].to_numpy(dtype=np.float64)
        known = position[np.isfinite(position).all(axis=1)]
        numbers = np.floor(known / CELL).astype(np.int64)
        cells = np.unique(np.concatenate([cells, numbers]), axis=0)
    # Pairs without a place are found by no distance
    if not len(cells):
        raise CatalogError(str(file), "no pair has a place: give watch.region")
    centres = (cells.astype(np.float64) + 0.5) * np.float64(CELL)
    return Places(centres[:, 0], centres[:, 1], RADIUS)


def _places_of_boxes(boxes: Sequence[Box], catalog: Path) -> Places:
    """Return a grid of places in the boxes of stored inventories."""
    if not boxes:
        raise CatalogError(str(catalog), "holds no inventory to watch for: give watch.region")
    centres: FloatArray = (np.arange(STEPS) + 0.5) / STEPS
    longitude, latitude, radius = list[FloatArray](), list[FloatArray](), 0.0
    # Middles of equal cells of each box
    for box in boxes:
        # West of a box across the date line is larger than its east
        width = (box.east - box.west) % 360.0
        height = box.north - box.south
        grid = np.meshgrid(box.west + centres * width, box.south + centres * height)
        longitude.append(grid[0].ravel())
        latitude.append(grid[1].ravel())
        diagonal = float(np.hypot(width, height)) / STEPS
        radius = max(radius, diagonal / 2 * METRES_PER_DEGREE)
    return Places(np.concatenate(longitude), np.concatenate(latitude), radius)


def distances(places: Places, longitude: FloatArray, latitude: FloatArray) -> FloatArray:
    """
    Compute the distance from each epicentre to the nearest place, never too large.

    Parameters
    ----------
    places : Places
        Of the inventory.
    longitude, latitude : (n_events,) ndarray
        Of the epicentres, degrees.

    Returns
    -------
    distance : (n_events,) ndarray
        m, along the great circle; 0 inside the circle of a place.
    """
    nearest = np.empty(len(longitude))
    # Piece by piece, so that many earthquakes need little memory
    size = max(1, AT_ONCE // len(places.longitude))
    for start in range(0, len(longitude), size):
        some = slice(start, start + size)
        east, north = longitude[some, None], latitude[some, None]
        nearest[some] = great_circle(east, north, *places[:2]).min(axis=1)
    return np.maximum(nearest - places.radius, 0.0)


def circle_around(places: Places, reach: float) -> Circle:
    """
    Return a circle that holds every epicentre within a distance of an inventory.

    Parameters
    ----------
    places : Places
        Of the inventory.
    reach : float
        m.
    """
    # The centre is the mean of the places as directions
    east, north = np.deg2rad(places.longitude), np.deg2rad(places.latitude)
    x, y = np.cos(north) * np.cos(east), np.cos(north) * np.sin(east)
    x_mean, y_mean, z_mean = (float(part.mean()) for part in (x, y, np.sin(north)))
    longitude = float(np.rad2deg(np.arctan2(y_mean, x_mean)))
    latitude = float(np.rad2deg(np.arctan2(z_mean, np.hypot(x_mean, y_mean))))
    farthest = float(great_circle(longitude, latitude, *places[:2]).max())
    # Wider by a thousandth for the rounding of numbers in a query
    radius = (farthest + places.radius + reach) / METRES_PER_DEGREE
    return Circle(longitude, latitude, min(radius * 1.001, 180.0))


def matters(reaches: Sequence[Reach], distance: float, magnitude: float) -> bool:
    """
    Return whether an earthquake of a magnitude at a distance is relevant.

    Examples
    --------
    >>> reaches = [Reach(distance=50e3, magnitude=5.0), Reach(distance=200e3, magnitude=6.5)]
    >>> matters(reaches, 40e3, 5.0), matters(reaches, 60e3, 6.0), matters(reaches, 60e3, 6.5)
    (True, False, True)
    """
    return any(distance <= reach.distance and magnitude >= reach.magnitude for reach in reaches)
