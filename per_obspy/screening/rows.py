"""
The rows of the risk table, not ranked yet: pairs with the records of their stations, station by station, in blocks.

A row depends on its pair, its station and the settings, and on no other row.
"""

from collections.abc import Iterator

import numpy as np
import pandas as pd
import xarray as xr

from per_obspy.config import Building, Screening
from per_obspy.errors import Rejection
from per_obspy.inventory.completion import completed_pairs
from per_obspy.screening.assignment import Stations, assigned
from per_obspy.screening.codes import code_columns
from per_obspy.screening.columns import ORDER
from per_obspy.screening.demand import demand_ratio, pounding_state
from per_obspy.screening.exact import exact_decides, furthest_azimuth
from per_obspy.screening.flags import flag_text, period_is_derived
from per_obspy.screening.judgement import judged
from per_obspy.screening.mitigation import mitigation_columns
from per_obspy.screening.motion import (
    PairMotion,
    motion_along_azimuths,
    motion_along_every_azimuth,
    motion_of_one_horizontal,
)
from per_obspy.screening.probability import pair_probability
from per_obspy.screening.ranking import risk_class
from per_obspy.screening.site_motion import StationField, motion_at_pairs
from per_obspy.screening.values import at_contact, values

#: Needed on the way only; flags tell what is to be known of them.
ON_THE_WAY = [
    "linearized_converged",
    "motion_from_other_site_class",
    *(f"equivalent_{name}_{i}" for name in ("period", "damping", "per") for i in (1, 2)),
]

#: Pairs in a block: at 180 azimuths a block of every array stays below 3 MB.
BLOCK = 2000


def risk_rows(
    pairs: pd.DataFrame, stations: Stations, field: StationField | None, building: Building, screening: Screening
) -> tuple[pd.DataFrame, tuple[Rejection, ...]]:
    """
    Return one row a pair, in no particular order, and the pairs that have no station in reach.

    Parameters
    ----------
    pairs : DataFrame
        From :func:`per_obspy.read_pairs`, or some rows of it.
    stations : Stations
        Which there are; only those that serve a pair are read.
    field : StationField or None
        The motion between them; None if there are none.
    building, screening : Building, Screening
        What is assumed; thresholds.

    Returns
    -------
    rows : DataFrame
        Columns in the order of ``screening.columns.ORDER`` without ``rank``, then the other columns of the pair table.
    rejected : tuple of Rejection
        Pairs without a station in reach.
    """
    placed, far = assigned(completed_pairs(pairs, building), stations, screening.largest_distance)
    if field is not None:
        placed = placed.assign(**motion_at_pairs(field, placed, placed["station_index"].to_numpy()))
    blocks = [_rows(stations.read(index), block, screening) for index, block in _blocks(placed)]
    rows = pd.concat(blocks, ignore_index=True) if blocks else placed.reindex(columns=[*ORDER])
    first = [name for name in ORDER if name != "rank"]
    others = [name for name in rows if name not in ORDER and name != "station_index"]
    return rows[[*first, *others]], far


def _blocks(pairs: pd.DataFrame) -> Iterator[tuple[int, pd.DataFrame]]:
    """Give blocks of pairs that share a station."""
    for index in np.unique(pairs["station_index"].to_numpy(np.int64)).tolist():
        group = pairs[pairs["station_index"] == index]
        for start in range(0, len(group), BLOCK):
            yield index, group.iloc[start : start + BLOCK]


def _rows(station: xr.Dataset, block: pd.DataFrame, screening: Screening) -> pd.DataFrame:
    """Return the finished rows of one block, not ranked yet."""
    motions = _motions(station, block, screening.exact)
    table = pd.concat([judged(station, *motion, screening.exact) for motion in motions])
    table = table.assign(**mitigation_columns(station, table, screening.target_amplification))
    gap, demand = values(table, "gap"), values(table, "demand")
    probability = pair_probability(station, table, screening)
    possible = period_is_derived(table) | (probability >= screening.possible_from)
    ratio = demand_ratio(gap, demand)
    table = table.assign(
        probability=probability,
        demand_ratio=ratio,
        state=pounding_state(gap, demand, possible),
        risk_class=risk_class(ratio, screening.classes),
    )
    rules = code_columns(table, *at_contact(table, "sd"), codes=screening.codes)
    return table.assign(flags=flag_text(table, station, screening)).join(rules).drop(columns=ON_THE_WAY)


def _motions(station: xr.Dataset, block: pd.DataFrame, exact: bool) -> Iterator[tuple[pd.DataFrame, PairMotion, str]]:
    """Give the pairs of a block by how their azimuth is found, with their motion and the name of that way."""
    if station.sizes["horizontal"] == 1:
        yield block, motion_of_one_horizontal(station, block), "station"
        return
    unknown, decides = block["azimuth"].isna().to_numpy(), exact & exact_decides(station, block)
    if len(given := block[~unknown]):
        yield given, motion_along_azimuths(station, given, values(given, "azimuth")), "given"
    if len(worst := block[unknown & decides]):
        yield worst, motion_along_azimuths(station, worst, furthest_azimuth(station, worst)), "worst"
    if len(worst := block[unknown & ~decides]):
        yield worst, motion_along_every_azimuth(station, worst), "worst"
