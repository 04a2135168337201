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


def directions(azimuth: Any, flags: Any) -> dict[str, FloatArray]:
    """
    Return the directions towards the neighbours on both sides of interfaces.

    Parameters
    ----------
    azimuth : (n,) array_like
        Of the axes of the rows, from their first to their last buildings, degrees.
    flags : (n,) array_like of str
        Flags of the rows.

    Returns
    -------
    dict of (n,) ndarray
        ``direction_left`` (of the building on the left) and ``direction_right``, degrees; NaN if
        the axis is unknown.
    """
    # Many rows share few texts
    codes, texts = pd.factorize(np.asarray(flags, dtype=object))
    known = np.array(["unknown_azimuth" not in text for text in texts], dtype=bool)[codes]
    axis = np.asarray(azimuth, dtype=np.float64)
    return {
        f"direction_{side}": np.where(known, (axis + turn) % 360.0, np.nan)
        for side, turn in (("left", 0.0), ("right", 180.0))
    }


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
        # Group and place of the value as one number, each once
        places, names = pd.factorize(values[where])
        both = np.sort(group * (len(names) + 1) + places)
        once = both[np.diff(both, prepend=-1) > 0]
        return np.bincount(once // (len(names) + 1), minlength=self.starts.size).astype(np.int64)

    def texts(self, values: NDArray[Any], join: Callable[[list[str]], str]) -> NDArray[np.object_]:
        """Return the different texts of each group, joined."""
        texts = np.asarray(values, dtype=object)
        joined = texts[self.starts]
        # Few groups have different texts
        differs = self.any(np.asarray(texts != np.repeat(joined, self.sizes), dtype=bool))
        for group in np.flatnonzero(differs).tolist():
            some = texts[self.starts[group] : self.starts[group] + self.sizes[group]]
            joined[group] = join(list(dict.fromkeys(some.tolist())))
        return joined

    def _reduced(self, function: np.ufunc, values: NDArray[Any]) -> FloatArray:
        """Apply a reduction to each group."""
        return np.asarray(
            function.reduceat(np.asarray(values, dtype=np.float64), self.starts), dtype=np.float64
        )
