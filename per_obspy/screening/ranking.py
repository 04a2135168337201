"""
Order of pairs by severity and configuration, worst first; names of states and classes.

Pairs of unknown gap are computed as if their buildings were too far apart to meet, and the columns
that depend on the gap are emptied at the end. A pair whose gap is assumed by the configuration
(``[building] gap``) keeps them; its risk class remains ``gap unknown``.
"""

import numpy as np
import pandas as pd

from per_obspy.checks import FloatArray
from per_obspy.config import Screening, States
from per_obspy.config.screening import EVERY_STATE as EVERY_STATE
from per_obspy.config.screening import STATES as STATES
from per_obspy.config.screening import UNKNOWN_STATE as UNKNOWN_STATE
from per_obspy.inventory.table_columns import joined_names
from per_obspy.screening.codes import SUFFICES
from per_obspy.screening.flags import damage_is_unknown, elastic_ratios, outlines_are_learned
from per_obspy.screening.values import (
    BoolArray,
    Columns,
    IndexArray,
    TextArray,
    both,
    values,
)

#: Factors of the impact velocity by configuration, for class and rank: what one mode per building
#: does not see. Floors that hit columns shear them at less than what slabs bear; a low roof hits a
#: storey of its tall neighbour in midheight. Both are criteria of FEMA P-154 and of the New Zealand
#: guidelines (from memory); the numbers are reasoned. Light beside heavy and end of row are named
#: only: masses are in the histories of pairs, ends of rows in those of rows.
CONFIGURATIONS = {
    "floor_to_column": 2.0,
    "tall_beside_low": 1.5,
    "light_beside_heavy": 1.0,
    "end_of_row": 1.0,
}

#: Storeys by which a building is tall beside a low one (FEMA P-154, from memory), and ratio of
#: masses from which one is heavy (reasoned).
TALLER, HEAVIER = 2.0, 2.0

#: Columns by which rows are ordered, all ascending; ties are broken by ``pair_id``.
KEYS = (
    "order_velocity",
    "order_amplification",
    "order_probability",
    "order_importance",
    "order_occupants",
)

#: Expected impact velocity of a pair over its demand times the mean of both angular frequencies:
#: median of 2345 touching pairs of real and simulated records, 0.51 (log-standard deviation 0.42);
#: 0.59 where the gap is half of the demand.
VELOCITY_OF_DEMAND = 0.5


def pounding_state(probability: FloatArray, states: States) -> TextArray:
    """
    Return the state of each pair, by its probability of contact alone.

    Parameters
    ----------
    probability : (n_pairs,) ndarray
        From 0 to 1.
    states : States
        Smallest probability of each state.

    Returns
    -------
    state : (n_pairs,) ndarray of str
        One of ``STATES``.

    Examples
    --------
    >>> pounding_state(np.array([1.0, 0.9, 0.5, 0.1, 0.01, 1e-6]), States()).tolist()
    ['yes', 'yes', 'likely', 'possible', 'unlikely', 'no']
    """
    named = {name: float(getattr(states, name)) for name in STATES[:-1]}
    return _first_reached(probability, named | {STATES[-1]: 0.0})


def risk_class(velocity: FloatArray, classes: dict[str, float]) -> TextArray:
    """
    Return the first class whose threshold an expected impact velocity reaches.

    Parameters
    ----------
    velocity : (n_pairs,) ndarray
        Expected impact velocity, m/s.
    classes : dict of str to float
        Name and smallest velocity of each class, descending to 0.

    Returns
    -------
    name : (n_pairs,) ndarray of str
        Name of the class.

    Examples
    --------
    >>> risk_class(np.array([0.0, 0.1, 0.2]), {"high": 0.2, "low": 0.0}).tolist()
    ['low', 'low', 'high']
    """
    return _first_reached(velocity, classes)


