"""
The rows of the risk table, not ranked yet: pairs with the records of their stations, station by station.

A row depends on its pair, its station and the settings, and on no other row.
"""

from collections.abc import Iterator

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray
from pandas.api.types import is_numeric_dtype

from per_obspy.config import Building, Screening
from per_obspy.errors import Rejection
from per_obspy.inventory.completion import completed_pairs
from per_obspy.screening.by_record.demand import demand_ratio, pounding_state
from per_obspy.screening.by_record.estimates import judged
from per_obspy.screening.by_record.exact import exact_decides, furthest_azimuth
from per_obspy.screening.by_record.pair_radii import (
    PairMotion,
    motion_along_azimuths,
    motion_along_every_azimuth,
    motion_of_one_horizontal,
)
from per_obspy.screening.by_spectrum.shakemap_table import shakemap_fallback
from per_obspy.screening.codes import code_columns, rule_columns
from per_obspy.screening.columns import FLAGS, ORDER, RESULTS
from per_obspy.screening.flags import (
    joined_flags,
    period_is_derived,
    raised_by_pairs,
    raised_by_record,
)
from per_obspy.screening.ground_motion.assignment import assigned
from per_obspy.screening.ground_motion.site_motion import RegionalMotion, motion_at_pairs
from per_obspy.screening.mitigation import mitigation_columns
from per_obspy.screening.ranking import KEYS, risk_class
from per_obspy.screening.uncertainty.probability import pair_probability
from per_obspy.screening.values import Columns, at_contact, chosen, joined, values

#: Needed on the way only; flags tell what is to be known of them.
ON_THE_WAY = (
    "station_index",
    "other_site_class",
    "linearized_converged",
    "motion_from_other_site_class",
    *(f"equivalent_{name}_{i}" for name in ("period", "damping", "per") for i in (1, 2)),
)

#: Pairs of unknown azimuth that are judged together: at 180 azimuths every array of theirs stays
#: below 3 MB.
BLOCK = 2000


def risk_rows(
    pairs: pd.DataFrame, ground: RegionalMotion, building: Building, screening: Screening
) -> tuple[pd.DataFrame, tuple[Rejection, ...]]:
    """
    Return one row a pair, in no particular order, and the pairs that have no station in reach.

    Parameters
    ----------
    pairs : DataFrame
        From :func:`per_obspy.read_pairs`, or some rows of it; its columns named as results are
        replaced.
    ground : RegionalMotion
        The ground motion; only stations that serve a pair are read.
    building, screening : Building, Screening
        What is assumed; thresholds.

    Returns
    -------
    rows : DataFrame
        Columns in the order of ``screening.columns.ORDER`` without ``rank``, then the other columns
        of the pair table.
    rejected : tuple of Rejection
        Pairs that neither a station nor the map serves.
    """
    complete = completed_pairs(_without_results(pairs), building)
    placed, rejected = assigned(complete, ground.stations, screening.largest_distance)
    tables = [_of_stations(placed.reset_index(drop=True), ground, screening)] if len(placed) else []
    if ground.shakemap is not None and rejected:
        mapped, rejected = shakemap_fallback(ground.shakemap, complete, rejected, screening)
        tables += [mapped] if len(mapped) else []
    rows = pd.concat(tables, ignore_index=True) if tables else placed.reindex(columns=[*ORDER])
    return _ordered(rows), rejected


def _without_results(pairs: pd.DataFrame) -> pd.DataFrame:
    """Return the pairs without columns named as those of this table: an earlier one may serve as a pair table."""
    ours = {*RESULTS, *rule_columns(), *ON_THE_WAY, *KEYS, *(f"raised_{flag}" for flag in FLAGS)}
    return pairs.drop(columns=[name for name in pairs if name in ours])


def _of_stations(pairs: pd.DataFrame, ground: RegionalMotion, screening: Screening) -> pd.DataFrame:
    """Return the rows of pairs that have a station."""
    if ground.field is not None:
        pairs = pairs.assign(
            **motion_at_pairs(ground.field, pairs, pairs["station_index"].to_numpy())
        )
    index = pairs["station_index"].to_numpy(np.int64)
    known = {
        name: pairs[name].to_numpy()
        for name in pairs
        if name == "derived" or is_numeric_dtype(pairs[name])
    }
    blocks = [(station, np.flatnonzero(index == station)) for station in np.unique(index).tolist()]
    told = [
        (rows, _told(ground.stations.read(one), chosen(known, rows), screening))
        for one, rows in blocks
    ]
    return _judged_as_a_whole(pairs.assign(**joined(told)), screening)


def _told(station: xr.Dataset, block: Columns, screening: Screening) -> Columns:
    """Return what a record tells of its pairs; flags that it raises as columns ``raised_...``."""
    table = joined(
        [
            (rows, judged(station, chosen(block, rows), motion, rule, screening.exact))
            for rows, motion, rule in _motions(station, block, screening.exact)
        ]
    )
    table |= mitigation_columns(station, table, screening.target_amplification)
    raised = {
        f"raised_{name}": rows for name, rows in raised_by_record(table, station, screening).items()
    }
    table |= {"probability": pair_probability(station, table, screening), **raised}
    return {name: column for name, column in table.items() if name not in block}


def _judged_as_a_whole(table: pd.DataFrame, screening: Screening) -> pd.DataFrame:
    """Return the table with everything that needs no record any more: state, class, code rules, flags."""
    gap, demand, probability = (values(table, name) for name in ("gap", "demand", "probability"))
    ratio = demand_ratio(gap, demand)
    possible = period_is_derived(table) | (probability >= screening.possible_from)
    state, named = pounding_state(gap, demand, possible), risk_class(ratio, screening.classes)
    table = table.assign(demand_ratio=ratio, state=state, risk_class=named)
    by_record = {flag: f"raised_{flag}" for flag in FLAGS if f"raised_{flag}" in table}
    raised = {flag: table[name].to_numpy(dtype=bool) for flag, name in by_record.items()}
    flags = joined_flags(raised_by_pairs(table) | raised)
    rules = code_columns(table, *at_contact(table, "sd"), codes=screening.codes)
    return table.drop(columns=[*ON_THE_WAY, *by_record.values()]).assign(flags=flags).join(rules)


def _ordered(table: pd.DataFrame) -> pd.DataFrame:
    """Return the leading columns in their order, then the others."""
    first = [name for name in ORDER if name != "rank"]
    return table[[*first, *(name for name in table if name not in ORDER)]]


def _motions(
    station: xr.Dataset, block: Columns, exact: bool
) -> Iterator[tuple[NDArray[np.intp], PairMotion, str]]:
    """Give the rows of a block by how their azimuth is found, with their motion and the name of that way."""
    azimuth = values(block, "azimuth")
    if station.sizes["horizontal"] == 1:
        yield np.arange(azimuth.size), motion_of_one_horizontal(station, block), "station"
        return
    unknown, decides = np.isnan(azimuth), exact & exact_decides(station, block)
    if (given := np.flatnonzero(~unknown)).size:
        yield given, motion_along_azimuths(station, chosen(block, given), azimuth[given]), "given"
    if (worst := np.flatnonzero(unknown & decides)).size:
        pairs = chosen(block, worst)
        yield (
            worst,
            motion_along_azimuths(station, pairs, furthest_azimuth(station, pairs)),
            "worst",
        )
    worst = np.flatnonzero(unknown & ~decides)
    for some in (worst[first : first + BLOCK] for first in range(0, worst.size, BLOCK)):
        yield some, motion_along_every_azimuth(station, chosen(block, some)), "worst"
