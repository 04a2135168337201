"""Styles of QGIS (QML): colour by severity, the worst on top, and names of columns with units."""

from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from xml.etree import ElementTree

from per_obspy.errors import printable
from per_obspy.report.style import class_colours

#: First line of the XML files of QGIS.
DOCTYPE = "<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>\n"

#: Version of QGIS whose XML this is: a long-term release, which later ones read without a warning.
VERSION = "3.22.16"

#: Diameter of a marker or width of a line, worst and mildest class, millimetres on the screen.
LARGEST, SMALLEST = 2.6, 1.2

#: Width of the dark edge of a line, millimetres, and opacity of a building, 0 to 255: a pair is
#: visible on buildings of its class.
EDGE, OPACITY = 0.25, 150

#: Geometry of a layer -> its number in QML, kind of symbol, and class of the symbol's layer.
_KINDS = {
    "Point": ("0", "marker", "SimpleMarker"),
    "LineString": ("1", "line", "SimpleLine"),
    "Polygon": ("2", "fill", "SimpleFill"),
    "MultiPolygon": ("2", "fill", "SimpleFill"),
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
    geometry: str, colour: str, aliases: Mapping[str, str] = MappingProxyType({})
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
    """
    root = _root()
    renderer = ElementTree.SubElement(root, "renderer-v2", type="singleSymbol", symbollevels="0")
    symbols = ElementTree.SubElement(renderer, "symbols")
    # Open symbols cover no pair
    kind = _KINDS[geometry][1]
    options = {
        "marker": {"name": "triangle", "size": "2.8", "color": "255,255,255,0"},
        "line": {"line_width": "0.4"},
        "fill": {"style": "no", "outline_width": "0.4"},
    }[kind]
    outline = "line_color" if kind == "line" else "outline_color"
    _add_symbol(symbols, "0", geometry, options | {outline: _rgba(colour)})
    return _document(root, geometry, aliases)


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
    """Add a category and its symbol for each risk class, and for pairs of unknown gap."""
    categories = ElementTree.SubElement(renderer, "categories")
    symbols = ElementTree.SubElement(renderer, "symbols")
    for number, (name, colour) in enumerate(class_colours(classes).items()):
        # Size changes evenly from the worst to the mildest class
        share = min(number / max(len(classes) - 1, 1), 1.0)
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
    _, kind, layer_class = _KINDS[geometry]
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
