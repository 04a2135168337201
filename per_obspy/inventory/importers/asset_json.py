"""Assets of SimCenter in JSON: collections of features with a unit, and assets by themselves."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import shapely

from per_obspy.errors import CatalogError
from per_obspy.inventory.importers.geojson_lines import geometry_of, plain_cell
from per_obspy.inventory.importers.importer import RawLayer
from per_obspy.inventory.importers.sources.simcenter import LENGTH_UNIT

#: Bytes at the beginning in which an asset shows itself.
_HEAD = 1 << 16

#: Largest file, which is read as a whole, bytes.
LARGEST = 512 << 20

_GENERAL = "GeneralInformation"


def is_asset_json(file: Path) -> bool:
    """Return whether the beginning of a JSON file has the words of SimCenter's assets."""
    with file.open("rb") as opened:
        head = opened.read(_HEAD)
    return b'"GeneralInformation"' in head or (b'"NumberOfStories"' in head and b'"units"' in head)


def read_asset_json(file: Path, source: str) -> RawLayer:
    """
    Read assets: one, a list of them, or a FeatureCollection.

    Parameters
    ----------
    file : Path
        Its size is limited to ``LARGEST``.
    source : str
        Name of the file, for messages.

    Raises
    ------
    CatalogError
        If the file is too large, no JSON, or holds no asset.
    """
    content = _content(file, source)
    geometries, cells, faults = list[Any](), list[dict[str, object]](), dict[int, str]()
    for row, asset in enumerate(_assets(content)):
        properties = _properties(asset)
        # Outline, or position, or the reason for the rejection
        try:
            geometry = _geometry(asset, properties)
        except ValueError as error:
            geometry, faults[row] = None, str(error)
        geometries.append(geometry)
        cells.append(_cells(properties, _member(content, "units")))
    if not geometries:
        raise CatalogError(source, f"no asset: neither features nor {_GENERAL}")
    # Outlines are in the geometries now
    table = pd.DataFrame(cells).drop(columns=["Footprint", "units"], errors="ignore")
    return RawLayer(np.array(geometries, dtype=object), table, "OGC:CRS84", faults)


def _content(file: Path, source: str) -> object:
    """Return the content of a JSON file; raise CatalogError if it is too large or none."""
    if file.stat().st_size > LARGEST:
        raise CatalogError(source, f"it is larger than {LARGEST >> 20} MiB: split the file")
    try:
        content: object = json.loads(file.read_bytes())
    except (ValueError, RecursionError) as error:
        raise CatalogError(source, f"not a JSON file: {str(error)[:200]}") from error
    return content


def _cells(properties: dict[str, Any], common_units: object) -> dict[str, object]:
    """Return the cells of an asset, with its unit of length or that of the file."""
    unit = _member(properties.get("units") or common_units, "length")
    cells = {LENGTH_UNIT: unit, **properties}
    return {str(name)[:200]: plain_cell(value) for name, value in cells.items()}


def _assets(content: object) -> Iterator[dict[str, Any]]:
    """Yield the assets of a file; entries that are no objects are empty ones."""
    if isinstance(content, dict):
        content = content.get("features", [content])
    if isinstance(content, list):
        for asset in content:
            yield asset if isinstance(asset, dict) else {}


def _member(content: object, name: str) -> Any:
    """Return a member of an object, None if there is none."""
    return content.get(name) if isinstance(content, dict) else None


def _properties(asset: dict[str, Any]) -> dict[str, Any]:
    """Return the attributes of a building from its asset."""
    properties = _member(asset, "properties") or asset
    general = _member(properties, _GENERAL) or properties
    found = dict(general) if isinstance(general, dict) else {}
    # One identifier under several names
    names = (found.get("id"), found.get("AIM_id"), asset.get("id"))
    found["id"] = next((name for name in names if name is not None), None)
    if isinstance(asset.get("geometry"), dict):
        found.pop("geometry", None)
    return found


def _geometry(asset: dict[str, Any], properties: dict[str, Any]) -> Any:
    """
    Return the outline of an asset, else its position.

    Raises
    ------
    ValueError
        If neither can be read.
    """
    if asset.get("geometry") is not None:
        return geometry_of(asset["geometry"])
    if properties.get("Footprint"):
        return footprint_of(properties["Footprint"])
    # Position of the asset
    location = properties.get("location")
    east, north = (
        properties.get(name.capitalize(), _member(location, name))
        for name in ("longitude", "latitude")
    )
    if isinstance(east, int | float) and isinstance(north, int | float):
        return shapely.Point(float(east), float(north))
    raise ValueError("neither Footprint nor location")


def footprint_of(cell: object) -> Any:
    """
    Return an outline from a cell that contains GeoJSON as text.

    Raises
    ------
    ValueError
        If it is none.

    Examples
    --------
    >>> footprint_of('{"type": "Point", "coordinates": [1.0, 2.0]}')
    <POINT (1 2)>
    """
    try:
        found = json.loads(cell) if isinstance(cell, str) else cell
    except (ValueError, RecursionError) as error:
        raise ValueError(f"Footprint is not JSON: {str(error)[:80]}") from error
    if not isinstance(found, dict):
        raise ValueError(f"Footprint = {str(cell)[:40]!r} is not a geometry")
    return geometry_of(found.get("geometry", found))
