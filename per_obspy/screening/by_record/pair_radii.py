"""
The ground motion that a pair of buildings is given: radii of both along one azimuth, and their correlation.

Every array has the shape (n_pairs, n_azimuths): one azimuth where the pair's is given or the
station has a single horizontal, else every degree of the half circle, from which the pair's worst
is chosen by its demand. Both buildings are always driven along the same azimuth.
"""

from typing import NamedTuple

import numpy as np
import xarray as xr

from per_obspy.checks import FloatArray
from per_obspy.pounding.correlation.azimuths import directional_correlation
from per_obspy.screening.values import Table, both, components
from per_obspy.spectra.azimuthal import (
    EVERY_AZIMUTH,
    azimuthal_per_spectrum,
    azimuthal_sd_spectrum,
)
from per_obspy.spectra.per_pair import azimuth_maxima


class PairMotion(NamedTuple):
    """
    What a record does to pairs of buildings, (n_pairs, n_azimuths).

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


def motion_along_azimuths(station: xr.Dataset, pairs: Table, azimuth: FloatArray) -> PairMotion:
    """Return the motion along one azimuth a pair, (n_pairs,), degrees."""
    return _along(*components(station), pairs, azimuth)


def motion_of_one_horizontal(station: xr.Dataset, pairs: Table) -> PairMotion:
    """Return the motion along the only horizontal of a station, whatever the pairs' azimuths."""
    motion = _along(*components(station), pairs, np.zeros(len(pairs["azimuth"])))
    return motion._replace(
        azimuth=np.full_like(motion.azimuth, float(station["horizontal_azimuth"][0]))
    )


def motion_along_every_azimuth(station: xr.Dataset, pairs: Table) -> PairMotion:
    """Return the motion along every degree of the half circle, for pairs whose azimuth is unknown."""
    north, east, dt = components(station)
    radii = [_every_radius(north, east, dt, *oscillator) for oscillator in _oscillators(pairs)]
    return PairMotion(
        azimuth=np.broadcast_to(EVERY_AZIMUTH, radii[0][0].shape),
        per=(radii[0][0], radii[1][0]),
        sd=(radii[0][1], radii[1][1]),
        correlation=_correlation(north, east, dt, pairs, EVERY_AZIMUTH[None, :]),
    )


def _along(
    north: FloatArray, east: FloatArray, dt: float, pairs: Table, azimuth: FloatArray
) -> PairMotion:
    (per_1, sd_1), (per_2, sd_2) = (
        azimuth_maxima(north, east, dt, period, damping, azimuth)
        for period, damping in _oscillators(pairs)
    )
    return PairMotion(
        azimuth=azimuth[:, None],
        per=(per_1[:, None], per_2[:, None]),
        sd=(sd_1[:, None], sd_2[:, None]),
        correlation=_correlation(north, east, dt, pairs, azimuth[:, None]),
    )


def _oscillators(pairs: Table) -> list[tuple[FloatArray, FloatArray]]:
    """Return period and damping of buildings 1 and of buildings 2."""
    return list(zip(both(pairs, "period"), both(pairs, "damping"), strict=True))


def _correlation(
    north: FloatArray, east: FloatArray, dt: float, pairs: Table, azimuths: FloatArray
) -> FloatArray:
    first, second = _oscillators(pairs)
    return directional_correlation(north, east, dt, *first, *second, azimuths)


def _every_radius(
    north: FloatArray, east: FloatArray, dt: float, periods: FloatArray, dampings: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return PER and SD along every azimuth, (n, 180); equal oscillators are computed once."""
    per, sd = np.empty((2, periods.size, EVERY_AZIMUTH.size))
    for damping in np.unique(dampings):
        chosen = np.flatnonzero(dampings == damping)
        distinct, position = np.unique(periods[chosen], return_inverse=True)
        per[chosen] = azimuthal_per_spectrum(north, east, dt, distinct, damping, EVERY_AZIMUTH)[
            position
        ]
        sd[chosen] = azimuthal_sd_spectrum(north, east, dt, distinct, damping, EVERY_AZIMUTH)[
            position
        ]
    return per, sd
