"""Project of QGIS with the styles of its layers."""

import zipfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple
from xml.etree import ElementTree

from per_obspy.errors import printable
from per_obspy.files import written_whole
from per_obspy.report.layers.inspections import QUESTIONS, add_form
from per_obspy.report.style import class_colours
from per_obspy.screening.ranking import NO_VERDICT

#: First line of the XML files of QGIS.
DOCTYPE = "<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>\n"

#: Version of QGIS whose XML this is: a long-term release, which later ones read without a warning.
VERSION = "3.22.16"

#: Diameter of a marker or width of a line, worst and mildest class, millimetres on the screen.
LARGEST, SMALLEST = 2.6, 1.2

#: Width of the dark edge of a line, millimetres, and opacity of a building, 0 to 255: a pair is
#: visible on buildings of its class.
EDGE, OPACITY = 0.25, 150

#: Geometry of a layer -> its number in QML, kind of symbol, class of the symbol's layer, and its
#: name in a project.
_KINDS = {
    "Point": ("0", "marker", "SimpleMarker", "Point"),
    "LineString": ("1", "line", "SimpleLine", "Line"),
    **dict.fromkeys(("Polygon", "MultiPolygon"), ("2", "fill", "SimpleFill", "Polygon")),
}


def class_style(
    classes: Sequence[str], geometry: str, aliases: Mapping[str, str] = MappingProxyType({})
) -> str:
    """
    Return a style with one symbol per risk class, the worst drawn on top.

    Parameters
    ----------
    classes : sequence of str
        Names of the risk classes, worst first; its symbol is the largest.
    geometry : str
        Type of the layer: ``Point``, ``LineString``, ``Polygon`` or ``MultiPolygon``.
    aliases : mapping of str to str
        Column -> name with unit.

    Returns
    -------
    style : str
        XML document.
    """
    root = _root()
    renderer = ElementTree.SubElement(
        root,
        "renderer-v2",
        type="categorizedSymbol",
        attr="risk_class",
        enableorderby="1",
        symbollevels="0",
    )
    _add_categories(renderer, classes, geometry)
    # Drawn by falling rank: the worst, rank 1, last
    order_by = ElementTree.SubElement(renderer, "orderby")
    order = ElementTree.SubElement(order_by, "orderByClause", asc="0", nullsFirst="0")
    order.text = '"rank"'
    return _document(root, geometry, aliases)


def single_style(
    geometry: str,
    colour: str,
    aliases: Mapping[str, str] = MappingProxyType({}),
    marker: str = "triangle",
) -> str:
    """
    Return a style with one open symbol for all features, as of stations and areas.

    Parameters
    ----------
    geometry : str
        Type of the layer.
    colour : str
        Colour of the outline, hexadecimal.
    aliases : mapping of str to str
        Column -> name with unit.
    marker : str
        Shape of points, as QGIS names it.
    """
    root = _root()
    renderer = ElementTree.SubElement(root, "renderer-v2", type="singleSymbol", symbollevels="0")
    symbols = ElementTree.SubElement(renderer, "symbols")
    # Open symbols cover no pair
    kind = _KINDS[geometry][1]
    options = {
        "marker": {"name": marker, "size": "2.8", "color": "255,255,255,0"},
        "line": {"line_width": "0.4"},
        "fill": {"style": "no", "outline_width": "0.4"},
    }[kind]
    outline = "line_color" if kind == "line" else "outline_color"
    _add_symbol(symbols, "0", geometry, options | {outline: _rgba(colour)})
    return _document(root, geometry, aliases)


def form_style() -> str:
    """Return the style of the inspections: a square beside its pair, and how fields are asked."""
    root = ElementTree.fromstring(
        single_style("Point", "#0057b8", QUESTIONS, "square").removeprefix(DOCTYPE)
    )
    add_form(root)
    return DOCTYPE + ElementTree.tostring(root, encoding="unicode")


def _root() -> ElementTree.Element:
    """Return the root of a style."""
    categories = "Symbology|Fields|Forms"
    return ElementTree.Element("qgis", version=VERSION, styleCategories=categories)


def _document(root: ElementTree.Element, geometry: str, aliases: Mapping[str, str]) -> str:
    """Return a style as text, with the aliases of its columns."""
    # Fields are found by their names, their places are those of the table
    listed = ElementTree.SubElement(root, "aliases")
    for index, (field, alias) in enumerate(aliases.items()):
        facts = {"field": printable(field), "index": str(index), "name": printable(alias)}
        ElementTree.SubElement(listed, "alias", facts)
    ElementTree.SubElement(root, "layerGeometryType").text = _KINDS[geometry][0]
    return DOCTYPE + ElementTree.tostring(root, encoding="unicode")


