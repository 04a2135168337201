"""
Pairs under a seismic hazard: probability of pounding within a year, and the gap for a target rate.

Uniform hazard spectra at several probabilities of exceedance, as OpenQuake writes them, are spectra
of known annual rates. Each screens the pairs as a design spectrum does. Of the rates :math:`r_k` of
motions, the rate of contact is the sum of :math:`P_k` over their differences (Cornell 1968);
earthquakes come as a Poisson process. The hazard holds the variation of motions, so that a
spectrum itself is certain; both periods are exceeded together, which is on the safe side.

References
----------
Cornell, C. A. (1968). Engineering seismic risk analysis. Bulletin of the Seismological Society of
America 58 (5), 1583-1606.
"""

import numpy as np
import pandas as pd

from per_obspy.checks import FloatArray
from per_obspy.config import Building, Screening
from per_obspy.errors import CatalogError
from per_obspy.inventory.completion import completed_pairs
from per_obspy.screening.assignment import nearest_station
from per_obspy.screening.columns import DEMAND_SHARES, HAZARD
from per_obspy.screening.design import LEADING
from per_obspy.screening.ensemble import gap_for_rate
from per_obspy.screening.hazard_files import HazardSpectra
from per_obspy.screening.population import (
    NODES,
    SAMPLES,
    chance_of_contact,
    demand_quantiles,
    estimated_motion,
    one_wall_chance,
)
from per_obspy.screening.ranking import kept_apart, without_gap, worst_first
from per_obspy.screening.shakemap import MapMotion, map_motion
from per_obspy.screening.spectral_demand import (
    Limits,
    SpectralMotion,
    pair_rejections,
    reasons_outside,
    spectral_rows,
    spectral_uncertainty,
)
from per_obspy.screening.values import Columns, IndexArray, values

#: Largest ratio of neighbouring rates over which the chance of contact is taken as linear.
RATE_STEP = 1.3

#: Chance of contact in the most frequent motion from which more frequent ones count: the rate is a
#: least one.
NEGLIGIBLE = 0.01


def hazard_table(
    hazard: HazardSpectra,
    pairs: pd.DataFrame,
    building: Building,
    screening: Screening,
    target_rate: float,
) -> pd.DataFrame:
    """
    Compute the annual probability of pounding and the gap for a target rate: one row per pair.

    Parameters
    ----------
    hazard : HazardSpectra
        From :func:`read_hazard`; each pair has the nearest site within ``largest_distance``.
    pairs : DataFrame
        From :func:`per_obspy.read_pairs`.
    building, screening : Building, Screening
        Assumptions for missing values; thresholds.
    target_rate : float
        Annual rate of contact that a planner accepts, 1/year; inside the rates of the hazard.

    Returns
    -------
    DataFrame
        That of :func:`~per_obspy.screening.design.design_table` for the spectrum of the target
        rate, with the columns ``HAZARD``, worst first; ``attrs["rejected"]`` alike.

    Raises
    ------
    CatalogError
        If the target rate is outside the rates of the hazard.
    """
    complete = kept_apart(completed_pairs(pairs, building))
    site, reasons = _sites_of_pairs(hazard, complete, screening.largest_distance)
    _add_reasons_of_rates(hazard, site, target_rate, reasons)
    rejected = pair_rejections(complete, reasons, hazard.name)
    # Rows of the pairs inside the hazard, worst first
    inside = np.array([not why for why in reasons], dtype=bool)
    within = complete[inside].reset_index(drop=True)
    rows = _rows(hazard, within, site[inside], screening, target_rate)
    ranked = _ordered(rows)
    ranked.attrs["rejected"] = (*pairs.attrs.get("rejected", ()), *rejected)
    return ranked


