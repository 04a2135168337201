"""
OpenStreetMap: tags as columns, or together in one column.

GDAL gives further tags in ``other_tags`` (hstore text or JSON), Overpass and QuackOSM in ``tags``
(JSON or a map). Heights are metres unless they have a unit, which is read as that of any length.
``building:levels`` counts storeys above ground without those in the roof. Materials are known, not
structural systems.

Source: OpenStreetMap wiki, "Key:height" and "Key:building:levels"; GDAL, driver "OSM".
"""

import json
import re

import pandas as pd

from per_obspy.inventory.importers.importer import Importer

#: Tags that are looked for inside a column of several.
TAGS = ("height", "building:levels", "building")

#: Columns of several tags.
TAG_COLUMNS = ("other_tags", "tags")

_HSTORE = re.compile(r'"(?P<key>(?:[^"\\]|\\.)*)"=>"(?P<value>(?:[^"\\]|\\.)*)"')


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
    """Return the attributes with the known tags as columns, and one identifier."""
    table = attributes.copy()
    # Tags that are together in one column
    for column in TAG_COLUMNS:
        if column in table:
            cells = [tags_of(cell) for cell in table[column]]
            for tag in TAGS:
                found = pd.Series([tags.get(tag) for tags in cells], table.index, dtype=object)
                table[tag] = table[tag].astype(object).fillna(found) if tag in table else found
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
