"""
Index of stored pair inventories: a TOML file with the contents, origin and hash of each.

A file is used only after its hash was compared (:func:`verified_file`), so that a changed or
damaged inventory is noticed before it is screened. Positions are longitude and latitude
(WGS 84), as in every pair table.
"""

import datetime
import json
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pydantic import Field

from per_obspy import config
from per_obspy.checks import FloatArray
from per_obspy.constants import METRES_PER_DEGREE
from per_obspy.errors import CatalogError, Rejection
from per_obspy.files import file_hash, written_whole
from per_obspy.inventory.files.reading import read_pairs

#: Longitude and latitude, WGS 84.
CRS = "OGC:CRS84"

#: Comment at the head of an index.
HEADER = (
    "# Index of stored inventories of building pairs. `per-obspy catalog add` writes it, "
    "`per-obspy catalog check` compares\n"
    "# every file with its hash. Bounding boxes are west, south, east, north in degrees.\n"
)

#: Every longitude and latitude, in the order of a box.
DEGREES = (180.0, 90.0, 180.0, 90.0)

#: Smallest cosine of a latitude that widens longitudes: near a pole a box spans the whole Earth.
SMALLEST_COSINE = 1e-6


class Box(NamedTuple):
    """
    Bounding box in degrees of longitude and latitude.

    It crosses the date line if west is larger than east.
    """

    west: float
    south: float
    east: float
    north: float

    @property
    def width(self) -> float:
        """Range of longitudes, degrees: 360 for the whole Earth, not its remainder 0."""
        return self.east - self.west + (360.0 if self.west > self.east else 0.0)


class StoredInventory(config.Section):
    """One entry of the index."""

    name: str = Field(min_length=1, description="unique in the index")
    file: config.RelativePath = Field(
        description="CSV or Parquet pair table, relative to the index"
    )
    bounding_box: Box = Field(
        description="west, south, east, north, degrees; west above east crosses the date line"
    )
    crs: str = Field(
        CRS, pattern=f"^{CRS}$", description="of the bounding box and of every pair table"
    )
    sha256: str = Field(pattern="^[0-9a-f]{64}$", description="of the file's bytes")
    pairs: int = Field(ge=1, description="usable rows")
    source: str = Field(min_length=1, description="where the data come from")
    licence: str = Field(min_length=1, description="under which they may be used")
    date: datetime.date = Field(description="when the entry was made")


class Catalogue(config.Section):
    """The whole index."""

    inventory: tuple[StoredInventory, ...] = ()


class Origin(NamedTuple):
    """Origin of an inventory, given by the user: name, source, licence and date of entry."""

    name: str
    source: str
    licence: str
    date: datetime.date


def stored_inventories(index: str | Path) -> tuple[StoredInventory, ...]:
    """
    Read the index.

    Parameters
    ----------
    index : str or Path
        ``catalog.toml``.

    Raises
    ------
    CatalogError
        If the index cannot be read, an entry lacks a key, has a wrong value, or two have the same
        name.
    """
    entries = config.load(Path(index), Catalogue).inventory
    names = [entry.name for entry in entries]
    for name in names:
        if names.count(name) > 1:
            raise CatalogError(str(index), f"name = {name!r} occurs more than once")
    return entries


def add_inventory(index: str | Path, file: str | Path, origin: Origin) -> StoredInventory:
    """
    Check an inventory and add it to the index, which is created if it does not exist.

    Parameters
    ----------
    index : str or Path
        ``catalog.toml``.
    file : str or Path
        Pair table, CSV or Parquet.
    origin : Origin
        Name, source, licence and date.

    Returns
    -------
    entry : StoredInventory
        The new entry of the index.

    Raises
    ------
    CatalogError
        If the inventory has no usable row, the name is taken, or name, source or licence is empty.
    """
    target, path = Path(index), Path(file)
    entries = stored_inventories(target) if target.exists() else ()
    _check_origin(target, entries, file, origin)
    # An inventory needs at least one usable pair
    pairs = read_pairs(file)
    if pairs.empty:
        reasons = "; ".join(pairs.attrs["rejected"][0].reasons)
        raise CatalogError(str(file), f"no usable row: {reasons}")
    # Contents and hash of the file
    places = [pairs[[f"{name}_1", f"{name}_2"]].to_numpy() for name in ("longitude", "latitude")]
    entry = StoredInventory(
        **origin._asdict(),
        file=path.resolve(),
        bounding_box=box_around(*places),
        crs=CRS,
        sha256=file_hash(path),
        pairs=len(pairs),
    )
    # The whole index, whose files are relative to its folder
    folder = target.resolve().parent
    with written_whole(target) as part:
        texts = [HEADER, *(_toml(each, folder) for each in (*entries, entry))]
        part.write_text("\n".join(texts), encoding="utf-8")
    return entry


