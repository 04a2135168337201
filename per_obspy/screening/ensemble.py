"""Probability of pounding of each pair over several scenarios, and within a year."""

from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy.special import ndtr, ndtri

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.config.run import TARGET_RATE
from per_obspy.errors import Rejection
from per_obspy.inventory.schema import COLUMNS, COMPLETED, Column
from per_obspy.screening.columns import DEMAND_SHARES, HAZARD
from per_obspy.screening.population import at_rows
from per_obspy.screening.ranking import velocity_of_unknown
from per_obspy.screening.values import BoolArray, Both, Columns, IndexArray


def conditional_probability(probability: ArrayLike, weights: ArrayLike) -> FloatArray:
    """
    Compute the probability given that one of the scenarios happens, ``sum(w P) / sum(w)``.

    Parameters
    ----------
    probability : (n_scenarios, n_pairs) array_like
        Of pounding in each scenario, from 0 to 1.
    weights : (n_scenarios,) array_like
        Weight of each scenario relative to the others; any positive sum.

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
    pounding, weight = _scenarios(probability, weights, "weights")
    if not weight.sum() > 0:
        raise ValueError(f"weights must have a positive sum, got {weight.sum():g}")
    joined: FloatArray = np.minimum(_weighted_sum(pounding, weight / weight.sum()), 1.0)
    return joined


def annual_probability(probability: ArrayLike, rates: ArrayLike) -> FloatArray:
    """
    Compute the probability that a pair pounds within a year, ``1 - exp(-sum(rate P))``.

    Scenarios come as a Poisson process, and pounding does not change a pair.

    Parameters
    ----------
    probability : (n_scenarios, n_pairs) array_like
        Of pounding in each scenario, from 0 to 1.
    rates : (n_scenarios,) array_like
        Rate of each scenario, 1/year.

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
    pounding, rate = _scenarios(probability, rates, "rates")
    return np.asarray(-np.expm1(-_weighted_sum(pounding, rate)))


def _weighted_sum(probability: FloatArray, weight: FloatArray) -> FloatArray:
    """Return the weighted sum over the scenarios for each pair."""
    # Unlike a matrix product, this gives a pair the same bits whatever other pairs there are
    total = np.zeros(probability.shape[1])
    for row, factor in zip(probability, weight, strict=True):
        total += factor * row
    return total


def _scenarios(probability: ArrayLike, weights: ArrayLike, name: str) -> Both:
    """Check probabilities, (n_scenarios, n_pairs), and one weight or rate per scenario."""
    pounding = np.atleast_2d(checks.between("probability", probability, 0.0, 1.0))
    weight = np.atleast_1d(checks.not_negative(name, weights))
    if weight.shape != pounding.shape[:1]:
        raise ValueError(f"{name} must be one a scenario ({pounding.shape[0]}), got {weight.size}")
    return pounding, weight


#: Columns, with units, in which all scenarios must agree, else equal names are not the same pair.
SAME = {"gap": "m", "longitude": "degrees", "latitude": "degrees"}

#: Expected severity of a pair in a scenario, by which pairs are ordered, and its value where it is
#: unknown: that without contact.
SEVERITY = {
    "expected_impact_velocity": 0.0,
    "weighted_velocity": 0.0,
    "expected_amplification": 1.0,
}

#: Periods of both buildings, which give unknown gaps their place among the others.
PERIODS = ("period_1", "period_2")

#: Column by which pairs are ordered, m/s: ``weighted_velocity``, or what stands for it.
ORDER = "order_velocity"

#: Columns that do not depend on the scenarios; ``probability`` is the third.
JOINED = (
    Column(
        "rank",
        "int64",
        "",
        "1 is the worst: by weighted_velocity, then amplification; an unknown gap by the gap that "
        "is needed, a pair that a scenario lacks by the other scenarios",
    ),
    Column("pair_id", "str", "", COLUMNS["pair_id"].meaning),
    Column(
        "annual_probability",
        "float64",
        "1",
        "of pounding within a year, scenarios coming as a Poisson process",
    ),
    Column("expected_impact_velocity", "float64", "m/s", "weighted mean of those in the scenarios"),
    Column("configuration", "str", "", "that of the pair in the runs"),
    Column(
        "weighted_velocity",
        "float64",
        "m/s",
        "weighted mean of those in the scenarios, which have the factor of the configuration",
    ),
    Column(
        "expected_amplification",
        "float64",
        "1",
        "weighted mean of those in the scenarios; 1 without contact",
    ),
    Column(
        "worst_scenario", "str", "", "name of the one with the largest expected impact velocity"
    ),
)


#: Columns of the gap that a planner asks for; rates are needed.
GAPS = ("gap_for_target", "missing_gap_for_target")

