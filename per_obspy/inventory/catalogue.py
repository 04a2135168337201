"""
The index of stored pair inventories: a TOML file beside them that says what each holds and whether it is unchanged.

A file is used only after its hash was compared (:func:`verified_file`), so that a changed or
damaged inventory is noticed before any number is made of it. Positions are longitude and latitude
(WGS 84), as in every pair table.
"""

import datetime
import json
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from pydantic import Field

from per_obspy import config
from per_obspy.constants import METRES_PER_DEGREE
from per_obspy.errors import CatalogError, Rejection
from per_obspy.files import file_hash, written_whole
from per_obspy.inventory.files.reading import read_pairs

CRS = "OGC:CRS84"

HEADER = """\
# Index of stored inventories of building pairs. `per-obspy catalog add` writes it, `per-obspy catalog check` compares
# every file with its hash. Bounding boxes are west, south, east, north in degrees.
"""


class Box(NamedTuple):
    """A range of longitudes and latitudes in degrees; it crosses the date line if west is larger than east."""

    west: float
    south: float
    east: float
    north: float


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
    """What only a person can say of an inventory: its name, source, licence and the date of entry."""

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
            raise CatalogError(str(index), f"name = {name!r} stands more than once")
    return entries


def add_inventory(index: str | Path, file: str | Path, origin: Origin) -> StoredInventory:
    """
    Check an inventory and enter it into the index, which is made if it does not exist.

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
        As it now stands in the index.

    Raises
    ------
    CatalogError
        If the inventory has no usable row, the name is taken, or name, source or licence is empty.
    """
    target = Path(index)
    entries = stored_inventories(target) if target.exists() else ()
    if origin.name in [entry.name for entry in entries]:
        raise CatalogError(str(target), f"name = {origin.name!r} is taken")
    empty = [field for field in ("name", "source", "licence") if not getattr(origin, field).strip()]
    if empty:
        raise CatalogError(str(target), f"{empty[0]} of the inventory {str(file)!r} is empty")
    pairs = read_pairs(file)
    if pairs.empty:
        raise CatalogError(
            str(file), f"no usable row: {'; '.join(pairs.attrs['rejected'][0].reasons)}"
        )
    entry = StoredInventory(
        name=origin.name,
        file=Path(file).resolve(),
        bounding_box=bounding_box(pairs),
        sha256=file_hash(Path(file)),
        pairs=len(pairs),
        source=origin.source,
        licence=origin.licence,
        date=origin.date,
    )
    _write(target, (*entries, entry))
    return entry


def bounding_box(pairs: pd.DataFrame) -> Box:
    """Return the smallest box around all buildings of a pair table; across the date line if that is smaller."""
    latitude = pairs[["latitude_1", "latitude_2"]].to_numpy()
    longitude = np.unique(pairs[["longitude_1", "longitude_2"]].to_numpy())
    empty = np.diff(longitude, append=longitude[0] + 360.0)
    widest = int(empty.argmax())
    return Box(
        float(longitude[(widest + 1) % longitude.size]), float(latitude.min()),
        float(longitude[widest]), float(latitude.max()),
    )  # fmt: skip


def region_around(longitudes: Sequence[float], latitudes: Sequence[float], reach: float) -> Box:
    """Return the box around some places, widened by a distance in m; the whole earth's width near a pole."""
    places = pd.DataFrame(
        {
            f"{name}_{i}": column
            for name, column in (("longitude", longitudes), ("latitude", latitudes))
            for i in (1, 2)
        }
    )
    box, degrees = bounding_box(places), reach / METRES_PER_DEGREE
    south, north = max(box.south - degrees, -90.0), min(box.north + degrees, 90.0)
    widened = degrees / max(float(np.cos(np.radians(max(abs(south), abs(north))))), 1e-6)
    if _width(box) + 2.0 * widened >= 360.0:
        return Box(-180.0, south, 180.0, north)
    west, east = (
        (edge + 540.0) % 360.0 - 180.0 for edge in (box.west - widened, box.east + widened)
    )
    return Box(west, south, east, north)


def touch(one: Box, other: Box) -> bool:
    """Return whether two boxes have a point in common."""
    east, west = (other.west - one.west) % 360.0, (one.west - other.west) % 360.0
    side_by_side = east <= _width(one) or west <= _width(other)
    return side_by_side and one.south <= other.north and other.south <= one.north


def _width(box: Box) -> float:
    """Return the extent in degrees; 360 for the whole earth, which a remainder would make 0."""
    return box.east - box.west + (360.0 if box.west > box.east else 0.0)


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
    _check(region)
    return tuple(entry for entry in stored_inventories(index) if touch(entry.bounding_box, region))


def _check(region: Box) -> None:
    values = np.abs(np.array(region, dtype=np.float64))
    if not (values <= [180.0, 90.0, 180.0, 90.0]).all() or region.south > region.north:
        raise ValueError(
            f"region must be west, south, east, north in degrees, got {', '.join(map(str, region))}"
        )


def verified_file(entry: StoredInventory) -> Path:
    """
    Return the file of an entry once it is known to be unchanged.

    Raises
    ------
    CatalogError
        If the file is missing or its hash is not that of the entry.
    """
    if not entry.file.is_file():
        raise CatalogError(str(entry.file), f"the stored inventory {entry.name!r} is missing")
    found = file_hash(entry.file)
    if found != entry.sha256:
        problem = f"changed or damaged since it was stored as {entry.name!r} (sha256 {found}, expected {entry.sha256})"
        raise CatalogError(str(entry.file), problem)
    return entry.file


def check_inventories(index: str | Path) -> tuple[Rejection, ...]:
    """Return every stored inventory that cannot be used, with its reason; none if all are as they were stored."""
    faults = []
    for entry in stored_inventories(index):
        try:
            verified_file(entry)
        except CatalogError as error:
            faults.append(Rejection("file", entry.name, str(entry.file), None, (error.problem,)))
    return tuple(faults)


def _write(index: Path, entries: tuple[StoredInventory, ...]) -> None:
    folder = index.resolve().parent
    with written_whole(index) as part:
        part.write_text(
            "\n".join([HEADER, *(_toml(entry, folder) for entry in entries)]), encoding="utf-8"
        )


def _toml(entry: StoredInventory, folder: Path) -> str:
    """Return one entry as TOML, its file relative to the folder; JSON's strings and lists are TOML's as well."""
    values = entry.model_dump(context={"folder": folder})
    day = values.pop("date")
    lines = [f"{key} = {json.dumps(value, ensure_ascii=False)}" for key, value in values.items()]
    return "\n".join(["[[inventory]]", *lines, f"date = {day.isoformat()}", ""])
