"""
Columns of buildings by the schema, from the names of a source or of the user, and all others.

A column of the layer whose name has another meaning in the schema or the results is kept as
``layer_`` and its name.

Where a source has classes, a building without a size has the median height of its class in the same
layer, and its deviation, ``height_log_std``. A class needs ``ENOUGH`` known heights; where there
are none but storeys, the same is done with storeys. No value is taken from outside the layer. The
known buildings are taken for a sample of the class, which they may not be: tall buildings are
mapped first.

A raster of heights, where the user has one, comes before the classes. Its deviation is that from
the known heights of the layer, if there are ``ENOUGH``, else that of heights from coarse images.
"""

from collections.abc import Iterable, Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.errors import CatalogError, did_you_mean, printable
from per_obspy.inventory.cells import NOTES, is_number, read_numbers
from per_obspy.inventory.footprints.sources import (
    ORIGINS,
    OUTLINE_SOURCE,
    Source,
    converted,
    outline_origins,
    source_of,
)
from per_obspy.inventory.schema import COLUMNS

#: Quantities of a building that a layer may give, by their names in the schema.
GIVEN = (
    *("building_id", "height", "storeys", "storey_height", "system", "period", "damping"),
    *("mass", "occupants", "importance", "participation", "yield_displacement"),
    *("yield_coefficient", "hardening", "period_log_std", "damping_log_std"),
    "height_log_std",
)

#: Quantities of which a layer must give one.
SIZES = ("height", "storeys", "period")

#: Quantities that the outlines give.
FROM_OUTLINES = ("longitude", "latitude", "area", "geometry")

#: Results of one building in the risk table; a test compares them with the table's columns.
RESULTS = (
    *("amplification", "amplification_exact", "contact_mass", "displacement_exact", "ductility"),
    "elastic_ratio",
    *("ln_per_ratio", "ln_per_std", "per", "residual", "sd"),
)

#: Prefix of columns whose names are needed otherwise.
PREFIX = "layer_"

#: Longest name of a carried column, characters: that of a pair table has two more.
LONGEST_NAME = 190

#: Column of the buildings whose height is from a raster, and its word.
HEIGHT_SOURCE, RASTER = "height_source", "raster"

#: Largest ratio of a raster's heights to the known ones in the median, and its inverse: beyond it
#: they are in feet, or above sea level.
LARGEST_RATIO = 2.0

#: Known values that a class needs. The median of twenty of log-deviation s is off by 1.25 s / 4.5.
ENOUGH = 20


def building_columns(
    attributes: pd.DataFrame,
    names: Mapping[str, str],
    file: str,
    raster: FloatArray | None = None,
) -> pd.DataFrame:
    """
    Return the attributes of a layer by the schema, without ``_1`` or ``_2``, then all others.

    The index is the number of the feature; ``cell_notes`` contains what was not understood. Names
    of the schema -> the layer's columns are given where those are not recognised, or not the right
    ones. Heights of the buildings in a raster, m, NaN where it has none, are for those without any
    size.

    Raises
    ------
    CatalogError
        If a named column is missing, or no column contains a height, storeys or a period.
    ValueError
        If a name is none of ``GIVEN``.
    """
    given = {}
    for name, column in names.items():
        if name not in GIVEN:
            raise ValueError(f"{name} is no column of a building{did_you_mean(name, GIVEN)}")
        if column not in attributes:
            columns = [str(each) for each in attributes.columns]
            problem = f"no column {column!r} for {name} (columns found: {', '.join(columns):.200})"
            raise CatalogError(file, f"{problem}{did_you_mean(column, columns)}")
        given[name] = attributes[column]
    # An empty cell is no name of a system
    if "system" in given:
        given["system"] = given["system"].fillna("").astype(str)
    table = schema_columns(attributes, file, given, raster)
    return table.join(_others(attributes, table))


def schema_columns(
    attributes: pd.DataFrame,
    file: str,
    given: Mapping[str, pd.Series] | None = None,
    raster: FloatArray | None = None,
) -> pd.DataFrame:
    """
    Return the columns of a known source under the schema's names, then those to carry along.

    The index is the number of the feature. A column that the user names for a name of the schema
    takes the place of the recognised one.

    Raises
    ------
    CatalogError
        If the layer has neither height nor storeys nor period, or a raster contradicts it.
    """
    source = source_of(map(str, attributes.columns))
    cells = converted(attributes, source)
    table = _named_columns(cells, source, given)
    notes, placeholders = _read_sizes(table)
    is_understood = np.array(notes, dtype=object) == ""
    if raster is not None:
        table = with_raster_heights(table, raster, is_understood, file)
    if problem := _without_any_size(table, is_understood, attributes, source):
        raise CatalogError(file, problem)
    table = _with_origins(table, cells, source, given)
    # Missing heights from the classes of the layer
    if source.class_column is not None:
        classes = cells.get(source.class_column, pd.Series("", cells.index))
        table = with_class_heights(table, classes, is_understood)
    # A placeholder of a building without any size is a note
    for row in np.flatnonzero(_has_no_size(table) & is_understood).tolist():
        notes[row] = placeholders.get(row, "")
    if any(notes):
        table[NOTES] = notes
    return table.join(cells[[name for name in source.carried if name in cells]])