def _add_categories(renderer: ElementTree.Element, classes: Sequence[str], geometry: str) -> None:
    """Add a category and its symbol for each risk class and for pairs without one."""
    categories = ElementTree.SubElement(renderer, "categories")
    symbols = ElementTree.SubElement(renderer, "symbols")
    for number, (name, colour) in enumerate(class_colours(classes).items()):
        # Size changes evenly from the worst to the mildest class
        share = min(number / max(len(classes) - 1 - (NO_VERDICT in classes), 1), 1.0)
        size = LARGEST + share * (SMALLEST - LARGEST)
        facts = {"value": printable(name), "label": printable(name)}
        facts |= {"symbol": str(number), "render": "true"}
        ElementTree.SubElement(categories, "category", facts)
        _add_symbol(symbols, str(number), geometry, *_options(geometry, colour, size))


def _options(geometry: str, colour: str, size: float) -> list[dict[str, str]]:
    """Return the options of each layer of a symbol of a colour (hexadecimal) and a size, mm."""
    dark, fill = "35,35,35,255", _rgba(colour)
    if _KINDS[geometry][1] == "line":
        # A wider dark line below; round ends: pairs are dots on the map of a town
        widths = {dark: size + 2.0 * EDGE, fill: size}
        return [
            {"line_color": line, "line_width": f"{width:.2f}", "capstyle": "round"}
            for line, width in widths.items()
        ]
    common = {"color": fill, "outline_color": dark, "outline_width": "0.1"}
    if _KINDS[geometry][1] == "fill":
        return [common | {"color": _rgba(colour, OPACITY), "style": "solid"}]
    return [common | {"name": "circle", "size": f"{size:.2f}", "size_unit": "MM"}]


def _rgba(colour: str, opacity: int = 255) -> str:
    """Return a hexadecimal colour as QGIS takes it: red, green, blue and opacity, 0 to 255."""
    parts = [int(colour[start : start + 2], 16) for start in (1, 3, 5)]
    return ",".join(map(str, [*parts, opacity]))


def _add_symbol(
    symbols: ElementTree.Element, name: str, geometry: str, *layers: Mapping[str, str]
) -> None:
    """Add a symbol of layers with these options, the lowest first."""
    _, kind, layer_class, _ = _KINDS[geometry]
    symbol = ElementTree.SubElement(
        symbols, "symbol", type=kind, name=name, alpha="1", clip_to_extent="1"
    )
    for options in layers:
        layer = ElementTree.SubElement(
            symbol, "layer", {"class": layer_class, "enabled": "1", "locked": "0", "pass": "0"}
        )
        # Options as QGIS stores them since version 3.22
        mapping = ElementTree.SubElement(layer, "Option", type="Map")
        for option, value in options.items():
            ElementTree.SubElement(mapping, "Option", type="QString", name=option, value=value)


def column_aliases(columns: Iterable[str], units: Mapping[str, str]) -> dict[str, str]:
    """
    Return names with units, of columns whose unit is known.

    Examples
    --------
    >>> column_aliases(["gap", "pair_id", "expected_impact_velocity"], {"gap": "m"})
    {'gap': 'gap (m)', 'pair_id': 'pair id', 'expected_impact_velocity': 'expected impact velocity'}
    """
    units = {name: f" ({unit})" for name, unit in units.items() if unit not in ("", "1")}
    return {name: name.replace("_", " ") + units.get(name, "") for name in columns}


#: WGS 84 as projects describe it; the authority's name implies longitude and latitude.
_REFERENCE = {
    "proj4": "+proj=longlat +datum=WGS84 +no_defs",
    "srsid": "3452",
    "srid": "4326",
    "authid": "EPSG:4326",
    "description": "WGS 84",
    "projectionacronym": "longlat",
    "ellipsoidacronym": "EPSG:7030",
    "geographicflag": "true",
}


class ProjectLayer(NamedTuple):
    """
    A layer of the GeoPackage.

    Attributes
    ----------
    name : str
        Of the layer.
    geometry : str
        ``Point``, ``LineString``, ``Polygon`` or ``MultiPolygon``.
    style : str
        QML document.
    """

    name: str
    geometry: str
    style: str


