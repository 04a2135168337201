"""
The risk table: pairs of buildings with the records of their stations, one row a pair, worst first.

Pairs go station by station and in blocks, so that memory follows the block and not the inventory.
"""

from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd
import xarray as xr

from per_obspy.config import Building, Screening
from per_obspy.errors import Rejection
from per_obspy.inventory.completion import completed_pairs
from per_obspy.screening.assignment import nearest_station
from per_obspy.screening.codes import code_columns
from per_obspy.screening.columns import ORDER
from per_obspy.screening.demand import demand_ratio, pounding_state
from per_obspy.screening.exact import exact_decides, furthest_azimuth
from per_obspy.screening.flags import flag_text, period_is_derived
from per_obspy.screening.judgement import impact_velocity_that_counts, judged
from per_obspy.screening.motion import (
    PairMotion,
    motion_along_azimuths,
    motion_along_every_azimuth,
    motion_of_one_horizontal,
)
from per_obspy.screening.probability import pair_probability
from per_obspy.screening.ranking import risk_class, worst_first
from per_obspy.screening.values import at_contact, number, values

#: Defaults of the configuration.
BUILDING, SCREENING = Building(), Screening()

#: Pairs in a block: at 180 azimuths a block of every array stays below 3 MB.
BLOCK = 2000


def risk_table(
    spectra: xr.Dataset | Sequence[xr.Dataset],
    pairs: pd.DataFrame,
    building: Building = BUILDING,
    screening: Screening = SCREENING,
) -> pd.DataFrame:
    """
    Return one row a pair: ground motion, demand, whether it pounds, and how hard; worst first.

    Parameters
    ----------
    spectra : Dataset or sequence of Dataset
        Stations, from :func:`per_obspy.station_spectra`.
    pairs : DataFrame
        From :func:`per_obspy.read_pairs`.
    building : Building
        What is assumed where the inventory is silent.
    screening : Screening
        Distances, and thresholds of flags and classes.

    Returns
    -------
    DataFrame
        Columns in the order of ``screening.columns.ORDER``, then the other columns of the pair table.
        ``attrs["rejected"]`` holds a :class:`~per_obspy.errors.Rejection` for every pair without a station in reach.
    """
    stations = [spectra] if isinstance(spectra, xr.Dataset) else list(spectra)
    located = [station for station in stations if np.isfinite(station["latitude"].item())]
    nowhere = tuple(
        Rejection("station", station["station"].item(), "", None, ("its coordinates are unknown: it serves no pair",))
        for station in stations
        if not np.isfinite(station["latitude"].item())
    )
    complete = completed_pairs(pairs, building)
    assigned, far = _assigned(complete, located, screening)
    blocks = [_rows(located[index], block, screening) for index, block in _blocks(assigned)]
    table = _ranked(pd.concat(blocks, ignore_index=True)) if blocks else assigned.reindex(columns=[*ORDER])
    table.attrs["rejected"] = (*pairs.attrs.get("rejected", ()), *nowhere, *far)
    return table


def _assigned(
    pairs: pd.DataFrame, stations: list[xr.Dataset], screening: Screening
) -> tuple[pd.DataFrame, tuple[Rejection, ...]]:
    """Return the pairs with the index of their station and its distance, and those with none in reach."""
    if not stations:
        lost = (Rejection("pair", name, "", None, ("no station has coordinates",)) for name in pairs["pair_id"])
        return pairs.iloc[:0].assign(station_index=0), tuple(lost)
    index, distance = nearest_station(
        values(pairs, "longitude"),
        values(pairs, "latitude"),
        np.array([number(station, "longitude") for station in stations]),
        np.array([number(station, "latitude") for station in stations]),
    )
    names = np.array([station["station"].item() for station in stations], dtype=object)
    placed = pairs.assign(station=names[index], station_index=index, distance=distance)
    reach = screening.largest_distance
    far = placed[distance > reach]
    rejected = tuple(
        Rejection("pair", name, "", None, (f"nearest station {station} is {metres:.0f} m away, beyond {reach:.0f} m",))
        for name, station, metres in far[["pair_id", "station", "distance"]].itertuples(index=False)
    )
    return placed[distance <= reach], rejected


def _blocks(pairs: pd.DataFrame) -> Iterator[tuple[int, pd.DataFrame]]:
    """Give blocks of pairs that share a station."""
    for index in np.unique(pairs["station_index"].to_numpy(np.int64)).tolist():
        group = pairs[pairs["station_index"] == index]
        for start in range(0, len(group), BLOCK):
            yield index, group.iloc[start : start + BLOCK]


def _rows(station: xr.Dataset, block: pd.DataFrame, screening: Screening) -> pd.DataFrame:
    """Return the finished rows of one block, not ranked yet."""
    table = pd.concat([judged(station, pairs, motion, rule) for pairs, motion, rule in _motions(station, block)])
    gap, demand = values(table, "gap"), values(table, "demand")
    probability = pair_probability(station, table, screening.model_dispersion)
    possible = period_is_derived(table) | (probability >= screening.possible_from)
    ratio = demand_ratio(gap, demand)
    table = table.assign(
        probability=probability,
        demand_ratio=ratio,
        state=pounding_state(gap, demand, possible),
        risk_class=risk_class(ratio, screening.classes),
    )
    rules = code_columns(table, *at_contact(table, "sd"), codes=screening.codes)
    return table.assign(flags=flag_text(table, station, screening)).join(rules)


def _motions(station: xr.Dataset, block: pd.DataFrame) -> Iterator[tuple[pd.DataFrame, PairMotion, str]]:
    """Give the pairs of a block by how their azimuth is found, with their motion and the name of that way."""
    if station.sizes["horizontal"] == 1:
        yield block, motion_of_one_horizontal(station, block), "station"
        return
    unknown, exact = block["azimuth"].isna().to_numpy(), exact_decides(station, block)
    if len(given := block[~unknown]):
        yield given, motion_along_azimuths(station, given, values(given, "azimuth")), "given"
    if len(worst := block[unknown & exact]):
        yield worst, motion_along_azimuths(station, worst, furthest_azimuth(station, worst)), "worst"
    if len(worst := block[unknown & ~exact]):
        yield worst, motion_along_every_azimuth(station, worst), "worst"


def _ranked(table: pd.DataFrame) -> pd.DataFrame:
    """Return the table worst pair first, leading columns in their order."""
    ranked = worst_first(table, impact_velocity_that_counts(table))
    others = [name for name in ranked if name not in ORDER and name != "station_index"]
    return ranked[[*ORDER, *others]]
