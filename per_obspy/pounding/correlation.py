"""
Correlation of the responses of a pair: under white noise (16), under a record, along any azimuth.

The covariance of two linear oscillators over all time follows from their equations of motion once
the integrals of each response times the ground acceleration are known. These belong to one
building, not to a pair: the record is run through once per building, and a pair costs a few
operations whatever the record's length.
"""

import numpy as np
from scipy import fft

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray
from per_obspy.kernels.relative.input_moments import LAG_TILE, input_moments
from per_obspy.kernels.relative.worst_azimuth import largest_separation
from per_obspy.pounding.kernel_tables import both_components
from per_obspy.pounding.structure import Pairs
from per_obspy.spectra.trace_arguments import takes_trace

#: Smallest number above 0
SMALLEST = 5e-324


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

    # T1/T2 - T2/T1 without cancellation
    detuning = (period_1 - period_2) * (1 / period_1 + 1 / period_2)

    # Divided by the largest of the three, squares of small dampings cannot underflow
    scale = np.maximum(np.maximum(damping_1, damping_2), np.maximum(abs(detuning), SMALLEST))
    xi_1, xi_2, detuning = damping_1 / scale, damping_2 / scale, detuning / scale

    # Numerator and denominator of equation (16), both divided by b²
    ratio, product = period_1 / period_2, xi_1 * xi_2
    root = np.sqrt(ratio)
    above = 8 * np.sqrt(product) * (xi_2 * root + xi_1 / root)
    below = detuning**2 + 4 * (product * (ratio + 1 / ratio) + xi_1**2 + xi_2**2)
    return np.minimum(np.divide(above, below, out=np.ones_like(below), where=below > 0), 1.0)


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
    products = sample_products(*both_components(north, east))
    step = checks.number("dt", dt, checks.positive)
    return correlation_along(products, step, period_1, damping_1, period_2, damping_2, azimuths)


def correlation_along(
    products: tuple[FloatArray, FloatArray],
    dt: float,
    period_1: ArrayLike,
    damping_1: ArrayLike,
    period_2: ArrayLike,
    damping_2: ArrayLike,
    azimuths: ArrayLike,
) -> FloatArray:
    """Return :func:`directional_correlation` from the :func:`sample_products` of a record."""
    pairs = Pairs.of(period_1=period_1, damping_1=damping_1, period_2=period_2, damping_2=damping_2)
    return _correlations(products, dt, pairs, np.radians(checks.finite("azimuths", azimuths)))


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
    pairs = Pairs.of(
        period_1=period_1,
        damping_1=damping_1,
        participation_1=participation_1,
        period_2=period_2,
        damping_2=damping_2,
        participation_2=participation_2,
    )
    if not pairs.gap.size:
        return np.empty(0)
    step = checks.number("dt", dt, checks.positive)

    # The ramp that closes the record, and two of the longest period of free vibration after it
    rest = 1 + int(np.ceil(2.0 * pairs.period.max() / step))
    motion = np.pad(both_components(north, east), ((0, 0), (0, rest)))

    # The direction of the longest vector q1 u1 - q2 u2 is the azimuth
    vector = np.empty((2, pairs.gap.size))
    largest_separation(*motion, step, pairs.oscillators, vector)
    azimuth: FloatArray = np.degrees(np.arctan2(vector[1], vector[0])) % 360.0
    return azimuth


