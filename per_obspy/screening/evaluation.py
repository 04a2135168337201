"""Comparison of a prediction with observations: hit rate, Brier score, reliability."""

from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from per_obspy import checks
from per_obspy.checks import FloatArray


class Evaluation(NamedTuple):
    """
    Prediction against observation, for the pairs with an observation.

    Attributes
    ----------
    pairs, pounded : int
        Pairs with an observation, and those of them that pounded.
    hit_rate : float
        Share of the pounded pairs whose state is yes or likely; NaN if none pounded.
    hit_rate_with_possible : float
        Share of the pounded pairs whose state is yes, likely or possible.
    false_alarm_rate : float
        Share of the other pairs whose state is yes or likely; NaN if all pounded.
    brier_score : float
        Mean squared difference of probability and observation; NaN without probabilities.
    brier_score_of_the_share : float
        Score of a prediction that gives every pair the observed share: a useful one stays below
        it.
    reliability : DataFrame
        See :func:`reliability`; without rows if there are no probabilities.
    """

    pairs: int
    pounded: int
    hit_rate: float
    hit_rate_with_possible: float
    false_alarm_rate: float
    brier_score: float
    brier_score_of_the_share: float
    reliability: pd.DataFrame


def evaluation(table: pd.DataFrame) -> Evaluation:
    """
    Compare a risk table with observed pounding.

    Parameters
    ----------
    table : DataFrame
        Risk table with ``state``, ``probability`` if it has been computed, and ``observed``: 1 if
        pounding was seen, 0 if not, empty without an observation.

    Raises
    ------
    ValueError
        If no pair has an observation, or one is neither 0 nor 1.
    """
    rows = table[table["observed"].notna()]
    observed = _observed(rows["observed"])
    share = float(observed.mean())
    warned = rows["state"].isin(["yes", "likely"]).to_numpy()
    with_possible = warned | (rows["state"] == "possible").to_numpy()

    # Probabilities and observations of the pairs that have both
    missing = pd.Series(np.nan, index=rows.index)
    probability = rows.get("probability", missing).to_numpy(np.float64)
    known = ~np.isnan(probability)
    seen, predicted = observed[known], probability[known]

    # Predicting the share for every pair scores share (1 - share)
    return Evaluation(
        pairs=observed.size,
        pounded=int(observed.sum()),
        hit_rate=_share(warned[observed == 1]),
        hit_rate_with_possible=_share(with_possible[observed == 1]),
        false_alarm_rate=_share(warned[observed == 0]),
        brier_score=brier_score(seen, predicted) if known.any() else np.nan,
        brier_score_of_the_share=share * (1.0 - share),
        reliability=reliability(seen, predicted),
    )


def brier_score(observed: ArrayLike, probability: ArrayLike) -> float:
    """
    Compute the mean squared difference of probability and outcome.

    Parameters
    ----------
    observed : (n_events,) array_like
        0 or 1, at least one.
    probability : (n_events,) array_like
        From 0 to 1.

    References
    ----------
    Brier (1950), Monthly Weather Review 78, 1-3.

    Examples
    --------
    >>> brier_score([1, 0, 0, 1], [1.0, 0.0, 0.5, 0.5])
    0.125
    """
    difference = checks.between("probability", probability, 0.0, 1.0) - _observed(observed)
    return float(np.mean(difference**2))


def reliability(observed: ArrayLike, probability: ArrayLike, bins: int = 10) -> pd.DataFrame:
    """
    Compare probabilities with observed shares, in bins of equal width.

    Parameters
    ----------
    observed : (n_events,) array_like
        0 or 1.
    probability : (n_events,) array_like
        From 0 to 1.
    bins : int
        Number of bins of the probability.

    Returns
    -------
    DataFrame
        One row per bin that has events: ``low, high, events, mean_probability, observed_share``
        and ``share_std``, the standard deviation of the share if the mean probability were true.

    Examples
    --------
    >>> table = reliability([1, 0, 0, 1], [0.6, 0.1, 0.1, 0.6], bins=2)
    >>> table[["high", "events", "observed_share"]]
       high  events  observed_share
    0   0.5       2             0.0
    1   1.0       2             1.0
    """
    predicted = np.atleast_1d(checks.between("probability", probability, 0.0, 1.0))
    seen = np.asarray(observed, dtype=np.float64)
    table = pd.DataFrame({"predicted": predicted, "seen": seen})
    # A probability of 1 belongs to the last bin
    table["bin"] = np.minimum((predicted * bins).astype(np.int64), bins - 1)
    groups = table.groupby("bin")
    events, mean = groups.size(), groups["predicted"].mean()
    columns = {
        "low": events.index / bins,
        "high": (events.index + 1) / bins,
        "events": events.to_numpy(),
        "mean_probability": mean.to_numpy(),
        "observed_share": groups["seen"].mean().to_numpy(),
        "share_std": np.sqrt(mean * (1.0 - mean) / events).to_numpy(),
    }
    return pd.DataFrame(columns)


def _observed(observed: ArrayLike) -> FloatArray:
    """Check observations: at least one, each 0 or 1."""
    values = np.atleast_1d(checks.finite("observed", observed))
    if not values.size:
        raise ValueError("observed must have at least one value, got none")
    wrong = values[~np.isin(values, (0.0, 1.0))]
    if wrong.size:
        raise ValueError(f"observed must be 0 or 1, got {wrong[0]:g}")
    return values


def _share(true: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> float:
    """Return the share of true values, NaN if there are no values."""
    return float(true.mean()) if true.size else np.nan
