"""GeoPackages of a risk table and of its totals, with a QGIS style for the risk classes."""

from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pyarrow as pa
import pyogrio
import shapely
from matplotlib.colors import LinearSegmentedColormap, to_hex
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.errors import printable
from per_obspy.files import written_whole
from per_obspy.inventory.footprints.gdal_paths import literal_path
from per_obspy.report.style import STATE_COLOURS, UNKNOWN_COLOUR
from per_obspy.screening.uncertainty.unknown_gaps import UNKNOWN_CLASS

#: WGS 84; a GeoPackage keeps longitude before latitude, unlike the definition of EPSG.
CRS = "EPSG:4326"
GEOMETRY, IDENTIFIER = "geom", "fid"
PAIRS, TOTALS, STYLES = "pairs", "totals", "layer_styles"

#: Diameter of a pair's marker, worst and mildest class, millimetres on the screen.
LARGEST, SMALLEST = 2.6, 1.2


def write_pairs_layer(
    tables: Iterable[pd.DataFrame], classes: Sequence[str], path: Path, facts: Mapping[str, str]
) -> None:
    """
    Write the pairs of a risk table as points of a GeoPackage, whole or not at all.

    Parameters
    ----------
    tables : iterable of DataFrame
        The risk table, in one piece or in several with the same columns; only one is held at a
        time. Columns named as another one but for the case of letters get a number.
    classes : sequence of str
        Names of the risk classes, worst first.
    path : Path
        ``.gpkg``.
    facts : mapping of str to str
        Facts that hold for all rows, for example whether the motion is simulated.
    """
    with written_whole(path) as whole, literal_path(whole) as part:
        for number, table in enumerate(tables):
            points = shapely.points(table["longitude"].to_numpy(), table["latitude"].to_numpy())
            write_layer(part, PAIRS, points, table, number > 0, facts)
        _write_style(part, PAIRS, class_style(classes))


def write_totals_layer(
    totals: pd.DataFrame,
    outlines: Sequence[FloatArray] | None,
    path: Path,
    facts: Mapping[str, str],
) -> None:
    """
    Write totals as polygons of their cells or as points amid their pairs, whole or not at all.

    Parameters
    ----------
    totals : DataFrame
        From :func:`per_obspy.screening.region.totals.totals`.
    outlines : sequence of ndarray, or None
        Corners of each area in the order of the rows, (n_corners, 2), degrees east and north; None
        for areas without known outlines.
    path : Path
        ``.gpkg``.
    facts : mapping of str to str
        Facts that hold for all rows.
    """
    if outlines is None:
        shapes = shapely.points(totals["longitude"].to_numpy(), totals["latitude"].to_numpy())
    else:
        shapes = np.array([shapely.Polygon(corners) for corners in outlines], dtype=object)
    with written_whole(path) as whole, literal_path(whole) as part:
        write_layer(part, TOTALS, shapes, totals, False, facts)


def write_layer(
    path: Path,
    layer: str,
    shapes: NDArray[np.object_],
    table: pd.DataFrame,
    append: bool,
    facts: Mapping[str, str],
) -> None:
    """
    Write or append a layer of a GeoPackage.

    Parameters
    ----------
    path : Path
        File that :func:`.literal_path` gave.
    layer : str
        Name of the layer.
    shapes : (n_rows,) ndarray of object
        Geometries, all of one type.
    table : DataFrame
        Attributes of each shape.
    append : bool
        Whether the file exists: the layer is added to it, or rows to the layer.
    facts : mapping of str to str
        Facts that hold for all rows, as the description of the layer.
    """
    # All shapes are of one type
    kind = shapes[0].geom_type if len(shapes) else "Point"
    description = "; ".join(f"{name}: {value}" for name, value in facts.items())
    pyogrio.raw.write_arrow(
        _with_shapes(table, shapes),
        path,
        geometry_name=GEOMETRY,
        geometry_type=kind,
        crs=CRS,
        layer=layer,
        append=append,
        driver="GPKG",
        layer_options={
            "GEOMETRY_NAME": GEOMETRY,
            "FID": IDENTIFIER,
            "DESCRIPTION": printable(description),
        },
    )


def layer_names(columns: Iterable[str]) -> list[str]:
    """
    Return names of columns for a layer, which are distinct whatever the case of their letters.

    The layer has an identifier ``fid`` and a geometry ``geom`` of its own. Of names that are taken
    the later one gets a number.

    Examples
    --------
    >>> layer_names(["gap", "Gap", "fid", "GAP"])
    ['gap', 'Gap_2', 'fid_2', 'GAP_3']
    """
    taken, names = {GEOMETRY, IDENTIFIER}, list[str]()
    for column in columns:
        name, number = column, 1
        while name.lower() in taken:
            number += 1
            name = f"{column}_{number}"
        taken.add(name.lower())
        names.append(name)
    return names


