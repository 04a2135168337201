"""Values of buildings that a completed pair table contains, without derived or assumed ones."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.inventory.table_columns import numbers_in

#: Properties in which two pairs of a building must agree within its row. The period is that in the
#: direction of the axis, which is common to a row.
PROPERTIES = (
    "height",
    "storeys",
    "period",
    "damping",
    "mass",
    "yield_displacement",
    "hardening",
)


class GivenColumns(Mapping[str, FloatArray]):
    """
    Properties of :func:`given_values` that are read one after the other, when they are needed.

    Parameters
    ----------
    read : callable
        Return the columns of these names of all pairs, as far as the table has them.
    """

    def __init__(self, read: Callable[[Sequence[str]], pd.DataFrame]) -> None:
        self._read = read

    def __getitem__(self, name: str) -> FloatArray:
        """Return one property of both buildings, (n_pairs, 2)."""
        names = {"derived": None}
        for column in (name, "yield_displacement"):
            names |= dict.fromkeys(f"{column}_{i}" for i in (1, 2))
        return _given(self._read(list(names)), name)

    def __iter__(self) -> Iterator[str]:
        """Return the names of the properties."""
        return iter(PROPERTIES)

    def __len__(self) -> int:
        """Return the number of properties."""
        return len(PROPERTIES)


def given_values(pairs: pd.DataFrame) -> dict[str, FloatArray]:
    """
    Return the properties of buildings 1 and 2 that the table gives.

    Parameters
    ----------
    pairs : DataFrame
        Completed pairs, with ``derived``.

    Returns
    -------
    dict of (n_pairs, 2) ndarray
        By the names of ``PROPERTIES``; NaN where a value is derived, assumed, or infinite.
    """
    return {name: _given(pairs, name) for name in PROPERTIES}


def _given(pairs: pd.DataFrame, name: str) -> FloatArray:
    """Return one property of both buildings, NaN where it is not given."""
    sides = []
    for i in (1, 2):
        column = f"{name}_{i}"
        values = numbers_in(pairs, column)
        known = np.isfinite(values) & ~is_derived(pairs["derived"], column)
        # Without a yield displacement a hardening of 0 is assumed
        if name == "hardening":
            known &= np.isfinite(numbers_in(pairs, f"yield_displacement_{i}"))
        sides.append(np.where(known, values, np.nan))
    return np.stack(sides, axis=1)


def is_derived(derived: Any, column: str) -> NDArray[np.bool_]:
    """Return in which rows a column is among those that were derived, by their list in a text."""
    # Many rows share few texts
    codes, texts = pd.factorize(pd.Series(derived), use_na_sentinel=False)
    has = np.array([column in str(text).split() for text in texts], dtype=bool)
    return has[codes] if has.size else np.zeros(len(derived), dtype=bool)
