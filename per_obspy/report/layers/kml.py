"""Worst pairs as KML, for globe viewers and telephones."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pandas as pd

from per_obspy.errors import printable, shortened
from per_obspy.files import written_whole
from per_obspy.inventory.places import with_towns
from per_obspy.report.style import class_colours
from per_obspy.report.words import name_text, pair_lines

#: Longitude and latitude of both buildings.
BOTH_PLACES = ("longitude_1", "latitude_1", "longitude_2", "latitude_2")


def has_both_places(columns: Iterable[str]) -> bool:
    """Return whether a table has the places of both buildings."""
    return set(BOTH_PLACES) <= set(columns)


#: Namespace of KML 2.2 (OGC 07-147r2).
NAMESPACE = "http://www.opengis.net/kml/2.2"

#: Pairs of the file: viewers are slow with many more.
ROWS = 1000

#: Letters of markup, and how HTML writes them.
_LETTERS = str.maketrans({"&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;", "$": "&#36;"})


def write_kml(
    worst: pd.DataFrame, classes: Sequence[str], title: str, path: Path, note: str = ""
) -> None:
    """
    Write the worst pairs, in the colours of their classes, whole or not at all.

    Texts of an inventory are never markup: balloons show them letter by letter.

    Parameters
    ----------
    worst : DataFrame
        Rows of the risk table, worst first; those after the first ``ROWS`` are left out.
    classes : sequence of str
        Names of the risk classes, worst first.
    title : str
        Name of the run.
    path : Path
        ``.kml``.
    note : str
        Sentence on the pairs that the file leaves out.
    """
    root = ElementTree.Element("kml", xmlns=NAMESPACE)
    document = ElementTree.SubElement(root, "Document")
    ElementTree.SubElement(document, "name").text = shortened(title, 200)
    if note:
        ElementTree.SubElement(document, "description").text = _as_html(note)
    # One style per class
    styles = dict[str, str]()
    for number, (name, colour) in enumerate(class_colours(classes).items()):
        styles[name] = f"#class{number}"
        _add_style(document, f"class{number}", colour)
    # Balloons with numbers, and shapes
    for row in _with_places(worst.head(ROWS)).to_dict("records"):
        pair = {str(name): value for name, value in row.items()}
        mark = _add_mark(document, pair, styles)
        _add_shape(mark, pair, has_both_places(worst.columns))
    with written_whole(path) as part:
        ElementTree.ElementTree(root).write(part, encoding="utf-8", xml_declaration=True)


def _with_places(pairs: pd.DataFrame) -> pd.DataFrame:
    """Return pairs with the nearest town where the inventory names no place."""
    # All at once, which takes a tenth of one search per pair
    place = pairs["place"] if "place" in pairs else [""] * len(pairs)
    return pairs.assign(place=with_towns(place, pairs["longitude"], pairs["latitude"]))


def _add_mark(
    document: ElementTree.Element, pair: dict[str, Any], styles: dict[str, str]
) -> ElementTree.Element:
    """Add a pair with its name, its numbers in words and its style."""
    mark = ElementTree.SubElement(document, "Placemark")
    ElementTree.SubElement(mark, "name").text = name_text(pair["pair_id"])
    # A balloon takes a description for HTML
    text = "<br/>".join(_as_html(line) for line in pair_lines(pair))
    ElementTree.SubElement(mark, "description").text = text
    if style := styles.get(str(pair["risk_class"])):
        ElementTree.SubElement(mark, "styleUrl").text = style
    return mark


def _as_html(line: str) -> str:
    """Return a line with HTML markup escaped."""
    return printable(line).translate(_LETTERS)


def _add_style(document: ElementTree.Element, name: str, colour: str) -> None:
    """Add the style of a class; KML has opacity, blue, green, red."""
    red, green, blue = colour[1:3], colour[3:5], colour[5:7]
    style = ElementTree.SubElement(document, "Style", id=name)
    # Pairs are points from far away and lines from near
    for kind, sizes in (("IconStyle", {"scale": "0.6"}), ("LineStyle", {"width": "5"})):
        element = ElementTree.SubElement(style, kind)
        ElementTree.SubElement(element, "color").text = f"ff{blue}{green}{red}".lower()
        for size, value in sizes.items():
            ElementTree.SubElement(element, size).text = value
    ElementTree.SubElement(ElementTree.SubElement(style, "LabelStyle"), "scale").text = "0"


def _add_shape(mark: ElementTree.Element, pair: dict[str, Any], line: bool) -> None:
    """Add the line between both buildings with a point in its middle, or the point only."""
    parent = ElementTree.SubElement(mark, "MultiGeometry") if line else mark
    point = ElementTree.SubElement(parent, "Point")
    place = f"{pair['longitude']:.7f},{pair['latitude']:.7f}"
    ElementTree.SubElement(point, "coordinates").text = place
    # From near both buildings are seen
    if line:
        ends = (f"{pair[f'longitude_{i}']:.7f},{pair[f'latitude_{i}']:.7f}" for i in (1, 2))
        element = ElementTree.SubElement(parent, "LineString")
        ElementTree.SubElement(element, "coordinates").text = " ".join(ends)
