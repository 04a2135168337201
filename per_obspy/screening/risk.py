"""
The risk table: pairs of buildings with the records of their stations, one row a pair, worst first.

Pairs go station by station and in blocks, so that memory follows the block and not the inventory.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.config import Building, Screening
from per_obspy.errors import Rejection
from per_obspy.inventory.completion import completed_pairs
from per_obspy.pounding.single_hit import single_hit
from per_obspy.screening.assignment import nearest_station
from per_obspy.screening.codes import code_columns
from per_obspy.screening.columns import ORDER
from per_obspy.screening.demand import (
    Demand,
    GapEstimates,
    demand_ratio,
    gap_estimates,
    governing_demand,
    pounding_state,
)
from per_obspy.screening.exact import exact_decides, exact_outcome, furthest_azimuth
from per_obspy.screening.flags import flag_text, period_is_derived
from per_obspy.screening.motion import (
    PairMotion,
    motion_along_azimuths,
    motion_along_every_azimuth,
    motion_of_one_horizontal,
)
from per_obspy.screening.probability import pair_probability
from per_obspy.screening.ranking import risk_class, worst_first

#: Defaults of the configuration.
BUILDING, SCREENING = Building(), Screening()

#: Demand / sum of the radii below which two oscillators move as one: the difference of equal numbers.
ROUND_OFF = 1e-12

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
        pairs["longitude"].to_numpy(),
        pairs["latitude"].to_numpy(),
        np.array([station["longitude"].item() for station in stations]),
        np.array([station["latitude"].item() for station in stations]),
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
    for index, group in pairs.groupby("station_index"):
        for start in range(0, len(group), BLOCK):
            yield int(index), group.iloc[start : start + BLOCK]


def _rows(station: xr.Dataset, block: pd.DataFrame, screening: Screening) -> pd.DataFrame:
    """Return the finished rows of one block, not ranked yet."""
    parts = [_judged_rows(station, pairs, motion, rule) for pairs, motion, rule in _motions(station, block)]
    table = pd.concat(parts)
    gap, demand = table["gap"].to_numpy(np.float64), table["demand"].to_numpy(np.float64)
    table["demand_ratio"] = demand_ratio(gap, demand)
    table["probability"] = pair_probability(station, table, screening.model_dispersion)
    possible = period_is_derived(table) | (table["probability"].to_numpy() >= screening.possible_from)
    table["state"] = pounding_state(gap, demand, possible)
    table["risk_class"] = risk_class(table["demand_ratio"].to_numpy(), screening.classes)
    table["flags"] = flag_text(table, station, screening)
    contact = [table[f"participation_{i}"].to_numpy() * table[f"sd_{i}"].to_numpy() for i in (1, 2)]
    return pd.concat([table, code_columns(table, *contact, screening.codes)], axis=1)


def _motions(station: xr.Dataset, block: pd.DataFrame) -> Iterator[tuple[pd.DataFrame, PairMotion, str]]:
    """Give the pairs of a block by how their azimuth is found, with their motion and the name of that way."""
    if station.sizes["horizontal"] == 1:
        yield block, motion_of_one_horizontal(station, block), "station"
        return
    unknown, exact = block["azimuth"].isna().to_numpy(), exact_decides(station, block)
    if len(given := block[~unknown]):
        yield given, motion_along_azimuths(station, given, given["azimuth"].to_numpy(np.float64)), "given"
    if len(worst := block[unknown & exact]):
        yield worst, motion_along_azimuths(station, worst, furthest_azimuth(station, worst)), "worst"
    if len(worst := block[unknown & ~exact]):
        yield worst, motion_along_every_azimuth(station, worst), "worst"


def _judged_rows(station: xr.Dataset, pairs: pd.DataFrame, motion: PairMotion, rule: str) -> pd.DataFrame:
    """Return the pairs with estimates, single hit, exact outcome and the demand that decides."""
    judged = _judged(motion, pairs)
    hit = _hits(judged, pairs)
    azimuth = judged.columns["azimuth_used"] if rule != "station" else np.zeros(len(pairs))
    outcome = exact_outcome(station, pairs, azimuth, judged.per)
    table = pairs.assign(azimuth_rule=rule, **judged.columns, **hit, **outcome)
    exact = exact_decides(station, pairs)
    table["demand"] = np.where(exact, table["demand_exact"], table["demand"])
    table["demand"] = table["demand"].where(table["demand"] > ROUND_OFF * table["absolute_gap"], 0.0)
    table["demand_rule"] = np.where(exact, "exact", table["demand_rule"])
    return table


class _Judged(NamedTuple):
    """Columns at each pair's governing azimuth, and the contact-level radii there."""

    columns: dict[str, NDArray[np.generic]]
    per: tuple[FloatArray, FloatArray]


