"""
Pairs under a design or user spectrum: the spectrum, and the table without a record.

There is neither a record's correlation nor an exact history, and no PER: the radius is the spectral
displacement. On broad-band records the gap from SD and eq. (16) has a median of 0.97 of the exact
one, a log-standard deviation of 0.14, and is too small in two of three cases. A gap below it is a
finding of the demand only; state, class and rank follow from the population, which includes that
error and resamples uncertain periods and dampings.
"""

from pathlib import Path
from typing import NamedTuple, TextIO

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.config import Building, Screening
from per_obspy.errors import CatalogError, Rejection, reason_of
from per_obspy.inventory.completion import completed_pairs
from per_obspy.inventory.files.text_lines import check_separator, check_text
from per_obspy.inventory.schema import Column
from per_obspy.screening.by_record.station_motion import LogSpectra, log_period_and_damping
from per_obspy.screening.by_spectrum.demand import (
    SpectralDemand,
    spectral_columns,
    spectral_demand,
    spectral_radius,
)
from per_obspy.screening.ranking import worst_first
from per_obspy.screening.uncertainty.estimated import (
    SD_DISPERSION,
    UncertainMotion,
    estimated_population,
)
from per_obspy.screening.uncertainty.unknown_gaps import kept_apart, without_gap
from per_obspy.screening.values import both, values

#: Largest value that a spectrum may have and its unit: larger ones are in other units (ms, per
#: cent, mm, cm/s2).
LARGEST = {
    "period": (100.0, "s"),
    "damping": (1.0 - 1e-9, "of critical"),
    "sd": (20.0, "m"),
    "psa": (200.0, "m/s2"),
}

QUANTITIES = ("sd", "psa")

#: Characters that no line of a spectrum has.
LONGEST_LINE = 10_000


class DesignSpectrum(NamedTuple):
    """
    Spectral displacement on a grid.

    Attributes
    ----------
    name : str
        File of the spectrum.
    periods : (n_periods,) ndarray
        s, rising.
    dampings : (n_dampings,) ndarray
        Fractions of critical, rising.
    sd : (n_dampings, n_periods) ndarray
        m.
    """

    name: str
    periods: FloatArray
    dampings: FloatArray
    sd: FloatArray


def read_design_spectrum(path: str | Path) -> DesignSpectrum:
    """
    Read a spectrum.

    Parameters
    ----------
    path : str or Path
        CSV with the columns ``period`` (s), ``damping`` (fraction of critical) and either ``sd``
        (m) or ``psa`` (pseudo-acceleration, m/s2), one row per value in any order; every damping
        has the same periods. Lines that start with # are comments.

    Raises
    ------
    CatalogError
        If the file cannot be read, a column lacks, a value is none or implausible, or the grid is
        not full.
    """
    source = str(path)
    table = _read(source)
    quantity = _quantity(table, source)
    names = ("period", "damping", quantity)
    rows = pd.DataFrame({name: _positive(table, name, source) for name in names})
    return _on_grid(rows, quantity, source)


def _read(source: str) -> pd.DataFrame:
    """Read a CSV file as a table of text."""
    try:
        check_text(Path(source))
        # An open file, as pandas fetches names that are addresses and unpacks others
        with Path(source).open(encoding="utf-8") as file:
            _check_lines(file, source)
            table = pd.read_csv(file, comment="#", skipinitialspace=True)
    except (OSError, pd.errors.ParserError, pd.errors.EmptyDataError) as error:
        raise CatalogError(source, f"cannot be read as CSV: {reason_of(error)}") from error
    check_separator(Path(source), list(map(str, table.columns)))
    return table


def _check_lines(file: TextIO, source: str) -> None:
    """Raise ``CatalogError`` for a line that is not plain numbers, before it is parsed."""
    while line := file.readline(LONGEST_LINE):
        if len(line) == LONGEST_LINE:
            raise CatalogError(source, f"has a line of {LONGEST_LINE} characters or more")
    file.seek(0)


def _quantity(table: pd.DataFrame, source: str) -> str:
    """Return the quantity of the table, one of two."""
    given = [name for name in QUANTITIES if name in table]
    missing = [name for name in ("period", "damping") if name not in table]
    if missing or len(given) != 1:
        columns = ", ".join(map(str, table.columns))
        raise CatalogError(
            source, f"needs the columns period, damping and either sd or psa, has {columns}"
        )
    return given[0]


