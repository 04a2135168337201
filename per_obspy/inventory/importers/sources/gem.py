"""
GEM exposure: buildings whose column ``taxonomy`` has a string of the GEM Building Taxonomy.

A string has attributes separated by ``/`` and details of one attribute by ``+``; attributes of
version 2.0 are in a fixed order, those of 3.x are not, so that each is known by its code. Storeys
above ground are ``HEX:4`` (exact), ``HAPP:4`` (approximate), ``HBET:6,3`` (range, upper bound
first), and in 3.x ``H:4`` and ``HBET:3-6``. Storeys in a range have the geometric mean of its ends
and the logarithmic deviation of an even distribution between them.

Source: GEM Building Taxonomy version 2.0 (Brzev et al. 2013, GEM Technical Report 2013-02); GEM
glossary, https://taxonomy.openquake.org; GED4ALL, version 3.
"""

import math
import re
from typing import NamedTuple

import pandas as pd

from per_obspy.inventory.importers.importer import Importer

#: Longest string that is taken apart, characters.
LONGEST = 500

_EXACT = re.compile(r"(?:H|HEX|HAPP):([0-9]{1,3})")
_RANGE = re.compile(r"(?:H|HBET):([0-9]{1,3})[-,]([0-9]{1,3})")

#: Logarithmic deviation of an approximate number of storeys: one of four, as in HAPP:4.
APPROXIMATE = 0.2

#: Codes of the position in the block -> adjoining buildings.
ADJOINING = {"BPD": 0, "BP1": 1, "BP2": 2, "BP3": 3}

#: Material and lateral system -> structural system; infilled frames have periods of ``other``.
SYSTEMS = {
    ("CR", "LFM"): "concrete_mrf",
    ("CR", "LWAL"): "concrete_wall",
    ("CR", "LDUAL"): "concrete_frame_wall",
    ("S", "LFM"): "steel_mrf",
    **{(material, "LFINF"): "other" for material in ("CR", "S", "SRC")},
}

#: Materials whose buildings have periods of ``other``, whatever their lateral system.
OTHER = ("MUR", "MCF", "MR", "M99", "W", "EU", "ER", "E99")


class Taxonomy(NamedTuple):
    """
    Attributes of a building in a taxonomy string.

    Attributes
    ----------
    storeys : float
        Above ground, NaN if unknown.
    log_std : float
        Logarithmic standard deviation of the storeys, NaN if they are exact or unknown.
    system : str
        Structural system of the schema, empty if unknown.
    adjoining : int or None
        Buildings that adjoin it.
    """

    storeys: float
    log_std: float
    system: str
    adjoining: int | None


def parsed(text: object) -> Taxonomy:
    """
    Take a taxonomy string apart; attributes that are not understood are unknown.

    Examples
    --------
    >>> parsed("CR+CIP/LFM+DUC/HEX:4/BP2")
    Taxonomy(storeys=4.0, log_std=nan, system='concrete_mrf', adjoining=2)
    >>> parsed("MUR+CLBRS/LWAL/H:2").storeys
    2.0
    """
    parts = [part.strip() for part in str(text)[:LONGEST].upper().split("/")]
    # First detail of each attribute: its main code
    codes = [part.split("+")[0] for part in parts]
    details = [detail for part in parts for detail in part.split("+")]
    storeys, log_std = _storeys(details)
    adjoining = next((ADJOINING[code] for code in codes if code in ADJOINING), None)
    return Taxonomy(storeys, log_std, _system(codes), adjoining)


def _storeys(details: list[str]) -> tuple[float, float]:
    """Return storeys and their logarithmic deviation, NaN where unknown."""
    for detail in details:
        if found := _EXACT.fullmatch(detail):
            return float(found[1]), APPROXIMATE if detail.startswith("HAPP") else math.nan
        if found := _RANGE.fullmatch(detail):
            low, high = sorted((float(found[1]), float(found[2])))
            if low < 1.0:
                return math.nan, math.nan
            # Even between the logarithms of the ends
            return math.sqrt(low * high), math.log(high / low) / math.sqrt(12.0)
    return math.nan, math.nan


def _system(codes: list[str]) -> str:
    """Return the structural system of material and lateral system, empty if unknown."""
    lateral = next((code for code in codes if code.startswith("L")), "")
    for material in codes:
        if material in OTHER:
            return "other"
        if (material, lateral) in SYSTEMS:
            return SYSTEMS[material, lateral]
    return ""


def adapted(attributes: pd.DataFrame) -> pd.DataFrame:
    """Return the attributes with storeys, system and position in the block of each string."""
    texts = attributes["taxonomy"].astype(str)
    # A portfolio repeats few strings
    known = {text: parsed(text) for text in texts.unique()}
    table = attributes.copy()
    found = texts.map(known)
    table["gem_storeys"] = [row.storeys for row in found]
    table["gem_log_std"] = [row.log_std for row in found]
    table["gem_system"] = [row.system for row in found]
    table["adjoining_buildings"] = [row.adjoining for row in found]
    return table


GEM = Importer(
    name="GEM exposure",
    needed=(("taxonomy",),),
    columns={
        "building_id": "id",
        "height": "height",
        "storeys": "gem_storeys",
        "height_log_std": "gem_log_std",
        "occupants": "night",
    },
    systems={name: name for name in {*SYSTEMS.values(), "other"}},
    system_columns=("gem_system",),
    carried=("taxonomy", "adjoining_buildings"),
    adapted=adapted,
)
