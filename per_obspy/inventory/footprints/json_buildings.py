"""
Buildings as JSON: GeoJSON features one per line, and the assets of SimCenter.

Microsoft publishes lines. Assets are a collection of features with a unit, a list of objects with
``GeneralInformation``, or one such object. Positions are degrees (WGS 84), as RFC 7946 demands.
"""

import json
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import shapely

from per_obspy.errors import CatalogError
from per_obspy.inventory.footprints.raw_layer import RawLayer, cell_table, features

#: Longest line, bytes: a footprint of ten thousand corners. Most lines that are read.
LONGEST_LINE, MOST_LINES = 1 << 20, 5_000_000

#: Largest file of assets, which is read as a whole, bytes.
LARGEST_ASSETS = 512 << 20

#: Geometries that are parsed together.
_BLOCK = 1_000

_GENERAL = "GeneralInformation"

#: Column of the unit of length of an asset.
LENGTH_UNIT = "length_unit"


class _Feature(NamedTuple):
    """Geometry as text of GeoJSON, None if there is none; cells; the fault, empty if none."""

    geometry: str | None
    cells: dict[str, object]
    fault: str = ""


def read_geojson_lines(file: Path, source: str) -> RawLayer:
    """
    Read a file of features, one per line; blank lines and record separators are skipped.

    A line that is no feature is a separate fault.

    Raises
    ------
    CatalogError
        If no line is a feature, or there are more than ``MOST_LINES``.
    """
    layer = _layer(_features_of_lines(file, source))
    # Another kind of file
    if len(layer.faults) == len(layer.wkb):
        first = layer.faults.get(0, "it is empty")
        raise CatalogError(source, f"not a file of GeoJSON features: line 1: {first}")
    return layer


def _layer(found: Iterator[_Feature]) -> RawLayer:
    """Return features as a layer; their geometries are parsed block by block."""
    shapes, faults = [np.empty(0, dtype=object)], dict[int, str]()

    # Cells go into columns while geometries are set aside
    def cells() -> Iterator[dict[str, object]]:
        first = 0
        while block := list(islice(found, _BLOCK)):
            texts = np.array([feature.geometry for feature in block], dtype=object)
            # A number beyond all numbers becomes infinite, which no place on the Earth is
            with np.errstate(all="ignore"):
                shapes.append(shapely.from_geojson(texts, on_invalid="ignore"))
            for row in np.flatnonzero(shapely.is_missing(shapes[-1])).tolist():
                if block[row].fault or block[row].geometry is not None:
                    faults[first + row] = block[row].fault or "not a geometry of GeoJSON"
            yield from (feature.cells for feature in block)
            first += len(block)

    table = cell_table(cells())
    return features(np.concatenate(shapes), table, "OGC:CRS84", faults)


def _features_of_lines(file: Path, source: str) -> Iterator[_Feature]:
    """Yield the features of a file of lines; a line that is none loses only one building."""
    for row, line in enumerate(_lines(file)):
        if row >= MOST_LINES:
            raise CatalogError(source, f"it has more than {MOST_LINES} features: split the file")
        # The fault of a line is that of its building
        fault = ""
        if len(line) > LONGEST_LINE:
            fault = f"the line is longer than {LONGEST_LINE} bytes"
        else:
            try:
                feature = json.loads(line)
            except (ValueError, RecursionError) as error:
                fault = f"not JSON: {str(error)[:80]}"
        # One feature, not a collection of them
        if not fault and not (isinstance(feature, dict) and feature.get("type") == "Feature"):
            fault = "not a GeoJSON feature"
        if fault:
            yield _Feature(None, {}, fault)
            continue
        geometry, properties = feature.get("geometry"), feature.get("properties")
        cells = properties if isinstance(properties, dict) else {}
        plain = {name: plain_cell(value) for name, value in cells.items()}
        yield _Feature(None if geometry is None else json.dumps(geometry), plain)


def _lines(file: Path) -> Iterator[bytes]:
    """Yield the lines of a file that are not blank, each cut beyond its longest length."""
    with file.open("rb") as opened:
        while line := opened.readline(LONGEST_LINE + 2):
            # The rest of a line that is too long is not a line of the file
            while not line.endswith(b"\n") and (rest := opened.readline(LONGEST_LINE)):
                line = line[: LONGEST_LINE + 1] + rest[-1:]
            if text := line.strip(b"\x1e\xef\xbb\xbf \t\r\n"):
                yield text


