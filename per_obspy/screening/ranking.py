"""Which pair is worse, and the name of its risk."""

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from per_obspy.checks import FloatArray

#: Rank of a state, worst first.
STATES = {"yes": 0, "possible": 1, "no": 2}


def risk_class(ratio: FloatArray, classes: dict[str, float]) -> NDArray[np.object_]:
    """
    Return the first class whose threshold the ratio gap / demand does not exceed; the last where there is no ratio.

    Examples
    --------
    >>> risk_class(np.array([0.0, 1.0, 1.1, np.nan]), {"high": 1.0, "low": np.inf}).tolist()
    ['high', 'high', 'low', 'low']
    """
    names = np.array(list(classes), dtype=object)
    index = np.searchsorted(np.array(list(classes.values())), np.nan_to_num(ratio, nan=np.inf), side="left")
    chosen: NDArray[np.object_] = names[np.minimum(index, names.size - 1)]
    return chosen


def worst_first(table: pd.DataFrame, velocity: ArrayLike) -> pd.DataFrame:
    """
    Return the rows with the worst pair first and a column ``rank`` from 1.

    Parameters
    ----------
    table : DataFrame
        Pairs with ``state``, ``demand_ratio``, ``pair_id``, and ``probability`` where it is known.
    velocity : (n_pairs,) array_like
        Impact velocity that counts, m/s; NaN counts as 0.

    Notes
    -----
    The order is by state, probability, impact velocity and ratio gap / demand; ties are broken by importance,
    occupants and name, so that it does not depend on the order in which pairs were computed.
    """
    columns = {
        "state": table["state"].map(STATES),
        "probability": -_numbers(table, "probability"),
        "velocity": -np.nan_to_num(np.asarray(velocity, dtype=np.float64)),
        "ratio": table["demand_ratio"].fillna(np.inf),
        "importance": -_numbers(table, "importance_1", "importance_2"),
        "occupants": -_numbers(table, "occupants_1", "occupants_2"),
        "pair_id": table["pair_id"],
    }
    order = pd.DataFrame(columns, index=table.index).sort_values(list(columns), kind="stable").index
    return table.loc[order].reset_index(drop=True).assign(rank=np.arange(1, len(table) + 1))


def _numbers(table: pd.DataFrame, *names: str) -> pd.Series:
    """Return the largest value of some columns, 0 where the table knows none."""
    return table.reindex(columns=[*names]).max(axis=1).fillna(0.0)
