"""
Published sources of buildings: their columns and codes, and rules for cells that need more.

The table of aliases is ``sources.toml``; a layer is recognised by the names of its columns.
"""

import json
import math
import re
import tomllib
from collections.abc import Iterable, Mapping
from functools import cache
from importlib.resources import files
from typing import NamedTuple

import pandas as pd

from per_obspy.inventory.cells import plain_numbers, read_numbers
from per_obspy.inventory.footprints.json_buildings import LENGTH_UNIT


class Origin(NamedTuple):
    """Accuracy of outlines, and of heights from the same images."""

    #: Standard deviation of gaps between two of them, m. Their median is the gap as it is drawn: an
    #: offset of the images moves neighbours alike.
    gap_std: float
    #: Standard deviation of heights, m; 0 of measured ones.
    height_std: float = 0.0


#: How outlines were made -> their accuracy. Reasoned, if nothing else is said:
#: drawn: 0.2 mm on a plan of 1:500, about the finest that it shows; also those of unknown origin.
#: traced by hand from images: places are off by 3 m (OpenStreetMap in Lombardy, Brovelli & Zamboni
#: 2018) to 4 m (in Munich), most of it common to neighbours. Measured: the root mean square of the
#: drawn gaps of neighbours that touch by a survey is 0.15 to 0.5 m (docs/inventories.md).
#: learned from images of 0.3 to 0.5 m: two to three pixels at both walls, and eaves; heights: one
#: storey.
#: coarse, learned from images of 3 m: GlobalBuildingAtlas, whose heights have root mean square
#: errors of 1.5 to 8.9 m by continent (Zhu et al. 2025), here their geometric mean.
ORIGINS = {
    "drawn": Origin(0.1),
    "traced": Origin(0.3),
    "learned": Origin(1.0, 3.0),
    "coarse": Origin(2.0, 3.7),
}

#: Origins whose gaps show no pair to be safe.
LEARNED = ("learned", "coarse")

#: Column of buildings with the origin of their outlines, where it is not drawn.
OUTLINE_SOURCE = "outline_source"


class Source(NamedTuple):
    """Names and codes of one source, as ``sources.toml`` explains them."""

    name: str
    needs: list[list[str]]
    columns: dict[str, str]
    carried: tuple[str, ...] = ()
    class_column: str | None = None
    codes: tuple[str, ...] = ()
    #: Code -> structural system of the schema.
    systems: Mapping[str, str] = {}
    outlines: str = "drawn"
    origin_column: str = ""
    #: Word -> origin of outlines.
    origins: Mapping[str, str] = {}
    heights: str = ""
    #: That forbids commercial use, if it does.
    licence: str = ""


@cache
def sources() -> tuple[Source, ...]:
    """Return all sources in the order in which a layer is recognised; the last fits every layer."""
    table = tomllib.loads(files(__package__).joinpath("sources.toml").read_text("utf-8"))
    read = []
    for entry in table["source"]:
        systems = entry.pop("systems", {})
        by_code = {code: system for system, codes in systems.items() for code in codes}
        # Without words of a source its column has the names of the origins themselves
        origins = entry.pop("origins", {name: [name] for name in ORIGINS})
        by_word = {word: origin for origin, words in origins.items() for word in words}
        read.append(Source(**entry, systems=by_code, origins=by_word))
    return tuple(read)


def outline_origins(cells: pd.DataFrame, source: Source) -> pd.Series:
    """Return how the outline of each building was made, one of ``ORIGINS``."""
    if source.origin_column not in cells:
        return pd.Series(source.outlines, cells.index)
    texts = cells[source.origin_column].fillna("").astype(str).str.lower()

    # The first word of a cell decides: Overture's first dataset is that of the outline
    def origin(text: str) -> str:
        words = [word for word in source.origins if word in text]
        return source.origins[min(words, key=text.find)] if words else source.outlines

    return texts.map({text: origin(text) for text in texts.unique()})