def state_columns(table: pd.DataFrame, screening: Screening) -> Columns:
    """
    Return gap over demand, elastic over yield displacements, state and risk class of rows.

    The population alone decides the state, with the configuration the class. The first ratio is 0
    for touching pairs and NaN (an empty cell) where the demand is 0. Pairs of outlines that were
    learned from images, or of unknown damage, are ``unlikely`` where others are a ``no``.
    """
    gap, demand = values(table, "gap"), values(table, "demand")
    nothing = np.full(demand.shape, np.nan)
    # the largest factor of the configurations
    configuration, factor = configurations(table), np.ones(demand.shape)
    for name, is_present in configuration.items():
        factor = np.where(is_present, np.maximum(factor, CONFIGURATIONS[name]), factor)
    velocity = factor * values(table, "expected_impact_velocity")
    # no gap of learned outlines, or after damage, is known to be wide enough
    state = pounding_state(values(table, "probability"), screening.states)
    doubtful = outlines_are_learned(table) | damage_is_unknown(table)
    state[doubtful & (state == STATES[-1])] = STATES[-2]
    return {
        "demand_ratio": np.divide(gap, demand, out=nothing, where=demand > 0),
        **elastic_ratios(table),
        "state": state,
        "configuration": joined_names(configuration),
        "weighted_velocity": velocity,
        "risk_class": risk_class(velocity, screening.classes),
    }


def configurations(table: pd.DataFrame) -> dict[str, BoolArray]:
    """Return a mask of rows per configuration of ``CONFIGURATIONS``."""
    (storeys_1, storeys_2), (mass_1, mass_2) = both(table, "storeys"), both(table, "mass")
    # of the pair, or of either building
    ends = np.zeros(len(table), dtype=bool)
    for name in ("position", "position_1", "position_2"):
        if name in table:
            ends |= np.asarray(table[name] == "end")
    return {
        "floor_to_column": np.asarray(table["floors_misaligned"], dtype=bool),
        "tall_beside_low": np.abs(storeys_1 - storeys_2) >= TALLER,
        "light_beside_heavy": np.maximum(mass_1, mass_2) >= HEAVIER * np.minimum(mass_1, mass_2),
        "end_of_row": ends,
    }


def _first_reached(numbers: FloatArray, thresholds: dict[str, float]) -> TextArray:
    """Return the name of the largest threshold that each number reaches."""
    names = np.array(list(thresholds), dtype=object)
    falling = np.array(list(thresholds.values()))
    index = np.searchsorted(-falling, -numbers, side="left")
    first: TextArray = names[np.minimum(index, names.size - 1)]
    return first


def in_order(table: pd.DataFrame) -> pd.DataFrame:
    """
    Sort pairs with their population, worst first, and add the sort columns ``KEYS``.

    The order is by weighted impact velocity, then by expected amplification; ties are broken by
    probability, importance, occupants and at last the name, so that it does not depend on the order
    in which pairs were computed. Pairs without a probability, because their gap is unknown, stand
    beside the others as if their buildings touched: by ``VELOCITY_OF_DEMAND``.
    """
    keys = _order_keys(table)
    # lexsort sorts by its last row first
    badness = np.stack(list(keys.values()))
    order = np.lexsort(badness[::-1])
    order = _ties_by_name(order, badness[:, order], table["pair_id"].to_numpy(object))
    return table.assign(**keys).iloc[order].reset_index(drop=True)


def worst_first(table: pd.DataFrame) -> pd.DataFrame:
    """Sort pairs as :func:`in_order` does and add a column ``rank`` from 1."""
    ordered = in_order(table).drop(columns=[*KEYS])
    return ordered.assign(rank=np.arange(1, len(table) + 1))


def _order_keys(table: pd.DataFrame) -> dict[str, FloatArray]:
    """Return the columns ``KEYS``; the worst pair has the smallest numbers."""
    # Negated, for more is worse
    keys = (
        -np.maximum(_largest(table, "weighted_velocity"), velocity_of_unknown(table)),
        -_largest(table, "expected_amplification"),
        -_largest(table, "probability"),
        -_largest(table, "importance_1", "importance_2"),
        -_largest(table, "occupants_1", "occupants_2"),
    )
    return dict(zip(KEYS, keys, strict=True))


