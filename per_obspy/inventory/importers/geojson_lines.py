"""GeoJSON features one per line, as Microsoft publishes footprints."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import shapely

from per_obspy.errors import CatalogError
from per_obspy.inventory.importers.importer import RawLayer

#: Longest line, bytes: a footprint of ten thousand corners.
LONGEST_LINE = 1 << 20

#: Most lines that are read.
MOST_LINES = 5_000_000

#: Most columns: further names of properties are left out.
MOST_NAMES = 200


def read_geojson_lines(file: Path, source: str) -> RawLayer:
    """
    Read a file of features, one per line; blank lines and record separators are skipped.

    Parameters
    ----------
    file : Path
        UTF-8, WGS 84 as RFC 7946 demands. It is read line by line; a line that is no feature is a
        separate fault.
    source : str
        Name of the file, for messages.

    Raises
    ------
    CatalogError
        If no line is a feature, or there are more than ``MOST_LINES``.
    """
    geometries, faults = list[Any](), dict[int, str]()
    columns = dict[str, list[Any]]()
    for row, line in enumerate(_lines(file)):
        if row >= MOST_LINES:
            raise CatalogError(source, f"it has more than {MOST_LINES} features: split the file")
        # A line that is not a feature loses only one building
        try:
            geometry, properties = feature_of(line)
        except ValueError as error:
            geometry, properties, faults[row] = None, {}, str(error)
        geometries.append(geometry)
        _append(columns, properties, row)
    # Another kind of file
    if len(faults) == len(geometries):
        first = faults.get(0, "it is empty")
        raise CatalogError(source, f"not a file of GeoJSON features: line 1: {first}")
    shapes = np.array(geometries, dtype=object)
    return RawLayer(shapes, _table(columns, len(geometries)), "OGC:CRS84", faults)


def _lines(file: Path) -> Iterator[bytes]:
    """Yield the lines of a file that are not blank, each cut beyond its longest length."""
    with file.open("rb") as opened:
        while line := opened.readline(LONGEST_LINE + 2):
            # The rest of a line that is too long is not a line of the file
            while not line.endswith(b"\n") and (rest := opened.readline(LONGEST_LINE)):
                line = line[: LONGEST_LINE + 1] + rest[-1:]
            if text := line.strip(b"\x1e\xef\xbb\xbf \t\r\n"):
                yield text


def feature_of(line: bytes) -> tuple[Any, dict[str, Any]]:
    """
    Return geometry and properties of a GeoJSON feature.

    Raises
    ------
    ValueError
        If the text is no feature, is too long, or is nested too deeply.

    Examples
    --------
    >>> feature_of(b'{"type": "Feature", "geometry": null, "properties": {"height": -1}}')
    (None, {'height': -1})
    """
    if len(line) > LONGEST_LINE:
        raise ValueError(f"the line is longer than {LONGEST_LINE} bytes")
    try:
        found = json.loads(line)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"not JSON: {str(error)[:80]}") from error
    # One feature, not a collection of them
    if not isinstance(found, dict) or found.get("type") != "Feature":
        raise ValueError("not a GeoJSON feature")
    properties = found.get("properties")
    geometry = geometry_of(found.get("geometry"))
    return geometry, properties if isinstance(properties, dict) else {}


def geometry_of(found: object) -> Any:
    """
    Return a GeoJSON geometry as a shapely one, None if it is missing.

    Raises
    ------
    ValueError
        If it is no geometry.
    """
    if found is None:
        return None
    try:
        return shapely.from_geojson(json.dumps(found))
    except (shapely.errors.GEOSException, ValueError, TypeError, RecursionError) as error:
        raise ValueError(f"not a geometry: {str(error)[:80]}") from error


def _append(columns: dict[str, list[Any]], properties: dict[str, Any], row: int) -> None:
    """Append the properties of a feature to the columns, which are filled up to its row."""
    for name, value in properties.items():
        if name in columns or len(columns) < MOST_NAMES:
            column = columns.setdefault(name, [])
            column.extend([None] * (row - len(column)))
            column.append(plain_cell(value))


def _table(columns: dict[str, list[Any]], count: int) -> pd.DataFrame:
    """Return columns of numbers and texts, all of the same length."""
    table = {}
    for name, cells in columns.items():
        padded = cells + [None] * (count - len(cells))
        table[name] = pd.Series(padded, dtype=object).infer_objects()
    return pd.DataFrame(table, index=range(count))


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