def source_of(names: Iterable[str]) -> Source:
    """
    Return the source of a layer by the names of its columns.

    Examples
    --------
    >>> source_of(["height", "confidence"]).name
    'Microsoft building footprints'
    """
    known = set(names)
    return next(
        source for source in sources() if any(known.issuperset(each) for each in source.needs)
    )


def converted(attributes: pd.DataFrame, source: Source) -> pd.DataFrame:
    """Return the attributes of a layer with the columns that the rule of its source adds."""
    rule = _RULES.get(source.name)
    return attributes if rule is None else rule(attributes.copy(), source)


#: Tags of OpenStreetMap that are looked for in columns of several.
_TAGS, _TAG_COLUMNS = ("height", "building:levels", "building"), ("other_tags", "tags")

#: Tags of OpenStreetMap that say where a building is; a column without any is left out.
_PLACES = ("name", *(f"addr:{part}" for part in (
    "street", "housenumber", "housename", "neighbourhood", "suburb", "district", "city", "full",
)))  # fmt: skip

_HSTORE = re.compile(r'"(?P<key>(?:[^"\\]|\\.)*)"=>"(?P<value>(?:[^"\\]|\\.)*)"')


def tags_of(cell: object) -> dict[str, object]:
    """
    Return the tags in a cell of several: JSON, or text of hstore as GDAL writes it.

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
            tags = json.loads(cell)
        except (ValueError, RecursionError):
            return {}
        return tags if isinstance(tags, dict) else {}
    return {tag["key"]: tag["value"] for tag in _HSTORE.finditer(cell)}


def _with_tags(table: pd.DataFrame, _: Source) -> pd.DataFrame:
    """Return OpenStreetMap's columns with the known tags as columns, and one identifier."""
    # Tags that are together in one column
    for column in _TAG_COLUMNS:
        if column in table:
            cells = [tags_of(cell) for cell in table[column]]
            for tag in (*_TAGS, *_PLACES):
                values = pd.Series([tags.get(tag) for tags in cells], table.index, dtype=object)
                if tag in table:
                    table[tag] = table[tag].astype(object).fillna(values)
                elif tag in _TAGS or values.notna().any():
                    table[tag] = values
    # Ways have one identifier in GDAL's layers, relations another
    if "osm_way_id" in table:
        way = "w" + table["osm_way_id"].astype(str)
        given = table["osm_id"] if "osm_id" in table else pd.Series(None, table.index, dtype=object)
        table["osm_id"] = given.fillna(way.mask(table["osm_way_id"].isna()))
    for name in ("@id", "osmid", "feature_id"):
        if name in table and "osm_id" not in table:
            table["osm_id"] = table[name]
    return table


def _above_ground(table: pd.DataFrame, _: Source) -> pd.DataFrame:
    """Return Overture's columns without the heights of buildings under the ground."""
    if "is_underground" in table:
        below = table["is_underground"].astype(str).str.lower() == "true"
        # Text is no number: the pair is rejected with this word
        for name in ("height", "num_floors"):
            given = table[name] if name in table else pd.Series(None, table.index)
            table[name] = given.astype(object).mask(below, "underground")
    return table


def _people_at_night(table: pd.DataFrame, _: Source) -> pd.DataFrame:
    """Return columns of the National Structure Inventory with the people at night, of any age."""
    if {"pop2amu65", "pop2amo65"} <= set(table):
        table["pop2am"] = plain_numbers(table["pop2amu65"]) + plain_numbers(table["pop2amo65"])
    return table


#: Units of length in m.
_METRES = {"m": 1.0, "meter": 1.0, "metre": 1.0, "cm": 0.01, "ft": 0.3048, "in": 0.0254}


def _in_metres(table: pd.DataFrame, _: Source) -> pd.DataFrame:
    """Return SimCenter's columns with heights in m, each in the unit of its file, if known."""
    name = next((name for name in ("Height", "height") if name in table), None)
    if name is not None:
        # Each building in the unit of its file
        units = table.get(LENGTH_UNIT, pd.Series("", table.index)).astype(str)
        heights = read_numbers("height", table[name]).values
        table["height_m"] = heights * units.str.strip().str.lower().map(_METRES)
    return table


