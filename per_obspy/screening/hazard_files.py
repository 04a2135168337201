"""
Seismic hazard in CSV files of OpenQuake: uniform hazard spectra, or hazard curves of one measure.

A process that exceeds a motion within t years with probability p does so r = -ln(1 - p) / t times a
year, if earthquakes come as a Poisson process. Curves of several measures are joined to spectra of
equal rates; one measure alone scales a spectral shape that is given.
"""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from per_obspy.checks import FloatArray
from per_obspy.constants import REFERENCE_DAMPING, STANDARD_GRAVITY
from per_obspy.errors import CatalogError, reason_of
from per_obspy.screening.design import (
    LARGEST,
    LONGEST_LINE,
    DesignSpectrum,
    read_design_spectrum,
    require_header,
)
from per_obspy.screening.station_motion import LogSpectra, stored_log

#: Probability and period of a column of spectra; the name of a repeated one is numbered by pandas.
_LEVEL = re.compile(r"(0?\.\d+(?:[eE]-?\d+)?|\d(?:\.\d+)?[eE]-\d+)~SA\((\d+(?:\.\d+)?)\)(?:\.\d+)?")

#: Intensity of a column of a curve, g.
_INTENSITY = re.compile(r"poe-(\d+(?:\.\d+)?(?:[eE][-+]?\d+)?)")

#: Facts of the first line.
_YEARS = re.compile(r"investigation_time=(\d+(?:\.\d*)?)")
_KIND = re.compile(r"kind=['\"]?([\w.-]+)")
_MEASURE = re.compile(r"imt=['\"]?(PGA|SA\((\d+(?:\.\d+)?)\))")

#: Rates of the spectra that curves are joined to, evenly in the logarithm.
LEVELS = 48

#: Longest period of a shape at which its ordinate is the peak ground acceleration, s.
PEAK_PERIOD = 0.05


class HazardSpectra(NamedTuple):
    """Uniform hazard spectra of several sites."""

    name: str  # file or folder
    longitude: FloatArray  # degrees, (n_sites,)
    latitude: FloatArray
    # Of exceedance, 1/year, falling, (n_sites, n_levels); NaN at a site whose curves have none in
    # common
    rates: FloatArray
    periods: FloatArray  # s, rising
    sd: FloatArray  # at 5 % damping, m, (n_sites, n_levels, n_periods)


class HazardCurve(NamedTuple):
    """Hazard curves of one measure at several sites."""

    path: Path
    kind: str  # mean, quantile-0.5, rlz-001, ...; empty where the file has none
    period: float  # s; 0 of the peak ground acceleration
    places: FloatArray  # longitude and latitude, degrees, (n_sites, 2), in their order
    intensities: FloatArray  # m/s2, rising
    rates: FloatArray  # of exceedance, 1/year, (n_sites, n_intensities); infinite where certain


def is_hazard(path: Path) -> bool:
    """Return whether a path is a folder, or a file that begins as hazard results of OpenQuake."""
    try:
        if path.is_dir():
            return True
        with path.open("rb") as file:
            return b"investigation_time=" in file.readline(LONGEST_LINE)
    except OSError:
        return False


def read_hazard(path: Path, shape: Path | None = None) -> HazardSpectra:
    """
    Read a seismic hazard of OpenQuake.

    Parameters
    ----------
    path : Path
        CSV of ``oq export uhs``: a comment with ``investigation_time`` (years), then ``lon``,
        ``lat`` and one column per probability of exceedance and measure, such as ``0.1~SA(0.5)``,
        in g; other measures are passed over. Or of ``oq export hcurves``: a comment with ``imt``
        too, and one column of probabilities per intensity in g, such as ``poe-0.0050000``; or a
        folder with such curves of several SA, of which those of the kind ``mean`` are read if there
        are several kinds.
    shape : Path, optional
        A design spectrum, from which one measure becomes a spectrum: PGA or one SA, the same shape
        at every rate.

    Raises
    ------
    CatalogError
        If a file cannot be read, is no spectrum without a shape, or has a value that is missing,
        implausible or does not grow with rarity.
    """
    # One file of spectra, else curves
    if path.is_dir():
        curves = _curves_of_folder(path)
    else:
        table, head = _table(path)
        if _fact(_KIND, head) == "std":
            raise CatalogError(str(path), "is of kind std, a deviation and no hazard")
        if not _intensity_names(table):
            if shape is not None:
                raise CatalogError(str(path), "is of spectra, which need no shape")
            return _spectra(path, table, head)
        curves = [_curve(path, table, head)]
    if shape is not None:
        if len(curves) > 1:
            raise CatalogError(str(path), f"shape: is for one measure, there are {len(curves)}")
        return _shaped(path, curves[0], read_design_spectrum(shape))
    # The peak is no ordinate of a spectrum
    curves = [curve for curve in curves if curve.period > 0.0]
    if len(curves) < 2:
        raise CatalogError(
            str(path),
            "one measure is no spectrum: give curves of SA at two periods or more in a folder, or "
            "the shape of the spectrum (shape = a design spectrum)",
        )
    return _joined(path, sorted(curves, key=lambda curve: curve.period))