def _with_origins(
    table: pd.DataFrame,
    cells: pd.DataFrame,
    source: Source,
    given: Mapping[str, pd.Series] | None,
) -> pd.DataFrame:
    """Return a table with the origin of outlines, and the deviation of heights from images."""
    # Columns have no origin where all are drawn
    origins = outline_origins(cells, source)
    if (origins != "drawn").any():
        table = table.assign(**{OUTLINE_SOURCE: origins})
    if "height" not in table or (given and "height" in given):
        return table
    # A lognormal height of that deviation in m
    of_heights = pd.Series(source.heights, table.index) if source.heights else origins
    errors = of_heights.map({name: origin.height_std for name, origin in ORIGINS.items()})
    learned = (errors > 0.0) & (table["height"] > 0.0)
    if not learned.any():
        return table
    deviation = np.sqrt(np.log1p((errors / table["height"]) ** 2))
    deviation = np.minimum(deviation, COLUMNS["height_log_std_1"].high)
    known = table.get("height_log_std", pd.Series(np.nan, table.index))
    return table.assign(height_log_std=known.mask(learned & known.isna(), deviation))


def _named_columns(
    cells: pd.DataFrame, source: Source, given: Mapping[str, pd.Series] | None
) -> pd.DataFrame:
    """Return the columns of a source, or those that the user names, with systems and names."""
    columns = {name: cells[own] for name, own in source.columns.items() if own in cells}
    table = pd.DataFrame(columns | dict(given or {}), index=cells.index)
    if "system" not in table and (systems := _systems(cells, source)) is not None:
        table["system"] = systems
    return table.assign(building_id=_identifiers(table))


def _has_no_size(table: pd.DataFrame) -> pd.Series:
    """Return which buildings have neither height nor storeys nor period."""
    return table[[name for name in SIZES if name in table]].isna().all(axis=1)


def _read_sizes(table: pd.DataFrame) -> tuple[list[str], dict[int, str]]:
    """Turn sizes into numbers; return notes on the cells of each row, and placeholders by row."""
    notes, placeholders = [""] * len(table), dict[int, str]()
    for name in (*SIZES, "storey_height"):
        if name in table:
            numbers = read_numbers(name, table[name])
            table[name] = numbers.values
            # What was not understood, and numbers that mean nothing
            for row, note in numbers.notes.items():
                notes[row] = f"{notes[row]}; {note}" if notes[row] else note
            for row, number in numbers.placeholders.items():
                placeholders[row] = f"{name} = {number:g} is a placeholder, not a size"
    return notes, placeholders


def _systems(cells: pd.DataFrame, source: Source) -> pd.Series | None:
    """Return structural systems by name or by code, None if the layer has neither."""
    if "system" in cells and not source.systems:
        return cells["system"].fillna("")
    if not source.systems or not set(source.codes) <= set(cells.columns):
        return None
    # Material and lateral system
    codes = pd.Series("", cells.index)
    for name in source.codes:
        codes = codes + " " + cells[name].fillna("").astype(str).str.strip()
    return codes.str[1:].map(source.systems).fillna("")


def _without_any_size(
    table: pd.DataFrame, is_understood: NDArray[np.bool_], attributes: pd.DataFrame, source: Source
) -> str:
    """Return what a layer without any size lacks, with a similar column; empty if it has one."""
    mend = "" if source.name == "per_obspy" else f"; {source.name} gives none here, add one"
    # The column is empty, or is not there
    if set(SIZES) & set(table):
        is_empty = len(table) and (_has_no_size(table) & is_understood).all()
        return f"height, storeys and period are empty in every feature{mend}" if is_empty else ""
    columns = list(map(str, attributes.columns))
    suggestion = did_you_mean("height", columns) or did_you_mean("storeys", columns)
    problem = "no column height, storeys or period in the layer"
    return f"{problem}{mend} (columns found: {', '.join(columns) or 'none':.200}){suggestion}"


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


