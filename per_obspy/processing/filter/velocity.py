"""Baselines that shift during the shaking, seen in velocity or displacement and taken out of the acceleration."""

from collections.abc import Iterator
from itertools import product

import numpy as np
from numpy.polynomial import Polynomial
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicHermiteSpline

from per_obspy.checks import FloatArray, number, positive, record

LATEST_START = 0.9  # of the record, where the quiet end must have begun
TRIAL_ENDS = 12


def boore_segments(data: FloatArray, dt: float, first: float, second: float) -> FloatArray:
    r"""
    Return acceleration without two baseline shifts, one during the shaking and one from then on.

    A line is fitted to the velocity after the shaking; its slope is the shift there, and the shift
    during the shaking is what brings the velocity from zero onto that line:

    .. math:: v_f(t) = v_0 + a_f t, \quad t \ge t_2, \qquad a_m = v_f(t_2) / (t_2 - t_1)

    ``trace.detrend("boore_segments", dt=..., first=..., second=...)`` calls it.

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
    if not 0 <= first < second <= time[-1] - 10 * dt:
        raise ValueError(
            f"first and second must be times within the record, got {first:g} and {second:g} s"
        )
    constant, slope = _final_line(samples, time, second)
    during = (constant + slope * second) / (second - first)
    shift = np.where(time >= second, slope, np.where(time >= first, during, 0.0))
    return samples - shift


def residual_velocity(data: FloatArray, dt: float, end: float) -> float:
    """
    Return the velocity that is left when the shaking ends: that of the line through the velocity from then on, m/s.

    The ground has come to rest by then, so that this is the integral of what the baseline did
    during the shaking.

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
        Not negative.

    Examples
    --------
    >>> shifted = np.zeros(1000)
    >>> shifted[200:300] = 0.05  # m/s2 for 1 s
    >>> round(residual_velocity(shifted, 0.01, 5.0), 12)
    0.05
    """
    constant, slope = _final_line(*_samples_and_times(data, dt), end)
    return abs(constant + slope * end)


def crossing_time(data: FloatArray, dt: float, first: float, second: float) -> float:
    """
    Return the t2 at which the line through the final velocity crosses zero, if that is between the times, else second.

    With it the shift during the shaking vanishes: the baseline has a single step.

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
    constant, slope = _final_line(*_samples_and_times(data, dt), second)
    crossing = -constant / slope if slope else np.inf
    return float(crossing) if first < crossing < second else second


def velocity_residual(data: FloatArray, dt: float, onset: float, end: float) -> FloatArray:
    """
    Return acceleration without the slope of what is left in its velocity before and after the shaking.

    Before the onset the velocity is fitted by a line or a parabola, after the shaking by a
    polynomial up to third order; a cubic that meets both with their slopes bridges the shaking.
    When the shaking ends is tried in steps, and the combination with the smallest velocity outside
    the shaking is taken.

    ``trace.detrend("velocity_residual", dt=..., onset=..., end=...)`` calls it.

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
    Jones, Kalkan & Stephens 2017, U.S. Geological Survey Open-File Report 2017-1008: adaptive
    baseline correction, after whose idea this is made.
    """
    samples, time = _samples_and_times(data, dt)
    latest = LATEST_START * time[-1]
    if not 0 < onset < end <= latest:
        raise ValueError(
            f"onset and end must be times within the first 90 % of the record, got {onset:g} and {end:g} s"
        )
    velocity = cumulative_trapezoid(samples, dx=dt, initial=0)
    outside = (time < onset) | (time >= end)
    candidates = _residual_baselines(velocity, time, onset, np.linspace(end, latest, TRIAL_ENDS))
    best = min(candidates, key=lambda baseline: float(np.mean((velocity - baseline)[outside] ** 2)))
    return samples - np.gradient(best, dt)


def _residual_baselines(
    velocity: FloatArray, time: FloatArray, onset: float, ends: FloatArray
) -> Iterator[FloatArray]:
    before = time <= onset
    for end, early, late in product(ends, (1, 2), (1, 2, 3)):
        after = time >= end
        first = Polynomial.fit(time[before], velocity[before], early)
        last = Polynomial.fit(time[after], velocity[after], late)
        bridge = CubicHermiteSpline(
            [onset, end], [first(onset), last(end)], [first.deriv()(onset), last.deriv()(end)]
        )
        yield np.where(before, first(time), np.where(after, last(time), bridge(time)))


def displacement_polynomial(data: FloatArray, dt: float, order: int = 6) -> FloatArray:
    """
    Return acceleration without the second derivative of the polynomial that fits its displacement.

    The polynomial has no constant and no linear term: the ground starts at rest.

    ``trace.detrend("displacement_polynomial", dt=...)`` calls it.

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
    displacement = cumulative_trapezoid(
        cumulative_trapezoid(samples, dx=dt, initial=0), dx=dt, initial=0
    )
    duration = time[-1]
    powers = np.arange(2, order + 1)
    terms = (time[:, None] / duration) ** powers
    coefficients, *_ = np.linalg.lstsq(terms, displacement)
    curvature = powers * (powers - 1) * (time[:, None] / duration) ** (powers - 2) / duration**2
    return np.asarray(samples - curvature @ coefficients)


def _samples_and_times(data: FloatArray, dt: float) -> tuple[FloatArray, FloatArray]:
    samples = record("data", data)
    return samples, np.arange(float(samples.size)) * number("dt", dt, positive)


def _final_line(samples: FloatArray, time: FloatArray, start: float) -> tuple[float, float]:
    """Return the constant, m/s, and the slope, m/s2, of the line through the velocity from the start on."""
    velocity = cumulative_trapezoid(samples, time, initial=0)
    after = time >= start
    constant, slope = Polynomial.fit(time[after], velocity[after], 1).convert().coef
    return float(constant), float(slope)