def write_project(
    title: str,
    data: str,
    layers: Sequence[ProjectLayer],
    extent: tuple[float, float, float, float],
    path: Path,
) -> None:
    """
    Write a project, whole or not at all.

    Parameters
    ----------
    title : str
        Name of the run.
    data : str
        Name of the GeoPackage in the folder of the project: both can be moved together.
    layers : sequence of ProjectLayer
        The first is drawn on top.
    extent : tuple of float
        West, south, east, north of the first view, degrees.
    path : Path
        ``.qgz``.
    """
    root = ElementTree.Element("qgis", version=VERSION, projectname=printable(title))
    ElementTree.SubElement(root, "homePath", path="")
    ElementTree.SubElement(root, "title").text = printable(title)
    _add_reference(ElementTree.SubElement(root, "projectCrs"))
    tree = ElementTree.SubElement(root, "layer-tree-group")
    _add_view(root, extent)
    # Each layer is in the tree, among the described layers and in their order
    described = ElementTree.SubElement(root, "projectlayers")
    order = ElementTree.SubElement(root, "layerorder")
    for layer in layers:
        _add_layer(tree, described, order, layer, f"./{data}|layername={layer.name}")
    _add_properties(root)
    document = DOCTYPE + ElementTree.tostring(root, encoding="unicode")
    # The same project has the same bytes: entries of an archive have a fixed date
    entry = zipfile.ZipInfo(f"{path.stem}.qgs", (1980, 1, 1, 0, 0, 0))
    with written_whole(path) as part, zipfile.ZipFile(part, "w") as archive:
        archive.writestr(entry, document.encode(), zipfile.ZIP_DEFLATED)


def _add_properties(root: ElementTree.Element) -> None:
    """Set relative paths and the use of a coordinate reference system."""
    properties = ElementTree.SubElement(root, "properties")
    paths = ElementTree.SubElement(properties, "Paths")
    ElementTree.SubElement(paths, "Absolute", type="bool").text = "false"
    # Without this QGIS ignores the reference system of the project
    system = ElementTree.SubElement(properties, "SpatialRefSys")
    ElementTree.SubElement(system, "ProjectionsEnabled", type="int").text = "1"


def _add_view(root: ElementTree.Element, extent: tuple[float, float, float, float]) -> None:
    """Add the initial extent of the map."""
    view = ElementTree.SubElement(root, "mapcanvas", name="theMapCanvas", annotationsVisible="1")
    ElementTree.SubElement(view, "units").text = "degrees"
    corners = ElementTree.SubElement(view, "extent")
    # West, south, east, north
    for name, value in zip(("xmin", "ymin", "xmax", "ymax"), extent, strict=True):
        ElementTree.SubElement(corners, name).text = repr(float(value))
    _add_reference(ElementTree.SubElement(view, "destinationsrs"))


def _add_reference(parent: ElementTree.Element) -> None:
    """Add the coordinate reference system."""
    system = ElementTree.SubElement(parent, "spatialrefsys", nativeFormat="Wkt")
    for name, text in _REFERENCE.items():
        ElementTree.SubElement(system, name).text = text


def _add_layer(
    tree: ElementTree.Element,
    described: ElementTree.Element,
    order: ElementTree.Element,
    layer: ProjectLayer,
    source: str,
) -> None:
    """Add a layer to the tree, to the described layers with its style, and to their order."""
    identifier = f"per_obspy_{layer.name}"
    facts = {"id": identifier, "name": layer.name, "providerKey": "ogr", "source": source}
    ElementTree.SubElement(
        tree, "layer-tree-layer", facts | {"checked": "Qt::Checked", "expanded": "1"}
    )
    ElementTree.SubElement(order, "layer", id=identifier)
    facts = {"type": "vector", "geometry": _KINDS[layer.geometry][3]}
    element = ElementTree.SubElement(described, "maplayer", facts)
    ElementTree.SubElement(element, "id").text = identifier
    ElementTree.SubElement(element, "datasource").text = source
    ElementTree.SubElement(element, "layername").text = layer.name
    _add_reference(ElementTree.SubElement(element, "srs"))
    ElementTree.SubElement(element, "provider", encoding="UTF-8").text = "ogr"
    # Symbols and aliases as in the style
    style = ElementTree.fromstring(layer.style.removeprefix(DOCTYPE))
    element.extend(style)
