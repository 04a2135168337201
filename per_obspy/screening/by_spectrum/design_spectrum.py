"""Design or user spectrum: displacement by period and damping, in place of a record."""

from pathlib import Path
from typing import NamedTuple, TextIO

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.errors import CatalogError, reason_of
from per_obspy.inventory.files.text_lines import check_separator, check_text

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
