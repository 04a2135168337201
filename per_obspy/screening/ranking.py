"""Order of pairs, the worst first, and names of risk classes."""

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from per_obspy.checks import FloatArray

#: States of a pair, worst first.
STATES = ("yes", "possible", "no")

#: Columns by which rows are ordered, all ascending; ties are broken by ``pair_id``.
KEYS = (
    "order_state",
    "order_probability",
    "order_velocity",
    "order_ratio",
    "order_importance",
    "order_occupants",
)


def risk_class(ratio: FloatArray, classes: dict[str, float]) -> NDArray[np.object_]:
    """
    Return the first class whose threshold the ratio gap / demand does not exceed.

    Parameters
    ----------
    ratio : (n_pairs,) ndarray
        Gap / demand, dimensionless; NaN, without a demand, belongs to the last class.
    classes : dict of str to float
        Name and threshold of each class, ascending.

    Returns
    -------
    name : (n_pairs,) ndarray of str
        Name of the class.

    Examples
    --------
    >>> risk_class(np.array([0.0, 1.0, 1.1, np.nan]), {"high": 1.0, "low": np.inf}).tolist()
    ['high', 'high', 'low', 'low']
    """
    names = np.array(list(classes), dtype=object)
    thresholds = np.array(list(classes.values()))
    index = np.searchsorted(thresholds, np.nan_to_num(ratio, nan=np.inf), side="left")
    chosen: NDArray[np.object_] = names[np.minimum(index, names.size - 1)]
    return chosen


def in_order(table: pd.DataFrame, velocity: ArrayLike) -> pd.DataFrame:
    """
    Sort pairs, the worst first, and add the columns ``KEYS`` by which they are sorted.

    Parameters
    ----------
    table : DataFrame
        Pairs with ``state``, ``demand_ratio``, and ``probability`` where it is known.
    velocity : (n_pairs,) array_like
        Impact velocity by which pairs are ordered, m/s; NaN counts as 0.

    Notes
    -----
    The order is by state, probability, impact velocity and ratio gap / demand; ties are broken by
    importance, occupants and at last the name, so that it does not depend on the order in which
    pairs were computed.
    """
    keys = _order_keys(table, velocity)
    # lexsort sorts by its last row first
    badness = np.stack(list(keys.values()))
    order = np.lexsort(badness[::-1])
    order = _ties_by_name(order, badness[:, order], table["pair_id"].to_numpy(object))
    return table.assign(**keys).iloc[order].reset_index(drop=True)


def worst_first(table: pd.DataFrame, velocity: ArrayLike) -> pd.DataFrame:
    """Sort pairs as :func:`in_order` does and add a column ``rank`` from 1."""
    ordered = in_order(table, velocity).drop(columns=[*KEYS])
    return ordered.assign(rank=np.arange(1, len(table) + 1))


def _order_keys(table: pd.DataFrame, velocity: ArrayLike) -> dict[str, FloatArray]:
    """Return the columns ``KEYS``; the worst pair has the smallest numbers."""
    state = table["state"].map({state: rank for rank, state in enumerate(STATES)})
    ratio = table["demand_ratio"].to_numpy(np.float64)
    # Negated where more is worse; a ratio that does not exist is the best
    keys = (
        np.asarray(state, dtype=np.float64),
        -_largest(table, "probability"),
        -np.nan_to_num(np.asarray(velocity, dtype=np.float64)),
        np.nan_to_num(ratio, nan=np.inf),
        -_largest(table, "importance_1", "importance_2"),
        -_largest(table, "occupants_1", "occupants_2"),
    )
    return dict(zip(KEYS, keys, strict=True))


def _ties_by_name(
    order: NDArray[np.intp], badness: FloatArray, names: NDArray[np.object_]
) -> NDArray[np.intp]:
    """Sort rows with equal keys by name."""
    # Names are compared only within ties, for that takes time
    repeats = np.zeros(order.size, dtype=bool)
    repeats[1:] = (badness[:, 1:] == badness[:, :-1]).all(axis=0)
    tied = repeats | np.append(repeats[1:], False)[: order.size]

    # Within a group of equal rows only the name decides
    group, rows = np.cumsum(~repeats)[tied], order[tied]
    result = order.copy()
    result[tied] = rows[np.lexsort([names[rows].astype(str), group])]
    return result


def _largest(table: pd.DataFrame, *names: str) -> FloatArray:
    """Return the largest value of columns per row, 0 where all are missing."""
    return np.asarray(table.reindex(columns=[*names]).max(axis=1).fillna(0.0), dtype=np.float64)
