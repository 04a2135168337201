"""Pairs as GeoParquet: the risk table with one shape per pair, written piece by piece."""

import json
from pathlib import Path
from types import TracebackType
from typing import Self

import pandas as pd
import pyarrow.parquet as pq
import shapely

from per_obspy.report.layers.geopackage import geometry_type, with_shapes
from per_obspy.report.layers.shapes import Shapes

#: Version of the specification (https://geoparquet.org/releases/v1.1.0), and name of the shapes.
VERSION, GEOMETRY = "1.1.0", "geometry"


class GeoParquet:
    """
    GeoParquet file to which rows are appended in pieces.

    Parameters
    ----------
    path : Path
        The file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._writer: pq.ParquetWriter | None = None

    def append(self, table: pd.DataFrame, shapes: Shapes) -> None:
        """Append rows; those of the first piece decide the types of all columns."""
        rows = with_shapes(table, shapes, GEOMETRY)
        if self._writer is None:
            # Without a reference system coordinates are longitude and latitude, WGS 84
            column = {"encoding": "WKB", "geometry_types": _types(shapes)}
            geo = {"version": VERSION, "primary_column": GEOMETRY, "columns": {GEOMETRY: column}}
            schema = rows.schema.with_metadata({"geo": json.dumps(geo)})
            self._writer = pq.ParquetWriter(self.path, schema)
        self._writer.write_table(rows.cast(self._writer.schema))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._writer is not None:
            self._writer.close()


def _types(shapes: Shapes) -> list[str]:
    """Return the types of the shapes; none means that they are unknown."""
    return [geometry_type(shapes)] if shapely.is_geometry(shapes).any() else []
