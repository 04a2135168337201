"""
Baselines: means and trends, and those that shift during the shaking.

The latter are found in velocity or displacement.
"""

from collections.abc import Callable, Iterator
from itertools import product

import numpy as np
from numpy.polynomial import Polynomial
from obspy import Trace
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicHermiteSpline

from per_obspy.checks import FloatArray, number, positive, record
from per_obspy.processing import series
from per_obspy.processing.account import with_note

#: Latest start of the quiet end, fraction of the record.
LATEST_START = 0.9

#: Trial ends of the shaking.
TRIAL_ENDS = 12

#: Orders of the polynomials of the velocity before and after the shaking.
EARLY_ORDERS, LATE_ORDERS = (1, 2), (1, 2, 3)

#: Fewest samples after the shaking to which a line is fitted.
FEWEST_AFTER = 10


def without_mean(trace: Trace, pre_event: float = 0.0) -> Trace:
    """
    Return a copy without the mean of its quiet beginning, or else of the whole record.

    Parameters
    ----------
    trace : obspy Trace
    pre_event : float
        Length of the noise at the beginning, s; 0 or less: the mean of the whole record.

    Returns
    -------
    obspy Trace

    References
    ----------
    Boore & Bommer 2005, Soil Dyn. Earthq. Eng. 25, 93-115, section 3.
    """
    # Samples of the noise, if there are any
    quiet = trace.data[: max(round(pre_event / trace.stats.delta), 0)]
    mean = float((quiet if quiet.size else trace.data).mean())
    source = f"the first {pre_event:g} s" if quiet.size else "the whole record"
    step = f"mean {mean:.4g} of {source} removed"
    return with_note(trace, step, trace.data - mean, mean=mean, mean_of=source)


def without_line(trace: Trace) -> Trace:
    """Return a copy without its least-squares straight line, fitted to the whole record."""
    samples = series.without_line(trace.data)
    return with_note(trace, "polynomial trend of order 1 removed", samples, trend_order=1)


def without_baseline(trace: Trace, remove: Callable[..., FloatArray], **options: float) -> Trace:
    """
    Return a copy without the baseline that one of the functions below removes.

    Parameters
    ----------
    trace : obspy Trace
    remove : callable
        From samples, m/s2, sampling interval, s, and options to samples.
    **options : float
        Further arguments of the function, SI.

    Returns
    -------
    obspy Trace
    """
    numbers = ", ".join(f"{name} {value:g}" for name, value in options.items())
    samples = remove(trace.data, trace.stats.delta, **options)
    return with_note(trace, f"baseline by {remove.__name__} removed ({numbers})", samples)


def boore_segments(data: FloatArray, dt: float, first: float, second: float) -> FloatArray:
    r"""
    Remove two baseline shifts from acceleration, one during the shaking and one from then on.

    A line is fitted to the velocity after the shaking; its slope is the shift there, and the shift
    during the shaking is the part that brings the velocity from zero onto that line:

    .. math:: v_f(t) = v_0 + a_f t, \quad t \ge t_2, \qquad a_m = v_f(t_2) / (t_2 - t_1)

    Parameters
    ----------
    data : (n_samples,) array_like
        Acceleration without the mean of its quiet beginning, m/s2.
    dt : float
        Sampling interval, s.
    first, second : float
        t1 and t2, s from the first sample; see `crossing_time` for a choice of t2.

    Returns
    -------
    (n_samples,) ndarray
        m/s2.

    Raises
    ------
    ValueError
        Unless 0 <= first < second and ten samples follow the second.

    References
    ----------
    Boore 2001, Bull. Seism. Soc. Am. 91, 1199-1211, eq. (1)-(3).
    """
    samples, time = _samples_and_times(data, dt)
    if not 0 <= first < second <= time[-1] - FEWEST_AFTER * dt:
        raise ValueError(
            f"first and second must be times within the record, got {first:g} and {second:g} s"
        )
    # Shifts after t2 and between t1 and t2: a_f and a_m
    constant, slope = final_line(samples, time, second)
    during = (constant + slope * second) / (second - first)
    shift = np.where(time >= second, slope, np.where(time >= first, during, 0.0))
    return samples - shift


def residual_velocity(data: FloatArray, dt: float, end: float) -> float:
    """
    Return the residual velocity at the end of the shaking, m/s.

    It is that of the line through the velocity from then on. The ground has come to rest by then,
    so that this is the integral of the baseline's shifts during the shaking.

    Parameters
    ----------
    data : (n_samples,) array_like
        Acceleration without the mean of its quiet beginning, m/s2.
    dt : float
        Sampling interval, s.
    end : float
        Of the shaking, s from the first sample.

    Returns
    -------
    float
        At least 0.

    Examples
    --------
    >>> shifted = np.zeros(1000)
    >>> shifted[200:300] = 0.05  # m/s2 for 1 s
    >>> round(residual_velocity(shifted, 0.01, 5.0), 12)
    0.05
    """
    constant, slope = final_line(*_samples_and_times(data, dt), end)
    return abs(constant + slope * end)


