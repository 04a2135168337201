"""A design or user spectrum: displacement by period and damping, given instead of a record."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.errors import CatalogError, reason_of
from per_obspy.inventory.files.csv_text import check_separator, check_text

#: Largest value that a spectrum may have and its unit: larger ones are in other units (ms, per
#: cent, mm, cm/s2).
LARGEST = {
    "period": (100.0, "s"),
    "damping": (1.0 - 1e-9, "of critical"),
    "sd": (20.0, "m"),
    "psa": (200.0, "m/s2"),
}

QUANTITIES = ("sd", "psa")


class DesignSpectrum(NamedTuple):
    """
    Spectral displacement on a grid.

    Attributes
    ----------
    name : str
        Where it comes from.
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
        (m) or ``psa`` (pseudo-acceleration, m/s2), one row a value in any order; every damping has
        the same periods. Lines that start with # are comments.

    Raises
    ------
    CatalogError
        If the file cannot be read, a column lacks, a value is none or implausible, or the grid is
        not full.
    """
    source = str(path)
    table = _read(source)
    quantity = _quantity(table, source)
    values = {name: _positive(table, name, source) for name in ("period", "damping", quantity)}
    grid = pd.DataFrame(values)
    if grid.duplicated(["period", "damping"]).any():
        first = grid[grid.duplicated(["period", "damping"])].iloc[0]
        raise CatalogError(
            source, f"period = {first['period']:g}, damping = {first['damping']:g} stands twice"
        )
    full = grid.pivot(index="damping", columns="period", values=quantity)
    if full.isna().any(axis=None) or full.shape[1] < 2:
        raise CatalogError(source, "every damping needs the same periods, at least two")
    periods, dampings = full.columns.to_numpy(np.float64), full.index.to_numpy(np.float64)
    factor = (periods / (2.0 * np.pi)) ** 2 if quantity == "psa" else 1.0
    return DesignSpectrum(source, periods, dampings, full.to_numpy() * factor)


def _read(source: str) -> pd.DataFrame:
    try:
        check_text(Path(source))
        table = pd.read_csv(source, comment="#", skipinitialspace=True)
    except (OSError, pd.errors.ParserError, pd.errors.EmptyDataError) as error:
        raise CatalogError(source, f"cannot be read as CSV: {reason_of(error)}") from error
    check_separator(Path(source), list(map(str, table.columns)))
    return table


def _quantity(table: pd.DataFrame, source: str) -> str:
    """Return which of the two quantities the table gives."""
    given = [name for name in QUANTITIES if name in table]
    missing = [name for name in ("period", "damping") if name not in table]
    if missing or len(given) != 1:
        columns = ", ".join(map(str, table.columns))
        raise CatalogError(
            source, f"needs the columns period, damping and either sd or psa, has {columns}"
        )
    return given[0]


def _positive(table: pd.DataFrame, name: str, source: str) -> FloatArray:
    """Return a column of plausible numbers above zero; rows are counted without the header and comments."""
    values = pd.to_numeric(table[name], errors="coerce").to_numpy(np.float64)
    if not values.size:
        raise CatalogError(source, "has no row")
    largest, unit = LARGEST[name]
    for bad, reason in (
        (~(values > 0.0), "must be a positive number"),
        (values > largest, "in other units?"),
    ):
        if bad.any():
            row = int(np.argmax(bad))
            raise CatalogError(
                source, f"{name} = {table[name].iloc[row]} {unit} in row {row + 1}: {reason}"
            )
    return values


def within(spectrum: DesignSpectrum, period: ArrayLike, damping: ArrayLike) -> NDArray[np.bool_]:
    """Return where the spectrum tells of an oscillator: inside its periods and its dampings, ends included."""
    period, damping = (
        checks.positive("period", period),
        checks.fraction_of_critical("damping", damping),
    )
    periods, dampings = spectrum.periods, spectrum.dampings
    inside = (
        (period >= periods[0])
        & (period <= periods[-1])
        & (damping >= dampings[0])
        & (damping <= dampings[-1])
    )
    return np.asarray(inside)


def displacement_at(spectrum: DesignSpectrum, period: ArrayLike, damping: ArrayLike) -> FloatArray:
    """
    Return the spectral displacement of oscillators.

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
        If an oscillator is outside the grid: nothing is extrapolated.
    """
    natural, fraction = (
        np.atleast_1d(np.asarray(period, np.float64)),
        np.atleast_1d(np.asarray(damping, np.float64)),
    )
    inside = within(spectrum, natural, fraction)
    if not inside.all():
        where = int(np.argmin(inside))
        raise ValueError(
            f"period and damping must be inside the spectrum, got {natural[where]:g} s and {fraction[where]:g}"
        )
    logs = np.log(spectrum.sd)
    curves = np.array([np.interp(np.log(natural), np.log(spectrum.periods), row) for row in logs])
    last = spectrum.dampings.size - 1
    upper = np.clip(np.searchsorted(spectrum.dampings, fraction), min(1, last), last)
    lower = np.maximum(upper - 1, 0)
    low, high = np.log(spectrum.dampings)[lower], np.log(spectrum.dampings)[upper]
    share = np.divide(np.log(fraction) - low, high - low, out=np.zeros_like(low), where=high > low)
    column = np.arange(natural.size)
    result: FloatArray = np.exp(
        (1.0 - share) * curves[lower, column] + share * curves[upper, column]
    )
    return result
