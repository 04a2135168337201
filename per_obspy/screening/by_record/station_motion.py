"""Ground motion of one station as arrays: its record and its stored spectra."""

from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.screening.by_record.stored_spectra import SMALLEST_DAMPING, LogSpectra
from per_obspy.screening.values import Table, components, number, values


class StationMotion(NamedTuple):
    """
    Record and stored spectra of one station.

    Attributes
    ----------
    north, east : (n_samples,) ndarray
        Ground acceleration, m/s². The record of a single horizontal is ``north``, to be used at
        azimuth 0; ``east`` is 0 then.
    dt : float
        Sampling interval, s.
    horizontals : int
        Number of horizontal sensors, 1 or 2.
    sensor_azimuth : float
        Of a single horizontal, degrees clockwise from north; NaN if unknown, or of two horizontals.
    usable_periods : tuple of float
        Shortest and longest usable period, s.
    azimuths : (n_azimuths,) ndarray
        Of the stored spectra, degrees, evenly spaced over the half circle; 0 of one horizontal.
    per, sd : LogSpectra
        Logarithms of the stored PER and SD in m, by azimuth.
    per_rotd50 : LogSpectra
        Logarithm of the stored median PER over the azimuths, in one row; of one horizontal its PER.
    """

    north: FloatArray
    east: FloatArray
    dt: float
    horizontals: int
    sensor_azimuth: float
    usable_periods: tuple[float, float]
    azimuths: FloatArray
    per: LogSpectra
    sd: LogSpectra
    per_rotd50: LogSpectra


def station_motion(station: xr.Dataset) -> StationMotion:
    """
    Decode the Dataset of one station, once for all its pairs.

    Parameters
    ----------
    station : Dataset
        From :func:`per_obspy.station_spectra`.
    """
    north, east, dt = components(station)
    horizontals = station.sizes["horizontal"]
    # the azimuth of the sensor is used of a single horizontal only
    sensor_azimuth = float(station["horizontal_azimuth"][0]) if horizontals == 1 else np.nan
    shortest = number(station, "shortest_usable_period")
    longest = number(station, "longest_usable_period")
    azimuths = station["azimuth"].to_numpy() if "azimuth" in station else np.zeros(1)
    return StationMotion(
        north=north,
        east=east,
        dt=dt,
        horizontals=horizontals,
        sensor_azimuth=sensor_azimuth,
        usable_periods=(shortest, longest),
        azimuths=azimuths,
        per=_by_azimuth(station, "per"),
        sd=_by_azimuth(station, "sd"),
        per_rotd50=_median_over_azimuths(station),
    )


def nearest_azimuth(station: StationMotion, table: Table) -> NDArray[np.intp]:
    """Return the row of the stored azimuth nearest to ``azimuth_used`` of each pair."""
    count = station.azimuths.size
    azimuth = np.nan_to_num(values(table, "azimuth_used")) % 180.0
    row: NDArray[np.intp] = np.rint(azimuth / (180.0 / count)).astype(np.intp) % count
    return row


def _by_azimuth(station: xr.Dataset, name: str) -> LogSpectra:
    """Return the stored PER (``per``) or SD (``sd``) by azimuth; one horizontal has one azimuth."""
    by_azimuth = f"{name}_azimuthal"
    if by_azimuth in station:
        return _log_spectra(station, station[by_azimuth].to_numpy())
    return _log_spectra(station, station[name].to_numpy()[:1])


def _median_over_azimuths(station: xr.Dataset) -> LogSpectra:
    """Return the stored RotD50 of PER in one row, or the PER of the only horizontal."""
    if "per_rotd50" in station:
        return _log_spectra(station, station["per_rotd50"].to_numpy()[None])
    return _by_azimuth(station, "per")


def _log_spectra(station: xr.Dataset, stored: NDArray[np.float32]) -> LogSpectra:
    """Return stored radii, (n_rows, n_dampings, n_periods), on logarithmic axes."""
    # spectra are stored as float32: a radius of 0 counts as the smallest of these
    radii = np.log(np.maximum(stored.astype(np.float64), np.finfo(np.float32).tiny))
    dampings = np.log(np.maximum(station["damping"].to_numpy(), SMALLEST_DAMPING))
    return LogSpectra(np.log(station["period"].to_numpy()), dampings, np.ascontiguousarray(radii))
