"""
Correlation of the responses of a pair: under white noise (16), under a record, along any azimuth.

The covariance of two linear oscillators over all time follows from their equations of motion once
the integrals of each response times the ground acceleration are known. These belong to one
building, not to a pair: the record is run through once per building, and a pair costs a few
operations whatever the record's length.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray
from per_obspy.kernels.relative.input_moments import LAG_TILE, input_moments
from per_obspy.kernels.relative.worst_azimuth import largest_separation
from per_obspy.pounding.structure import checked_oscillators
from per_obspy.spectra.trace_arguments import takes_trace


def ddc_correlation(
    period_1: ArrayLike, damping_1: ArrayLike, period_2: ArrayLike, damping_2: ArrayLike
) -> FloatArray:
    """
    Compute the correlation of two oscillators under white noise, exact for any damping.

    Parameters
    ----------
    period_1, period_2 : array_like
        Undamped periods, s.
    damping_1, damping_2 : array_like
        Fractions of critical, at least 0 and below 1, dimensionless.

    Returns
    -------
    correlation : ndarray
        Broadcast shape, dimensionless, from 0 to 1. Two undamped oscillators give 1 for equal
        periods, else 0.

    Raises
    ------
    ValueError
        If a period is not positive or a damping is outside [0, 1).

    Notes
    -----
    With b = T2/T1, written here in a form that does not change when 1 and 2 are exchanged::

                        8 sqrt(xi1 xi2) (xi2 + xi1 b) b^1.5
        rho = -------------------------------------------------------------
              (1 - b²)² + 4 xi1 xi2 (1 + b²) b + 4 (xi1² + xi2²) b²

    References
    ----------
    Valles-Mattox & Reinhorn (1996), 11WCEE, equation (16); Jeng, Kasai & Maison (1992), Earthquake
    Spectra 8(2).

    Examples
    --------
    >>> print(round(float(ddc_correlation(1.0, 0.05, 1.2, 0.05)), 6))
    0.229814
    """
    period_1 = checks.positive("period_1", period_1)
    period_2 = checks.positive("period_2", period_2)
    damping_1 = checks.fraction_of_critical("damping_1", damping_1)
    damping_2 = checks.fraction_of_critical("damping_2", damping_2)
    ratio = period_1 / period_2

    # T1/T2 - T2/T1 without cancellation
    detuning = (period_1 - period_2) * (1 / period_1 + 1 / period_2)

    # Divided by the largest of the three, squares of small dampings cannot underflow
    scale = np.maximum(np.maximum(damping_1, damping_2), np.abs(detuning))
    same = scale == 0
    scale = np.where(same, 1.0, scale)
    above, below = _fraction(ratio, damping_1 / scale, damping_2 / scale, detuning / scale)
    return np.where(same, 1.0, np.minimum(above / np.where(same, 1.0, below), 1.0))[()]


def _fraction(
    ratio: FloatArray, damping_1: FloatArray, damping_2: FloatArray, detuning: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return numerator and denominator of equation (16), both divided by b²."""
    product = damping_1 * damping_2
    above = 8 * np.sqrt(product) * (damping_2 * np.sqrt(ratio) + damping_1 / np.sqrt(ratio))
    below = detuning**2 + 4 * product * (ratio + 1 / ratio) + 4 * (damping_1**2 + damping_2**2)
    return above, below