def _add_reasons_of_rates(
    hazard: HazardSpectra, site: IndexArray, target_rate: float, reasons: list[list[str]]
) -> None:
    """Add why a pair has no spectrum of the target rate."""
    # Beyond its rates a hazard says nothing
    covered = (hazard.rates[:, -1] <= target_rate) & (target_rate <= hazard.rates[:, 0])
    if not covered.any():
        if np.isnan(hazard.rates).all():
            raise CatalogError(hazard.name, "no site has two rates that all measures have")
        span = f"{np.nanmin(hazard.rates):.3g} to {np.nanmax(hazard.rates):.3g}"
        raise CatalogError(
            hazard.name, f"target_rate = {target_rate:g} is outside its {span} 1/year"
        )
    # Sites have rates of their own
    for row in np.flatnonzero(~covered[site]):
        first, last = hazard.rates[site[row], [0, -1]]
        span = f"{last:.3g} to {first:.3g} 1/year" if first > last else "no rates"
        reasons[row].append(f"target_rate = {target_rate:g} is outside the nearest site's {span}")


def _ordered(rows: pd.DataFrame) -> pd.DataFrame:
    """Return rows worst first, with the leading columns before the others."""
    ranked = worst_first(without_gap(rows))
    # What depends on an unknown gap is unknown
    known = ranked["probability"].notna()
    for name in ("annual_probability", "missing_gap_for_target"):
        ranked[name] = ranked[name].where(known)
    leading = [*LEADING[:5], *HAZARD, *LEADING[5:]]
    return ranked[[*leading, *(name for name in ranked if name not in leading)]]


def _sites_of_pairs(
    hazard: HazardSpectra, pairs: pd.DataFrame, reach: float
) -> tuple[IndexArray, list[list[str]]]:
    """Return the nearest site of every pair, and why a pair has no spectrum."""
    east, north = values(pairs, "longitude"), values(pairs, "latitude")
    # The nearest site, and limits of the spectra
    site, distance = nearest_station(east, north, hazard.longitude, hazard.latitude)
    limits: Limits = {
        f"period_{i}": (values(pairs, f"period_{i}"), *hazard.periods[[0, -1]], " s", 0.0)
        for i in (1, 2)
    }
    reasons = reasons_outside(limits, "hazard")
    for row in np.flatnonzero(distance > reach):
        far = f"nearest site of the hazard is {distance[row]:.0f} m away, beyond {reach:.0f} m"
        reasons[row].append(far)
    return site, reasons


def _rows(
    hazard: HazardSpectra,
    pairs: pd.DataFrame,
    site: IndexArray,
    screening: Screening,
    target_rate: float,
) -> pd.DataFrame:
    """Return the rows of completed pairs inside the hazard, not ranked."""
    motion = map_motion(_at_rate(hazard, site, np.full(site.size, target_rate)), pairs)
    table = spectral_rows(pairs, motion, screening)
    rule = np.where(table.pop("squares_decide"), "sd_srss", "sd_white_noise").astype(object)
    table = table.assign(spectrum=hazard.name, demand_rule=rule)
    return table.assign(**_annual_columns(hazard, table, site, target_rate))


def _annual_columns(
    hazard: HazardSpectra, table: pd.DataFrame, site: IndexArray, target_rate: float
) -> Columns:
    """Return the columns ``HAZARD`` of rows with their demand at the target rate."""
    count = _levels_of(hazard.rates[site])
    parts = [
        _block_columns(
            hazard, table.iloc[rows].reset_index(drop=True), site[rows], target_rate, count
        )
        for rows in _blocks(len(table))
    ]
    whole = pd.concat(map(pd.DataFrame, parts), ignore_index=True)
    return {name: whole[name].to_numpy() for name in HAZARD}