def _positive(table: pd.DataFrame, name: str, source: str) -> FloatArray:
    """Check and return a column of plausible positive numbers; row numbers exclude comments."""
    values = pd.to_numeric(table[name], errors="coerce").to_numpy(np.float64)
    if not values.size:
        raise CatalogError(source, "has no row")
    largest, unit = LARGEST[name]
    faults = {"must be a positive number": ~(values > 0.0), "in other units?": values > largest}
    # the first row with a fault is named with its text
    for reason, faulty in faults.items():
        if faulty.any():
            row = int(np.argmax(faulty))
            text = f"{table[name].iloc[row]} {unit}"
            raise CatalogError(source, f"{name} = {text} in row {row + 1}: {reason}")
    return values


def _on_grid(rows: pd.DataFrame, quantity: str, source: str) -> DesignSpectrum:
    """Return rows of period, damping and a quantity as a spectrum on a full grid."""
    repeated = rows[rows.duplicated(["period", "damping"])]
    if len(repeated):
        first = repeated.iloc[0]
        place = f"period = {first['period']:g}, damping = {first['damping']:g}"
        raise CatalogError(source, f"{place} occurs twice")
    grid = rows.pivot(index="damping", columns="period", values=quantity)
    if grid.isna().any(axis=None) or grid.shape[1] < 2:
        raise CatalogError(source, "every damping needs the same periods, at least two")
    # SD = PSA (T / 2 pi)^2
    periods, dampings = grid.columns.to_numpy(np.float64), grid.index.to_numpy(np.float64)
    factor = (periods / (2.0 * np.pi)) ** 2 if quantity == "psa" else 1.0
    return DesignSpectrum(source, periods, dampings, grid.to_numpy() * factor)


def within(spectrum: DesignSpectrum, period: ArrayLike, damping: ArrayLike) -> NDArray[np.bool_]:
    """
    Return a mask of oscillators within the periods and dampings of a spectrum, inclusive.

    Parameters
    ----------
    spectrum : DesignSpectrum
        On its grid.
    period, damping : array_like
        s; fraction of critical.
    """
    period = checks.positive("period", period)
    damping = checks.fraction_of_critical("damping", damping)
    periods, dampings = spectrum.periods, spectrum.dampings
    inside_periods = (period >= periods[0]) & (period <= periods[-1])
    return np.asarray(inside_periods & (damping >= dampings[0]) & (damping <= dampings[-1]))


def displacement_at(spectrum: DesignSpectrum, period: ArrayLike, damping: ArrayLike) -> FloatArray:
    """
    Interpolate the spectral displacement of oscillators.

    Parameters
    ----------
    spectrum : DesignSpectrum
        On its grid.
    period, damping : (n,) array_like
        s; fraction of critical. Inside the grid.

    Returns
    -------
    displacement : (n,) ndarray
        m, interpolated between logarithms in period and in damping: exact for every branch that is
        a power of the period, as those of codes are.

    Raises
    ------
    ValueError
        If an oscillator is outside the grid: values are not extrapolated.
    """
    period = np.atleast_1d(np.asarray(period, np.float64))
    damping = np.atleast_1d(np.asarray(damping, np.float64))
    inside = within(spectrum, period, damping)
    if not inside.all():
        outside = int(np.argmin(inside))
        values = f"{period[outside]:g} s and {damping[outside]:g}"
        raise ValueError(f"period and damping must be inside the spectrum, got {values}")
    # along the period at every damping of the grid
    log_sd, log_periods = np.log(spectrum.sd), np.log(spectrum.periods)
    curves = np.array([np.interp(np.log(period), log_periods, row) for row in log_sd])
    # then from the damping below to the one above
    lower, upper, share = _damping_cell(spectrum.dampings, damping)
    column = np.arange(period.size)
    result: FloatArray = np.exp(
        (1.0 - share) * curves[lower, column] + share * curves[upper, column]
    )
    return result


def _damping_cell(
    dampings: FloatArray, damping: FloatArray
) -> tuple[NDArray[np.intp], NDArray[np.intp], FloatArray]:
    """Return the rows of the dampings below and above, and the fraction between, in ln damping."""
    last = dampings.size - 1
    upper = np.clip(np.searchsorted(dampings, damping), min(1, last), last)
    lower = np.maximum(upper - 1, 0)
    low, high = np.log(dampings)[lower], np.log(dampings)[upper]
    # a single damping serves itself only
    share = np.divide(np.log(damping) - low, high - low, out=np.zeros_like(low), where=high > low)
    return lower, upper, share


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
        From :func:`~per_obspy.screening.by_spectrum.design.read_design_spectrum`.
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
