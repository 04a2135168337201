"""Scores of predictions at places that were left out: errors, Brier scores, bins of probability."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy.special import ndtr

from per_obspy.checks import FloatArray

#: Ends of the bins of distance, km.
DISTANCES = (0.0, 3.0, 10.0, 20.0, 50.0, np.inf)


def weights(rows: pd.DataFrame) -> FloatArray:
    """Return weights of cases with which every earthquake counts alike."""
    return 1.0 / rows.groupby("event")["station"].transform("size").to_numpy(dtype=np.float64)


def rms(errors: ArrayLike, weight: ArrayLike) -> float:
    """Return the root of the weighted mean square."""
    return float(np.sqrt(np.average(np.square(errors), weights=weight)))


def brier(rows: pd.DataFrame, weight: ArrayLike) -> tuple[float, float]:
    """Return the Brier scores of the probability and of that of the scaled record alone."""
    larger = (rows["true"] > rows["gap"]).to_numpy(dtype=np.float64)
    alone = ndtr((rows["ln_record"] - np.log(rows["gap"])) / rows["record_log_std"])
    scores = [np.square(np.asarray(chance) - larger) for chance in (rows["probability"], alone)]
    return tuple(float(np.average(score, weights=weight)) for score in scores)


def by_distance(rows: pd.DataFrame) -> Iterator[tuple[str, pd.DataFrame]]:
    """Yield label and rows of every bin of the distance between place and record."""
    kilometres = rows["distance"] / 1000.0
    for low, high in pairwise(DISTANCES):
        some = rows[(kilometres > low) & (kilometres <= high)]
        if len(some):
            yield distance_label(low, high), some


def distance_label(low: float, high: float) -> str:
    """Return the words for a bin of distance."""
    return f"{low:g} to {high:g} km" if np.isfinite(high) else f"beyond {low:g} km"


def bins(rows: pd.DataFrame, name: str = "probability") -> pd.DataFrame:
    """
    Return reliability in tenths of the probability, indexed by their lower ends.

    Columns are ``predicted`` (mean probability), ``share`` (of demands larger than the gap),
    ``doubt`` (one deviation of the share, cases at a place dependent) and ``cases``.
    """
    tenth = np.minimum((rows[name] * 10).astype(int), 9) / 10
    found = {}
    for low, some in rows.groupby(tenth):
        larger = (some["true"] > some["gap"]).astype(float)
        by_place = (larger - larger.mean()).groupby([some["event"], some["station"]]).sum()
        doubt = np.sqrt((by_place**2).sum()) / len(some)
        found[round(low, 1)] = (some[name].mean(), larger.mean(), doubt, len(some))
    return pd.DataFrame.from_dict(
        found, orient="index", columns=["predicted", "share", "doubt", "cases"]
    )
