"""Columns of a pair table: numbers that may be absent, and names of flags joined to one text."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from per_obspy.checks import FloatArray
from per_obspy.constants import METRES_PER_DEGREE


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
    code = np.zeros(len(next(iter(rows.values()))), dtype=np.int64)
    for bit, flag in enumerate(rows.values()):
        code[flag] |= 1 << bit
    # One text per combination that occurs
    places, combinations = pd.factorize(code)
    texts = []
    for combination in combinations.tolist():
        names = [name for bit, name in enumerate(rows) if combination >> bit & 1]
        texts.append(" ".join(names))
    chosen: NDArray[np.object_] = np.array(texts, dtype=object)[places]
    return chosen


def metres_between(
    longitude_1: ArrayLike, latitude_1: ArrayLike, longitude_2: ArrayLike, latitude_2: ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """
    Return the way east and north from one position to another, m, across the date line too.

    On a sphere taken as flat; positions in degrees.
    """
    turn = np.subtract(longitude_2, longitude_1)
    east = (turn - 360.0 * np.rint(turn / 360.0)) * np.cos(np.deg2rad(latitude_1))
    return METRES_PER_DEGREE * east, METRES_PER_DEGREE * np.subtract(latitude_2, latitude_1)
