"""
Pairs without a station in reach, judged by a ShakeMap: the fallback demand.

A map gives pseudo-spectral acceleration at 5 % damping and few periods. The radius is its spectral
displacement, with no factor for PER: PER is never below SD, but how far above it depends on the
record, which a map does not have, and on broad-band records the gap from SD and eq. (16) is within
a log-standard deviation of 0.14 of the exact one (median 0.97), that from PER within 0.35 (1.14).
Other dampings are reached by the factor of EN 1998-1. Everything is told row by row.
"""

from collections.abc import Sequence

import numpy as np
import pandas as pd
import xarray as xr

from per_obspy.config import Screening
from per_obspy.errors import Rejection
from per_obspy.screening.by_spectrum.demand import spectral_demand, spectral_verdict
from per_obspy.screening.by_spectrum.shakemap_motion import (
    MapMotion,
    displacement_on_map,
    motion_on_map,
    seen_from,
)
from per_obspy.screening.by_spectrum.shakemap_probability import shakemap_probability
from per_obspy.screening.columns import ORDER, RESULTS
from per_obspy.screening.flags import joined_flags, raised_by_pairs
from per_obspy.screening.values import both, values

#: Longest way outside a map's edge that counts as on it: its coordinates have so many digits,
#: degrees.
EDGE = 1e-6


def shakemap_rows(
    shakemap: xr.Dataset, pairs: pd.DataFrame, screening: Screening
) -> tuple[pd.DataFrame, tuple[Rejection, ...]]:
    """
    Return the rows of the risk table of pairs that no station serves, and the pairs that the map cannot judge either.

    Parameters
    ----------
    shakemap : Dataset
        From :func:`per_obspy.records.shakemap.read_shakemap`.
    pairs : DataFrame
        Completed pairs.
    screening : Screening
        Thresholds, risk classes and the region's values for code rules.

    Returns
    -------
    rows : DataFrame
        Not ranked, with the columns of :func:`~per_obspy.screening.rows.risk_rows`; those that need
        a record (``per_1``, ``impacts``, ``station``, ...) are empty. ``demand_rule`` is
        ``shakemap``.
    rejected : tuple of Rejection
        Pairs outside the map, without motion there, or with a period outside the map's, each with
        the value.
    """
    pairs = pairs.reset_index(drop=True)
    reasons = _outside(shakemap, pairs)
    good = np.array([not reason for reason in reasons], dtype=bool)
    inside = pairs.iloc[np.flatnonzero(good)].reset_index(drop=True)
    motion = motion_on_map(
        shakemap,
        values(inside, "longitude"),
        values(inside, "latitude"),
        screening.shakemap_log_std,
    )
    still = ~np.isfinite(motion.ln_sd).all(axis=1)
    for row in np.flatnonzero(good)[still]:
        reasons[row].append("the ShakeMap has no motion there")
    moved = MapMotion(motion.periods, motion.ln_sd[~still], motion.log_std[~still])
    rows = _judged(
        shakemap, moved, inside.iloc[np.flatnonzero(~still)].reset_index(drop=True), screening
    )
    source = str(shakemap.attrs["source"])
    named = zip(pairs["pair_id"], reasons, strict=True)
    return rows, tuple(
        Rejection("pair", name, source, None, tuple(why)) for name, why in named if why
    )


def shakemap_fallback(
    shakemap: xr.Dataset, pairs: pd.DataFrame, unreached: Sequence[Rejection], screening: Screening
) -> tuple[pd.DataFrame, tuple[Rejection, ...]]:
    """
    Return the rows of pairs that were rejected for want of a station, and those that stay rejected, with both reasons.

    Parameters
    ----------
    shakemap : Dataset
        From :func:`per_obspy.records.shakemap.read_shakemap`.
    pairs : DataFrame
        Completed pairs, those with a station among them.
    unreached : sequence of Rejection
        Of pairs, from :func:`per_obspy.screening.ground_motion.assignment.assigned`.
    screening : Screening
        As for :func:`shakemap_rows`.
    """
    reasons = {one.name: one.reasons for one in unreached}
    rows, lost = shakemap_rows(shakemap, pairs[pairs["pair_id"].isin(list(reasons))], screening)
    return rows, tuple(one._replace(reasons=(*reasons[one.name], *one.reasons)) for one in lost)


def _judged(
    shakemap: xr.Dataset, motion: MapMotion, pairs: pd.DataFrame, screening: Screening
) -> pd.DataFrame:
    sd_1, sd_2 = (
        displacement_on_map(motion, *one)
        for one in zip(both(pairs, "period"), both(pairs, "damping"), strict=True)
    )
    asked = spectral_demand(pairs, (sd_1, sd_2))
    probability = shakemap_probability(motion, pairs, asked)
    table = spectral_verdict(
        pairs.assign(demand_rule="shakemap"), (sd_1, sd_2), asked, probability, screening
    )
    every = np.ones(len(table), dtype=bool)
    raised = raised_by_pairs(table) | {
        "shakemap_demand": every,
        "shakemap_assumed_deviation": every & ("psa_log_std" not in shakemap),
        "simulated": every & (shakemap.attrs.get("shakemap_event_type", "").upper() == "SCENARIO"),
    }
    missing = np.maximum(asked.demand - values(pairs, "gap"), 0.0)
    table = table.assign(flags=joined_flags(raised), missing_gap=missing)
    empty = {name: _empty(name) for name in ORDER if name not in table and name != "rank"}
    return table.assign(**empty).drop(columns=["srss_gap_sd", "absolute_gap_sd"])


def _empty(name: str) -> str | float:
    """Return what stands in a column of the risk table that a map cannot fill."""
    return "" if RESULTS[name].dtype == "str" else np.nan


def _outside(shakemap: xr.Dataset, pairs: pd.DataFrame) -> list[list[str]]:
    """Return, pair by pair, what lies outside the map."""
    reasons: list[list[str]] = [[] for _ in range(len(pairs))]
    longitude = seen_from(shakemap, values(pairs, "longitude"))
    ranges = {
        "longitude": (longitude, "longitude", "", EDGE),
        "latitude": (values(pairs, "latitude"), "latitude", "", EDGE),
        **{f"period_{i}": (values(pairs, f"period_{i}"), "period", " s", 0.0) for i in (1, 2)},
    }
    for name, (given, axis, unit, edge) in ranges.items():
        first, last = shakemap[axis].values[[0, -1]]
        for row in np.flatnonzero((given < first - edge) | (given > last + edge)):
            span = f"{first:g} to {last:g}{unit}"
            reasons[row].append(f"{name} = {given[row]:g}{unit} is outside the ShakeMap's {span}")
    return reasons