def _with_shapes(table: pd.DataFrame, shapes: NDArray[np.object_]) -> pa.Table:
    """Return the table with its geometries as GDAL takes them."""
    plain = table.copy(deep=False)
    plain.attrs = {}
    arrow = pa.Table.from_pandas(plain, preserve_index=False)
    arrow = arrow.rename_columns(layer_names(arrow.column_names))
    # GDAL has no null type: a column without any value counts as text
    schema = pa.schema(
        pa.field(field.name, pa.string()) if pa.types.is_null(field.type) else field
        for field in arrow.schema
    )
    geometry = pa.array(shapely.to_wkb(shapes), pa.binary())
    return arrow.cast(schema).append_column(GEOMETRY, geometry)


def _write_style(path: Path, layer: str, style: str) -> None:
    """Add the table in which QGIS keeps styles, with the default style of this layer."""
    texts = {
        "f_table_catalog": "",
        "f_table_schema": "",
        "f_table_name": layer,
        "f_geometry_column": GEOMETRY,
        "styleName": "risk class",
        "styleQML": style,
        "styleSLD": "",
        "description": "colour by risk class",
        "owner": "",
        "ui": "",
    }
    columns: dict[str, NDArray[Any]] = {
        name: np.array([text], dtype=object) for name, text in texts.items()
    }
    columns["useAsDefault"] = np.array([True])
    now = datetime.now(UTC).replace(tzinfo=None)
    columns["update_time"] = np.array([now], dtype="datetime64[ms]")
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


def class_style(classes: Sequence[str]) -> str:
    """
    Return a QGIS style (QML): one marker per risk class, the worst pairs drawn on top.

    Parameters
    ----------
    classes : sequence of str
        Names of the risk classes, worst first; its marker is the largest.

    Returns
    -------
    style : str
        XML document.
    """
    root = ElementTree.Element("qgis", version="3.28.0", styleCategories="Symbology")
    renderer = ElementTree.SubElement(
        root,
        "renderer-v2",
        type="categorizedSymbol",
        attr="risk_class",
        enableorderby="1",
        symbollevels="0",
    )
    _add_categories(renderer, classes)

    # Drawn by falling rank: the worst pair, rank 1, last
    order_by = ElementTree.SubElement(renderer, "orderby")
    order = ElementTree.SubElement(order_by, "orderByClause", asc="0", nullsFirst="0")
    order.text = '"rank"'
    ElementTree.SubElement(root, "layerGeometryType").text = "0"
    document = ElementTree.tostring(root, encoding="unicode")
    return "<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>\n" + document


def _add_categories(renderer: ElementTree.Element, classes: Sequence[str]) -> None:
    """Add a category and its marker for each risk class."""
    categories = ElementTree.SubElement(renderer, "categories")
    symbols = ElementTree.SubElement(renderer, "symbols")
    colours = LinearSegmentedColormap.from_list("risk", list(STATE_COLOURS.values()))
    for number, name in enumerate(classes):
        # Colour and size change evenly from the worst to the mildest class
        share = number / max(len(classes) - 1, 1)
        size = LARGEST + share * (SMALLEST - LARGEST)
        ElementTree.SubElement(
            categories, "category", value=name, label=name, symbol=str(number), render="true"
        )
        _add_marker(symbols, number, to_hex(colours(share)), size)
    # pairs of unknown gap are of no class of severity
    name, symbol = UNKNOWN_CLASS, str(len(classes))
    ElementTree.SubElement(
        categories, "category", value=name, label=name, symbol=symbol, render="true"
    )
    _add_marker(symbols, len(classes), UNKNOWN_COLOUR, SMALLEST)


def _add_marker(symbols: ElementTree.Element, number: int, colour: str, size: float) -> None:
    """Add a circle of a colour (hexadecimal) and a size, mm."""
    symbol = ElementTree.SubElement(
        symbols, "symbol", type="marker", name=str(number), alpha="1", clip_to_extent="1"
    )
    layer = ElementTree.SubElement(
        symbol, "layer", {"class": "SimpleMarker", "enabled": "1", "locked": "0", "pass": "0"}
    )
    # QGIS takes colours as red, green, blue and opacity, 0 to 255
    red, green, blue = (int(colour[start : start + 2], 16) for start in (1, 3, 5))
    options = {
        "name": "circle",
        "color": f"{red},{green},{blue},255",
        "outline_color": "35,35,35,255",
        "outline_width": "0.1",
        "size": f"{size:.2f}",
        "size_unit": "MM",
    }
    mapping = ElementTree.SubElement(layer, "Option", type="Map")
    for name, value in options.items():
        ElementTree.SubElement(mapping, "Option", type="QString", name=name, value=value)
