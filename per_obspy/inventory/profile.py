"""A profile of an inventory: what it gives, how much of it, and in which range."""

import pandas as pd

from per_obspy.inventory.schema import COLUMNS


def inventory_profile(pairs: pd.DataFrame) -> pd.DataFrame:
    """
    Describe every known column of a pair table.

    Parameters
    ----------
    pairs : DataFrame
        As :func:`~per_obspy.inventory.reading.read_pairs` gives them.

    Returns
    -------
    profile : DataFrame
        One row a column of the schema that the table has: ``column, unit, given`` (rows with a value), ``smallest,
        median, largest`` (in the column's unit, NaN for text) and ``most_frequent`` (as text, empty if nothing is
        given).
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