def _spectra(path: Path, table: pd.DataFrame, head: str) -> HazardSpectra:
    """Return the uniform hazard spectra of a table."""
    chances, periods, columns = _levels(table, path)
    psa = _numbers(table, columns) * STANDARD_GRAVITY
    psa = psa.reshape(-1, chances.size, periods.size)
    places = _places(path, table)
    _check(path, places, psa)
    rates = -np.log1p(-chances) / _years(path, head)
    # SD = PSA (T / 2 pi)^2
    sd = psa * (periods / (2.0 * np.pi)) ** 2
    east, north = places.to_numpy().T
    return HazardSpectra(str(path), east, north, np.tile(rates, (len(psa), 1)), periods, sd)


def _check(path: Path, places: pd.DataFrame, psa: FloatArray) -> None:
    """Refuse spectra with a site that is wrong; the first one is named."""
    plausible = (psa > 0.0) & (psa <= LARGEST["psa"][0])
    odd = psa[~plausible] / STANDARD_GRAVITY
    problem = f"SA must be above 0 and plausible, in g (got {odd[0]:g})" if odd.size else ""
    _require(path, plausible.all(axis=(1, 2)), problem)
    # Rarer motions are stronger at every period
    grows = (np.diff(psa, axis=1) > 0.0).all(axis=(1, 2))
    _require(path, grows, "SA must grow as the probability falls")
    _require_one_of_each(path, places, psa.reshape(len(psa), -1))


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


def _curves_of_folder(path: Path) -> list[HazardCurve]:
    """Return the curves of a folder of PGA and SA."""
    curves = list[HazardCurve]()
    for file in filter(is_hazard, sorted(path.glob("*.csv"))):
        table, head = _table(file)
        # Other measures, deviations and other results may lie beside them
        has_curve = _intensity_names(table) and _MEASURE.search(head)
        if has_curve and _fact(_KIND, head) != "std":
            curves.append(_curve(file, table, head))
    return _of_one_kind(path, curves)


def _of_one_kind(path: Path, curves: Sequence[HazardCurve]) -> list[HazardCurve]:
    """Return the curves of the kind mean, or of the only kind, each measure once."""
    kinds = sorted({curve.kind for curve in curves})
    if len(kinds) > 1 and "mean" not in kinds:
        raise CatalogError(str(path), f"has curves of {', '.join(kinds)} and no mean: keep one")
    curves = [curve for curve in curves if len(kinds) == 1 or curve.kind == "mean"]
    if not curves:
        raise CatalogError(str(path), "has no hazard curve of PGA or SA (*.csv)")
    # Files of two calculations
    files: dict[float, str] = {}
    for curve in curves:
        if files.setdefault(curve.period, curve.path.name) != curve.path.name:
            names = f"{files[curve.period]} and {curve.path.name}"
            raise CatalogError(str(path), f"has one measure twice, in {names}")
    return curves


def _intensity_names(table: pd.DataFrame) -> list[str]:
    """Return the columns of probabilities of a curve."""
    return [str(name) for name in table if str(name).startswith("poe-")]


def _fact(pattern: re.Pattern[str], head: str) -> str:
    """Return a fact of the first line, empty where it is none."""
    fact = pattern.search(head)
    return fact[1] if fact else ""


