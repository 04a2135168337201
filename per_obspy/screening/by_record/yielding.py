"""
The estimated demand of pairs in which a building yields.

A building whose displacement exceeds its yield displacement is replaced by an equivalent linear one
(Iwan 1980) at its own ductility. This is the largest ductility up to 40 at which the equivalent
building's displacement is that many yield displacements: on a lakebed a stiff, weak building has
several, and the first one is far too small where yielding takes its period into the resonance of
the ground. It is found on the station's stored spectra, scaled to the building's own SD,
interpolated in period and damping. PER at the equivalent period and damping, from the stored
spectra too, and eq. (16) at the equivalent properties give the critical gap. Yielding raises the
correlation under broad ground motion; under narrow one eq. (16) then makes too much of it, so that
the smaller of the elastic and the equivalent correlation is used.
"""

from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.pounding.correlation.white_noise import ddc_correlation
from per_obspy.pounding.critical_gap import critical_gap
from per_obspy.pounding.yielding.equivalent_linear import iwan
from per_obspy.pounding.yielding.linearization import NARROW, record_bandwidth
from per_obspy.screening.by_record.stored_spectra import (
    LogSpectra,
    azimuth_row,
    log_period_and_damping,
    log_spectra,
    stored_log,
)
from per_obspy.screening.values import Columns, Table, both, chosen, components, values

#: Ductilities that are tried; between two of them so many more.
DUCTILITIES: FloatArray = np.geomspace(1.0, 40.0, 97)
PARTS: FloatArray = np.linspace(0.0, 1.0, 33)

#: What yielding adds to a building's damping ends here: an oscillator has less than the critical
#: one.
LARGEST_DAMPING = 0.99

#: What an equivalent building has of its own.
EQUIVALENT = ("period", "damping", "per")


class Equivalent(NamedTuple):
    """
    Equivalent linear buildings, each (n_pairs,).

    Attributes
    ----------
    ductility : ndarray
        Displacement over yield displacement, dimensionless; 0 for a building that cannot yield.
    period, damping, per : ndarray
        s; fraction of critical; pseudo energy radius of the oscillator, m.
    converged : ndarray of bool
        Whether a ductility was found.
    """

    ductility: FloatArray
    period: FloatArray
    damping: FloatArray
    per: FloatArray
    converged: NDArray[np.bool_]


def linearized_columns(station: xr.Dataset, table: Table) -> Columns:
    """
    Return the estimated demand of equivalent linear buildings, as columns of the risk table.

    Parameters
    ----------
    station : Dataset
        The record, with its stored spectra.
    table : Table
        Completed pairs with ``azimuth_used``, radii and correlation along it, and
        ``critical_gap_per``.

    Returns
    -------
    dict of (n_pairs,) ndarray
        ``critical_gap_linearized, correlation_linearized, ductility_i`` (see ``columns.RESULTS``),
        period, damping and PER of the equivalent oscillators, ``equivalent_..._i``, and
        ``linearized_converged``. Where no building is taken beyond its yield displacement they
        equal the elastic ones.

    References
    ----------
    Iwan (1980), Earthquake Engineering and Structural Dynamics 8; Valles-Mattox & Reinhorn (1996),
    11WCEE, eq. (15), (16).
    """
    ductility = [_elastic_ductility(table, i) for i in (1, 2)]
    columns: Columns = {
        "critical_gap_linearized": values(table, "critical_gap_per").copy(),
        "correlation_linearized": values(table, "correlation").copy(),
        **{f"ductility_{i}": ductility[i - 1] for i in (1, 2)},
        **{
            f"equivalent_{name}_{i}": values(table, f"{name}_{i}").copy()
            for name in EQUIVALENT
            for i in (1, 2)
        },
        "linearized_converged": np.ones(len(ductility[0]), dtype=bool),
    }
    yields = (np.maximum(*ductility) > 1.0) & (values(table, "absolute_gap") > 0)
    if yields.any():
        for name, found in _of_yielding(station, chosen(table, yields)).items():
            columns[name][yields] = found
    return columns


def _elastic_ductility(table: Table, i: int) -> FloatArray:
    return values(table, f"sd_{i}") / values(table, f"yield_displacement_{i}")


