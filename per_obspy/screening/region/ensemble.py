"""Several scenarios together: the probability that a pair pounds in any of them, or in a year."""

from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.errors import Rejection
from per_obspy.inventory.schema import COLUMNS, COMPLETED, Column


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
    joined: FloatArray = np.minimum(_weighted(chance, weight / weight.sum()), 1.0)
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
    return np.asarray(-np.expm1(-_weighted(chance, rate)))


def _weighted(chance: FloatArray, weight: FloatArray) -> FloatArray:
    """Return the weighted sum of each pair; unlike a matrix product, the same bits whatever pairs stand beside it."""
    total = np.zeros(chance.shape[1])
    for row, factor in zip(chance, weight, strict=True):
        total += factor * row
    return total


def _scenarios(
    probability: ArrayLike, weights: ArrayLike, name: str
) -> tuple[FloatArray, FloatArray]:
    chance = np.atleast_2d(checks.between("probability", probability, 0.0, 1.0))
    weight = np.atleast_1d(checks.not_negative(name, weights))
    if weight.shape != chance.shape[:1]:
        raise ValueError(f"{name} must be one a scenario ({chance.shape[0]}), got {weight.size}")
    return chance, weight


#: What all scenarios must agree on, else equal names are not the same pair.
SAME = {"gap": "m", "longitude": "degrees", "latitude": "degrees"}


def ensemble_columns(weights: Mapping[str, float], yearly: bool) -> dict[str, Column]:
    """Return name, unit and meaning of every column of the table of several scenarios, in their order."""
    given = [f"{name} ({weight:g}{'/year' if yearly else ''})" for name, weight in weights.items()]
    columns = [
        Column("rank", "int64", "", "1 is the likeliest to pound"),
        Column("pair_id", "str", "", COLUMNS["pair_id"].meaning),
        Column(
            "probability",
            "float64",
            "1",
            f"of pounding, given that one of these happens: {', '.join(given)}",
        ),
        Column(
            "annual_probability",
            "float64",
            "1",
            "of pounding within a year, scenarios coming as a Poisson process",
        ),
        Column(
            "worst_scenario", "str", "", "name of the one that is likeliest to make the pair pound"
        ),
        *(
            Column(f"probability_{name}", "float64", "1", f"of pounding in scenario {name}")
            for name in weights
        ),
        *((COLUMNS | COMPLETED)[name] for name in SAME),
    ]
    return {one.name: one for one in columns if yearly or one.name != "annual_probability"}


def ensemble_rows(joined: pd.DataFrame, weights: Mapping[str, float], yearly: bool) -> pd.DataFrame:
    """
    Return the probabilities of pairs whose scenarios were joined.

    Parameters
    ----------
    joined : DataFrame
        ``pair_id``, ``probability_<name>`` of each scenario, and the smallest and largest value in
        any scenario of what is the same in all: ``gap``, ``gap_largest`` and so on.
    weights : mapping of str to float
        Weight of each scenario; see :func:`conditional_probability`.
    yearly : bool
        Whether weights are rates, 1/year: :func:`annual_probability` is a column then.

    Returns
    -------
    DataFrame
        Columns of :func:`ensemble_columns` without ``rank``, in the order of the rows; without the
        pairs that :func:`ensemble_rejections` names.
    """
    kept = joined[_faultless(joined, weights)]
    each = kept[[f"probability_{name}" for name in weights]].to_numpy(np.float64)
    values = np.array(list(weights.values()))
    found = {"probability": conditional_probability(each.T, values)}
    if yearly:
        found["annual_probability"] = annual_probability(each.T, values)
    worst = np.array(list(weights), dtype=object)[np.argmax(each, axis=1)]
    names = [name for name in ensemble_columns(weights, yearly) if name != "rank"]
    return kept.assign(**found, worst_scenario=worst)[names].reset_index(drop=True)


def ensemble_rejections(joined: pd.DataFrame, weights: Mapping[str, float]) -> Iterator[Rejection]:
    """Give the pairs that lack a probability in a scenario, or are not the same pair in all of them."""
    for row in joined[~_faultless(joined, weights)].to_dict("records"):
        lacking = [name for name in weights if np.isnan(row[f"probability_{name}"])]
        reasons = [
            f"no probability in {', '.join(lacking)}: not in its inventory, or rejected there"
        ] * bool(lacking)
        reasons += [
            f"{name} = {row[name]:.9g} {unit} in one scenario and {row[f'{name}_largest']:.9g} {unit} in another"
            for name, unit in SAME.items()
            if row[name] != row[f"{name}_largest"]
        ]
        yield Rejection("pair", str(row["pair_id"]), "", None, tuple(reasons))


def _faultless(joined: pd.DataFrame, weights: Mapping[str, float]) -> NDArray[np.bool_]:
    good: NDArray[np.bool_] = (
        joined[[f"probability_{name}" for name in weights]].notna().all(axis=1).to_numpy()
    )
    for name in SAME:
        good = good & (joined[name] == joined[f"{name}_largest"]).to_numpy()
    return good