def _intensities(path: Path, names: Sequence[str]) -> FloatArray:
    """Return the intensities of the columns of a curve, m/s2."""
    found = [_INTENSITY.fullmatch(name) for name in names]
    values = np.array([float(one[1]) if one else np.nan for one in found]) * STANDARD_GRAVITY
    # Other units, or a repeated column
    is_plausible = ((values > 0.0) & (values <= LARGEST["psa"][0])).all()
    if len(values) < 2 or not is_plausible or len({*values.tolist()}) < len(values):
        reason = "needs two intensities in g or more, each once, as poe-0.0050000"
        raise CatalogError(str(path), reason)
    return values


def _chances(path: Path, places: pd.DataFrame, chance: FloatArray) -> FloatArray:
    """Check and return probabilities of rising intensities."""
    within = ((chance >= 0.0) & (chance <= 1.0)).all(axis=1)
    _require(path, within, "a probability is missing or not 0 to 1")
    falls = (np.diff(chance, axis=1) <= 0.0).all(axis=1)
    _require(path, falls, "the probability grows with the intensity")
    # Of several curves of one place chance would take one
    _require_one_of_each(path, places, chance)
    return chance


def _curve(path: Path, table: pd.DataFrame, head: str) -> HazardCurve:
    """Return the hazard curves of a file."""
    measure, names = _MEASURE.search(head), _intensity_names(table)
    if measure is None:
        raise CatalogError(str(path), "needs imt='PGA' or such as imt='SA(0.5)' in its first line")
    intensities = _intensities(path, names)
    # Columns in any order
    order = np.argsort(intensities)
    places = _places(path, table)
    chance = _chances(path, places, _numbers(table, [names[i] for i in order]))
    # A certain motion has an infinite rate
    with np.errstate(divide="ignore"):
        rates = -np.log1p(-chance) / _years(path, head)
    # Every site once, in the same order in all files
    sites = places.drop_duplicates().sort_values(["lon", "lat"])
    place, rates = sites.to_numpy(np.float64), rates[sites.index]
    kind, period = _fact(_KIND, head), float(measure[2] or 0.0)
    return HazardCurve(path, kind, period, place, intensities[order], rates)


def _joined(path: Path, curves: Sequence[HazardCurve]) -> HazardSpectra:
    """Return the spectra of several measures at the sites of all of them."""
    for curve in curves:
        if not np.array_equal(curve.places, curves[0].places):
            raise CatalogError(str(curve.path), f"has other sites than {curves[0].path.name}")
    periods, rates = np.array([curve.period for curve in curves]), _common_rates(curves)
    # SD = PSA (T / 2 pi)^2
    psa = np.stack([_at_rates(curve, rates) for curve in curves], axis=-1)
    sd = psa * (periods / (2.0 * np.pi)) ** 2
    east, north = curves[0].places.T
    return HazardSpectra(str(path), east, north, rates, periods, sd)


def _shaped(path: Path, curve: HazardCurve, shape: DesignSpectrum) -> HazardSpectra:
    """Return the spectra of one shape that have the ordinate of a curve."""
    _require_ordinate(curve, shape)
    dampings, periods = shape.dampings, shape.periods
    # SD at 5 % damping, the last at the period of the curve, or at the shortest one
    wanted = np.append(periods, max(curve.period, periods[0]))
    spectra = LogSpectra(np.log(periods), np.log(dampings), np.log(shape.sd)[None])
    ln_damping = np.full(wanted.size, np.log(REFERENCE_DAMPING))
    row = np.zeros(wanted.size, dtype=np.intp)
    sd = np.exp(stored_log(spectra, row, np.log(wanted), ln_damping))
    # Every rate has the same shape
    ordinate, rates = sd[-1] * (2.0 * np.pi / wanted[-1]) ** 2, _common_rates([curve])
    scale = _at_rates(curve, rates)[:, :, None] / ordinate
    east, north = curve.places.T
    return HazardSpectra(str(path), east, north, rates, periods, scale * sd[:-1])


def _require_ordinate(curve: HazardCurve, shape: DesignSpectrum) -> None:
    """Refuse a shape that has no ordinate at the period of a curve, with its damping."""
    if not shape.dampings[0] <= REFERENCE_DAMPING <= shape.dampings[-1]:
        raise CatalogError(shape.name, "shape: needs a damping of 0.05")
    # The peak is the ordinate of the shortest period
    periods = shape.periods
    if not (periods[0] <= (curve.period or PEAK_PERIOD) and curve.period <= periods[-1]):
        measure = f"SA({curve.period:g})" if curve.period else f"PGA, at {PEAK_PERIOD:g} s or less"
        raise CatalogError(shape.name, f"shape: has no ordinate for the curve of {measure}")


