"""
Pairs under a design or user spectrum: the spectrum, and the table without a record.

There is neither a record's correlation nor an exact history, and no PER: the radius is the spectral
displacement. The gap from SD and eq. (16) is uncertain (`sd_error`), and too small in two of three
cases. A gap below it is a finding of the demand only; state, class and rank follow from the
population, which includes that error and resamples uncertain periods and dampings.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from per_obspy.checks import FloatArray
from per_obspy.config import Building, Screening
from per_obspy.errors import CatalogError, reason_of
from per_obspy.inventory.completion import completed_pairs
from per_obspy.inventory.files.text_lines import check_separator, check_text
from per_obspy.inventory.schema import Column
from per_obspy.screening.ranking import kept_apart, without_gap, worst_first
from per_obspy.screening.spectral_demand import (
    Limits,
    SpectralMotion,
    pair_rejections,
    reasons_outside,
    spectral_rows,
)
from per_obspy.screening.station_motion import (
    LogSpectra,
    log_period_and_damping,
    stored_log,
)
from per_obspy.screening.values import both, values

#: Largest value that a spectrum may have and its unit: larger ones are in other units (ms, per
#: cent, mm, cm/s2).
LARGEST = {
    "period": (100.0, "s"),
    "damping": (1.0 - 1e-9, "of critical"),
    "sd": (20.0, "m"),
    "psa": (200.0, "m/s2"),
}

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
    # one of two quantities
    quantities = [name for name in ("sd", "psa") if name in table]
    if len(quantities) != 1 or not {"period", "damping"} <= {*table}:
        columns = ", ".join(map(str, table.columns))
        raise CatalogError(
            source, f"needs the columns period, damping and either sd or psa, has {columns}"
        )
    names = ("period", "damping", *quantities)
    rows = pd.DataFrame({name: _positive(table, name, source) for name in names})
    return _on_grid(rows, quantities[0], source)


def _on_grid(rows: pd.DataFrame, quantity: str, source: str) -> DesignSpectrum:
    """Return rows of period, damping and a quantity as a spectrum on a full grid."""
    repeated = rows[rows.duplicated(["period", "damping"])]
    for period, damping in repeated[["period", "damping"]].to_numpy()[:1]:
        raise CatalogError(source, f"period = {period:g}, damping = {damping:g} occurs twice")
    grid = rows.pivot(index="damping", columns="period", values=quantity)
    if grid.isna().any(axis=None) or grid.shape[1] < 2:
        raise CatalogError(source, "every damping needs the same periods, at least two")
    # SD = PSA (T / 2 pi)^2
    periods, dampings = grid.columns.to_numpy(np.float64), grid.index.to_numpy(np.float64)
    factor = (periods / (2.0 * np.pi)) ** 2 if quantity == "psa" else 1.0
    return DesignSpectrum(source, periods, dampings, grid.to_numpy() * factor)


def _read(source: str) -> pd.DataFrame:
    """Read a CSV file as a table of text."""
    try:
        check_text(Path(source))
        # An open file, as pandas fetches names that are addresses and unpacks others
        with Path(source).open(encoding="utf-8") as file:
            # a header of many columns would take all memory
            while line := file.readline(LONGEST_LINE):
                if len(line) == LONGEST_LINE:
                    raise CatalogError(source, f"has a line of {LONGEST_LINE} characters or more")
            file.seek(0)
            table = pd.read_csv(file, comment="#", skipinitialspace=True)
    except (OSError, pd.errors.ParserError, pd.errors.EmptyDataError) as error:
        raise CatalogError(source, f"cannot be read as CSV: {reason_of(error)}") from error
    check_separator(Path(source), list(map(str, table.columns)))
    require_header(table, source)
    return table


def require_header(table: pd.DataFrame, source: str) -> None:
    """Refuse a table whose rows have more fields than the header, which shifts them."""
    if not isinstance(table.index, pd.RangeIndex):
        raise CatalogError(source, "its rows have more fields than its header")


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
    "configuration",
    "weighted_velocity",
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
        From :func:`read_design_spectrum`.
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
    reasons = _reasons_outside(spectrum, complete)
    rejected = pair_rejections(complete, reasons, spectrum.name)
    # demand of the pairs inside the spectrum, worst first
    inside = complete[[not why for why in reasons]].reset_index(drop=True)
    table = spectral_rows(inside, design_motion(spectrum, inside), screening)
    rule = np.where(table.pop("squares_decide"), "sd_srss", "sd_white_noise").astype(object)
    ranked = worst_first(without_gap(table.assign(spectrum=spectrum.name, demand_rule=rule)))
    ranked = ranked[[*LEADING, *(name for name in ranked if name not in LEADING)]]
    ranked.attrs["rejected"] = (*pairs.attrs.get("rejected", ()), *rejected)
    return ranked


def _reasons_outside(spectrum: DesignSpectrum, pairs: pd.DataFrame) -> list[list[str]]:
    """Return every period and damping outside the grid, pair by pair."""
    grids = {"period": (spectrum.periods, " s"), "damping": (spectrum.dampings, "")}
    # both ends belong to the grid
    limits: Limits = {
        f"{name}_{i}": (values(pairs, f"{name}_{i}"), grid[0], grid[-1], unit, 0.0)
        for name, (grid, unit) in grids.items()
        for i in (1, 2)
    }
    return reasons_outside(limits, "spectrum")


def design_motion(spectrum: DesignSpectrum, pairs: pd.DataFrame) -> SpectralMotion:
    """
    Return the motion of completed pairs inside a spectrum that is certain.

    Between the grid's values SD is linear on logarithmic axes, exact for every branch that is a
    power of the period, as those of codes are. Resampled oscillators beyond the grid have the
    value at its edge.
    """
    ln_sd, row = np.log(spectrum.sd)[None], np.zeros(len(pairs), dtype=np.intp)
    spectra = LogSpectra(np.log(spectrum.periods), np.log(spectrum.dampings), ln_sd)
    # of both oscillators
    sd_1, sd_2 = (
        np.exp(stored_log(spectra, row, np.log(period), np.log(damping)))
        for period, damping in zip(both(pairs, "period"), both(pairs, "damping"), strict=True)
    )
    certain = np.zeros(len(pairs))
    axes = log_period_and_damping(spectrum.periods, spectrum.dampings)
    return SpectralMotion((sd_1, sd_2), (certain, certain), LogSpectra(*axes, ln_sd), row)
