"""
OpenStreetMap: tags as columns, or together in one column.

GDAL gives further tags in ``other_tags`` (hstore text or JSON), Overpass and QuackOSM in ``tags``
(JSON or a map). Heights are metres unless they have a unit; feet and inches are written ``7'4"``.
``building:levels`` counts storeys above ground without those in the roof. Materials are known, not
structural systems.

Source: OpenStreetMap wiki, "Key:height" and "Key:building:levels"; GDAL, driver "OSM".
"""

import json
import re

import pandas as pd

from per_obspy.inventory.importers.importer import Importer

FOOT, INCH = 0.3048, 0.0254

#: Tags that are looked for inside a column of several.
TAGS = ("height", "building:levels", "building")

#: Columns of several tags.
TAG_COLUMNS = ("other_tags", "tags")

_NUMBER = r"(?P<number>[0-9]{1,6}(?:\.[0-9]{1,6})?)"
_METRES = re.compile(rf"{_NUMBER} ?m(?:et(?:er|re)s?)?")
_FEET = re.compile(rf"{_NUMBER} ?(?:ft|feet|foot)")
_FEET_AND_INCHES = re.compile(
    r"(?P<feet>[0-9]{1,5})'(?:(?P<inches>[0-9]{1,2}(?:\.[0-9]{1,3})?)\")?"
)
_HSTORE = re.compile(r'"(?P<key>(?:[^"\\]|\\.)*)"=>"(?P<value>(?:[^"\\]|\\.)*)"')


def metres(text: object) -> object:
    """
    Return a height in m where the text has a unit; any other value is returned as it is.

    Examples
    --------
    >>> metres("12.5 m"), round(metres("20 ft"), 3), round(metres("7'4" + chr(34)), 3)
    (12.5, 6.096, 2.235)
    >>> metres("12;15")
    '12;15'
    """
    # Metres, feet, feet and inches
    words = str(text).strip().lower()
    if found := _METRES.fullmatch(words):
        return float(found["number"])
    if found := _FEET.fullmatch(words):
        return float(found["number"]) * FOOT
    if found := _FEET_AND_INCHES.fullmatch(words):
        return float(found["feet"]) * FOOT + float(found["inches"] or 0.0) * INCH
    return text


def tags_of(cell: object) -> dict[str, object]:
    """
    Return the tags in a cell of several: JSON, hstore text, or pairs as Python prints them.

    Examples
    --------
    >>> tags_of('"height"=>"9 m","building:levels"=>"3"')
    {'height': '9 m', 'building:levels': '3'}
    >>> tags_of('{"height": "9"}'), tags_of(None), tags_of("{")
    ({'height': '9'}, {}, {})
    """
    if not isinstance(cell, str):
        return {}
    if cell.lstrip().startswith("{"):
        try:
            found = json.loads(cell)
        except (ValueError, RecursionError):
            return {}
        return found if isinstance(found, dict) else {}
    return {found["key"]: found["value"] for found in _HSTORE.finditer(cell)}


def adapted(attributes: pd.DataFrame) -> pd.DataFrame:
    """Return the attributes with the known tags as columns, and heights in m."""
    table = attributes.copy()
    # Tags that stand together in one column
    for column in TAG_COLUMNS:
        if column in table:
            cells = [tags_of(cell) for cell in table[column]]
            for tag in TAGS:
                found = pd.Series([tags.get(tag) for tags in cells], table.index, dtype=object)
                table[tag] = table[tag].astype(object).fillna(found) if tag in table else found
    if "height" in table:
        table["height"] = table["height"].map(metres)
    # Ways have one identifier in GDAL's layers, relations another
    if "osm_way_id" in table:
        way = "w" + table["osm_way_id"].astype(str)
        given = table["osm_id"] if "osm_id" in table else pd.Series(None, table.index, dtype=object)
        table["osm_id"] = given.fillna(way.mask(table["osm_way_id"].isna()))
    for name in ("@id", "osmid", "feature_id"):
        if name in table and "osm_id" not in table:
            table["osm_id"] = table[name]
    return table


OPENSTREETMAP = Importer(
    name="OpenStreetMap",
    needed=(
        ("building:levels",),
        ("osm_id", "building"),
        ("osm_way_id", "building"),
        ("osm_id", "other_tags"),
        ("@id", "building"),
        ("osmid", "building"),
        ("feature_id", "tags"),
        ("type", "id", "tags"),
    ),
    columns={"building_id": "osm_id", "height": "height", "storeys": "building:levels"},
    carried=("building",),
    class_column="building",
    adapted=adapted,
)
