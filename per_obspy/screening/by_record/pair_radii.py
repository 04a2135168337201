"""
Radii of both buildings of a pair along common azimuths, and the correlation of their responses.

Every array has the shape (n_pairs, n_azimuths): one azimuth where the pair's is known or the
station has a single horizontal, else every degree of the half circle, from which the pair's worst
is chosen by its demand. Both buildings are always driven along the same azimuth.
"""

from typing import NamedTuple

import numpy as np

from per_obspy.checks import FloatArray
from per_obspy.pounding.correlation import directional_correlation
from per_obspy.screening.by_record.station_motion import StationMotion
from per_obspy.screening.values import Table, both
from per_obspy.spectra.azimuthal import (
    EVERY_AZIMUTH,
    azimuthal_per_spectrum,
    azimuthal_sd_spectrum,
)
from per_obspy.spectra.per_pair import azimuth_maxima


class PairMotion(NamedTuple):
    """
    Response of pairs of buildings to a record, (n_pairs, n_azimuths).

    Attributes
    ----------
    azimuth : ndarray
        Of the ground motion, degrees clockwise from north; NaN where the only sensor's azimuth is
        unknown.
    per, sd : pairs of ndarray
        Pseudo energy radius and spectral displacement of the two oscillators, m.
    correlation : ndarray
        Of the two responses over all time, dimensionless.
    """

    azimuth: FloatArray
    per: tuple[FloatArray, FloatArray]
    sd: tuple[FloatArray, FloatArray]
    correlation: FloatArray


def motion_along_azimuths(station: StationMotion, pairs: Table, azimuth: FloatArray) -> PairMotion:
    """
    Compute the motion along one azimuth per pair.

    Parameters
    ----------
    station : StationMotion
        The record.
    pairs : Table
        With periods and dampings of both buildings.
    azimuth : (n_pairs,) ndarray
        Degrees clockwise from north.
    """
    motion = station.north, station.east, station.dt
    (period_1, damping_1), (period_2, damping_2) = _oscillators(pairs)
    per_1, sd_1 = azimuth_maxima(*motion, period_1, damping_1, azimuth)
    per_2, sd_2 = azimuth_maxima(*motion, period_2, damping_2, azimuth)
    # every pair has one azimuth: arrays (n_pairs, 1)
    return PairMotion(
        azimuth=azimuth[:, None],
        per=(per_1[:, None], per_2[:, None]),
        sd=(sd_1[:, None], sd_2[:, None]),
        correlation=_correlation(station, pairs, azimuth[:, None]),
    )


def motion_of_one_horizontal(station: StationMotion, pairs: Table) -> PairMotion:
    """Compute the motion along the only horizontal of a station, whatever the pairs' azimuths."""
    motion = motion_along_azimuths(station, pairs, np.zeros(len(pairs["azimuth"])))
    return motion._replace(azimuth=np.full_like(motion.azimuth, station.sensor_azimuth))


def motion_along_every_azimuth(station: StationMotion, pairs: Table) -> PairMotion:
    """Compute the motion along every degree of the half circle, for pairs of unknown azimuth."""
    oscillators_1, oscillators_2 = _oscillators(pairs)
    per_1, sd_1 = _every_radius(station, *oscillators_1)
    per_2, sd_2 = _every_radius(station, *oscillators_2)
    return PairMotion(
        azimuth=np.broadcast_to(EVERY_AZIMUTH, per_1.shape),
        per=(per_1, per_2),
        sd=(sd_1, sd_2),
        correlation=_correlation(station, pairs, EVERY_AZIMUTH[None, :]),
    )


def _oscillators(pairs: Table) -> list[tuple[FloatArray, FloatArray]]:
    """Return period and damping of buildings 1 and of buildings 2."""
    return list(zip(both(pairs, "period"), both(pairs, "damping"), strict=True))


def _correlation(station: StationMotion, pairs: Table, azimuths: FloatArray) -> FloatArray:
    """Return the correlation of both responses along azimuths (n_pairs or 1, n_azimuths)."""
    first, second = _oscillators(pairs)
    motion = station.north, station.east, station.dt
    return directional_correlation(*motion, *first, *second, azimuths)


def _every_radius(
    station: StationMotion, periods: FloatArray, dampings: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return PER and SD along every azimuth, (n, 180); equal oscillators are computed once."""
    motion = station.north, station.east, station.dt
    per, sd = np.empty((2, periods.size, EVERY_AZIMUTH.size))
    for damping in np.unique(dampings):
        damped = np.flatnonzero(dampings == damping)
        # one spectrum of the distinct periods serves all oscillators of this damping
        distinct, position = np.unique(periods[damped], return_inverse=True)
        spectrum = distinct, damping, EVERY_AZIMUTH
        per[damped] = azimuthal_per_spectrum(*motion, *spectrum)[position]
        sd[damped] = azimuthal_sd_spectrum(*motion, *spectrum)[position]
    return per, sd
