"""
Two responses to one record along any azimuth, for whole inventories: their correlation, their worst azimuth.

The covariance of two linear oscillators over all time follows from their equations of motion once
the integrals of each response times the ground acceleration are known. These belong to one
building, not to a pair: the record is run through once a building, and a pair costs a few
operations whatever the record's length.
"""

import numpy as np
from numpy.typing import ArrayLike
from scipy import fft

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.kernels.relative.input_moments import LAG_TILE, input_moments
from per_obspy.kernels.relative.worst_azimuth import largest_separation


def directional_correlation(
    north: ArrayLike,
    east: ArrayLike,
    dt: float,
    period_1: ArrayLike,
    damping_1: ArrayLike,
    period_2: ArrayLike,
    damping_2: ArrayLike,
    azimuths: ArrayLike,
) -> FloatArray:
    """
    Return the correlation of two displacements over all time, both driven along the same azimuth.

    Parameters
    ----------
    north, east : (n_samples,) array_like
        Ground acceleration, m/s²; the free vibration after the record is included.
    dt : float
        Sampling interval, s.
    period_1, damping_1, period_2, damping_2 : (n_pairs,) array_like
        s; fraction of critical.
    azimuths : (n_pairs, n_azimuths) or (1, n_azimuths) array_like
        Degrees clockwise from north.

    Returns
    -------
    correlation : (n_pairs, n_azimuths) ndarray
        Dimensionless, from -1 to 1. Undamped oscillators vibrate for ever: 1 for equal ones, 0 for
        others.

    Raises
    ------
    ValueError
        If an argument is out of range, or there is no motion along an azimuth.

    Notes
    -----
    With c = 2 ξ ω, k = ω², and the integrals over all time U = ∫ u a dt, V = ∫ v a dt, stationarity
    of the products
    u1 u2, u1 v2, v1 u2 and v1 v2 (zero at rest before and after) gives::

        ∫ u1 u2 dt = [(k1 - k2)(U1 - U2) - c (c1 U1 + c2 U2 + V1 + V2)] / [(k1 - k2)² + c (c1 k2 +
        c2 k1)]

    with c = c1 + c2. For white noise (U = 0, V the same for both) its normalised form is eq. (16).
    """
    period_1, period_2 = (
        checks.positive("period_1", period_1),
        checks.positive("period_2", period_2),
    )
    damping_1 = checks.fraction_of_critical("damping_1", damping_1)
    damping_2 = checks.fraction_of_critical("damping_2", damping_2)
    angle = np.radians(checks.finite("azimuths", azimuths))
    motion = _closed(checks.record("north", north), checks.record("east", east))
    dt = checks.number("dt", dt, checks.positive)
    oscillators = np.concatenate([period_1, period_2]), np.concatenate([damping_1, damping_2])
    first, second = (
        _along(moments, angle) for moments in np.split(_moments(*motion, dt, *oscillators), 2)
    )
    stiffness_1, stiffness_2 = (
        (2.0 * np.pi / period[:, None]) ** 2 for period in (period_1, period_2)
    )
    viscosity_1, viscosity_2 = (
        2.0 * damping_1[:, None] * stiffness_1**0.5,
        2.0 * damping_2[:, None] * stiffness_2**0.5,
    )
    own_1 = _covariance(first, first, stiffness_1, stiffness_1, viscosity_1, viscosity_1)
    own_2 = _covariance(second, second, stiffness_2, stiffness_2, viscosity_2, viscosity_2)
    both = _covariance(first, second, stiffness_1, stiffness_2, viscosity_1, viscosity_2)
    undamped = (damping_1 * damping_2 == 0)[:, None]
    equal = ((period_1 == period_2) & (damping_1 == damping_2))[:, None]
    if np.any((own_1 <= 0) & ~undamped) or np.any((own_2 <= 0) & ~undamped):
        raise ValueError("north and east have no motion along an azimuth: there is no correlation")
    scale = np.sqrt(np.where(undamped, 1.0, own_1)) * np.sqrt(np.where(undamped, 1.0, own_2))
    correlation: FloatArray = np.where(
        undamped, equal, np.clip(np.where(equal, scale, both) / scale, -1.0, 1.0)
    )
    return correlation


