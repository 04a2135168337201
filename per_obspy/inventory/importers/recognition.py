"""Recognition of a layer's source by its columns, and its attributes under the schema's names."""

from collections.abc import Iterable, Mapping

import numpy as np
import pandas as pd

from per_obspy.errors import CatalogError, did_you_mean
from per_obspy.inventory.cells import NOTES, read_numbers
from per_obspy.inventory.importers.class_heights import with_class_heights
from per_obspy.inventory.importers.importer import Importer
from per_obspy.inventory.importers.sources.gem import GEM
from per_obspy.inventory.importers.sources.google import GOOGLE
from per_obspy.inventory.importers.sources.microsoft import MICROSOFT
from per_obspy.inventory.importers.sources.national_structures import NATIONAL_STRUCTURES
from per_obspy.inventory.importers.sources.openstreetmap import OPENSTREETMAP
from per_obspy.inventory.importers.sources.overture import OVERTURE
from per_obspy.inventory.importers.sources.own_names import OWN
from per_obspy.inventory.importers.sources.plateau import CITYGML
from per_obspy.inventory.importers.sources.seismic_building_exposure import (
    SEISMIC_BUILDING_EXPOSURE,
)
from per_obspy.inventory.importers.sources.simcenter import SIMCENTER

#: In the order in which a layer is recognised; the last one fits every layer.
IMPORTERS = (
    SEISMIC_BUILDING_EXPOSURE,
    CITYGML,
    GOOGLE,
    NATIONAL_STRUCTURES,
    SIMCENTER,
    GEM,
    OVERTURE,
    OPENSTREETMAP,
    MICROSOFT,
    OWN,
)

#: Quantities of which a layer must give one, and the one that makes heights of storeys.
_SIZES, _STOREY = ("height", "storeys", "period"), "storey_height"


def recognised(names: Iterable[str]) -> Importer:
    """
    Return the importer of a layer by the names of its columns.

    Examples
    --------
    >>> recognised(["height", "confidence"]).name
    'Microsoft building footprints'
    """
    known = set(names)
    for importer in IMPORTERS:
        if any(known.issuperset(each) for each in importer.needed):
            return importer
    return OWN


def imported(
    attributes: pd.DataFrame, source: str, given: Mapping[str, pd.Series] | None = None
) -> pd.DataFrame:
    """
    Return the attributes of buildings under the schema's names, then the columns to carry along.

    Heights that a layer leaves empty are estimated from buildings of the same class in the layer:
    see :mod:`per_obspy.inventory.importers.class_heights`.

    Parameters
    ----------
    attributes : DataFrame
        One row per footprint with the layer's columns; the index is the number of the feature.
    source : str
        The file, for messages.
    given : mapping of str to Series, optional
        Name in the schema -> column that the user names for it, which takes the place of the
        recognised one.

    Raises
    ------
    CatalogError
        If the layer has neither height nor storeys nor period.
    """
    importer = recognised(map(str, attributes.columns))
    adapted = importer.adapted(attributes)
    table = _named(adapted, importer, given or {})
    names = set(adapted.columns)
    table, notes, placeholders = _with_sizes(table)
    _require_sizes(attributes, table, importer, source, notes)
    # Names of systems and buildings
    if "system" not in table and (systems := _systems(adapted, importer)) is not None:
        table["system"] = systems
    table["building_id"] = _identifiers(table)
    # Missing heights from the classes of the layer
    if importer.class_column is not None:
        unknown = pd.Series("", adapted.index)
        classes = adapted.get(importer.class_column, unknown)
        table = with_class_heights(table, classes, (notes == "").to_numpy())
    table = _with_notes(table, notes, placeholders)
    return table.join(adapted[[name for name in importer.carried if name in names]])


def _with_notes(
    table: pd.DataFrame, notes: pd.Series, placeholders: Mapping[int, str]
) -> pd.DataFrame:
    """Return the table with notes on cells, and on placeholders of buildings without a size."""
    lost = _sizes(table).isna().all(axis=1).to_numpy() & (notes == "").to_numpy()
    # By position
    texts = notes.tolist()
    for row in placeholders.keys() & set(np.flatnonzero(lost).tolist()):
        texts[row] = placeholders[row]
    return table.assign(**{NOTES: texts}) if any(texts) else table


def _sizes(table: pd.DataFrame) -> pd.DataFrame:
    """Return the columns of sizes that a table has."""
    return table[[name for name in _SIZES if name in table]]


def _require_sizes(
    attributes: pd.DataFrame, table: pd.DataFrame, importer: Importer, source: str, notes: pd.Series
) -> None:
    """Raise CatalogError if a layer has no size of any building, not even one to be quoted."""
    sizes = _sizes(table)
    is_empty = len(sizes) and sizes.isna().all(axis=None) and (notes == "").all()
    if sizes.columns.empty or is_empty:
        raise CatalogError(source, _no_height(attributes, importer, not sizes.columns.empty))


def _with_sizes(table: pd.DataFrame) -> tuple[pd.DataFrame, pd.Series, dict[int, str]]:
    """Return sizes as numbers, notes on the cells of each row, and placeholders by row."""
    # By row: what was not understood, and numbers that mean nothing
    notes: list[list[str]] = [[] for _ in range(len(table))]
    placeholders = dict[int, str]()
    for name in (*_SIZES, _STOREY):
        if name in table:
            numbers = read_numbers(name, table[name])
            table[name] = numbers.values
            for row, note in numbers.notes.items():
                notes[row].append(note)
            for row, number in numbers.placeholders.items():
                placeholders[row] = f"{name} = {number:g} is a placeholder, not a size"
    texts = pd.Series(["; ".join(said) for said in notes], table.index, dtype=object)
    return table, texts, placeholders


def _named(
    adapted: pd.DataFrame, importer: Importer, given: Mapping[str, pd.Series]
) -> pd.DataFrame:
    """Return the columns that a layer has, or the user names, under the names of the schema."""
    names = set(adapted.columns)
    found = {name: adapted[column] for name, column in importer.columns.items() if column in names}
    return pd.DataFrame(found | dict(given), index=adapted.index)


def _systems(attributes: pd.DataFrame, importer: Importer) -> pd.Series | None:
    """Return structural systems by name or by code, None if the layer has neither."""
    if "system" in attributes and not importer.systems:
        return attributes["system"].fillna("")
    if importer.systems and set(importer.system_columns) <= set(attributes.columns):
        return _coded_systems(attributes, importer)
    return None


def _no_height(attributes: pd.DataFrame, importer: Importer, has_column: bool) -> str:
    """Return the message for a layer without heights, with a similar column if there is one."""
    columns = list(map(str, attributes.columns))
    suggestion = did_you_mean("height", columns) or did_you_mean("storeys", columns)
    found = ", ".join(columns) or "none"
    # The column is empty, or is not there
    mend = "" if importer.name == "per_obspy" else f"; {importer.name} gives none here, add one"
    if has_column:
        return f"height, storeys and period are empty in every feature{mend}"
    problem = "no column height, storeys or period in the layer"
    return f"{problem}{mend} (columns found: {found:.200}){suggestion}"


def _coded_systems(attributes: pd.DataFrame, importer: Importer) -> pd.Series:
    """Return structural systems from the codes of material and lateral system, "" if unknown."""
    given = (attributes[name] for name in importer.system_columns)
    first, *others = (column.fillna("").astype(str).str.strip() for column in given)
    codes = first
    for other in others:
        codes = codes + " " + other
    return codes.map(importer.systems).fillna("")


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
