"""Columns of a pair table: numbers that may be absent, and names of flags joined to one text."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from per_obspy.checks import FloatArray


def numbers_in(pairs: pd.DataFrame, name: str) -> FloatArray:
    """Return a column of numbers, NaN in every row if the table has no such column."""
    if name not in pairs.columns:
        return np.full(len(pairs), np.nan)
    return pairs[name].to_numpy(dtype=np.float64)


def joined_names(rows: Mapping[str, NDArray[np.bool_]]) -> NDArray[np.object_]:
    """
    Return the names of the flags that are true in each row, separated by a blank.

    Rows share few combinations of flags, so that each combination is written once.

    Parameters
    ----------
    rows : mapping of str to (n,) ndarray of bool
        At least one and at most 63 names, in the order in which they are written.

    Returns
    -------
    names : (n,) ndarray of object
        Texts; empty where no flag is true.

    Examples
    --------
    >>> first, second = np.array([True, False, True]), np.array([True, False, False])
    >>> joined_names({"a": first, "b": second}).tolist()
    ['a b', '', 'a']
    """
    # Each row's combination of flags as a whole number, one bit per name
    shifted = (flag.astype(np.int64) << bit for bit, flag in enumerate(rows.values()))
    code = sum(shifted, start=np.int64(0))
    # One text per combination that occurs
    combinations, inverse = np.unique(code, return_inverse=True)
    texts = []
    for combination in combinations.tolist():
        names = [name for bit, name in enumerate(rows) if combination >> bit & 1]
        texts.append(" ".join(names))
    chosen: NDArray[np.object_] = np.array(texts, dtype=object)[inverse]
    return chosen