def _block_columns(
    hazard: HazardSpectra, pairs: pd.DataFrame, site: IndexArray, target_rate: float, count: int
) -> Columns:
    """Return the columns ``HAZARD`` of some pairs from a number of motions between the rates."""
    rates = np.geomspace(hazard.rates[site, 0], hazard.rates[site, -1], count)
    # Chance of contact, and quantiles of the demand, in the motion of each rate
    chances, demands = np.empty(rates.shape), np.empty((count, len(DEMAND_SHARES), site.size))
    for level, rate in enumerate(rates):
        motion = map_motion(_at_rate(hazard, site, rate), pairs)
        chances[level], demands[level] = _in_motion(pairs, motion)
    # Every motion stands for its share of the rates, as a scenario does
    shares = shares_of_rates(rates)
    needed = gap_for_rate(demands, shares, target_rate)
    return {
        "annual_probability": -np.expm1(-(shares * chances).sum(axis=0)),
        "annual_probability_bound": np.where(chances[0] > NEGLIGIBLE, "at least", ""),
        "gap_for_target": needed,
        "missing_gap_for_target": np.maximum(needed - values(pairs, "gap"), 0.0),
    }


def _blocks(count: int) -> list[IndexArray]:
    """Return the numbers of rows in blocks, which bound the memory."""
    size = SAMPLES // len(NODES)
    return [np.arange(first, min(first + size, count)) for first in range(0, max(count, 1), size)]


def _at_rate(hazard: HazardSpectra, site: IndexArray, rate: FloatArray) -> MapMotion:
    """Return the spectra of sites at annual rates, one a site; ln SD is linear in ln rate."""
    # Between two rates of the file, which fall
    lower = np.clip(
        (hazard.rates[site] >= rate[:, None]).sum(axis=1) - 1, 0, hazard.sd.shape[1] - 2
    )
    first, last = np.log(hazard.rates[site, lower]), np.log(hazard.rates[site, lower + 1])
    share = ((np.log(rate) - first) / (last - first))[:, None]
    ln_sd = (1.0 - share) * np.log(hazard.sd[site, lower])
    ln_sd += share * np.log(hazard.sd[site, lower + 1])
    return MapMotion(hazard.periods, ln_sd, np.zeros(ln_sd.shape))


def _levels_of(rates: FloatArray) -> int:
    """Return the number of motions that steps of ``RATE_STEP`` need at every site."""
    spans = np.log(rates[:, 0] / rates[:, -1])
    return max(int(np.ceil(spans.max(initial=0.0) / np.log(RATE_STEP))) + 1, 2)


def _in_motion(pairs: pd.DataFrame, motion: SpectralMotion) -> tuple[FloatArray, FloatArray]:
    """Return the chance of contact in one motion, (n_pairs,), and the quantiles of the demand."""
    uncertain = spectral_uncertainty(pairs, motion)
    demand = estimated_motion(uncertain, motion.spectra, pairs, NODES).demand
    # Buildings of outlines that touch may share a wall
    one_wall = one_wall_chance(pairs) * (demand > 0.0).mean(axis=1)
    chance = np.maximum(chance_of_contact(demand, uncertain.log_std, pairs), one_wall)
    return chance, demand_quantiles(demand, uncertain.log_std, NODES)


def shares_of_rates(rates: FloatArray) -> FloatArray:
    """
    Return the rate that each motion of a hazard stands for, 1/year.

    Parameters
    ----------
    rates : (n_levels, ...) ndarray
        Annual rates of exceedance of the motions, 1/year, falling.

    Returns
    -------
    shares : ndarray
        Half of the differences to both neighbours, as if the chance of contact were linear between
        them. Rarer motions than the last count as it; more frequent ones than the first are left
        out. The sum is the first rate.

    Examples
    --------
    >>> shares_of_rates(np.array([0.1, 0.01, 0.001])).round(12)
    array([0.045 , 0.0495, 0.0055])
    """
    halves = -0.5 * np.diff(rates, axis=0)
    nothing = np.zeros_like(rates[:1])
    shares: FloatArray = np.concatenate([halves, nothing]) + np.concatenate([nothing, halves])
    shares[-1] += rates[-1]
    return shares