def with_class_heights(
    table: pd.DataFrame, classes: pd.Series, is_understood: NDArray[np.bool_] | bool = True
) -> pd.DataFrame:
    """
    Return a table of buildings with missing heights or storeys estimated by class.

    Missing classes form a separate class; rows with a size that was not understood are not
    estimated. Estimated ones have ``height_log_std``, the logarithmic standard deviation of the
    class, at least 1e-3, by which the row is marked as derived.
    """
    missing = _has_no_size(table) & is_understood
    if not missing.any():
        return table
    result, labels = table.copy(), classes.fillna("").astype(str)
    # Heights first, storeys where a class has too few heights
    for name in ("height", "storeys"):
        if name not in table:
            continue
        logarithms = np.log(table[name].where(table[name] > 0.0)).groupby(labels)
        is_enough = logarithms.transform("count") >= ENOUGH
        median = np.exp(logarithms.transform("median")).where(is_enough)
        deviation = logarithms.transform("std").where(is_enough).clip(lower=1e-3)
        # Each missing value, marked by its deviation
        rows = missing & median.notna()
        result[name] = result[name].mask(rows, median)
        given = result.get("height_log_std", pd.Series(np.nan, table.index))
        result["height_log_std"] = given.mask(rows, deviation)
        missing &= ~rows
    return result


def with_raster_heights(
    table: pd.DataFrame,
    raster: FloatArray,
    is_understood: NDArray[np.bool_] | bool,
    file: str,
) -> pd.DataFrame:
    """
    Return a table of buildings with heights of a raster, m, where they have no size.

    They are marked as derived by ``height_log_std``, and ``height_source`` is ``raster``.

    Raises
    ------
    CatalogError
        If the raster has another median than the known heights of the layer, by a factor of 2.
    """
    limits = COLUMNS["height_1"]
    usable = (raster >= limits.low) & (raster <= limits.high)
    height = table.get("height", pd.Series(np.nan, table.index))
    # The raster beside the heights that the layer knows
    known = usable & (height > 0.0).to_numpy()
    errors = np.log(raster[known] / height.to_numpy(np.float64)[known])
    deviation = _raster_deviation(raster, errors, file)
    # Each missing height, marked by its deviation
    rows = usable & (_has_no_size(table) & is_understood).to_numpy()
    given = table.get("height_log_std", pd.Series(np.nan, table.index))
    return table.assign(
        height=height.mask(rows, raster),
        height_log_std=given.mask(rows, deviation),
        **{HEIGHT_SOURCE: np.where(rows, RASTER, "")},
    )


def _raster_deviation(raster: FloatArray, errors: FloatArray, file: str) -> FloatArray:
    """Return log-deviations of a raster's heights, m, by its errors beside known ones if enough."""
    if errors.size < ENOUGH:
        deviation = np.sqrt(np.log1p((ORIGINS["coarse"].height_std / raster) ** 2))
    else:
        ratio = float(np.exp(np.median(errors)))
        if not 1.0 / LARGEST_RATIO <= ratio <= LARGEST_RATIO:
            problem = f"heights of the raster are {ratio:.3g} times the {errors.size} known ones"
            raise CatalogError(file, f"{problem}, in the median: metres above ground expected")
        # Bias included
        deviation = np.full(raster.size, np.sqrt(np.mean(errors**2)))
    return np.clip(deviation, 1e-3, COLUMNS["height_log_std_1"].high)


def raster_counts(table: pd.DataFrame) -> dict[str, int | float]:
    """Return what a raster gave to buildings: counts and the largest deviation; empty without."""
    if HEIGHT_SOURCE not in table or "height_log_std" not in table:
        return {}
    rows = table[HEIGHT_SOURCE] == RASTER
    return {
        "heights_from_raster": int(rows.sum()),
        "largest_height_log_std": float(table["height_log_std"][rows].max()) if rows.any() else 0.0,
        "without_size": int(_has_no_size(table).sum()),
    }


def _others(attributes: pd.DataFrame, known: pd.DataFrame) -> pd.DataFrame:
    """Return the columns of a layer that are not in a table of known ones, under free names."""
    # Names are compared without case, as layers and spreadsheets do
    taken = {str(name).lower() for name in known}
    columns = {}
    for name in attributes.columns:
        if name not in known or not _is_same(attributes[name], known[name]):
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
    first, second = (cells.astype(str).mask(cells.isna(), "") for cells in (original, known))
    return bool((first == second).all())


def _free_name(name: str, taken: Iterable[str]) -> str:
    """Return a name that is not needed otherwise and not taken, whatever the case of letters."""
    plain = printable(name).strip()[:LONGEST_NAME] or "unnamed"
    schema = {column.removesuffix("_1") for column in COLUMNS if column.endswith("_1")}
    if plain.lower() in {*schema, *FROM_OUTLINES, *RESULTS, *GIVEN, *taken}:
        plain = f"{PREFIX}{plain}"
    # A number where even that is taken
    free, number = plain, 2
    while free.lower() in taken:
        free, number = f"{plain}_{number}", number + 1
    return free
