"""Sides of buildings: each contact seen from one of its buildings, and groups of sides."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from per_obspy.checks import FloatArray

#: Columns of the risk table that a side of a building needs, besides those of its interface.
OF_PAIRS = (
    "rank",
    "state",
    "probability",
    "expected_impact_velocity",
    "missing_gap",
    "supplemental_damping",
    "bumper_restitution",
    "floors_misaligned",
    *(
        f"{name}_{i}"
        for name in ("longitude", "latitude", "importance", "occupants")
        for i in (1, 2)
    ),
)


def sides_of(interfaces: pd.DataFrame) -> pd.DataFrame:
    """
    Return interfaces as seen from one of their two buildings.

    Parameters
    ----------
    interfaces : DataFrame
        Columns ``row_columns.ROWS`` and ``OF_PAIRS``, and ``leftward``: whether the building is the
        left one.

    Returns
    -------
    DataFrame
        The columns without ``_left``, ``_right``, ``_1`` and ``_2``, and ``neighbour_number``,
        ``neighbour_id`` and ``direction`` (towards the neighbour, degrees; NaN if unknown).
    """
    at_left = interfaces["leftward"].to_numpy(bool)
    columns = _own_columns(interfaces, at_left)
    for name in ("number", "id"):
        left, right = (interfaces[f"building_{name}_{side}"] for side in ("left", "right"))
        columns[f"neighbour_{name}"] = right.where(at_left, left)
    # Towards the neighbour
    azimuth = interfaces["azimuth"] + np.where(at_left, 0.0, 180.0)
    known = ~interfaces["flags"].str.contains("unknown_azimuth", regex=False)
    columns["direction"] = (azimuth % 360.0).where(known)
    return pd.DataFrame(columns)


def _own_columns(interfaces: pd.DataFrame, at_left: NDArray[np.bool_]) -> dict[str, Any]:
    """Return the columns of the pair, and those of the building of one side."""
    columns: dict[str, Any] = {}
    # Building 1 is on the left of a pair that is not turned
    is_first = at_left ^ interfaces["turned"].to_numpy(bool)
    for name in map(str, interfaces):
        stem, _, end = name.rpartition("_")
        if end == "left":
            columns[stem] = interfaces[name].where(at_left, interfaces[f"{stem}_right"])
        elif end == "1":
            columns[stem] = interfaces[name].where(is_first, interfaces[f"{stem}_2"])
        elif end not in ("right", "2"):
            columns[name] = interfaces[name]
    return columns


class Groups:
    """
    Groups of consecutive rows of a table with the same number.

    Parameters
    ----------
    number : (n,) ndarray of int
        Not falling.
    """

    def __init__(self, number: NDArray[np.int64]) -> None:
        self.starts = np.flatnonzero(np.diff(number, prepend=number[:1] - 1))
        self.sizes = np.diff(self.starts, append=number.size)

    def sum(self, values: NDArray[Any]) -> FloatArray:
        """Return the sum of each group; NaN counts as 0, unless a group has only NaN."""
        numbers = np.asarray(values, dtype=np.float64)
        known = np.add.reduceat(~np.isnan(numbers), self.starts, dtype=np.int64)
        total = np.add.reduceat(np.nan_to_num(numbers), self.starts)
        return np.where(known > 0, total, np.nan)

    def largest(self, values: NDArray[Any]) -> FloatArray:
        """Return the largest value of each group, NaN if it has none."""
        return self._reduced(np.fmax, values)

    def smallest(self, values: NDArray[Any]) -> FloatArray:
        """Return the smallest value of each group, NaN if it has none."""
        return self._reduced(np.fmin, values)

    def product(self, values: NDArray[Any]) -> FloatArray:
        """Return the product of each group, in the order of its rows."""
        return np.asarray(np.multiply.reduceat(values, self.starts), dtype=np.float64)

    def any(self, values: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return whether any row of each group is true."""
        return np.asarray(np.logical_or.reduceat(values, self.starts))

    def distinct(self, values: NDArray[np.int64], where: NDArray[np.bool_]) -> NDArray[np.int64]:
        """Return the number of different values in some rows of each group."""
        group = np.repeat(np.arange(self.starts.size), self.sizes)[where]
        pairs = np.unique(np.stack([group, values[where]], axis=1), axis=0)
        return np.bincount(pairs[:, 0], minlength=self.starts.size).astype(np.int64)

    def texts(self, values: NDArray[Any], join: Callable[[list[str]], str]) -> NDArray[np.object_]:
        """Return the different texts of each group, joined."""
        joined = []
        for start, size in zip(self.starts.tolist(), self.sizes.tolist(), strict=True):
            joined.append(join(list(dict.fromkeys(values[start : start + size]))))
        return np.array(joined, dtype=object)

    def _reduced(self, function: np.ufunc, values: NDArray[Any]) -> FloatArray:
        """Apply a reduction to each group."""
        return np.asarray(
            function.reduceat(np.asarray(values, dtype=np.float64), self.starts), dtype=np.float64
        )