def crossing_time(data: FloatArray, dt: float, first: float, second: float) -> float:
    """
    Return the t2 at which the line through the final velocity crosses zero.

    It must lie between the two times, else the second is returned. With it the shift during the
    shaking vanishes: the baseline has a single step.

    Parameters
    ----------
    data : (n_samples,) array_like
        As in `boore_segments`.
    dt, first, second : float
        s.

    Returns
    -------
    float
        s.

    References
    ----------
    Boore 2001, Bull. Seism. Soc. Am. 91, 1199-1211: "v0 correction".
    """
    constant, slope = final_line(*_samples_and_times(data, dt), second)
    crossing = -constant / slope if slope else np.inf
    return float(crossing) if first < crossing < second else second


def velocity_residual(data: FloatArray, dt: float, onset: float, end: float) -> FloatArray:
    """
    Remove the slope of the residual velocity before and after the shaking from acceleration.

    Before the onset the velocity is fitted by a line or a parabola, after the shaking by a
    polynomial up to third order; a cubic that meets both with their slopes bridges the shaking.
    Ends of the shaking are tried in steps, and the combination with the smallest velocity outside
    the shaking is used.

    Parameters
    ----------
    data : (n_samples,) array_like
        Acceleration without the mean of its quiet beginning, m/s2.
    dt : float
        Sampling interval, s.
    onset, end : float
        Of the shaking, s from the first sample; the end is the earliest that is tried.

    Returns
    -------
    (n_samples,) ndarray
        m/s2.

    Raises
    ------
    ValueError
        Unless 0 < onset < end and a tenth of the record follows the end.

    References
    ----------
    Jones, Kalkan & Stephens 2017, U.S. Geological Survey Open-File Report 2017-1008: the idea of
    the adaptive baseline correction.
    """
    samples, time = _samples_and_times(data, dt)
    latest = LATEST_START * time[-1]
    if not 0 < onset < end <= latest:
        raise ValueError(
            "onset and end must be times within the first 90 % of the record, "
            f"got {onset:g} and {end:g} s"
        )
    velocity = cumulative_trapezoid(samples, dx=dt, initial=0)
    is_outside = (time < onset) | (time >= end)

    def mean_square(baseline: FloatArray) -> float:
        return float(np.mean((velocity - baseline)[is_outside] ** 2))

    # Baseline of the velocity that leaves least outside the shaking
    ends = np.linspace(end, latest, TRIAL_ENDS)
    best = min(_residual_baselines(velocity, time, onset, ends), key=mean_square)
    return samples - np.gradient(best, dt)


def _residual_baselines(
    velocity: FloatArray, time: FloatArray, onset: float, ends: FloatArray
) -> Iterator[FloatArray]:
    """Yield the trial baselines of the velocity, m/s."""
    before = time <= onset
    for end, early, late in product(ends, EARLY_ORDERS, LATE_ORDERS):
        # Polynomials outside the shaking
        after = time >= end
        first = Polynomial.fit(time[before], velocity[before], early)
        last = Polynomial.fit(time[after], velocity[after], late)
        # Cubic with their values and slopes at the ends of the shaking
        values = [first(onset), last(end)]
        slopes = [first.deriv()(onset), last.deriv()(end)]
        bridge = CubicHermiteSpline([onset, end], values, slopes)
        yield np.where(before, first(time), np.where(after, last(time), bridge(time)))


def displacement_polynomial(data: FloatArray, dt: float, order: int = 6) -> FloatArray:
    """
    Remove the second derivative of the polynomial that fits the displacement from acceleration.

    The polynomial has no constant and no linear term: the ground starts at rest.

    Parameters
    ----------
    data : (n_samples,) array_like
        Acceleration, m/s2.
    dt : float
        Sampling interval, s.
    order : int
        Of the polynomial, at least 2.

    Returns
    -------
    (n_samples,) ndarray
        m/s2.

    References
    ----------
    Ancheta et al. 2013, PEER report 2013/03, NGA-West2 database: post-processing by a sixth-order
    polynomial.
    """
    samples, time = _samples_and_times(data, dt)
    if order < 2:
        raise ValueError(f"order must be at least 2, got {order}")
    velocity = cumulative_trapezoid(samples, dx=dt, initial=0)
    displacement = cumulative_trapezoid(velocity, dx=dt, initial=0)
    # Least squares in powers of time over the duration
    duration = time[-1]
    powers = np.arange(2, order + 1)
    terms = (time[:, None] / duration) ** powers
    coefficients, *_ = np.linalg.lstsq(terms, displacement)
    # Second derivative of each power
    curvature = powers * (powers - 1) * (time[:, None] / duration) ** (powers - 2) / duration**2
    return np.asarray(samples - curvature @ coefficients)


def _samples_and_times(data: FloatArray, dt: float) -> tuple[FloatArray, FloatArray]:
    """Return checked samples and their times, s."""
    samples = record("data", data)
    return samples, np.arange(float(samples.size)) * number("dt", dt, positive)


def final_line(samples: FloatArray, time: FloatArray, start: float) -> tuple[float, float]:
    """
    Return the line through the velocity from a time on.

    Parameters
    ----------
    samples : (n_samples,) ndarray
        Acceleration, m/s2.
    time : (n_samples,) ndarray
        s.
    start : float
        s; at least two samples follow.

    Returns
    -------
    constant, slope : float
        m/s and m/s2; the line has the value constant + slope * time.
    """
    velocity = cumulative_trapezoid(samples, time, initial=0)
    after = time >= start
    constant, slope = Polynomial.fit(time[after], velocity[after], 1).convert().coef
    return float(constant), float(slope)
