"""Column names and codes of footprint layers from other sources, one small table per source."""

from typing import NamedTuple

import numpy as np
import pandas as pd

from per_obspy.errors import CatalogError, did_you_mean


class Importer(NamedTuple):
    """
    Names and codes of one source for the columns of the pair table.

    Attributes
    ----------
    name : str
        The source.
    needed : tuple of str
        Columns by which a layer of this source is recognised.
    columns : dict
        Name of a building's quantity in the schema -> the source's column, which may be absent.
    systems : dict
        The source's code, material and lateral system joined by a blank -> structural system of the
        schema; other codes stay empty and are derived.
    system_columns : tuple of str
        The source's columns of material and lateral system; empty if it has none.
    carried : tuple of str
        Columns to carry along unchanged.
    """

    name: str
    needed: tuple[str, ...]
    columns: dict[str, str]
    systems: dict[str, str]
    system_columns: tuple[str, ...]
    carried: tuple[str, ...] = ()


#: Quantities of a building that a layer may give under the names of the schema.
_SCHEMA_NAMES = (
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
#: one city and in decimetres in another; it is not used, because there is ``height``.
#: ``pounding_effect`` is the surveyor's judgement of a possibility, no observation. Infilled frames
#: and walls have periods of ``other``.
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

#: Names of the schema; also for layers of which only some columns are known.
OWN = Importer("per_obspy", (), {name: name for name in _SCHEMA_NAMES}, {}, ())

#: In the order in which a layer is recognised; the last one fits every layer.
IMPORTERS = (SEISMIC_BUILDING_EXPOSURE, OPENSTREETMAP, OWN)


def imported(attributes: pd.DataFrame, source: str) -> pd.DataFrame:
    """
    Return the attributes of buildings under the schema's names, then the columns to carry along.

    Parameters
    ----------
    attributes : DataFrame
        One row per footprint with the layer's columns; the index is the number of the feature.
    source : str
        The file, for messages.

    Raises
    ------
    CatalogError
        If the layer has neither height nor storeys nor period.
    """
    names = set(attributes.columns)
    importer = next(importer for importer in IMPORTERS if set(importer.needed) <= names)
    # Columns that the layer has
    columns = {
        name: attributes[column] for name, column in importer.columns.items() if column in names
    }
    if not {"height", "storeys", "period"} & set(columns):
        raise CatalogError(source, _no_height(attributes))
    table = pd.DataFrame(columns, index=attributes.index)
    # Structural systems by name or by code
    if "system" in names and not importer.systems:
        table["system"] = attributes["system"].fillna("")
    elif set(importer.system_columns) <= names and importer.systems:
        table["system"] = _coded_systems(attributes, importer)
    carried = [name for name in importer.carried if name in names]
    table["building_id"] = _identifiers(table)
    return table.join(attributes[carried])


def _no_height(attributes: pd.DataFrame) -> str:
    """Return the message for a layer without heights, with a similar column if there is one."""
    columns = list(map(str, attributes.columns))
    suggestion = did_you_mean("height", columns) or did_you_mean("storeys", columns)
    found = ", ".join(columns) or "none"
    problem = "no column height, storeys or period in the layer"
    return f"{problem} (columns found: {found:.200}){suggestion}"


def _coded_systems(attributes: pd.DataFrame, importer: Importer) -> pd.Series:
    """Return structural systems from the codes of material and lateral system, "" if unknown."""
    material, lateral = (
        attributes[name].fillna("").astype(str) for name in importer.system_columns
    )
    return (material + " " + lateral).map(importer.systems).fillna("")


def _identifiers(table: pd.DataFrame) -> pd.Series:
    """Return identifiers as text, and the number of the feature where a building has none."""
    numbers = pd.Series([f"feature {number}" for number in table.index], index=table.index)
    if "building_id" not in table:
        return numbers
    given = table["building_id"]
    # Whole numbers that were stored as floats lose their decimal point
    if pd.api.types.is_float_dtype(given) and (given.dropna() % 1 == 0).all():
        given = given.astype("Int64")
    text = given.astype(str).str.strip()
    return text.mask(np.asarray(given.isna()) | (text == ""), numbers)
