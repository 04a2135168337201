"""Which pair is worse, and the name of its risk."""

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from per_obspy.checks import FloatArray

#: Rank of a state, worst first.
STATES = {"yes": 0, "possible": 1, "no": 2}

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
    Return the first class whose threshold the ratio gap / demand does not exceed; the last where there is no ratio.

    Examples
    --------
    >>> risk_class(np.array([0.0, 1.0, 1.1, np.nan]), {"high": 1.0, "low": np.inf}).tolist()
    ['high', 'high', 'low', 'low']
    """
    names = np.array(list(classes), dtype=object)
    index = np.searchsorted(
        np.array(list(classes.values())), np.nan_to_num(ratio, nan=np.inf), side="left"
    )
    chosen: NDArray[np.object_] = names[np.minimum(index, names.size - 1)]
    return chosen


def in_order(table: pd.DataFrame, velocity: ArrayLike) -> pd.DataFrame:
    """
    Return the rows with the columns ``KEYS``, the worst pair first.

    Parameters
    ----------
    table : DataFrame
        Pairs with ``state``, ``demand_ratio``, and ``probability`` where it is known.
    velocity : (n_pairs,) array_like
        Impact velocity that counts, m/s; NaN counts as 0.

    Notes
    -----
    The order is by state, probability, impact velocity and ratio gap / demand; ties are broken by
    importance, occupants and at last the name, so that it does not depend on the order in which
    pairs were computed.
    """
    keys = _order_keys(table, velocity)
    worst = np.stack(list(keys.values()))
    order = np.lexsort(worst[::-1])
    order = _ties_by_name(order, worst[:, order], table["pair_id"].to_numpy(object))
    return table.assign(**keys).iloc[order].reset_index(drop=True)


def worst_first(table: pd.DataFrame, velocity: ArrayLike) -> pd.DataFrame:
    """Return the rows in the order of :func:`in_order`, with a column ``rank`` from 1."""
    return in_order(table, velocity).drop(columns=[*KEYS]).assign(rank=np.arange(1, len(table) + 1))


def _order_keys(table: pd.DataFrame, velocity: ArrayLike) -> dict[str, FloatArray]:
    keys = (
        np.asarray(table["state"].map(STATES), dtype=np.float64),
        -_largest(table, "probability"),
        -np.nan_to_num(np.asarray(velocity, dtype=np.float64)),
        np.nan_to_num(table["demand_ratio"].to_numpy(np.float64), nan=np.inf),
        -_largest(table, "importance_1", "importance_2"),
        -_largest(table, "occupants_1", "occupants_2"),
    )
    return dict(zip(KEYS, keys, strict=True))


def _ties_by_name(
    order: NDArray[np.intp], worst: FloatArray, names: NDArray[np.object_]
) -> NDArray[np.intp]:
    """Return the order with rows that are equally bad by name; names are compared only there, which takes time."""
    as_before = (
        np.concatenate([[False], (worst[:, 1:] == worst[:, :-1]).all(axis=0)])
        if order.size
        else np.zeros(0, bool)
    )
    tied = as_before | np.append(as_before[1:], False)[: order.size]
    group, rows = np.cumsum(~as_before)[tied], order[tied]
    result = order.copy()
    result[tied] = rows[np.lexsort([names[rows].astype(str), group])]
    return result


def _largest(table: pd.DataFrame, *names: str) -> FloatArray:
    """Return the largest value of some columns, 0 where the table knows none."""
    return np.asarray(table.reindex(columns=[*names]).max(axis=1).fillna(0.0), dtype=np.float64)
