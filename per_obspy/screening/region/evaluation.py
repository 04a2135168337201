"""How a prediction compares with what was seen: hit rate, Brier score, reliability."""

from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from per_obspy import checks
from per_obspy.checks import FloatArray


class Evaluation(NamedTuple):
    """
    Prediction against observation, of the pairs that were looked at.

    Attributes
    ----------
    pairs, pounded : int
        Pairs with an observation, and those of them that pounded.
    hit_rate : float
        Share of the pounded pairs whose state is yes; NaN if none pounded.
    hit_rate_with_possible : float
        The same of those whose state is yes or possible.
    false_alarm_rate : float
        Share of the other pairs whose state is yes; NaN if all pounded.
    brier_score : float
        Mean squared difference of probability and observation; NaN without probabilities.
    brier_score_of_the_share : float
        What giving every pair the observed share would have scored: a useful prediction stays below
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
    Compare a risk table with its column ``observed`` (1 pounding was seen, 0 it was not, empty: nobody looked).

    Parameters
    ----------
    table : DataFrame
        Risk table with ``state``, and ``probability`` if it has been computed.

    Raises
    ------
    ValueError
        If no pair has an observation, or one is neither 0 nor 1.
    """
    looked_at = table[table["observed"].notna()]
    observed = _observed(looked_at["observed"])
    state, share = looked_at["state"].to_numpy(object), float(observed.mean())
    known = looked_at.get("probability", pd.Series(np.nan, index=looked_at.index)).to_numpy(
        np.float64
    )
    told = ~np.isnan(known)
    return Evaluation(
        pairs=observed.size,
        pounded=int(observed.sum()),
        hit_rate=_share((state == "yes")[observed == 1]),
        hit_rate_with_possible=_share((state != "no")[observed == 1]),
        false_alarm_rate=_share((state == "yes")[observed == 0]),
        brier_score=brier_score(observed[told], known[told]) if told.any() else np.nan,
        brier_score_of_the_share=share * (1.0 - share),
        reliability=reliability(observed[told], known[told]),
    )


def brier_score(observed: ArrayLike, probability: ArrayLike) -> float:
    """
    Return the mean squared difference of probability and outcome.

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
    Compare probabilities with shares, in bins of equal width.

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
        One row a bin that has events: ``low, high, events, mean_probability, observed_share``, and
        ``share_std``, the standard deviation of the share if the mean probability were true.

    Examples
    --------
    >>> reliability([1, 0, 0, 1], [0.6, 0.1, 0.1, 0.6], bins=2)[["high", "events", "observed_share"]]
       high  events  observed_share
    0   0.5       2             0.0
    1   1.0       2             1.0
    """
    given = np.atleast_1d(checks.between("probability", probability, 0.0, 1.0))
    table = pd.DataFrame({"given": given, "seen": np.asarray(observed, dtype=np.float64)})
    table["bin"] = np.minimum((given * bins).astype(np.int64), bins - 1)
    groups = table.groupby("bin")
    events, mean = groups.size(), groups["given"].mean()
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
    values = np.atleast_1d(checks.finite("observed", observed))
    if not values.size:
        raise ValueError("observed must have at least one value, got none")
    if not np.isin(values, (0.0, 1.0)).all():
        raise ValueError(
            f"observed must be 0 or 1, got {values[~np.isin(values, (0.0, 1.0))][0]:g}"
        )
    return values


def _share(true: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> float:
    return float(true.mean()) if true.size else np.nan
