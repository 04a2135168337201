"""Layers of a GeoPackage, and GeoParquet with the same pairs."""

from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pyogrio
import shapely
from numpy.typing import NDArray

from per_obspy.errors import printable
from per_obspy.inventory.footprints import raw_layer
from per_obspy.report.layers.kml import BOTH_PLACES, has_both_places

Shapes = NDArray[np.object_]


def pair_shapes(table: pd.DataFrame) -> Shapes:
    """
    Return each pair as a line from building 1 to 2, or as a point where only its middle is known.

    Lines across the date line go on beyond 180 degrees, instead of around the Earth.
    """
    if not has_both_places(table.columns):
        return points(table)
    east_1, north_1, east_2, north_2 = (table[name].to_numpy(float) for name in BOTH_PLACES)
    # Beyond the date line
    east_2 = east_2 - 360.0 * np.round((east_2 - east_1) / 360.0)
    ends = np.stack([np.column_stack([east_1, north_1]), np.column_stack([east_2, north_2])], 1)
    lines: Shapes = shapely.linestrings(ends)
    return lines


def points(table: pd.DataFrame) -> Shapes:
    """Return the places of rows as points; None where a coordinate is unknown."""
    longitude, latitude = (table[name].to_numpy(float) for name in ("longitude", "latitude"))
    known = np.isfinite(longitude) & np.isfinite(latitude)
    shapes: Shapes = shapely.points(longitude, latitude)
    shapes[~known] = None
    return shapes


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
        rows = with_shapes(table, shapes, raw_layer.GEOMETRY)
        if self._writer is None:
            kinds = [geometry_type(shapes)] if shapely.is_geometry(shapes).any() else []
            schema = rows.schema.with_metadata(raw_layer.geo_metadata(kinds))
            self._writer = pq.ParquetWriter(self.path, schema)
        self._writer.write_table(rows.cast(self._writer.schema))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._writer is not None:
            self._writer.close()


#: WGS 84; a GeoPackage keeps longitude before latitude, unlike the definition of EPSG.
CRS = "EPSG:4326"
GEOMETRY, IDENTIFIER = "geom", "fid"
STYLES = "layer_styles"

#: Version of the GeoPackage: libraries of 2020 read it without a warning.
PACKAGE_VERSION = "1.2"

#: Kinds of shapes by their type, as GDAL names them.
_KINDS = {0: "Point", 1: "LineString", 3: "Polygon", 6: "MultiPolygon"}


class Layer(NamedTuple):
    """
    A table with its shapes.

    Attributes
    ----------
    name : str
        Of the layer.
    table : DataFrame
        Columns as :func:`layer_names` names them.
    shapes : (n_rows,) ndarray of geometry
        All of one type.
    """

    name: str
    table: pd.DataFrame
    shapes: Shapes


def append_layer(path: Path, layer: Layer, is_new: bool, facts: Mapping[str, str]) -> None:
    """
    Write a layer into a GeoPackage, or append rows to an existing layer.

    Parameters
    ----------
    path : Path
        The file; it is made with its first layer.
    layer : Layer
        Rows and shapes.
    is_new : bool
        Whether the layer begins with these rows.
    facts : mapping of str to str
        Facts that hold for all rows, which become the description of the layer.
    """
    description = "; ".join(f"{name}: {value}" for name, value in facts.items())
    # The file is made with its first layer
    pyogrio.raw.write_arrow(
        with_shapes(layer.table, layer.shapes, GEOMETRY),
        path,
        geometry_name=GEOMETRY,
        geometry_type=geometry_type(layer.shapes),
        crs=CRS,
        layer=layer.name,
        append=not is_new or path.exists(),
        driver="GPKG",
        dataset_options=None if path.exists() else {"VERSION": PACKAGE_VERSION},
        layer_options={
            "GEOMETRY_NAME": GEOMETRY,
            "FID": IDENTIFIER,
            "DESCRIPTION": printable(description),
        },
    )


def geometry_type(shapes: Shapes) -> str:
    """Return the type of the shapes of a layer, points if there are none."""
    kinds = {_KINDS[kind] for kind in np.unique(shapely.get_type_id(shapes)).tolist() if kind >= 0}
    if kinds <= {"Polygon", "MultiPolygon"} and "MultiPolygon" in kinds:
        return "MultiPolygon"
    return kinds.pop() if kinds else "Point"


def layer_names(columns: Iterable[str], taken: Sequence[str] = (GEOMETRY, IDENTIFIER)) -> list[str]:
    """
    Return column names for a layer, distinct without regard to case.

    The layer has an identifier ``fid`` and a geometry ``geom`` of its own. Of names that are taken
    the later one gets a number.

    Examples
    --------
    >>> layer_names(["gap", "Gap", "fid", "GAP"])
    ['gap', 'Gap_2', 'fid_2', 'GAP_3']
    """
    known, names = {name.lower() for name in taken}, list[str]()
    for column in columns:
        name, number = column, 1
        while name.lower() in known:
            number += 1
            name = f"{column}_{number}"
        known.add(name.lower())
        names.append(name)
    return names


def with_shapes(table: pd.DataFrame, shapes: Shapes, geometry: str) -> pa.Table:
    """Return a table with WKB geometries in its last column and a known type for every column."""
    plain = table.copy(deep=False)
    plain.attrs = {}
    arrow = pa.Table.from_pandas(plain, preserve_index=False)
    arrow = arrow.rename_columns(layer_names(arrow.column_names, (geometry, IDENTIFIER)))
    # GDAL has no null type: a column without any value counts as text
    schema = pa.schema(
        pa.field(field.name, pa.string()) if pa.types.is_null(field.type) else field
        for field in arrow.schema
    )
    wkb = pa.array(shapely.to_wkb(shapes), pa.binary())
    return arrow.cast(schema).append_column(geometry, wkb)


def write_styles(path: Path, styles: Mapping[str, str]) -> None:
    """
    Add the table of QGIS styles with the default style of each layer.

    Parameters
    ----------
    path : Path
        GeoPackage.
    styles : mapping of str to str
        Layer -> QML document.
    """
    texts = {
        "f_table_catalog": "",
        "f_table_schema": "",
        "f_table_name": list(styles),
        "f_geometry_column": GEOMETRY,
        "styleName": "severity",
        "styleQML": list(styles.values()),
        "styleSLD": "",
        "description": "colour by severity, names with units",
        "owner": "",
        "ui": "",
    }
    # One row per layer
    columns: dict[str, NDArray[Any]] = {
        name: np.full(len(styles), text, dtype=object) for name, text in texts.items()
    }
    columns["useAsDefault"] = np.ones(len(styles), dtype=bool)
    now = datetime.now(UTC).replace(tzinfo=None)
    columns["update_time"] = np.full(len(styles), now, dtype="datetime64[ms]")
    # A table without geometry
    pyogrio.raw.write(
        path,
        None,
        list(columns.values()),
        list(columns),
        geometry_type=None,
        layer=STYLES,
        append=True,
        driver="GPKG",
        layer_options={"FID": "id"},
    )
