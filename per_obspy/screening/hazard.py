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

import re
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from per_obspy.checks import FloatArray
from per_obspy.config import Building, Screening
from per_obspy.constants import STANDARD_GRAVITY
from per_obspy.errors import CatalogError, reason_of
from per_obspy.inventory.completion import completed_pairs
from per_obspy.screening.assignment import nearest_station
from per_obspy.screening.columns import HAZARD
from per_obspy.screening.design import LARGEST, LEADING, LONGEST_LINE, require_header
from per_obspy.screening.population import (
    NODES,
    SAMPLES,
    chance_of_contact,
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

#: Largest ratio of neighbouring rates over which the chance of contact is taken as linear, and
#: gaps over the demand at the target rate among which the needed one is searched.
RATE_STEP = 1.3
GAPS = np.geomspace(0.1, 10.0, 41)

#: Smallest demand about which a gap is searched, m.
SMALLEST_DEMAND = 0.001

#: Chance of contact in the most frequent motion from which more frequent ones count: the rate is a
#: least one.
NEGLIGIBLE = 0.01

#: Probability and period of a column; the name of a repeated one is numbered by pandas.
_LEVEL = re.compile(r"(0?\.\d+(?:[eE]-?\d+)?|\d(?:\.\d+)?[eE]-\d+)~SA\((\d+(?:\.\d+)?)\)(?:\.\d+)?")
_YEARS = re.compile(r"investigation_time=(\d+(?:\.\d*)?)")


class HazardSpectra(NamedTuple):
    """
    Uniform hazard spectra of several sites.

    Attributes
    ----------
    name : str
        File of the spectra.
    longitude, latitude : (n_sites,) ndarray
        Degrees.
    rates : (n_levels,) ndarray
        Annual rates of exceedance, 1/year, falling.
    periods : (n_periods,) ndarray
        s, rising.
    sd : (n_sites, n_levels, n_periods) ndarray
        Spectral displacement at 5 % damping, m.
    """

    name: str
    longitude: FloatArray
    latitude: FloatArray
    rates: FloatArray
    periods: FloatArray
    sd: FloatArray


def is_hazard(path: Path) -> bool:
    """Return whether a file begins as hazard results of OpenQuake do."""
    try:
        with path.open("rb") as file:
            return b"investigation_time=" in file.readline(LONGEST_LINE)
    except OSError:
        return False


def read_hazard(path: Path) -> HazardSpectra:
    """
    Read uniform hazard spectra of OpenQuake.

    Parameters
    ----------
    path : Path
        CSV of ``oq export uhs``: a comment with ``investigation_time`` (years), then ``lon``,
        ``lat`` and one column per probability of exceedance and measure, such as ``0.1~SA(0.5)``,
        in g. Other measures are passed over.

    Raises
    ------
    CatalogError
        If the file cannot be read, has fewer than two probabilities or periods, or a value is
        missing, implausible or does not grow with rarity.
    """
    table, years = _table(path)
    chances, periods, columns = _levels(table, path)
    numbers = table.apply(pd.to_numeric, errors="coerce")
    east, north = numbers[["lon", "lat"]].to_numpy(np.float64).T
    psa = numbers[columns].to_numpy(np.float64) * STANDARD_GRAVITY
    psa = psa.reshape(-1, chances.size, periods.size)
    _check(path, east, north, psa)
    # A Poisson process exceeds a motion in t years with 1 - exp(-r t); SD = PSA (T / 2 pi)^2
    rates = -np.log1p(-chances) / years
    sd = psa * (periods / (2.0 * np.pi)) ** 2
    return HazardSpectra(str(path), east, north, rates, periods, sd)


def _check(path: Path, east: FloatArray, north: FloatArray, psa: FloatArray) -> None:
    """Refuse a file with a site that is wrong; the first one is named."""
    placed = (np.abs(east) <= 180.0) & (np.abs(north) <= 90.0)
    _require(path, placed, "lon, lat: not in degrees")
    plausible = (psa > 0.0) & (psa <= LARGEST["psa"][0])
    odd = psa[~plausible] / STANDARD_GRAVITY
    problem = f"SA must be above 0 and plausible, in g (got {odd[0]:g})" if odd.size else ""
    _require(path, plausible.all(axis=(1, 2)), problem)
    # Rarer motions are stronger at every period
    grows = (np.diff(psa, axis=1) > 0.0).all(axis=(1, 2))
    _require(path, grows, "SA must grow as the probability falls")
    # Of several spectra of one place chance would take one
    sites = pd.DataFrame(psa.reshape(len(psa), -1)).assign(lon=east, lat=north).drop_duplicates()
    again = np.zeros(len(psa), dtype=bool)
    again[sites.index] = sites.duplicated(["lon", "lat"])
    _require(path, ~again, "has another SA than an earlier row of the same lon, lat")


def _levels(table: pd.DataFrame, path: Path) -> tuple[FloatArray, FloatArray, list[str]]:
    """Return falling probabilities, rising periods (s), and the column of each of one and other."""
    # Names such as 0.1~SA(0.5)
    found = {str(name): level for name in table if (level := _LEVEL.fullmatch(str(name)))}
    columns = {(float(level[1]), float(level[2])): name for name, level in found.items()}
    chances = sorted({chance for chance, _ in columns}, reverse=True)
    periods = sorted({period for _, period in columns})
    # Every probability with every period, once
    needed = [(chance, period) for chance in chances for period in periods]
    is_full = len(needed) == len(columns) == len(found) and {"lon", "lat"} <= {*table}
    if min(len(chances), len(periods)) < 2 or not is_full or periods[0] <= 0.0 or table.empty:
        raise CatalogError(
            str(path),
            "needs lon, lat, a site, and SA as 0.1~SA(0.5) once at two probabilities and periods",
        )
    return np.array(chances), np.array(periods), [columns[key] for key in needed]


def _table(path: Path) -> tuple[pd.DataFrame, float]:
    """Return the rows of a file and its investigation time, years."""
    try:
        with path.open(encoding="utf-8") as file:
            # A comment before the header
            years = _YEARS.search(file.readline(LONGEST_LINE))
            table = pd.read_csv(file)
    except (OSError, ValueError, pd.errors.ParserError, pd.errors.EmptyDataError) as error:
        raise CatalogError(str(path), f"cannot be read as CSV: {reason_of(error)}") from error
    if years is None or not float(years[1]) > 0.0:
        raise CatalogError(str(path), "has no investigation_time in its first line")
    require_header(table, str(path))
    return table, float(years[1])


def _require(path: Path, sites: ArrayLike, problem: str) -> None:
    """Refuse a file with a bad site, by its number."""
    good = np.asarray(sites)
    if not good.all():
        raise CatalogError(str(path), f"site {int(np.argmin(good)) + 1}: {problem}")


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
    # Beyond its rates a hazard says nothing
    if not hazard.rates[-1] <= target_rate <= hazard.rates[0]:
        span = f"{hazard.rates[-1]:.3g} to {hazard.rates[0]:.3g}"
        raise CatalogError(
            hazard.name, f"target_rate = {target_rate:g} is outside its {span} 1/year"
        )
    complete = kept_apart(completed_pairs(pairs, building))
    site, reasons = _sites_of_pairs(hazard, complete, screening.largest_distance)
    rejected = pair_rejections(complete, reasons, hazard.name)
    # Rows of the pairs inside the hazard, worst first
    inside = np.array([not why for why in reasons], dtype=bool)
    within = complete[inside].reset_index(drop=True)
    rows = _rows(hazard, within, site[inside], screening, target_rate)
    ranked = _ordered(rows)
    ranked.attrs["rejected"] = (*pairs.attrs.get("rejected", ()), *rejected)
    return ranked


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
    motion = map_motion(_at_rate(hazard, site, target_rate), pairs)
    table = spectral_rows(pairs, motion, screening)
    rule = np.where(table.pop("squares_decide"), "sd_srss", "sd_white_noise").astype(object)
    table = table.assign(spectrum=hazard.name, demand_rule=rule)
    return table.assign(**_annual_columns(hazard, table, site, target_rate))


def _annual_columns(
    hazard: HazardSpectra, table: pd.DataFrame, site: IndexArray, target_rate: float
) -> Columns:
    """Return the columns ``HAZARD`` of rows with their demand at the target rate."""
    rates = _fine_rates(hazard.rates)
    gaps = np.fmax(values(table, "demand"), SMALLEST_DEMAND)[:, None] * GAPS
    # Chance of contact by rate, at the gap and at those around the demand
    chance, by_gap = np.empty((rates.size, len(table))), np.empty((rates.size, *gaps.shape))
    for level, rows in product(range(rates.size), _blocks(len(table))):
        part = table.iloc[rows].reset_index(drop=True)
        motion = map_motion(_at_rate(hazard, site[rows], rates[level]), part)
        chance[level, rows], by_gap[level, rows] = _chances(part, motion, gaps[rows])
    # Sums over the rates
    needed = _gap_at(exceedance_rate(by_gap, rates), gaps, target_rate)
    return {
        "annual_probability": -np.expm1(-exceedance_rate(chance, rates)),
        "annual_probability_bound": np.where(chance[0] > NEGLIGIBLE, "at least", ""),
        "gap_for_target": needed,
        "missing_gap_for_target": np.maximum(needed - values(table, "gap"), 0.0),
    }


def _blocks(count: int) -> list[IndexArray]:
    """Return the numbers of rows in blocks, which bound the memory."""
    size = SAMPLES // len(NODES)
    return [np.arange(first, min(first + size, count)) for first in range(0, count, size)]


def _at_rate(hazard: HazardSpectra, site: IndexArray, rate: float) -> MapMotion:
    """Return the spectra of sites at an annual rate; ln SD is linear in its logarithm."""
    steps = np.log(hazard.rates[::-1])
    # Between the rates of the file
    upper = int(np.clip(np.searchsorted(steps, np.log(rate)), 1, steps.size - 1))
    share = (np.log(rate) - steps[upper - 1]) / (steps[upper] - steps[upper - 1])
    ln_sd = np.log(hazard.sd[:, ::-1])
    at_rate = (1.0 - share) * ln_sd[:, upper - 1] + share * ln_sd[:, upper]
    return MapMotion(hazard.periods, at_rate[site], np.zeros((site.size, hazard.periods.size)))


def _fine_rates(rates: FloatArray) -> FloatArray:
    """Return rates in small steps of their logarithm, falling."""
    count = int(np.ceil(np.log(rates[0] / rates[-1]) / np.log(RATE_STEP))) + 1
    return np.geomspace(rates[0], rates[-1], max(count, 2))


def _chances(
    pairs: pd.DataFrame, motion: SpectralMotion, gaps: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the chance of contact in one motion: (n_pairs,) and at gaps (n_pairs, n_gaps)."""
    uncertain = spectral_uncertainty(pairs, motion)
    demand = estimated_motion(uncertain, motion.spectra, pairs, NODES).demand
    # Buildings of outlines that touch may share a wall
    one_wall = one_wall_chance(pairs) * (demand > 0.0).mean(axis=1)
    chance = np.maximum(chance_of_contact(demand, uncertain.log_std, pairs), one_wall)
    by_gap = np.empty(gaps.shape)
    for column, gap in enumerate(gaps.T):
        by_gap[:, column] = chance_of_contact(demand, uncertain.log_std, _with_gap(gap))
    return chance, by_gap


def _with_gap(gap: FloatArray) -> Columns:
    """Return all of pairs that a gap that is certain depends on."""
    return {
        "gap": gap,
        "gap_std": np.zeros_like(gap),
        "assumed_gap": np.zeros(gap.size, dtype=bool),
    }


def exceedance_rate(chance: FloatArray, rates: FloatArray) -> FloatArray:
    """
    Return the annual rate of contact.

    Parameters
    ----------
    chance : (n_levels, ...) ndarray
        Of contact in the motion of every rate.
    rates : (n_levels,) ndarray
        Annual rates of exceedance of the motions, 1/year, falling.

    Returns
    -------
    rate : ndarray
        1/year. Rarer motions than the last count as it; more frequent ones than the first are left
        out.

    Examples
    --------
    >>> exceedance_rate(np.ones(3), np.array([0.1, 0.01, 0.001])).round(12)
    np.float64(0.1)
    """
    middle = 0.5 * (chance[1:] + chance[:-1])
    rate: FloatArray = np.tensordot(-np.diff(rates), middle, axes=1) + rates[-1] * chance[-1]
    return rate


def _gap_at(by_gap: FloatArray, gaps: FloatArray, target: float) -> FloatArray:
    """
    Return the gap of every pair at which its rate falls to the target.

    It is the smallest of the gaps where that suffices, NaN where the largest does not.
    """
    needed = np.full(len(gaps), np.nan)
    for row, (rates, wide) in enumerate(zip(by_gap, gaps, strict=True)):
        # Rates fall as gaps grow
        if rates[-1] <= target:
            logs = np.log(np.maximum(rates[::-1], 1e-300))
            needed[row] = np.exp(np.interp(np.log(target), logs, np.log(wide[::-1])))
    return needed
