"""A layer of buildings as its file has it, unchecked, and columns from the cells of buildings."""

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import shapely
from numpy.typing import NDArray

from per_obspy.errors import Rejection

Geometries = NDArray[np.object_]

#: Column of the outlines in GeoParquet.
GEOMETRY = "geometry"

#: Most columns of a file without a header: further names are left out.
MOST_NAMES = 200


class RawLayer(NamedTuple):
    """A layer as its file has it."""

    #: Geometries as WKB, first coordinate east, second north; null where there is none.
    wkb: pa.Array | pa.ChunkedArray
    #: One row per geometry.
    attributes: pa.Table
    #: Coordinate reference system in any form; None if unknown.
    crs: Any
    #: Number of each feature in the file, or line of a table.
    numbers: NDArray[np.int64]
    #: Position of a feature -> why it has no geometry, where that is known.
    faults: Mapping[int, str] = {}
    #: Lines of a table that are no rows.
    broken: tuple[Rejection, ...] = ()


def features(
    shapes: Geometries, attributes: pa.Table, crs: Any, faults: Mapping[int, str]
) -> RawLayer:
    """Return the features of a file, without the geometries of those that have a fault."""
    numbers = np.arange(1, len(shapes) + 1)
    shapes[list(faults)] = None
    return RawLayer(as_wkb(shapes), attributes, crs, numbers, faults)


def as_wkb(shapes: Geometries) -> pa.Array:
    """Return geometries as WKB, null where there is none."""
    return pa.array(shapely.to_wkb(shapes), pa.large_binary())


def geo_metadata(types: Sequence[str]) -> dict[str, str]:
    """
    Return what GeoParquet 1.1 has to say of its column of WKB with geometries of some types.

    Without a reference system coordinates are longitude and latitude, WGS 84; no types mean that
    they are unknown (https://geoparquet.org/releases/v1.1.0/).
    """
    column = {"encoding": "WKB", "geometry_types": types}
    geo = {"version": "1.1.0", "primary_column": GEOMETRY, "columns": {GEOMETRY: column}}
    return {"geo": json.dumps(geo)}


def cell_table(rows: Iterable[Mapping[str, object]]) -> pa.Table:
    """
    Return rows of named cells as columns, null where a row has no cell of the name.

    Examples
    --------
    >>> cell_table([{"height": 3}, {"height": 4.5, "use": "shop"}]).to_pydict()
    {'height': [3.0, 4.5], 'use': [None, 'shop']}
    """
    columns, count = dict[str, list[object]](), 0
    for count, row in enumerate(rows, start=1):
        # Columns are as long as the rows before
        for name, cell in row.items():
            if name in columns or len(columns) < MOST_NAMES:
                column = columns.setdefault(name, [])
                column.extend([None] * (count - 1 - len(column)))
                column.append(cell)
    for column in columns.values():
        column.extend([None] * (count - len(column)))
    return pa.table({name: _column(cells) for name, cells in columns.items()})


def _column(cells: Sequence[object]) -> pa.Array:
    """Return cells as a column; numbers and texts in one become text."""
    try:
        return pa.array(cells)
    except pa.ArrowException:
        return pa.array([None if cell is None else str(cell) for cell in cells], pa.string())
