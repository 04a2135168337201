"""Foreign column names and codes of footprint layers, one small table a source."""

from typing import NamedTuple

import numpy as np
import pandas as pd

from per_obspy.errors import CatalogError, did_you_mean


class Importer(NamedTuple):
    """
    How one source names what the pair table needs.

    Attributes
    ----------
    name : str
        The source.
    needed : tuple of str
        Columns by which a layer of this source is recognised.
    columns : dict
        Our name of a building's quantity -> the source's column. Absent columns are no fault.
    systems : dict
        The source's codes of a structural system, material and lateral system joined by a blank ->
        one of ours; others stay empty and are derived.
    system_columns : tuple of str
        Where the source keeps material and lateral system; empty if it does not.
    carried : tuple of str
        Columns to carry along unchanged.
    """

    name: str
    needed: tuple[str, ...]
    columns: dict[str, str]
    systems: dict[str, str]
    system_columns: tuple[str, ...]
    carried: tuple[str, ...] = ()


_OUR_NAMES = (
    "building_id",
    "height",
    "storeys",
    "storey_height",
    "period",
    "damping",
    "mass",
    "occupants",
    "importance",
)

#: SeismicBuildingExposure (surveys of Guatemala, San Jose). Its ``floor_height`` is in metres in
#: one city and in decimetres in another, and ``height`` is there, so it is not used.
#: ``pounding_effect`` is the surveyor's judgement of what may happen, no observation. Infilled
#: frames and walls have periods of ``other``.
SEISMIC_BUILDING_EXPOSURE = Importer(
    "SeismicBuildingExposure",
    ("n_storeys", "touches_left", "touches_right", "llrs"),
    {"building_id": "id", "height": "height", "storeys": "n_storeys", "occupants": "n_residents"},
    {
        "CR LFM": "concrete_mrf",
        "S_frame LFM": "steel_mrf",
        "S LFM": "steel_mrf",
        "S LFBR": "ebf_brbf",
    }
    | {
        f"{material} {resisting}": "other"
        for material in ("M", "ADO", "CR", "W")
        for resisting in ("LWAL", "LFINF")
    },
    ("structural_system", "llrs"),
    (
        "touches_left",
        "touches_right",
        "touches_back",
        "pounding_effect",
        "relative_position",
        "soil_type",
    ),
)

#: OpenStreetMap, as GDAL and the usual extracts name its tags; it knows materials, not structural
#: systems.
OPENSTREETMAP = Importer(
    "OpenStreetMap",
    ("building:levels",),
    {"building_id": "osm_id", "height": "height", "storeys": "building:levels"},
    {},
    (),
    ("building",),
)

#: Our own names; also for layers of which only some columns are known.
OWN = Importer("per_obspy", (), {name: name for name in _OUR_NAMES}, {}, ())

IMPORTERS = (SEISMIC_BUILDING_EXPOSURE, OPENSTREETMAP, OWN)


def imported(attributes: pd.DataFrame, source: str) -> pd.DataFrame:
    """
    Return the attributes of buildings under our names, and after them the columns to carry along.

    Parameters
    ----------
    attributes : DataFrame
        As the layer has them, one row a footprint; the index is the number of the feature.
    source : str
        The file, for messages.

    Raises
    ------
    CatalogError
        If nothing tells how high a building is.
    """
    importer = next(one for one in IMPORTERS if set(one.needed) <= set(attributes.columns))
    found = {
        ours: attributes[theirs]
        for ours, theirs in importer.columns.items()
        if theirs in attributes.columns
    }
    if not {"height", "storeys", "period"} & set(found):
        columns = ", ".join(map(str, attributes.columns)) or "none"
        asked = next(
            filter(
                None,
                (
                    did_you_mean(name, map(str, attributes.columns))
                    for name in ("height", "storeys")
                ),
            ),
            "",
        )
        raise CatalogError(
            source,
            f"no column height, storeys or period in the layer (columns found: {columns:.200}){asked}",
        )
    table = pd.DataFrame(found, index=attributes.index)
    if "system" in attributes.columns and not importer.systems:
        table["system"] = attributes["system"].fillna("")
    elif set(importer.system_columns) <= set(attributes.columns) and importer.systems:
        material, resisting = (
            attributes[name].fillna("").astype(str) for name in importer.system_columns
        )
        codes = material + " " + resisting
        table["system"] = codes.map(importer.systems).fillna("")
    carried = [name for name in importer.carried if name in attributes.columns]
    table["building_id"] = _identifiers(table)
    return table.join(attributes[carried])


def _identifiers(table: pd.DataFrame) -> pd.Series:
    """Return identifiers as text: whole numbers without a decimal point, and the feature's number where none is."""
    numbers = pd.Series([f"feature {number}" for number in table.index], index=table.index)
    if "building_id" not in table:
        return numbers
    given = table["building_id"]
    if pd.api.types.is_float_dtype(given) and (given.dropna() % 1 == 0).all():
        given = given.astype("Int64")
    text = given.astype(str).str.strip()
    return text.mask(np.asarray(given.isna()) | (text == ""), numbers)
