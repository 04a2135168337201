"""
Sensitivity of a pair to each input that is uncertain: its chance of contact at other values of it.

Each input is set in turn to the value that it does not exceed in 16, and in 84, of 100 cases: one
standard deviation on both sides of the median of a normal variable. Everything else of the pair
stays as uncertain as it is, and the row is computed again as the risk table computes it.
"""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
import pandas as pd

from per_obspy.checks import FloatArray
from per_obspy.config import Building, Screening
from per_obspy.screening.population import (
    LARGEST_DAMPING,
    gap_dispersion,
    median_gap,
    one_wall_chance,
)
from per_obspy.screening.ranking import kept_apart
from per_obspy.screening.risk import contact_chances
from per_obspy.screening.site_motion import RegionalMotion
from per_obspy.screening.values import BoolArray, values

#: Inputs that have a logarithmic standard deviation; the gap has one in metres.
LOGNORMAL = (
    *("period_1", "period_2", "damping_1", "damping_2"),
    *("yield_displacement_1", "yield_displacement_2"),
)

#: Standard deviation of Fisher's z of a derived correlation of both periods. Reasoned: one step of
#: likeness, from 0.5 down to 0 and up to 0.82.
CORRELATION_STD = 0.6

#: Share of outcomes below the lower value; as many lie above the upper one.
TAIL = 0.16

#: A row that is computed again must have its probability; else its inputs are not all known.
TOLERANCE = 0.005

#: Lower and upper values of an input, and rows in which it is uncertain.
Ends = tuple[FloatArray, FloatArray, BoolArray]


class Sensitivity(NamedTuple):
    """
    Outcome of a pair at both values of one input.

    Attributes
    ----------
    pair_id : str
        The pair.
    name : str
        Column of the input.
    low, high : float
        Its values, s, m or a fraction of critical.
    probability_low, probability_high : float
        Of contact at these values.
    state_low, state_high : str
        States at these values.
    """

    pair_id: str
    name: str
    low: float
    high: float
    probability_low: float
    probability_high: float
    state_low: str
    state_high: str


def input_sensitivity(
    rows: pd.DataFrame, ground: RegionalMotion, building: Building, screening: Screening
) -> list[Sensitivity]:
    """
    Return how the chance of contact depends on each uncertain input of some pairs.

    Rows of the risk table have all columns; ground and settings are those with which they were
    computed. None of a pair without probability, or whose row cannot be computed again from its
    columns.
    """
    known = rows[rows["probability"].notna()].reset_index(drop=True)
    inputs = {name: ends for name, ends in _ends(known).items() if ends[2].any()}
    if not inputs:
        return []
    # Rows are compared with themselves: of other settings they have other probabilities
    found = contact_chances(_variants(known, inputs), ground, building, screening)
    by_name = found.set_index("pair_id")
    same = _same(known, by_name)
    return [
        outcome
        for name, (low, high, varies) in inputs.items()
        for outcome in _outcomes(
            known, name, (low, high, varies & same & _found(known, name, by_name)), by_name
        )
    ]


def _variants(known: pd.DataFrame, inputs: dict[str, Ends]) -> pd.DataFrame:
    """Return the rows as they are, and with each input at both of its values, as a pair table."""
    given = _as_given(known)
    # Every variant is a pair with a name of its own
    variants = [given.assign(pair_id=_names(range(len(known)), "", 0))]
    for name, (low, high, varies) in inputs.items():
        for side, value in enumerate((low, high)):
            names = _names(range(len(known)), name, side)
            changed = _with_value(given, name, value).assign(pair_id=names)
            variants.append(changed[varies])
    return pd.concat(variants, ignore_index=True)


def _names(rows: Iterable[int], name: str, side: int) -> list[str]:
    """Return names of variants: number of the row, input and side."""
    return [f"{row} {name} {side}" for row in rows]


def _found(known: pd.DataFrame, name: str, found: pd.DataFrame) -> BoolArray:
    """Return which rows have an outcome at both values: a spectrum may not reach one of them."""
    ends = [pd.Index(_names(range(len(known)), name, side)).isin(found.index) for side in (0, 1)]
    return np.asarray(ends[0] & ends[1])


def _same(known: pd.DataFrame, found: pd.DataFrame) -> BoolArray:
    """Return which rows have the probability of the risk table when they are computed again."""
    again = found["probability"].reindex(_names(range(len(known)), "", 0)).to_numpy(np.float64)
    # NaN of a pair that was rejected compares as false
    return np.asarray(np.abs(again - values(known, "probability")) <= TOLERANCE)


def _outcomes(
    known: pd.DataFrame, name: str, ends: Ends, found: pd.DataFrame
) -> Iterator[Sensitivity]:
    """Yield the outcome of each chosen pair at both values of an input."""
    low, high, chosen = ends
    rows = np.flatnonzero(chosen)
    # Rows are named by pair, input and side
    sides = [found.loc[_names(rows.tolist(), name, side)] for side in (0, 1)]
    chances = [values(side, "probability").tolist() for side in sides]
    states = [side["state"].astype(str).tolist() for side in sides]
    columns = (low[rows].tolist(), high[rows].tolist(), *chances, *states)
    for pair_id, *outcome in zip(known["pair_id"].iloc[rows], *columns, strict=True):
        yield Sensitivity(pair_id, name, *outcome)


def _as_given(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the rows as a pair table; derived values with a deviation are empty."""
    derived = rows["derived"].str.split()
    columns: dict[str, pd.Series] = {}
    # An empty period keeps its deviation; masses and heights have none of their own
    for name in (*LOGNORMAL, "gap", "period_correlation"):
        is_derived = derived.map(lambda names, name=name: name in names)
        columns[name] = rows[name].mask(is_derived, np.nan)
    return rows.assign(**columns)


def _with_value(given: pd.DataFrame, name: str, value: FloatArray) -> pd.DataFrame:
    changed = given.assign(**{name: value})
    if name == "period_correlation":
        return changed
    return changed.assign(**{"gap_std" if name == "gap" else _deviation(name): 0.0})


def _deviation(name: str) -> str:
    return f"{name.split('_')[0]}_log_std_{name[-1]}"


def _ends(rows: pd.DataFrame) -> dict[str, Ends]:
    """Return the lower and the upper value of each input, and the rows in which it is uncertain."""
    ends = {}
    for name in LOGNORMAL:
        deviation = np.nan_to_num(values(rows, _deviation(name)))
        median, spread = values(rows, name), np.exp(deviation)
        # A damping stays below the critical one, as at the nodes
        largest = np.maximum(median, LARGEST_DAMPING) if "damping" in name else np.inf
        ends[name] = median / spread, np.minimum(median * spread, largest), deviation > 0.0
    # a derived correlation is below 1
    is_derived = rows["derived"].str.contains("period_correlation").to_numpy(bool)
    shared = np.arctanh(np.where(is_derived, values(rows, "period_correlation"), 0.0))
    low, high = np.tanh(shared - CORRELATION_STD), np.tanh(shared + CORRELATION_STD)
    ends["period_correlation"] = np.maximum(low, 0.0), high, is_derived
    return ends | {"gap": _gap_ends(rows)}


def _gap_ends(rows: pd.DataFrame) -> Ends:
    """Return both values of the gap, m; the lower one is 0 where the walls may be one."""
    marked = kept_apart(rows)
    median, deviation = median_gap(marked), gap_dispersion(marked)
    low = np.where(one_wall_chance(marked) > TAIL, 0.0, median * np.exp(-deviation))
    return low, median * np.exp(deviation), deviation > 0.0
