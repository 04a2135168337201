"""
Pairs whose gap is unknown: their demand is known, everything that depends on the gap is empty.

Such pairs are computed as if their buildings were too far apart to meet, and the columns that
depend on the gap are emptied at the end. A pair whose gap is assumed by the configuration
(``[building] gap``) keeps them; its risk class remains ``gap unknown``.
"""

import numpy as np
import pandas as pd

from per_obspy.screening.codes import SUFFICES
from per_obspy.screening.ranking import UNKNOWN_STATE
from per_obspy.screening.values import values

#: Gap with which pairs of unknown gap are computed, m: further than any building moves.
APART = 1000.0

#: Risk class of every pair whose gap is unknown, assumed or not.
UNKNOWN_CLASS = "gap unknown"

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