def _ties_by_name(order: IndexArray, badness: FloatArray, names: TextArray) -> IndexArray:
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


def velocity_of_unknown(table: pd.DataFrame) -> FloatArray:
    """Return the impact velocity that the demand stands for where the gap is unknown, else 0."""
    known = table.reindex(columns=["probability", "demand", "period_1", "period_2"])
    probability, demand, *periods = known.to_numpy(np.float64).T
    frequency = np.pi * sum(1.0 / period for period in periods)
    velocity = np.where(np.isnan(probability), VELOCITY_OF_DEMAND * frequency * demand, 0.0)
    return np.nan_to_num(velocity)


def _largest(table: pd.DataFrame, *names: str) -> FloatArray:
    """Return the largest value of columns per row, 0 where all are missing."""
    return np.asarray(table.reindex(columns=[*names]).max(axis=1).fillna(0.0), dtype=np.float64)


#: Gap with which pairs of unknown gap are computed, m: further than any building moves.
APART = 1000.0

#: Risk class of every pair whose gap is unknown, assumed or not.
UNKNOWN_CLASS = "gap unknown"

#: Risk class of pairs of an ensemble that a scenario lacks.
NO_VERDICT = "no verdict"

#: Columns of truth values that :func:`kept_apart` adds and :func:`without_gap` drops.
MARKS = ("unknown_gap", "assumed_gap")

#: Numbers that depend on the gap.
NUMBERS = (
    "gap",
    "demand_ratio",
    "probability",
    "expected_impact_velocity",
    "weighted_velocity",
    "impact_velocity_84",
    "expected_amplification",
    "impact_velocity",
    "amplification_1",
    "amplification_2",
    "impacts",
    "impact_velocity_exact",
    "amplification_exact_1",
    "amplification_exact_2",
    "residual_1",
    "residual_2",
    "residual_gap",
    "missing_gap",
    "supplemental_damping",
    "bumper_restitution",
)

#: Texts that depend on the gap.
TEXTS = ("single_hit_status",)


def kept_apart(pairs: pd.DataFrame) -> pd.DataFrame:
    """
    Return completed pairs with a substitute for unknown gaps, and the columns ``MARKS``.

    The gap is NaN where neither the pair table nor the configuration gives one.
    """
    unknown = np.isnan(values(pairs, "gap"))
    derived = pairs["derived"].tolist()
    # many rows share few different texts: each text is split once
    has_gap = {text: "gap" in text.split() for text in set(derived)}
    assumed = np.fromiter(map(has_gap.__getitem__, derived), bool, len(derived))
    gap = np.where(unknown, APART, values(pairs, "gap"))
    return pairs.assign(gap=gap, unknown_gap=unknown | assumed, assumed_gap=assumed)


def without_gap(table: pd.DataFrame) -> pd.DataFrame:
    """Empty the columns that depend on an unknown gap, and drop the columns ``MARKS``."""
    unknown = table["unknown_gap"].to_numpy(bool)
    emptied = unknown & ~table["assumed_gap"].to_numpy(bool)
    table = table.drop(columns=list(MARKS))
    # The class names the reason, whatever was assumed; an assumed gap complies with no rule
    table = table.assign(risk_class=table["risk_class"].mask(unknown, UNKNOWN_CLASS))
    if SUFFICES.name in table:
        table = table.assign(**{SUFFICES.name: table[SUFFICES.name].mask(unknown, "unknown")})
    if not emptied.any():
        return table
    # Nothing but the demand is known of the others
    numbers = {name: table[name].mask(emptied, np.nan) for name in NUMBERS if name in table}
    texts = {name: table[name].mask(emptied, "") for name in TEXTS if name in table}
    state = table["state"].mask(emptied, UNKNOWN_STATE)
    return table.assign(**numbers, **texts, state=state)