#: Longest string of a taxonomy that is taken apart, characters.
_LONGEST = 500

#: Storeys above ground: HEX:4 (exact), HAPP:4 (approximate), HBET:6,3 (range, upper bound first);
#: in version 3 H:4 and HBET:3-6.
_EXACT = re.compile(r"(?:H|HEX|HAPP):([0-9]{1,3})")
_RANGE = re.compile(r"(?:H|HBET):([0-9]{1,3})[-,]([0-9]{1,3})")

#: Logarithmic deviation of an approximate number of storeys: one of four, as in HAPP:4.
_APPROXIMATE = 0.2

#: Codes of the position in the block -> adjoining buildings.
_ADJOINING = {"BPD": 0, "BP1": 1, "BP2": 2, "BP3": 3}


def taxonomy(text: str, systems: Mapping[str, str]) -> tuple[float, float, str, int | None]:
    """
    Return the attributes of a string of the GEM Building Taxonomy.

    Attributes are separated by ``/``, details of one by ``+``. Those of version 2 are in a fixed
    order, those of version 3 are not, so that each is known by its code; others are unknown.

    Returned are the storeys above ground (the geometric mean of the ends of a range) and their
    logarithmic standard deviation (that of an even distribution in a range), NaN where unknown;
    the code as ``systems`` has it, empty if unknown; the number of adjoining buildings, or None.

    Examples
    --------
    >>> taxonomy("CR+CIP/LFM+DUC/HEX:4/BP2", {"CR LFM": "concrete_mrf"})
    (4.0, nan, 'CR LFM', 2)
    """
    parts = [part.strip() for part in text[:_LONGEST].upper().split("/")]
    # The first detail of an attribute is its main code
    codes = [part.split("+")[0] for part in parts]
    lateral = next((code for code in codes if code.startswith("L")), "")
    known = (key for code in codes for key in (code, f"{code} {lateral}") if key in systems)
    adjoining = next((_ADJOINING[code] for code in codes if code in _ADJOINING), None)
    return *_storeys("+".join(parts).split("+")), next(known, ""), adjoining


def _storeys(details: list[str]) -> tuple[float, float]:
    """Return storeys and their logarithmic deviation, NaN where unknown."""
    for detail in details:
        if exact := _EXACT.fullmatch(detail):
            return float(exact[1]), _APPROXIMATE if detail.startswith("HAPP") else math.nan
        if ends := _RANGE.fullmatch(detail):
            low, high = sorted((float(ends[1]), float(ends[2])))
            if low < 1.0:
                break
            # Even between the logarithms of the ends
            return math.sqrt(low * high), math.log(high / low) / math.sqrt(12.0)
    return math.nan, math.nan


def _by_taxonomy(table: pd.DataFrame, source: Source) -> pd.DataFrame:
    """Return GEM's columns with storeys, system and position in the block of each string."""
    texts = table["taxonomy"].astype(str)
    # A portfolio repeats few strings
    known = {text: taxonomy(text, source.systems) for text in texts.unique()}
    names = ["gem_storeys", "gem_log_std", "gem_code", "adjoining_buildings"]
    return table.assign(**pd.DataFrame(texts.map(known).tolist(), table.index, names))


def _by_masonry(table: pd.DataFrame, _: Source) -> pd.DataFrame:
    """Return the survey with the material of masonry, else the system, as a code."""
    code = table.get("structural_system", pd.Series("", table.index)).fillna("").astype(str)
    material = table.get("llrs_material", code).fillna("").astype(str).str.split("/").str[0]
    return table.assign(masonry_code=code.mask((code == "M") & (material != ""), material))


_RULES = {
    "SeismicBuildingExposure": _by_masonry,
    "OpenStreetMap": _with_tags,
    "Overture Maps": _above_ground,
    "National Structure Inventory": _people_at_night,
    "SimCenter": _in_metres,
    "GEM exposure": _by_taxonomy,
}
