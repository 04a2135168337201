"""
Rows of pairs without a station in reach, by a ShakeMap: the fallback demand.

A map gives pseudo-spectral acceleration at 5 % damping and few periods. The radius is its spectral
displacement, with no factor for PER: PER is never below SD, but how far above it depends on the
record, which a map does not have, and on broad-band records the gap from SD and eq. (16) is within
a log-standard deviation of 0.14 of the exact one (median 0.97), that from PER within 0.35 (1.14).
Other dampings are reached by the factor of EN 1998-1. Flags of every row report these assumptions.
"""

from collections.abc import Sequence

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from per_obspy.config import Screening
from per_obspy.errors import Rejection
from per_obspy.inventory.suspicions import ODD
from per_obspy.screening.by_spectrum.demand import spectral_columns, spectral_demand
from per_obspy.screening.by_spectrum.shakemap_motion import (
    MapMotion,
    displacement_on_map,
    motion_on_map,
    seen_from,
    uncertain_map_motion,
)
from per_obspy.screening.columns import ORDER, RESULTS
from per_obspy.screening.flags import joined_flags, raised_by_pairs
from per_obspy.screening.uncertainty.estimated import estimated_population
from per_obspy.screening.values import both, values

#: Longest way outside a map's edge that counts as on it: its coordinates have so many digits,
#: degrees.
EDGE = 1e-6


def shakemap_rows(
    shakemap: xr.Dataset, pairs: pd.DataFrame, screening: Screening
) -> tuple[pd.DataFrame, tuple[Rejection, ...]]:
    """
    Compute the rows of pairs that no station serves, and the rejections of those outside the map.

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
    inside = np.flatnonzero([not reason for reason in reasons])
    motion = _motion_at(shakemap, _taken(pairs, inside), screening.shakemap_log_std)
    # nodes of a map outside its data have no motion
    moves = np.isfinite(motion.ln_sd).all(axis=1)
    for row in inside[~moves]:
        reasons[row].append("the ShakeMap has no motion there")
    moving = MapMotion(motion.periods, motion.ln_sd[moves], motion.log_std[moves])
    rows = _rows(shakemap, moving, _taken(pairs, inside[moves]), screening)
    # one rejection per pair with a reason
    source = str(shakemap.attrs["source"])
    rejections = []
    for name, reason in zip(pairs["pair_id"], reasons, strict=True):
        if reason:
            rejections.append(Rejection("pair", name, source, None, tuple(reason)))
    return rows, tuple(rejections)


def shakemap_fallback(
    shakemap: xr.Dataset, pairs: pd.DataFrame, unreached: Sequence[Rejection], screening: Screening
) -> tuple[pd.DataFrame, tuple[Rejection, ...]]:
    """
    Compute the rows of pairs without a station; reject those outside the map with both reasons.

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

    Returns
    -------
    rows, rejected : DataFrame, tuple of Rejection
        As from :func:`shakemap_rows`.
    """
    reasons = {rejection.name: rejection.reasons for rejection in unreached}
    without_station = pairs[pairs["pair_id"].isin(list(reasons))]
    rows, rejections = shakemap_rows(shakemap, without_station, screening)
    # the station's reason comes first
    rejected = []
    for rejection in rejections:
        both_reasons = (*reasons[rejection.name], *rejection.reasons)
        rejected.append(rejection._replace(reasons=both_reasons))
    return rows, tuple(rejected)


def _taken(pairs: pd.DataFrame, rows: NDArray[np.intp]) -> pd.DataFrame:
    """Return rows of pairs by position, renumbered."""
    return pairs.iloc[rows].reset_index(drop=True)


def _motion_at(shakemap: xr.Dataset, pairs: pd.DataFrame, assumed_log_std: float) -> MapMotion:
    """Return the motion of the map at pairs."""
    longitude, latitude = values(pairs, "longitude"), values(pairs, "latitude")
    return motion_on_map(shakemap, longitude, latitude, assumed_log_std)


def _rows(
    shakemap: xr.Dataset, motion: MapMotion, pairs: pd.DataFrame, screening: Screening
) -> pd.DataFrame:
    """Return the rows of pairs that have a motion on the map."""
    period_1, period_2 = both(pairs, "period")
    damping_1, damping_2 = both(pairs, "damping")
    # demand of SD, and the population
    sd_1 = displacement_on_map(motion, period_1, damping_1)
    sd_2 = displacement_on_map(motion, period_2, damping_2)
    demand = spectral_demand(pairs, (sd_1, sd_2))
    population = estimated_population(*uncertain_map_motion(motion, pairs, demand), pairs)
    # columns of a risk table with those of SD
    named = pairs.assign(demand_rule="shakemap")
    table = spectral_columns(named, (sd_1, sd_2), demand, population, screening)
    table = table.assign(flags=_flags(shakemap, table))
    empty = {name: _empty(name) for name in ORDER if name not in table and name != "rank"}
    return table.assign(**empty).drop(
        columns=["srss_gap_sd", "absolute_gap_sd", ODD], errors="ignore"
    )


def _flags(shakemap: xr.Dataset, table: pd.DataFrame) -> NDArray[np.object_]:
    """Return the flags of every row, those of the map included."""
    every = np.ones(len(table), dtype=bool)
    scenario = shakemap.attrs.get("shakemap_event_type", "").upper() == "SCENARIO"
    of_map = {
        "shakemap_demand": every,
        "shakemap_assumed_deviation": every & ("psa_log_std" not in shakemap),
        "simulated": every & scenario,
    }
    return joined_flags(raised_by_pairs(table) | of_map)


def _empty(name: str) -> str | float:
    """Return the empty value of a risk-table column without data from a map."""
    return "" if RESULTS[name].dtype == "str" else np.nan


def _outside(shakemap: xr.Dataset, pairs: pd.DataFrame) -> list[list[str]]:
    """Return one sentence per value outside the map, pair by pair."""
    reasons: list[list[str]] = [[] for _ in range(len(pairs))]
    # column of the pairs, axis of the map, unit, and distance from the edge that counts as on it
    longitude = seen_from(shakemap, values(pairs, "longitude"))
    ranges = {
        "longitude": (longitude, "longitude", "", EDGE),
        "latitude": (values(pairs, "latitude"), "latitude", "", EDGE),
        "period_1": (values(pairs, "period_1"), "period", " s", 0.0),
        "period_2": (values(pairs, "period_2"), "period", " s", 0.0),
    }
    for name, (column, axis, unit, edge) in ranges.items():
        first, last = shakemap[axis].values[[0, -1]]
        span = f"{first:g} to {last:g}{unit}"
        # every value outside is one reason
        for row in np.flatnonzero((column < first - edge) | (column > last + edge)):
            reason = f"{name} = {column[row]:g}{unit} is outside the ShakeMap's {span}"
            reasons[row].append(reason)
    return reasons
