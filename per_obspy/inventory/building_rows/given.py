"""Values of buildings that a completed pair table contains, without derived or assumed ones."""

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
    codes, texts = pd.factorize(np.asarray(derived, dtype=object), use_na_sentinel=False)
    has = np.array([column in str(text).split() for text in texts], dtype=bool)
    return has[codes] if has.size else np.zeros(len(derived), dtype=bool)
