"""A profile of an inventory: what it gives and in which range, what is derived instead, what nobody uses."""

from collections import Counter
from collections.abc import Iterable

import pandas as pd

from per_obspy.config import Building
from per_obspy.errors import Rejection, did_you_mean
from per_obspy.inventory.completion import completed_pairs
from per_obspy.inventory.schema import COLUMNS

#: Gaps are looked for within some 3 m; where most of them are wider, they may be in another unit,
#: m.
WIDE = 3.0


def inventory_profile(pairs: pd.DataFrame) -> pd.DataFrame:
    """
    Describe every known column of a pair table.

    Parameters
    ----------
    pairs : DataFrame
        As :func:`~per_obspy.inventory.files.reading.read_pairs` gives them.

    Returns
    -------
    profile : DataFrame
        One row a column of the schema that the table has: ``column, unit, given`` (rows with a
        value), ``smallest, median, largest`` (in the column's unit, NaN for text) and
        ``most_frequent`` (as text, empty if nothing is given).
    """
    return pd.DataFrame([_described(name, pairs[name]) for name in COLUMNS if name in pairs])


def _described(name: str, values: pd.Series) -> dict[str, object]:
    given = values[values.notna() & (values != "")]
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
    """Return in how many rows each column will be derived or assumed, because the table is silent."""
    counts: Counter[str] = Counter()
    for names, rows in completed_pairs(pairs, Building())["derived"].value_counts().items():
        counts.update(dict.fromkeys(str(names).split(), int(rows)))
    return dict(counts)


def unused_columns(pairs: pd.DataFrame) -> list[str]:
    """Return the columns that are carried along only, each with the known one that may have been meant."""
    return [f"{name}{did_you_mean(str(name), COLUMNS)}" for name in pairs if name not in COLUMNS]


def faults_by_column(rejected: Iterable[Rejection]) -> dict[str, int]:
    """Return how many rows were rejected for each column, or for a reason that is of no single one; most first."""
    reasons = (reason.partition(" = ")[0] for one in rejected for reason in one.reasons)
    return dict(Counter(reasons).most_common())


def suspicions(pairs: pd.DataFrame) -> list[str]:
    """Return what is possible row by row, but odd of the table as a whole."""
    apart = pairs["gap"][pairs["gap"] > 0.0]
    if apart.median() > WIDE:
        return [
            f"the median of the gaps above 0 is {apart.median():g} m: given in millimetres or centimetres?"
        ]
    return []