def _common_rates(curves: Sequence[HazardCurve]) -> FloatArray:
    """Return rates of every site that all its curves have, falling, (n_sites, LEVELS)."""
    # A certain motion has no rate, one that never comes has no intensity
    usable = [np.isfinite(curve.rates) & (curve.rates > 0.0) for curve in curves]
    both = list(zip(curves, usable, strict=True))
    most = np.min([np.where(use, one.rates, -np.inf).max(axis=1) for one, use in both], axis=0)
    least = np.max([np.where(use, one.rates, np.inf).min(axis=1) for one, use in both], axis=0)
    known, rates = most > least, np.full((most.size, LEVELS), np.nan)
    rates[known] = np.geomspace(most[known], least[known], LEVELS, axis=1)
    # Ends without round-off, as they are in the curve
    rates[known, 0], rates[known, -1] = most[known], least[known]
    return rates


def _at_rates(curve: HazardCurve, rates: FloatArray) -> FloatArray:
    """Return the intensities at rates of sites, m/s2; their logarithms are linear in the rates'."""
    result = np.full(rates.shape, np.nan)
    ln_intensity = np.log(curve.intensities)
    for number in np.flatnonzero(np.isfinite(rates[:, 0])):
        own = curve.rates[number]
        # Of equal rates the strongest motion
        usable = np.isfinite(own) & (own > 0.0) & (own > np.append(own[1:], 0.0))
        known = np.log(own[usable])[::-1], ln_intensity[usable][::-1]
        result[number] = np.exp(np.interp(np.log(rates[number]), *known))
    return result


def _table(path: Path) -> tuple[pd.DataFrame, str]:
    """Return the rows of a file and its first line, a comment before the header."""
    try:
        with path.open(encoding="utf-8") as file:
            head = file.readline(LONGEST_LINE)
            table = pd.read_csv(file)
    except (OSError, ValueError, pd.errors.ParserError, pd.errors.EmptyDataError) as error:
        raise CatalogError(str(path), f"cannot be read as CSV: {reason_of(error)}") from error
    require_header(table, str(path))
    return table, head


def _years(path: Path, head: str) -> float:
    """Return the investigation time of a file by its first line."""
    years = float(_fact(_YEARS, head) or 0.0)
    if not years > 0.0:
        raise CatalogError(str(path), "has no investigation_time in its first line")
    return years


def _places(path: Path, table: pd.DataFrame) -> pd.DataFrame:
    """Return longitudes and latitudes of the sites, degrees."""
    if not {"lon", "lat"} <= {*table} or table.empty:
        raise CatalogError(str(path), "needs lon, lat and a site")
    # As numbers, NaN where there is none
    places: pd.DataFrame = table[["lon", "lat"]].apply(pd.to_numeric, errors="coerce")
    east, north = places.to_numpy(np.float64).T
    _require(path, (np.abs(east) <= 180.0) & (np.abs(north) <= 90.0), "lon, lat: not in degrees")
    return places


def _numbers(table: pd.DataFrame, columns: list[str]) -> FloatArray:
    """Return columns as numbers, NaN where there is none."""
    numbers: pd.DataFrame = table[columns].apply(pd.to_numeric, errors="coerce")
    return np.asarray(numbers, dtype=np.float64)


def _require_one_of_each(path: Path, places: pd.DataFrame, values: FloatArray) -> None:
    """Refuse several different rows of one place, of which chance would take one."""
    sites = pd.DataFrame(values).assign(lon=places["lon"], lat=places["lat"]).drop_duplicates()
    again = np.zeros(len(values), dtype=bool)
    again[sites.index] = sites.duplicated(["lon", "lat"])
    _require(path, ~again, "has other values than an earlier row of the same lon, lat")


def _require(path: Path, sites: ArrayLike, problem: str) -> None:
    """Refuse a file with a bad site, by its number."""
    good = np.asarray(sites)
    if not good.all():
        raise CatalogError(str(path), f"site {int(np.argmin(good)) + 1}: {problem}")