def _of_yielding(station: xr.Dataset, table: Table) -> Columns:
    """Return the columns of pairs in which a building yields."""
    spectra = log_spectra(station, "sd"), log_spectra(station, "per")
    row = azimuth_row(station, table)
    first, second = (_equivalent(*spectra, row, table, i) for i in (1, 2))
    correlation = ddc_correlation(first.period, first.damping, second.period, second.damping)
    if record_bandwidth(*components(station)) < NARROW:
        correlation = np.minimum(correlation, values(table, "correlation"))
    share_1, share_2 = both(table, "participation")
    columns: Columns = {
        "critical_gap_linearized": critical_gap(
            share_1 * first.per, share_2 * second.per, correlation
        ),
        "correlation_linearized": correlation,
        "linearized_converged": first.converged & second.converged,
    }
    for i, building in enumerate((first, second), start=1):
        columns[f"ductility_{i}"] = building.ductility
        columns[f"equivalent_period_{i}"] = building.period
        columns[f"equivalent_damping_{i}"] = building.damping
        columns[f"equivalent_per_{i}"] = building.per
    return columns


def _equivalent(
    sd: LogSpectra, per: LogSpectra, row: NDArray[np.intp], table: Table, i: int
) -> Equivalent:
    """Return the equivalent linear buildings i; those that stay elastic as they are."""
    elastic, period, damping = (
        _elastic_ductility(table, i),
        values(table, f"period_{i}"),
        values(table, f"damping_{i}"),
    )
    yields = elastic > 1.0
    own = _Building(row[yields], period[yields], damping[yields])
    ductility, converged = elastic.copy(), np.ones(elastic.size, dtype=bool)
    ductility[yields], converged[yields] = _largest_ductility(sd, own, elastic[yields])
    longer, more = iwan(np.maximum(ductility, 1.0), 0.0)
    damped = np.maximum(damping, np.minimum(damping + more, LARGEST_DAMPING))
    radius = values(table, f"per_{i}").copy()
    radius[yields] *= _change(per, own, ductility[yields, None])[:, 0]
    return Equivalent(ductility, period * longer, damped, radius, converged)


class _Building(NamedTuple):
    """Buildings of the same side: row of the stored azimuth, period (s), damping (fraction of critical)."""

    row: NDArray[np.intp]
    period: FloatArray
    damping: FloatArray


def _change(spectra: LogSpectra, building: _Building, ductility: FloatArray) -> FloatArray:
    """Return the radius of the equivalent building over that of the elastic one at ductilities (n_pairs, n)."""
    row, period, damping = (
        building.row[:, None],
        building.period[:, None],
        building.damping[:, None],
    )
    longer, more = iwan(ductility, 0.0)
    equivalent = stored_log(spectra, row, *log_period_and_damping(period * longer, damping + more))
    elastic = stored_log(spectra, row, *log_period_and_damping(period, damping))
    return np.asarray(np.exp(equivalent - elastic))


def _largest_ductility(
    sd: LogSpectra, building: _Building, elastic: FloatArray
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return the ductility above which the displacement no longer exceeds it, and whether that is in reach."""

    def excess(ductility: FloatArray) -> FloatArray:
        return np.asarray(elastic[:, None] * _change(sd, building, ductility) - ductility)

    tried = np.broadcast_to(DUCTILITIES, (elastic.size, DUCTILITIES.size))
    over = excess(tried)
    (low, high), _ = _around(tried, over)
    finer = low + PARTS * (high - low)
    (low, high), (before, beyond) = _around(finer, excess(finer))
    part = np.divide(
        before, before - beyond, out=np.zeros_like(before), where=before > np.maximum(beyond, 0.0)
    )
    converged = np.asarray(over[:, -1] <= 0.0)
    return np.where(converged, (low + part * (high - low))[:, 0], DUCTILITIES[-1]), converged


def _around(
    tried: FloatArray, excess: FloatArray
) -> tuple[tuple[FloatArray, ...], tuple[FloatArray, ...]]:
    """Return the last ductility with an excess and the next one, at the ends the nearest two, and the excess there."""
    lasting = excess > 0.0
    lasting[:, 0], lasting[:, -1] = True, False
    last = (excess.shape[1] - 1 - lasting[:, ::-1].argmax(axis=1))[:, None]
    places = last, last + 1
    return tuple(np.take_along_axis(tried, place, axis=1) for place in places), tuple(
        np.take_along_axis(excess, place, axis=1) for place in places
    )