def _check_origin(
    index: Path, entries: tuple[StoredInventory, ...], file: str | Path, origin: Origin
) -> None:
    """Raise CatalogError if the name of a new inventory is taken, or a text of it is empty."""
    if origin.name in [entry.name for entry in entries]:
        raise CatalogError(str(index), f"name = {origin.name!r} is taken")
    for field in ("name", "source", "licence"):
        if not getattr(origin, field).strip():
            raise CatalogError(str(index), f"{field} of the inventory {str(file)!r} is empty")


def box_around(longitude: FloatArray, latitude: FloatArray) -> Box:
    """Return the smallest box around positions in degrees, across the date line or not."""
    # The box begins after the widest range of longitudes without a position
    east = np.unique(longitude)
    widest = int(np.diff(east, append=east[0] + 360.0).argmax())
    west = float(east[(widest + 1) % east.size])
    return Box(west, float(latitude.min()), float(east[widest]), float(latitude.max()))


def region_around(longitudes: Sequence[float], latitudes: Sequence[float], reach: float) -> Box:
    """
    Return the box around positions in degrees, widened by a distance in m on every side.

    Near a pole it has the width of the whole Earth.
    """
    box = box_around(np.array(longitudes), np.array(latitudes))
    degrees = reach / METRES_PER_DEGREE
    south, north = max(box.south - degrees, -90.0), min(box.north + degrees, 90.0)
    # Degrees of longitude are shortest at the latitude farthest from the equator
    cosine = float(np.cos(np.radians(max(abs(south), abs(north)))))
    widened = degrees / max(cosine, SMALLEST_COSINE)
    if box.width + 2.0 * widened >= 360.0:
        return Box(-180.0, south, 180.0, north)
    # Longitudes between -180 and 180 degrees
    west = (box.west - widened + 540.0) % 360.0 - 180.0
    east = (box.east + widened + 540.0) % 360.0 - 180.0
    return Box(west, south, east, north)


def touch(first: Box, second: Box) -> bool:
    """Return whether two boxes have a point in common."""
    east, west = (second.west - first.west) % 360.0, (first.west - second.west) % 360.0
    longitudes_overlap = east <= first.width or west <= second.width
    return longitudes_overlap and first.south <= second.north and second.south <= first.north


def find_inventories(index: str | Path, region: Box) -> tuple[StoredInventory, ...]:
    """
    Return the stored inventories that a region touches.

    Parameters
    ----------
    index : str or Path
        ``catalog.toml``.
    region : Box
        West, south, east, north in degrees.

    Raises
    ------
    CatalogError
        If the index is wrong.
    ValueError
        If the region is no box in degrees.
    """
    values = np.abs(np.array(region, dtype=np.float64))
    if not (values <= DEGREES).all() or region.south > region.north:
        edges = ", ".join(map(str, region))
        raise ValueError(f"region must be west, south, east, north in degrees, got {edges}")
    return tuple(entry for entry in stored_inventories(index) if touch(entry.bounding_box, region))


def verified_file(entry: StoredInventory) -> Path:
    """
    Return the file of an entry after comparing its hash.

    Raises
    ------
    CatalogError
        If the file is missing or its hash is not that of the entry.
    """
    if not entry.file.is_file():
        raise CatalogError(str(entry.file), f"the stored inventory {entry.name!r} is missing")
    # Any other byte gives another hash
    own = file_hash(entry.file)
    if own != entry.sha256:
        problem = f"changed or damaged since it was stored as {entry.name!r}"
        hashes = f"sha256 {own}, expected {entry.sha256}"
        raise CatalogError(str(entry.file), f"{problem} ({hashes})")
    return entry.file


def check_inventories(index: str | Path) -> tuple[Rejection, ...]:
    """Return a rejection for each stored inventory that is missing, changed or damaged."""
    faults = []
    for entry in stored_inventories(index):
        try:
            verified_file(entry)
        except CatalogError as error:
            faults.append(Rejection("file", entry.name, str(entry.file), None, (error.problem,)))
    return tuple(faults)


def _toml(entry: StoredInventory, folder: Path) -> str:
    """Return one entry as TOML with its file relative to the folder."""
    values = entry.model_dump(context={"folder": folder})
    day = values.pop("date")
    # Strings and lists of JSON are valid TOML
    lines = [f"{key} = {json.dumps(value, ensure_ascii=False)}" for key, value in values.items()]
    return "\n".join(["[[inventory]]", *lines, f"date = {day.isoformat()}", ""])
