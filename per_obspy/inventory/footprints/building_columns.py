"""
Columns of buildings: those of the schema, from names that the user gives, and all others kept.

A column of the layer whose name has another meaning in the schema or the results is kept as
``layer_`` and its name.
"""

from collections.abc import Iterable, Mapping

import numpy as np
import pandas as pd

from per_obspy.errors import CatalogError, did_you_mean, printable
from per_obspy.inventory.cells import is_number
from per_obspy.inventory.importers.recognition import imported
from per_obspy.inventory.schema import COLUMNS

#: Quantities of a building that a layer may give, by their names in the schema.
GIVEN = (
    *("building_id", "height", "storeys", "storey_height", "system", "period", "damping"),
    *("mass", "occupants", "importance", "participation", "yield_displacement"),
    *("yield_coefficient", "hardening", "period_log_std", "damping_log_std"),
    "height_log_std",
)

#: Quantities that the outlines give.
FROM_OUTLINES = ("longitude", "latitude", "area", "geometry")

#: Results of one building in the risk table; a test compares them with the table's columns.
RESULTS = (
    *("amplification", "amplification_exact", "contact_mass", "displacement_exact", "ductility"),
    *("ln_per_ratio", "ln_per_std", "per", "sd"),
)

#: Prefix of columns whose names are needed otherwise.
PREFIX = "layer_"

#: Longest name of a carried column, characters: that of a pair table has two more.
LONGEST_NAME = 190


def building_columns(
    attributes: pd.DataFrame, names: Mapping[str, str], source: str
) -> pd.DataFrame:
    """
    Return the attributes of a layer by the schema, with all other columns.

    Parameters
    ----------
    attributes : DataFrame
        Columns of the layer; the index is the number of the feature.
    names : mapping of str to str
        Name in the schema, without ``_1`` or ``_2`` -> the layer's column, for columns that are
        not recognised or not the right ones.
    source : str
        The file, for messages.

    Returns
    -------
    table : DataFrame
        One row per building: columns of the schema without ``_1`` or ``_2``, then all others;
        ``cell_notes`` contains what was not understood.

    Raises
    ------
    CatalogError
        If a named column is missing, or no column contains a height, storeys or a period.
    ValueError
        If a name is none of ``GIVEN``.
    """
    given = _given(attributes, names, source)
    known = imported(attributes, source, given)
    return known.join(_others(attributes, known))


def _given(attributes: pd.DataFrame, names: Mapping[str, str], source: str) -> dict[str, pd.Series]:
    """Return the columns that the user names, under the names of the schema."""
    given = {}
    for name, column in names.items():
        if name not in GIVEN:
            raise ValueError(f"{name} is no column of a building{did_you_mean(name, GIVEN)}")
        if column not in attributes:
            known = [str(found) for found in attributes.columns]
            listed = ", ".join(known)
            raise CatalogError(
                source,
                f"no column {column!r} for {name} (columns found: {listed:.200})"
                f"{did_you_mean(column, known)}",
            )
        given[name] = attributes[column]
    # An empty cell is no name of a system
    if "system" in given:
        given["system"] = given["system"].fillna("").astype(str)
    return given


def _others(attributes: pd.DataFrame, known: pd.DataFrame) -> pd.DataFrame:
    """Return the columns of a layer that are not in a table of known ones, under free names."""
    # Names are compared without case, as layers and spreadsheets do
    taken = {str(name).lower() for name in known}
    columns = {}
    for name in attributes.columns:
        if name in known and _is_same(attributes[name], known[name]):
            continue
        free = _free_name(str(name), taken)
        taken.add(free.lower())
        columns[free] = attributes[name]
    return pd.DataFrame(columns, index=attributes.index)


def _is_same(original: pd.Series, known: pd.Series) -> bool:
    """Return whether a column of the schema equals the column of the same name in the layer."""
    if is_number(original) and is_number(known):
        return bool(np.array_equal(original, known, equal_nan=True))
    # Text that was read as a number is kept in an additional column
    if is_number(original) or is_number(known):
        return False
    return bool((_texts(original) == _texts(known)).all())


def _texts(cells: pd.Series) -> pd.Series:
    """Return cells as text, empty where there is none."""
    return cells.astype(str).mask(cells.isna(), "")


def _free_name(name: str, taken: Iterable[str]) -> str:
    """Return a name that is not needed otherwise and not taken, whatever the case of letters."""
    plain = printable(name).strip()[:LONGEST_NAME] or "unnamed"
    needed = {column.removesuffix("_1") for column in COLUMNS if column.endswith("_1")}
    reserved = {*needed, *FROM_OUTLINES, *RESULTS, *GIVEN}
    if plain.lower() in reserved or plain.lower() in taken:
        plain = f"{PREFIX}{plain}"
    # A number where even that is taken
    free, number = plain, 2
    while free.lower() in taken:
        free, number = f"{plain}_{number}", number + 1
    return free