class _Responses(NamedTuple):
    """
    One oscillator of each pair and the integrals of its response over all time, per azimuth.

    ``stiffness`` is k = ω² (rad²/s²) and ``viscosity`` c = 2 ξ ω (1/s), (n_pairs, 1) each;
    ``displacement_work`` is U = ∫ u a dt and ``velocity_work`` V = ∫ v a dt, (n_pairs, n_azimuths).
    """

    stiffness: FloatArray
    viscosity: FloatArray
    displacement_work: FloatArray
    velocity_work: FloatArray


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
    Compute the correlation of two displacements over all time, both driven along one azimuth.

    Parameters
    ----------
    north, east : (n_samples,) array_like
        Ground acceleration, m/s²; the free vibration after the record is included.
    dt : float
        Sampling interval, s.
    period_1, damping_1, period_2, damping_2 : (n_pairs,) array_like
        Periods, s, and dampings, fractions of critical.
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
    of the products u1 u2, u1 v2, v1 u2 and v1 v2 (zero at rest before and after) gives::

                     (k1 - k2) (U1 - U2) - c (c1 U1 + c2 U2 + V1 + V2)
        ∫ u1 u2 dt = -------------------------------------------------
                            (k1 - k2)² + c (c1 k2 + c2 k1)

    with c = c1 + c2. For white noise (U = 0, V the same for both) its normalised form is eq. (16).
    """
    period_1 = checks.positive("period_1", period_1)
    period_2 = checks.positive("period_2", period_2)
    damping_1 = checks.fraction_of_critical("damping_1", damping_1)
    damping_2 = checks.fraction_of_critical("damping_2", damping_2)
    angle = np.radians(checks.finite("azimuths", azimuths))
    motion = _closed(checks.record("north", north), checks.record("east", east))
    dt = checks.number("dt", dt, checks.positive)

    # Run the record once through all oscillators: integrals of response times ground acceleration
    periods = np.concatenate([period_1, period_2])
    dampings = np.concatenate([damping_1, damping_2])
    moments_1, moments_2 = np.split(_moments(*motion, dt, periods, dampings), 2)
    first = _along(moments_1, angle, period_1, damping_1)
    second = _along(moments_2, angle, period_2, damping_2)

    # Undamped oscillators vibrate for ever: their correlation is known without integrals
    undamped = (damping_1 * damping_2 == 0)[:, None]
    equal = ((period_1 == period_2) & (damping_1 == damping_2))[:, None]
    return _normalised(first, second, undamped, equal)


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
    Find the azimuth of the axis from 1 to 2 along which a record closes the gap of a pair most.

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
        Periods, s, and dampings, fractions of critical.
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
    first = checked_oscillators(1, period_1, damping_1, participation_1)
    second = checked_oscillators(2, period_2, damping_2, participation_2)
    pairs = np.stack([*first, *second])
    if not pairs.size:
        return np.empty(0)
    step = checks.number("dt", dt, checks.positive)
    components = _closed(checks.record("north", north), checks.record("east", east))

    # Follow two of the longest period of free vibration after the record
    longest = float(np.max(2.0 * np.pi / pairs[[0, 3]]))
    rest = np.zeros(int(np.ceil(2.0 * longest / step)))
    north, east = (np.append(component, rest) for component in components)

    # The direction of the longest vector q1 u1 - q2 u2 is the azimuth
    vector = np.empty((2, pairs.shape[1]))
    largest_separation(north, east, step, np.ascontiguousarray(pairs), vector)
    azimuth: FloatArray = np.degrees(np.arctan2(vector[1], vector[0])) % 360.0
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
    order = np.argsort(omega * ratio, kind="stable")
    moments = np.empty((omega.size, 2, 3))
    lagged, firsts = _sample_products(north, east)
    input_moments(lagged, firsts, dt, omega, ratio, order, moments)
    return moments


def _sample_products(north: FloatArray, east: FloatArray) -> tuple[FloatArray, FloatArray]:
    """
    Return sums of products of two samples, and products with the first sample, by their distance.

    Both are (3, n): north with north, north with east and east with north, east with east.
    """
    count = north.size
    padded = fft.next_fast_len(2 * count, real=True)

    # Sums of products at every distance are the inverse transform of the (cross) power spectrum
    spectra = fft.rfft([north, east], padded)
    power_north = np.abs(spectra[0]) ** 2
    power_both = 2.0 * (spectra[0].conj() * spectra[1]).real
    power_east = np.abs(spectra[1]) ** 2
    powers = np.stack([power_north, power_both, power_east])
    lagged, firsts = np.zeros((2, 3, -(-count // LAG_TILE) * LAG_TILE + 2))
    lagged[:, :count] = fft.irfft(powers, padded)[:, :count]

    # Products of the first sample with the sample at each distance
    firsts[0, :count] = north[0] * north
    firsts[1, :count] = north[0] * east + east[0] * north
    firsts[2, :count] = east[0] * east
    return lagged, firsts


def _along(
    moments: FloatArray, angle: FloatArray, period: FloatArray, damping: FloatArray
) -> _Responses:
    """Return oscillators with the integrals of their response along the angles."""
    cosine, sine = np.cos(angle), np.sin(angle)
    north, cross, east = np.moveaxis(moments, -1, 0)[..., None]  # each (n_pairs, 2, 1)
    along: FloatArray = (
        cosine[:, None] ** 2 * north + (cosine * sine)[:, None] * cross + sine[:, None] ** 2 * east
    )
    stiffness = (2.0 * np.pi / period[:, None]) ** 2
    viscosity = 2.0 * damping[:, None] * stiffness**0.5
    return _Responses(stiffness, viscosity, along[:, 0], along[:, 1])


def _normalised(
    first: _Responses, second: _Responses, undamped: NDArray[np.bool_], equal: NDArray[np.bool_]
) -> FloatArray:
    """Return the covariance over the root of both variances; 1 or 0 for undamped oscillators."""
    variance_1, variance_2 = _covariance(first, first), _covariance(second, second)
    if np.any((variance_1 <= 0) & ~undamped) or np.any((variance_2 <= 0) & ~undamped):
        raise ValueError("north and east have no motion along an azimuth: there is no correlation")
    root_1 = np.sqrt(np.where(undamped, 1.0, variance_1))
    root_2 = np.sqrt(np.where(undamped, 1.0, variance_2))
    scale = root_1 * root_2

    # Equal oscillators move as one: exactly 1 in spite of rounding
    covariance = np.where(equal, scale, _covariance(first, second))
    bounded = np.clip(covariance / scale, -1.0, 1.0)
    correlation: FloatArray = np.where(undamped, equal, bounded)
    return correlation


def _covariance(first: _Responses, second: _Responses) -> FloatArray:
    """
    Return the integral of u1 u2 over all time, 0 if undamped.

    The formula is that in the notes of :func:`directional_correlation`.
    """
    detuning = first.stiffness - second.stiffness
    viscosity = first.viscosity + second.viscosity

    # c1 U1 + c2 U2 + V1 + V2
    input_work = (
        first.viscosity * first.displacement_work
        + second.viscosity * second.displacement_work
        + first.velocity_work
        + second.velocity_work
    )
    difference = first.displacement_work - second.displacement_work
    above = detuning * difference - viscosity * input_work

    # (k1 - k2)² + c (c1 k2 + c2 k1)
    coupling = first.viscosity * second.stiffness + second.viscosity * first.stiffness
    below = detuning**2 + viscosity * coupling
    covariance: FloatArray = np.divide(above, below, out=np.zeros_like(above), where=below > 0)
    return covariance


@takes_trace
def record_correlation(
    acceleration: ArrayLike,
    dt: float,
    period_1: ArrayLike,
    damping_1: ArrayLike,
    period_2: ArrayLike,
    damping_2: ArrayLike,
) -> FloatArray:
    """
    Compute the correlation of two displacements under a record and the free vibration after it.

    Parameters
    ----------
    acceleration : (n_samples,) array_like or obspy Trace
        Ground acceleration, linear between samples, m/s². A record that does not end at zero is
        closed by a ramp of dt.
    dt : float
        Sampling interval, s; not given with a Trace.
    period_1, period_2 : array_like
        Undamped periods, s.
    damping_1, damping_2 : array_like
        Fractions of critical, dimensionless.

    Returns
    -------
    correlation : ndarray
        ``∫ u1 u2 dt / sqrt(∫ u1² dt ∫ u2² dt)``, broadcast shape of the pairs, dimensionless, from
        -1 to 1. Undamped structures vibrate for ever: 1 for equal ones, 0 for others.

    Raises
    ------
    ValueError
        If an argument is out of range or the record is zero everywhere.

    See Also
    --------
    per_obspy.pounding.correlation.directional_correlation :
        The formula, for pairs along individual azimuths.

    Examples
    --------
    >>> print(record_correlation([0.0, 1.0, 0.0], 0.01, 1.0, 0.05, [1.0, 1.2], 0.05).round(3))
    [1.   0.23]
    """
    acceleration = checks.record("acceleration", acceleration)
    if not acceleration.any():
        raise ValueError("acceleration is 0 everywhere: there is no correlation")
    pairs = np.broadcast_arrays(
        checks.positive("period_1", period_1),
        checks.fraction_of_critical("damping_1", damping_1),
        checks.positive("period_2", period_2),
        checks.fraction_of_critical("damping_2", damping_2),
    )
    period_1, damping_1, period_2, damping_2 = (array.ravel() for array in pairs)

    # One component: the record is that along north, and so is the axis of every pair
    east = np.zeros_like(acceleration)
    correlation = directional_correlation(
        acceleration, east, dt, period_1, damping_1, period_2, damping_2, azimuths=[[0.0]]
    )
    shaped: FloatArray = correlation[:, 0].reshape(pairs[0].shape)
    return shaped