#: Halvings of the range of gaps from ``SMALLEST`` to ``LARGEST``, m, in which one is searched: the
#: last step is 1e-6 of the gap.
HALVINGS, SMALLEST, LARGEST = 24, 1e-4, 100.0


def ensemble_columns(weights: Mapping[str, float], yearly: bool) -> dict[str, Column]:
    """
    Return the columns of the ensemble table in order, by name.

    Weights are those of the scenarios, by name, or their rates where ``yearly``, 1/year:
    ``annual_probability`` is a column then.
    """
    unit = "/year" if yearly else ""
    scenarios = ", ".join(f"{name} ({weight:g}{unit})" for name, weight in weights.items())
    chance = f"of pounding, given that one of these happens: {scenarios}; empty if one lacks it"
    columns = [*JOINED[:2], Column("probability", "float64", "1", chance), *JOINED[2:]]
    # Columns of the scenarios follow the joined ones
    for name in weights:
        meaning = f"of pounding in scenario {name}; empty: gap unknown, or no row there"
        columns.append(Column(f"probability_{name}", "float64", "1", meaning))
    columns += [(COLUMNS | COMPLETED)[name] for name in SAME]
    columns += [HAZARD[name] for name in GAPS]
    # weights that are no rates leave out what holds in a year
    of_rates = () if yearly else ("annual_probability", *GAPS)
    return {column.name: column for column in columns if column.name not in of_rates}


def ensemble_rows(
    joined: pd.DataFrame,
    weights: Mapping[str, float],
    yearly: bool,
    target_rate: float = TARGET_RATE,
) -> pd.DataFrame:
    """
    Compute the probabilities of pairs from their joined scenarios.

    Parameters
    ----------
    joined : DataFrame
        ``pair_id``, ``configuration`` and ``PERIODS`` (s); ``probability_<name>``,
        ``demand_<name>`` (m) and the columns of ``SEVERITY`` of each scenario, such as
        ``weighted_velocity_<name>`` (m/s); and the smallest and largest value in any scenario of
        each column of ``SAME``: ``gap``, ``gap_largest`` and so on.
    weights : mapping of str to float
        Weight of each scenario; see :func:`conditional_probability`.
    yearly : bool
        Whether weights are rates, 1/year: :func:`annual_probability` and the gap for the target are
        columns then; ``joined`` has the columns of ``DEMAND_SHARES`` of each scenario.
    target_rate : float
        Annual rate of contact that is accepted, 1/year.

    Returns
    -------
    DataFrame
        Columns of :func:`ensemble_columns` without ``rank``, and ``ORDER``, in the order of the
        rows; without the pairs that :func:`ensemble_rejections` names. Probabilities and severities
        are NaN where a scenario has none.
    """
    rows = joined[_comparable(joined)].reset_index(drop=True)
    weight, velocity = np.array(list(weights.values())), _order_velocities(rows, weights)
    pounding = _of_scenarios(rows, "probability", weights)
    # Rank and hardest impact are of the scenarios that have the pair
    columns = {
        **_joint_columns(rows, weights, yearly),
        **(_gap_columns(rows, weights, target_rate) if yearly else {}),
        ORDER: _mean_of_known(velocity, weight),
        "worst_scenario": np.array(list(weights), dtype=object)[_worst(pounding, velocity)],
    }
    names = [name for name in ensemble_columns(weights, yearly) if name != "rank"]
    return rows.assign(**columns)[[*names, ORDER]]


def gap_for_rate(demands: ArrayLike, rates: ArrayLike, target: float) -> FloatArray:
    """
    Return the gap at which the annual rate of contact falls to a target.

    Parameters
    ----------
    demands : (n_scenarios, n_shares, n_pairs) array_like
        Demands that the shares of ``DEMAND_SHARES`` do not exceed in each scenario, m, rising.
        Between them, and beyond, the logarithm of the demand is linear in the normal score of the
        share.
    rates : (n_scenarios,) or (n_scenarios, n_pairs) array_like
        Rate of each scenario, 1/year.
    target : float
        Annual rate of contact, 1/year.

    Returns
    -------
    gap : (n_pairs,) ndarray
        m; 0 where contact is rarer without a gap, NaN where a demand is.
    """
    ln_demand, rate = np.log(np.asarray(demands, dtype=np.float64)), np.asarray(rates)
    scores = ndtri([*DEMAND_SHARES.values()])[:, None] + np.zeros(ln_demand.shape[1:])

    low, high = np.full((2, ln_demand.shape[2]), np.log([[SMALLEST], [LARGEST]]))
    # The rate of contact falls as the gap grows
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        chances = np.array([ndtr(-at_rows(one, scores, middle)) for one in ln_demand])
        above = _weighted_sum(chances, rate) > target
        low, high = np.where(above, middle, low), np.where(above, high, middle)
    # Where it was never above, no gap is needed
    gap = np.where(low > np.log(SMALLEST), np.exp(high), 0.0)
    return np.where(np.isnan(ln_demand).any(axis=(0, 1)), np.nan, gap)


