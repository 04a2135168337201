"""
Rounding of numbers in texts to their significant digits.

CSV files and workbooks have numbers of five significant digits, and coordinates of seven decimals
(a centimetre). Parquet files keep all digits. Columns that the pair table brings along stay as
they are: they may be identifiers.
"""

from collections.abc import Collection

import numpy as np
import pandas as pd
import pyarrow as pa
from numpy.typing import NDArray
from pandas.api.types import is_float_dtype

from per_obspy.checks import FloatArray
from per_obspy.screening.columns import known_column

#: Significant digits of numbers, and decimals of coordinates in degrees.
DIGITS, DECIMALS = 5, 7

#: Powers of ten that are exact as numbers: 10^22 is the largest.
_EXACT = 22


def rounded(values: FloatArray, digits: int = DIGITS) -> FloatArray:
    """
    Round numbers to significant digits.

    Parameters
    ----------
    values : (n,) ndarray
        Numbers; NaN and infinity stay.
    digits : int
        At least 1.

    Returns
    -------
    values : (n,) ndarray
        The numbers nearest to the decimal ones, so that they are written with these digits.

    Examples
    --------
    >>> print(rounded(np.array([0.123456789, 402888.8888, 0.0, np.inf, -1e-5])))
    [ 1.2346e-01  4.0289e+05  0.0000e+00         inf -1.0000e-05]
    """
    given = np.asarray(values, dtype=np.float64)
    usable = np.isfinite(given) & (given != 0.0)
    safe = np.where(usable, np.abs(given), 1.0)
    places = digits - 1 - np.floor(np.log10(safe)).astype(np.int64)
    # Multiplied or divided by an exact power of ten, a whole number gives the nearest number
    known = usable & (np.abs(places) <= _EXACT)
    usable, beyond = known, usable & ~known
    factor = 10.0 ** np.where(usable, np.abs(places), 0)
    whole = np.where(places >= 0, np.round(safe * factor), np.round(safe / factor))
    found = np.where(places >= 0, whole / factor, whole * factor)
    given = np.where(usable, np.copysign(found, given), given)
    # Few numbers are beyond these powers, such as a probability of 1e-30
    given[beyond] = [float(f"{value:.{digits - 1}e}") for value in given[beyond]]
    return given


def rounded_table(table: pd.DataFrame, own: Collection[str] = ()) -> pd.DataFrame:
    """
    Return a table whose known columns of numbers are rounded.

    Parameters
    ----------
    table : DataFrame
        It stays as it is.
    own : collection of str
        Further columns that the package has computed, and not the user brought along.
    """
    found = table.copy(deep=False)
    for position, name in enumerate(map(str, table.columns)):
        column = table.iloc[:, position]
        if is_float_dtype(column) and _is_own(name, own):
            found.isetitem(position, _rounded_column(name, column.to_numpy(np.float64)))
    return found


def rounded_arrow(table: pa.Table, own: Collection[str] = ()) -> pa.Table:
    """
    Return a table whose known columns of numbers are rounded; empty cells stay empty.

    Parameters
    ----------
    table : Table
        It stays as it is.
    own : collection of str
        As for :func:`rounded_table`.
    """
    for position, field in enumerate(table.schema):
        if not pa.types.is_floating(field.type) or not _is_own(field.name, own):
            continue
        # Empty cells of a column without gaps are NaN here
        column = table[position].combine_chunks()
        numbers = column.to_numpy(zero_copy_only=False)
        found = _rounded_column(field.name, numbers)
        cells = pa.array(found, field.type, mask=column.is_null().to_numpy(zero_copy_only=False))
        table = table.set_column(position, field.name, cells)
    return table


def _is_own(name: str, own: Collection[str]) -> bool:
    """Return whether a column is defined by the package."""
    return name in own or known_column(name) is not None


def _rounded_column(name: str, numbers: FloatArray) -> NDArray[np.float64]:
    """Round the numbers of a column: coordinates to decimals, others to significant digits."""
    if name.startswith(("longitude", "latitude")):
        return np.asarray(np.round(numbers, DECIMALS))
    return rounded(numbers)