def _judged(motion: PairMotion, pairs: pd.DataFrame) -> _Judged:
    """Return all estimates at the azimuth where the pair's demand is largest."""
    participation = [pairs[f"participation_{i}"].to_numpy(np.float64)[:, None] for i in (1, 2)]
    per = (participation[0] * motion.per[0], participation[1] * motion.per[1])
    sd = (participation[0] * motion.sd[0], participation[1] * motion.sd[1])
    period = tuple(pairs[f"period_{i}"].to_numpy(np.float64)[:, None] for i in (1, 2))
    damping = tuple(pairs[f"damping_{i}"].to_numpy(np.float64)[:, None] for i in (1, 2))
    estimates = gap_estimates(per, sd, period, damping, motion.correlation)
    demand = governing_demand(estimates, period_is_derived(pairs)[:, None])
    worst = np.argmax(demand.demand, axis=1)

    def at_worst(values: NDArray[np.generic]) -> NDArray[np.generic]:
        return np.take_along_axis(values, worst[:, None], axis=1)[:, 0]

    columns = _columns(motion, estimates, demand)
    return _Judged({name: at_worst(values) for name, values in columns.items()}, (at_worst(per[0]), at_worst(per[1])))


def _columns(motion: PairMotion, estimates: GapEstimates, demand: Demand) -> dict[str, NDArray[np.generic]]:
    return {
        "azimuth_used": motion.azimuth,
        "per_1": motion.per[0],
        "per_2": motion.per[1],
        "sd_1": motion.sd[0],
        "sd_2": motion.sd[1],
        "correlation": estimates.correlation,
        "correlation_record": motion.correlation,
        "critical_gap_per": estimates.per,
        "critical_gap_record": estimates.record,
        "critical_gap_sd": estimates.sd,
        "srss_gap": estimates.srss,
        "absolute_gap": estimates.absolute,
        "demand": demand.demand,
        "demand_rule": demand.rule,
    }


def _hits(judged: _Judged, pairs: pd.DataFrame) -> dict[str, NDArray[np.generic]]:
    """Return the single hit of every pair, its critical gap being the demand."""
    hit = single_hit(
        *judged.per,
        *(pairs[f"period_{i}"].to_numpy(np.float64) for i in (1, 2)),
        *(pairs[f"contact_mass_{i}"].to_numpy(np.float64) for i in (1, 2)),
        pairs["restitution"].to_numpy(np.float64),
        judged.columns["demand"],
        pairs["gap"].to_numpy(np.float64),
    )
    return {
        "single_hit_status": hit.status,
        "amplification_1": hit.amplification_1,
        "amplification_2": hit.amplification_2,
        "impact_velocity": hit.impact_velocity,
    }


def _ranked(table: pd.DataFrame) -> pd.DataFrame:
    """
    Return the table worst pair first, leading columns in their order.

    The impact velocity is that of the exact history where it decides, else the larger of it and of the single hit.
    """
    estimated = table["impact_velocity"].fillna(0.0).where(table["demand_rule"] != "exact", 0.0)
    ranked = worst_first(table, np.maximum(table["impact_velocity_exact"], estimated))
    others = [name for name in ranked if name not in ORDER and name != "station_index"]
    return ranked[[*ORDER, *others]]
