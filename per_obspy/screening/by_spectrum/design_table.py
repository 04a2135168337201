"""
Table of a screening by a design or user spectrum: demands and code rules without a record.

There is neither a record's correlation nor an exact history, and no PER: the radius is the spectral
displacement. On broad-band records the gap from SD and eq. (16) has a median of 0.97 of the exact
one, a log-standard deviation of 0.14, and is too small in two of three cases. A gap below it is a
finding of the demand only; state, class and rank follow from the population, which includes that
error and resamples uncertain periods and dampings.
"""

import numpy as np
import pandas as pd

from per_obspy.checks import FloatArray
from per_obspy.config import Building, Screening
from per_obspy.errors import Rejection
from per_obspy.inventory.completion import completed_pairs
from per_obspy.inventory.schema import Column
from per_obspy.screening.by_record.stored_spectra import LogSpectra, log_period_and_damping
from per_obspy.screening.by_spectrum.demand import (
    SpectralDemand,
    spectral_columns,
    spectral_demand,
    spectral_radius,
)
from per_obspy.screening.by_spectrum.design_spectrum import (
    DesignSpectrum,
    displacement_at,
    within,
)
from per_obspy.screening.ranking import worst_first
from per_obspy.screening.uncertainty.estimated import (
    SD_DISPERSION,
    UncertainMotion,
    estimated_population,
)
from per_obspy.screening.uncertainty.unknown_gaps import kept_apart, without_gap
from per_obspy.screening.values import both, values

#: Columns of this table besides those that a risk table has as well.
DESIGN: dict[str, Column] = {
    column.name: column
    for column in (
        Column("spectrum", "str", "", "file of the spectrum that was used instead of a record"),
        Column(
            "srss_gap_sd", "float64", "m", "root of the sum of the squared SD, at contact height"
        ),
        Column("absolute_gap_sd", "float64", "m", "sum of the SD, at contact height"),
        Column(
            "demand_rule",
            "str",
            "",
            "rule of the demand: sd_white_noise, or sd_srss for derived periods",
        ),
        Column(
            "probability",
            "float64",
            "1",
            "probability of pounding under the spectrum, over all uncertain values of the pair",
        ),
    )
}

LEADING = (
    "rank",
    "pair_id",
    "risk_class",
    "state",
    "probability",
    "expected_impact_velocity",
    "impact_velocity_84",
    "expected_amplification",
    "gap",
    "demand",
    "demand_rule",
    "demand_ratio",
    "missing_gap",
    "impact_velocity",
    "single_hit_status",
    "amplification_1",
    "amplification_2",
    "spectrum",
    "sd_1",
    "sd_2",
    "correlation",
    "critical_gap_sd",
    "srss_gap_sd",
    "absolute_gap_sd",
)


def design_table(
    spectrum: DesignSpectrum, pairs: pd.DataFrame, building: Building, screening: Screening
) -> pd.DataFrame:
    """
    Compute the demand of a design or user spectrum on pairs: one row per pair, worst first.

    Parameters
    ----------
    spectrum : DesignSpectrum
        From :func:`~per_obspy.screening.by_spectrum.design_spectrum.read_design_spectrum`.
    pairs : DataFrame
        From :func:`per_obspy.read_pairs`.
    building : Building
        Assumptions for values that the inventory lacks.
    screening : Screening
        Risk classes and the region's values for code rules.

    Returns
    -------
    DataFrame
        ``LEADING``, the rules of :func:`~per_obspy.screening.codes.code_columns`, then the
        completed pair table; ``attrs["rejected"]`` holds the pairs outside the periods or dampings
        of the spectrum, with both.
    """
    complete = kept_apart(completed_pairs(pairs, building))
    first, second = _oscillators(complete)
    inside = np.all([within(spectrum, *first), within(spectrum, *second)], axis=0)
    rejected = _outside(spectrum, complete[~inside])
    # demand of the pairs inside the spectrum, worst first
    table = _rows(spectrum, complete[inside].reset_index(drop=True), screening)
    ranked = worst_first(without_gap(table))
    others = [name for name in ranked if name not in LEADING]
    ranked = ranked[[*LEADING, *others]]
    ranked.attrs["rejected"] = (*pairs.attrs.get("rejected", ()), *rejected)
    return ranked


def _oscillators(pairs: pd.DataFrame) -> list[tuple[FloatArray, FloatArray]]:
    """Return period and damping of buildings 1 and of buildings 2."""
    return list(zip(both(pairs, "period"), both(pairs, "damping"), strict=True))


def _outside(spectrum: DesignSpectrum, pairs: pd.DataFrame) -> tuple[Rejection, ...]:
    """Return rejections of pairs outside the spectrum, each with all values that are outside."""
    reasons: list[list[str]] = [[] for _ in range(len(pairs))]
    grids = {"period": (spectrum.periods, " s"), "damping": (spectrum.dampings, "")}
    for name in ("period_1", "period_2", "damping_1", "damping_2"):
        grid, unit = grids[name[:-2]]
        span = f"{grid[0]:g} to {grid[-1]:g}{unit}"
        # both ends of the grid belong to it
        column = values(pairs, name)
        outside = ~((column >= grid[0]) & (column <= grid[-1]))
        for row in np.flatnonzero(outside):
            reason = f"{name} = {column[row]:g}{unit} is outside the spectrum's {span}"
            reasons[row].append(reason)
    # one rejection per pair
    named = zip(pairs["pair_id"], reasons, strict=True)
    return tuple(Rejection("pair", name, spectrum.name, None, tuple(why)) for name, why in named)


def uncertain_design_motion(
    spectrum: DesignSpectrum, pairs: pd.DataFrame, demand: SpectralDemand
) -> tuple[UncertainMotion, LogSpectra]:
    """
    Return the motion of pairs under a spectrum that is certain, and the spectrum.

    Parameters
    ----------
    spectrum : DesignSpectrum
        On its grid; beyond it, where only resampled oscillators are, the value at its edge.
    pairs : DataFrame
        Completed pairs with their log-standard deviations, medians inside the spectrum.
    demand : SpectralDemand
        Of the same pairs.
    """
    count = len(pairs)
    motion = UncertainMotion(
        spectral_radius(pairs, demand, 1),
        spectral_radius(pairs, demand, 2),
        correlation=demand.correlation,
        log_std=np.full(count, SD_DISPERSION),
        row=np.zeros(count, dtype=np.intp),
    )
    # logarithms of periods and dampings, and the only spectrum
    axes = log_period_and_damping(spectrum.periods, spectrum.dampings)
    return motion, LogSpectra(*axes, np.log(spectrum.sd)[None])


def _rows(spectrum: DesignSpectrum, pairs: pd.DataFrame, screening: Screening) -> pd.DataFrame:
    """Return the rows of pairs inside the spectrum, not ranked yet."""
    first, second = _oscillators(pairs)
    displacement = displacement_at(spectrum, *first), displacement_at(spectrum, *second)
    demand = spectral_demand(pairs, displacement)
    # resampled periods reach beyond the spectrum
    population = estimated_population(*uncertain_design_motion(spectrum, pairs, demand), pairs)
    rule = np.where(demand.squares_decide, "sd_srss", "sd_white_noise").astype(object)
    table = pairs.assign(spectrum=spectrum.name, demand_rule=rule)
    return spectral_columns(table, displacement, demand, population, screening)
