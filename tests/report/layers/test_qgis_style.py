"""Styles: one symbol per class, the worst on top, whatever the names are."""

from xml.etree import ElementTree

import pytest

from per_obspy.report.layers.qgis import class_style, single_style

CLASSES = ("severe", "high", "low")


@pytest.mark.parametrize(
    ("geometry", "size", "colour"),
    [("Point", "size", "color"), ("LineString", "line_width", "line_color")],
)
def test_every_class_has_a_mark_of_its_own_and_the_worst_is_on_top(geometry, size, colour):
    root = ElementTree.fromstring(class_style(CLASSES, geometry))
    categories = [(c.get("value"), c.get("symbol")) for c in root.iter("category")]
    assert categories == [*zip([*CLASSES, "gap unknown"], "0123", strict=True)]
    marks = [
        {o.get("name"): o.get("value") for o in symbol.iter("Option") if o.get("name")}
        for symbol in root.iter("symbol")
    ]
    assert [symbol.get("name") for symbol in root.iter("symbol")] == [*"0123"]
    assert len({mark[colour] for mark in marks}) == 4
    assert marks[0][colour] == "127,0,0,255"  # dark red of style.SEVERITY_COLOURS
    assert float(marks[0][size]) > float(marks[2][size])
    # drawn by falling rank: the worst, rank 1, last
    order = next(root.iter("orderByClause"))
    assert (order.text, order.get("asc")) == ('"rank"', "0")


def test_buildings_are_filled_and_areas_and_stations_are_open():
    (symbol, *_) = ElementTree.fromstring(class_style(CLASSES, "MultiPolygon")).iter("symbol")
    assert symbol.get("type") == "fill"
    for geometry, name in (("Polygon", "style"), ("Point", "color")):
        root = ElementTree.fromstring(single_style(geometry, "#232323"))
        options = {o.get("name"): o.get("value") for o in root.iter("Option")}
        assert options[name] in ("no", "255,255,255,0")


@pytest.mark.parametrize("name", ['<"grave" & more>', "\u202e\x00<script>", "x" * 10_000])
def test_a_class_and_a_column_may_have_any_name(name):
    root = ElementTree.fromstring(class_style([name], "Point", {name: name}))
    # control characters have no place in XML
    expected = name.replace("\u202e", " ").replace("\x00", " ")
    assert next(root.iter("category")).get("value") == expected
    assert next(root.iter("alias")).get("name") == expected