def plain_cell(value: object) -> object:
    """
    Return a value of JSON as a cell: numbers, truth values and text stay, others become text.

    Examples
    --------
    >>> plain_cell(3), plain_cell({"a": 1}), plain_cell(None)
    (3, '{"a": 1}', None)
    """
    if value is None or isinstance(value, str | bool | float):
        return value
    if isinstance(value, int):
        return value if abs(value) < 1 << 53 else str(value)[:40]
    return json.dumps(value)[:1000]


def is_asset_json(head: bytes) -> bool:
    """Return whether the beginning of a JSON file has the words of SimCenter's assets."""
    return b'"GeneralInformation"' in head or (b'"NumberOfStories"' in head and b'"units"' in head)


def read_asset_json(file: Path, source: str) -> RawLayer:
    """
    Read assets: one, a list of them, or a FeatureCollection.

    Raises
    ------
    CatalogError
        If the file is too large, no JSON, or holds no asset.
    """
    if file.stat().st_size > LARGEST_ASSETS:
        raise CatalogError(source, f"it is larger than {LARGEST_ASSETS >> 20} MiB: split the file")
    try:
        content = json.loads(file.read_bytes())
    except (ValueError, RecursionError) as error:
        raise CatalogError(source, f"not a JSON file: {str(error)[:200]}") from error
    units = _member(content, "units")
    assets = content.get("features", [content]) if isinstance(content, dict) else content
    # Entries that are no objects are assets without anything
    objects = [asset if isinstance(asset, dict) else {} for asset in assets or []]
    if not isinstance(assets, list) or not objects:
        raise CatalogError(source, f"no asset: neither features nor {_GENERAL}")
    return _layer(_asset(asset, units) for asset in objects)


def _asset(asset: dict[str, Any], common_units: object) -> _Feature:
    """Return an asset as a feature, with its unit of length or that of the file."""
    properties = _member(asset, "properties") or asset
    general = _member(properties, _GENERAL) or properties
    building = dict(general) if isinstance(general, dict) else {}
    # One identifier under several names
    names = (building.get("id"), building.get("AIM_id"), asset.get("id"))
    building["id"] = next((name for name in names if name is not None), None)
    if isinstance(asset.get("geometry"), dict):
        building.pop("geometry", None)
    cells = {LENGTH_UNIT: _member(building.get("units") or common_units, "length"), **building}
    plain = {str(name)[:200]: plain_cell(value) for name, value in cells.items()}
    for name in ("Footprint", "units"):
        plain.pop(name, None)
    # Outline, or position, or the reason for the rejection
    try:
        return _Feature(_asset_geometry(asset, building), plain)
    except ValueError as error:
        return _Feature(None, plain, str(error))


def _asset_geometry(asset: dict[str, Any], building: dict[str, Any]) -> str:
    """Return the outline of an asset, else its position, as GeoJSON; ValueError without any."""
    if asset.get("geometry") is not None:
        return json.dumps(asset["geometry"])
    if building.get("Footprint"):
        return geojson_text(building["Footprint"])
    # A point, which the layer needs to be called one
    place = []
    for name in ("longitude", "latitude"):
        degrees = building.get(name.capitalize(), _member(building.get("location"), name))
        if not isinstance(degrees, int | float):
            raise ValueError("neither Footprint nor location")
        place.append(degrees)
    return json.dumps({"type": "Point", "coordinates": place})


def geojson_text(cell: object) -> str:
    """
    Return the GeoJSON of a cell, which holds an object or its text.

    Raises
    ------
    ValueError
        If the text is no JSON, or no object: nested texts could exhaust the reader of geometries.
    """
    try:
        content = json.loads(cell) if isinstance(cell, str) else cell
    except (ValueError, RecursionError) as error:
        raise ValueError(f"Footprint is not JSON: {str(error)[:80]}") from error
    if not isinstance(content, dict):
        raise ValueError(f"Footprint = {str(cell)[:40]!r} is not a geometry")
    return cell if isinstance(cell, str) else json.dumps(content)


def _member(content: object, name: str) -> Any:
    """Return a member of an object, None if there is none."""
    return content.get(name) if isinstance(content, dict) else None