def _of_scenarios(rows: pd.DataFrame, name: str, weights: Mapping[str, float]) -> FloatArray:
    """Return a column of every scenario, (n_scenarios, n_pairs)."""
    return rows[[f"{name}_{scenario}" for scenario in weights]].to_numpy(np.float64).T


def _joint_columns(rows: pd.DataFrame, weights: Mapping[str, float], yearly: bool) -> Columns:
    """Return probabilities and severities over all scenarios, NaN where one has none."""
    pounding, weight = _of_scenarios(rows, "probability", weights), np.array([*weights.values()])
    is_known = ~np.isnan(pounding).any(axis=0)
    chance = np.where(is_known, pounding, 0.0)
    columns: Columns = {"probability": conditional_probability(chance, weight)}
    if yearly:
        columns["annual_probability"] = annual_probability(chance, weight)
    # A severity that is unknown is that without contact
    for name, unknown in SEVERITY.items():
        beyond = np.nan_to_num(_of_scenarios(rows, name, weights) - unknown)
        columns[name] = unknown + _weighted_sum(beyond, weight / weight.sum())
    return {name: np.where(is_known, column, np.nan) for name, column in columns.items()}


def _gap_columns(rows: pd.DataFrame, weights: Mapping[str, float], target_rate: float) -> Columns:
    """Return the gap that the target asks for, and by how much the gap is too small, m."""
    demands = []
    for scenario in weights:
        # NaN where an earlier version made the run
        quantiles = rows.reindex(columns=[f"{name}_{scenario}" for name in DEMAND_SHARES])
        demands.append(quantiles.to_numpy(np.float64).T)
    needed = gap_for_rate(demands, np.array([*weights.values()]), target_rate)
    missing = np.maximum(needed - rows["gap"].to_numpy(np.float64), 0.0)
    return dict(zip(GAPS, (needed, missing), strict=True))


def _order_velocities(rows: pd.DataFrame, weights: Mapping[str, float]) -> FloatArray:
    """Return the velocity that ranks each pair in each scenario, m/s; NaN in one that lacks it."""
    velocities = []
    for name in weights:
        motion = ("probability", "weighted_velocity", "demand")
        pairs = rows[[*PERIODS]].assign(**{column: rows[f"{column}_{name}"] for column in motion})
        # As in a run: an unknown gap counts as if the buildings touched
        velocity = pairs["weighted_velocity"].fillna(0.0).to_numpy() + velocity_of_unknown(pairs)
        lacks = pairs[["probability", "demand"]].isna().all(axis=1)
        velocities.append(np.where(lacks, np.nan, velocity))
    return np.array(velocities)


def _mean_of_known(velocity: FloatArray, weight: FloatArray) -> FloatArray:
    """Return the weighted mean over the scenarios that have a pair, the largest without weight."""
    known = np.nan_to_num(velocity)
    total = _weighted_sum((~np.isnan(velocity)).astype(float), weight)
    mean: FloatArray = known.max(axis=0)
    np.divide(_weighted_sum(known, weight), total, out=mean, where=total > 0.0)
    return mean


def _worst(pounding: FloatArray, velocity: FloatArray) -> IndexArray:
    """Return the scenario of the hardest impact of each pair; of equal ones the likeliest."""
    # NaN is last in either order
    order = np.lexsort((-pounding, -velocity), axis=0)
    return np.asarray(order[0])


def ensemble_rejections(joined: pd.DataFrame) -> Iterator[Rejection]:
    """Yield rejections of pairs whose data differ between scenarios."""
    for row in joined[~_comparable(joined)].to_dict("records"):
        # Smallest and largest value of columns that must be the same
        reasons = tuple(
            f"{name} = {row[name]:.9g} {unit} in one scenario "
            f"and {row[f'{name}_largest']:.9g} {unit} in another"
            for name, unit in SAME.items()
            if row[name] < row[f"{name}_largest"]
        )
        yield Rejection("pair", str(row["pair_id"]), "", None, reasons)


def _comparable(joined: pd.DataFrame) -> BoolArray:
    """Return a mask of pairs with equal data in all scenarios that have them."""
    comparable = np.ones(len(joined), dtype=bool)
    for name in SAME:
        # An unknown gap is NaN in all of them
        comparable &= ~(joined[name] < joined[f"{name}_largest"]).to_numpy()
    return comparable
