"""Description of a pair table as a whole: ranges of its columns, derived and unused columns."""

from collections import Counter
from collections.abc import Collection, Iterable

import pandas as pd

from per_obspy.config import Building
from per_obspy.errors import Rejection, did_you_mean
from per_obspy.inventory.completion import completed_pairs
from per_obspy.inventory.footprints.building_columns import PREFIX
from per_obspy.inventory.schema import COLUMNS, OF_OUTLINES
from per_obspy.inventory.suspicions import ODD


def inventory_profile(pairs: pd.DataFrame) -> pd.DataFrame:
    """
    Describe every known column of a pair table.

    Parameters
    ----------
    pairs : DataFrame
        From :func:`~per_obspy.inventory.files.reading.read_pairs`.

    Returns
    -------
    profile : DataFrame
        One row per column of the schema that the table has: ``column, unit, given`` (rows with a
        value), ``smallest, median, largest`` (in the column's unit, NaN for text) and
        ``most_frequent`` (as text, empty if no row has a value).
    """
    return pd.DataFrame([_column_profile(name, pairs[name]) for name in COLUMNS if name in pairs])


def _column_profile(name: str, values: pd.Series) -> dict[str, object]:
    """Return the row of the profile for one column."""
    given = values[values.notna() & (values != "")]
    # Text has no range
    numbers = given if COLUMNS[name].dtype == "float64" else given.iloc[:0].astype(float)
    counts = given.value_counts()
    return {
        "column": name,
        "unit": COLUMNS[name].unit,
        "given": len(given),
        "smallest": numbers.min(),
        "median": numbers.median(),
        "largest": numbers.max(),
        "most_frequent": str(counts.index[0]) if len(counts) else "",
    }


def derived_counts(pairs: pd.DataFrame) -> dict[str, int]:
    """Return the number of rows in which each column is missing and will be derived or assumed."""
    counts: Counter[str] = Counter()
    combinations = completed_pairs(pairs, Building())["derived"].value_counts()
    for names, rows in combinations.items():
        counts.update(dict.fromkeys(str(names).split(), int(rows)))
    return dict(counts)


def unused_columns(pairs: pd.DataFrame, known: Collection[str] = ()) -> list[str]:
    """Return columns that no command writes, each with a similar name of the schema."""
    # An outline keeps its value under another name where ours is another
    ours = {*COLUMNS, *(f"{PREFIX}{name}" for name in COLUMNS), *OF_OUTLINES, ODD, *known}
    return [f"{name}{did_you_mean(str(name), COLUMNS)}" for name in pairs if name not in ours]


def faults_by_column(rejected: Iterable[Rejection]) -> dict[str, int]:
    """
    Return the number of rejections for each column, most first.

    A reason that concerns several columns counts by itself.
    """
    reasons = (reason for rejection in rejected for reason in rejection.reasons)
    columns = (reason.partition(" = ")[0] for reason in reasons)
    return dict(Counter(columns).most_common())
