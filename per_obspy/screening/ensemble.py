"""Several scenarios together: the probability that a pair pounds in any of them, or in a year."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.errors import Rejection


def conditional_probability(probability: ArrayLike, weights: ArrayLike) -> FloatArray:
    """
    Return the probability given that one of the scenarios happens, ``sum(w P) / sum(w)``.

    Parameters
    ----------
    probability : (n_scenarios, n_pairs) array_like
        Of pounding in each scenario, from 0 to 1.
    weights : (n_scenarios,) array_like
        How likely each is beside the others; any positive sum.

    Returns
    -------
    probability : (n_pairs,) ndarray
        From 0 to 1.

    Raises
    ------
    ValueError
        If a probability is outside [0, 1], a weight is negative or all are 0.

    Examples
    --------
    >>> print(conditional_probability([[1.0, 0.2], [0.0, 0.6]], [3.0, 1.0]))
    [0.75 0.3 ]
    """
    chance, weight = _scenarios(probability, weights, "weights")
    if not weight.sum() > 0:
        raise ValueError(f"weights must have a positive sum, got {weight.sum():g}")
    joined: FloatArray = np.minimum((weight / weight.sum()) @ chance, 1.0)
    return joined


def annual_probability(probability: ArrayLike, rates: ArrayLike) -> FloatArray:
    """
    Return the probability that a pair pounds within a year, ``1 - exp(-sum(rate P))``.

    Scenarios come as a Poisson process, and a pair that has pounded is as it was before.

    Parameters
    ----------
    probability : (n_scenarios, n_pairs) array_like
        Of pounding in each scenario, from 0 to 1.
    rates : (n_scenarios,) array_like
        Of each scenario, 1/year.

    Returns
    -------
    probability : (n_pairs,) ndarray
        In one year.

    Raises
    ------
    ValueError
        If a probability is outside [0, 1] or a rate is negative.

    Examples
    --------
    >>> print(annual_probability([[1.0, 0.0]], [0.01]).round(6))
    [0.00995 0.     ]
    """
    chance, rate = _scenarios(probability, rates, "rates")
    return np.asarray(-np.expm1(-(rate @ chance)))


def _scenarios(probability: ArrayLike, weights: ArrayLike, name: str) -> tuple[FloatArray, FloatArray]:
    chance = np.atleast_2d(checks.between("probability", probability, 0.0, 1.0))
    weight = np.atleast_1d(checks.not_negative(name, weights))
    if weight.shape != chance.shape[:1]:
        raise ValueError(f"{name} must be one a scenario ({chance.shape[0]}), got {weight.size}")
    return chance, weight


def ensemble_table(tables: Sequence[pd.DataFrame], names: Sequence[str], weights: ArrayLike) -> pd.DataFrame:
    """
    Join the risk tables of several scenarios.

    Parameters
    ----------
    tables : sequence of DataFrame
        Risk tables of the same inventory with ``pair_id`` and ``probability``, in any order of rows.
    names : sequence of str
        Of the scenarios, each once.
    weights : (n_scenarios,) array_like
        See :func:`conditional_probability`. If they are rates (1/year), :func:`annual_probability` of
        ``[f"probability_{name}"]`` gives the probability in a year.

    Returns
    -------
    DataFrame
        One row a pair, likeliest first: ``pair_id, probability`` (given that one of the scenarios happens),
        ``worst_scenario`` and ``probability_<name>`` of each. ``attrs["rejected"]`` holds the pairs that lack a
        probability in a scenario, with the names of these scenarios.

    Raises
    ------
    ValueError
        If there are not as many names as tables, or one stands twice.
    """
    if len(names) != len(tables) or len(set(names)) != len(names) or not names:
        raise ValueError(f"names must be one a table ({len(tables)}), each once, got {', '.join(names)}")
    each = {f"probability_{name}": _of_pairs(table) for name, table in zip(names, tables, strict=True)}
    joined = pd.DataFrame(each).rename_axis("pair_id")
    lacking = joined[joined.isna().any(axis=1)]
    complete = joined.dropna()
    probability = conditional_probability(complete.to_numpy().T, weights)
    worst = np.array(names, dtype=object)[np.argmax(complete.to_numpy(), axis=1)]
    table = complete.reset_index()
    table.insert(1, "probability", probability)
    table.insert(2, "worst_scenario", worst)
    table = table.sort_values(["probability", "pair_id"], ascending=[False, True], ignore_index=True)
    table.attrs["rejected"] = tuple(_lacks(str(pair), row) for pair, row in lacking.iterrows())
    return table


def _of_pairs(table: pd.DataFrame) -> pd.Series:
    return table.set_index("pair_id")["probability"]


def _lacks(pair: str, row: pd.Series) -> Rejection:
    missing = ", ".join(str(name).removeprefix("probability_") for name in row.index[row.isna()])
    return Rejection("pair", pair, "", None, (f"no probability in {missing}",))