def _correlations(
    products: tuple[FloatArray, FloatArray], dt: float, pairs: Pairs, angle: FloatArray
) -> FloatArray:
    """
    Return the correlations of pairs along angles (rad), (n_pairs, n_angles).

    By the formula in the notes of :func:`directional_correlation`.
    """
    work, power = _input_work(products, dt, pairs, angle)
    omega, damping = pairs.frequency[..., np.newaxis], pairs.damping[..., np.newaxis]

    # Undamped oscillators vibrate for ever: their correlation is known without integrals
    undamped = damping[0] * damping[1] == 0
    equal = (omega[0] == omega[1]) & (damping[0] == damping[1])

    # k, c, and c U + V; of one structure the formula is -(c U + V)/(c k)
    stiffness, viscosity = omega**2, np.where(undamped, 1.0, 2.0 * damping * omega)
    own = viscosity * work + power
    variances = np.where(undamped, 1.0, -own / (viscosity * stiffness))
    if np.any(variances <= 0):
        raise ValueError("north and east have no motion along an azimuth: there is no correlation")
    scale = np.sqrt(variances[0]) * np.sqrt(variances[1])

    # Equal oscillators move as one: exactly 1 in spite of rounding
    ratio = _covariance(stiffness, viscosity, work, own) / scale
    return np.where(equal, 1.0, np.where(undamped, 0.0, np.clip(ratio, -1.0, 1.0)))


def _covariance(
    stiffness: FloatArray, viscosity: FloatArray, work: FloatArray, own: FloatArray
) -> FloatArray:
    """Return ∫ u1 u2 dt from k, c, U and c U + V of both structures (first axis)."""
    (k_1, k_2), (c_1, c_2) = stiffness, viscosity
    above = (k_1 - k_2) * (work[0] - work[1]) - (c_1 + c_2) * own.sum(axis=0)
    covariance: FloatArray = above / ((k_1 - k_2) ** 2 + (c_1 + c_2) * (c_1 * k_2 + c_2 * k_1))
    return covariance


def _input_work(
    products: tuple[FloatArray, FloatArray], dt: float, pairs: Pairs, angle: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return U = ∫ u a dt and V = ∫ v a dt of both structures, (2, n_pairs, n_angles) each."""
    # Run the record once through all oscillators
    frequency, damping = pairs.frequency.ravel(), pairs.damping.ravel()
    order = np.argsort(frequency * damping, kind="stable")
    moments = np.empty((order.size, 2, 3))
    input_moments(*products, dt, frequency, damping, order, moments)

    # Moments of north with north, of north with east, and of east with east
    cosine, sine = np.cos(angle), np.sin(angle)
    north, cross, east = moments.reshape(2, -1, 2, 3).transpose(3, 2, 0, 1)[..., np.newaxis]
    work, power = cosine**2 * north + cosine * sine * cross + sine**2 * east
    return work, power


def sample_products(north: FloatArray, east: FloatArray) -> tuple[FloatArray, FloatArray]:
    """
    Return sums of products of two samples, and products with the first sample, by their distance.

    Both are (3, n): north with north, north with east and east with north, east with east; the
    record is closed by a ramp to zero.
    """
    count = north.size + 1
    padded = fft.next_fast_len(2 * count, real=True)
    lagged, firsts = np.zeros((2, 3, -(-count // LAG_TILE) * LAG_TILE + 2))

    # Sums of products at every distance are the inverse transform of the (cross) power spectrum
    spectra = fft.rfft([north, east], padded)
    power_both = 2.0 * (spectra[0].conj() * spectra[1]).real
    powers = np.stack([np.abs(spectra[0]) ** 2, power_both, np.abs(spectra[1]) ** 2])
    lagged[:, :count] = fft.irfft(powers, padded)[:, :count]

    # Products of the first sample with the sample at each distance
    products = north[0] * north, north[0] * east + east[0] * north, east[0] * east
    firsts[:, : north.size] = products
    return lagged, firsts


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
    record = checks.record("acceleration", acceleration)
    if not record.any():
        raise ValueError("acceleration is 0 everywhere: there is no correlation")
    pairs = Pairs.of(period_1=period_1, damping_1=damping_1, period_2=period_2, damping_2=damping_2)

    # One component: the record is that along north, and so is the axis of every pair
    products = sample_products(record, np.zeros_like(record))
    step = checks.number("dt", dt, checks.positive)
    return _correlations(products, step, pairs, np.zeros((1, 1)))[:, 0].reshape(pairs.shape)