def worst_azimuth(
    north: ArrayLike,
    east: ArrayLike,
    dt: float,
    period_1: ArrayLike,
    damping_1: ArrayLike,
    period_2: ArrayLike,
    damping_2: ArrayLike,
    participation_1: ArrayLike,
    participation_2: ArrayLike,
) -> FloatArray:
    """
    Return the azimuth of the axis from 1 to 2 along which the record moves a pair furthest towards each other.

    The responses to the two components are the parts of a vector ``q1 u1 - q2 u2``; its largest
    length over time is the largest one-sided relative displacement over all azimuths, and its
    direction is that azimuth.

    Parameters
    ----------
    north, east : (n_samples,) array_like
        Ground acceleration, m/s²; two periods of free vibration after the record are included.
    dt : float
        Sampling interval, s. The vector is looked at at the samples; a direction is not sensitive
        to that.
    period_1, damping_1, period_2, damping_2 : (n_pairs,) array_like
        s; fraction of critical.
    participation_1, participation_2 : (n_pairs,) array_like
        Contact displacement over oscillator displacement, dimensionless.

    Returns
    -------
    azimuth : (n_pairs,) ndarray
        Degrees clockwise from north, from 0 to 360; 0 where the two never part.

    Raises
    ------
    ValueError
        If an argument is out of range.
    """
    pairs = np.stack(
        [
            2.0 * np.pi / checks.positive("period_1", period_1),
            checks.fraction_of_critical("damping_1", damping_1),
            checks.not_negative("participation_1", participation_1),
            2.0 * np.pi / checks.positive("period_2", period_2),
            checks.fraction_of_critical("damping_2", damping_2),
            checks.not_negative("participation_2", participation_2),
        ]
    )
    if not pairs.size:
        return np.empty(0)
    step = checks.number("dt", dt, checks.positive)
    rest = np.zeros(int(np.ceil(2.0 * float(np.max(2.0 * np.pi / pairs[[0, 3]])) / step)))
    components = _closed(checks.record("north", north), checks.record("east", east))
    apart = np.empty((2, pairs.shape[1]))
    largest_separation(
        np.append(components[0], rest),
        np.append(components[1], rest),
        step,
        np.ascontiguousarray(pairs),
        apart,
    )
    azimuth: FloatArray = np.degrees(np.arctan2(apart[1], apart[0])) % 360.0
    return azimuth


def _closed(north: FloatArray, east: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the two components with the ramp to zero that closes a record."""
    if north.size != east.size:
        raise ValueError(f"east must have the {north.size} samples of north, got {east.size}")
    return np.append(north, 0.0), np.append(east, 0.0)


def _moments(
    north: FloatArray, east: FloatArray, dt: float, period: FloatArray, damping: FloatArray
) -> FloatArray:
    """Return the moments (n, 2, 3) of the kernel."""
    omega, ratio = 2.0 * np.pi / period, np.ascontiguousarray(damping)
    moments = np.empty((omega.size, 2, 3))
    lagged, firsts = _sample_products(north, east)
    input_moments(
        lagged, firsts, dt, omega, ratio, np.argsort(omega * ratio, kind="stable"), moments
    )
    return moments


def _sample_products(north: FloatArray, east: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the sums of products of samples, and the products of the first ones, by their distance, (3, n) each."""
    count = north.size
    spectra = fft.rfft([north, east], fft.next_fast_len(2 * count, real=True))
    powers = np.stack(
        [
            np.abs(spectra[0]) ** 2,
            2.0 * (spectra[0].conj() * spectra[1]).real,
            np.abs(spectra[1]) ** 2,
        ]
    )
    lagged, firsts = np.zeros((2, 3, -(-count // LAG_TILE) * LAG_TILE + 2))
    lagged[:, :count] = fft.irfft(powers, fft.next_fast_len(2 * count, real=True))[:, :count]
    firsts[0, :count], firsts[2, :count] = north[0] * north, east[0] * east
    firsts[1, :count] = north[0] * east + east[0] * north
    return lagged, firsts


def _along(moments: FloatArray, angle: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return U and V along the angles, (n_pairs, n_azimuths)."""
    cosine, sine = np.cos(angle), np.sin(angle)
    north, both, east = np.moveaxis(moments, -1, 0)[..., None]  # each (n_pairs, 2, 1)
    along: FloatArray = (
        cosine[:, None] ** 2 * north + (cosine * sine)[:, None] * both + sine[:, None] ** 2 * east
    )
    return along[:, 0], along[:, 1]


def _covariance(
    first: tuple[FloatArray, FloatArray],
    second: tuple[FloatArray, FloatArray],
    stiffness_1: FloatArray,
    stiffness_2: FloatArray,
    viscosity_1: FloatArray,
    viscosity_2: FloatArray,
) -> FloatArray:
    """Return the integral of u1 u2 over all time by the formula of :func:`directional_correlation`; 0 if undamped."""
    detuning, viscosity = stiffness_1 - stiffness_2, viscosity_1 + viscosity_2
    input_work = viscosity_1 * first[0] + viscosity_2 * second[0] + first[1] + second[1]
    above = detuning * (first[0] - second[0]) - viscosity * input_work
    below = detuning**2 + viscosity * (viscosity_1 * stiffness_2 + viscosity_2 * stiffness_1)
    covariance: FloatArray = np.divide(above, below, out=np.zeros_like(above), where=below > 0)
    return covariance
