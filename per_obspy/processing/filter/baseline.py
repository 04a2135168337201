"""
Baselines: means and trends, and those that shift during the shaking.

The latter are found in velocity or displacement. Three functions are plugins of ``trace.detrend``
too: ObsPy passes them the samples only, so that their sampling interval is that of the trace whose
``detrend`` method calls.
"""

import inspect
from collections.abc import Callable, Iterator
from itertools import product
from types import FrameType

import numpy as np
from numpy.polynomial import Polynomial
from obspy import Trace
from scipy.interpolate import CubicHermiteSpline

from per_obspy.checks import FloatArray, number, positive, record
from per_obspy.processing.account import with_note
from per_obspy.processing.noise_window import picked_onset
from per_obspy.processing.series import integral, significant_samples

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
    Return a copy without the mean of its first seconds, or of the whole record where these are 0.

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


def without_baseline(trace: Trace, remove: Callable[..., FloatArray], **options: float) -> Trace:
    """Return a copy without the baseline that one of the functions below removes."""
    numbers = ", ".join(f"{name} {value:g}" for name, value in options.items())
    samples = remove(trace.data, trace.stats.delta, **options)
    return with_note(trace, f"baseline by {remove.__name__} removed ({numbers})", samples)


def boore_segments(
    data: FloatArray,
    dt: float | None = None,
    first: float | None = None,
    second: float | None = None,
) -> FloatArray:
    r"""
    Remove two baseline shifts from acceleration, one during the shaking and one from then on.

    ``trace.detrend("boore_segments")`` calls it. A line is fitted to the velocity after the
    shaking; its slope is the shift there, and the shift during the shaking is the part that brings
    the velocity from zero onto that line:

    .. math:: v_f(t) = v_0 + a_f t, \quad t \ge t_2, \qquad a_m = v_f(t_2) / (t_2 - t_1)

    Parameters
    ----------
    data : (n_samples,) array_like
        Acceleration without the mean of its quiet beginning, m/s2.
    dt : float, optional
        Sampling interval, s; that of the calling trace if not given.
    first, second : float, optional
        t1 and t2, s from the first sample; the picked onset and the end of the significant shaking
        if not given. See `crossing_time` for another choice of t2.

    Returns
    -------
    (n_samples,) ndarray
        m/s2.

    Raises
    ------
    ValueError
        If no onset can be picked, or unless 0 <= first < second and ten samples follow the second.

    References
    ----------
    Boore 2001, Bull. Seism. Soc. Am. 91, 1199-1211, eq. (1)-(3).
    """
    samples, dt, time = _record(data, dt, inspect.currentframe())
    first, second = _shaking(samples, dt, first, second)
    if not 0 <= first < second <= time[-1] - FEWEST_AFTER * dt:
        raise ValueError(
            f"first and second must be times within the record, got {first:g} and {second:g} s"
        )
    # Shifts after t2 and between t1 and t2: a_f and a_m
    constant, slope = final_line(samples, time, second)
    during = (constant + slope * second) / (second - first)
    shift = np.where(time >= second, slope, np.where(time >= first, during, 0.0))
    return samples - shift


def crossing_time(samples: FloatArray, dt: float, first: float, second: float) -> float:
    """
    Return the t2 at which the line through the final velocity crosses zero, s.

    It must lie between the two times, else the second is returned. With it the shift during the
    shaking vanishes: the baseline has a single step.

    References
    ----------
    Boore 2001, Bull. Seism. Soc. Am. 91, 1199-1211: "v0 correction".
    """
    constant, slope = final_line(samples, sample_times(samples, dt), second)
    crossing = -constant / slope if slope else np.inf
    return float(crossing) if first < crossing < second else second


def velocity_residual(
    data: FloatArray,
    dt: float | None = None,
    onset: float | None = None,
    end: float | None = None,
) -> FloatArray:
    """
    Remove the slope of the residual velocity before and after the shaking from acceleration.

    ``trace.detrend("velocity_residual")`` calls it. Before the onset the velocity is fitted by a
    line or a parabola, after the shaking by a polynomial up to third order; a cubic that meets both
    with their slopes bridges the shaking. Ends of the shaking are tried in steps, and the
    combination with the smallest velocity outside the shaking is used.

    Parameters
    ----------
    data : (n_samples,) array_like
        Acceleration without the mean of its quiet beginning, m/s2.
    dt : float, optional
        Sampling interval, s; that of the calling trace if not given.
    onset, end : float, optional
        Of the shaking, s from the first sample; the end is the earliest that is tried. The picked
        onset and the end of the significant shaking if not given.

    Returns
    -------
    (n_samples,) ndarray
        m/s2.

    Raises
    ------
    ValueError
        If no onset can be picked, or unless 0 < onset < end and a tenth of the record follows the
        end.

    References
    ----------
    Jones, Kalkan & Stephens 2017, U.S. Geological Survey Open-File Report 2017-1008: the idea of
    the adaptive baseline correction.
    """
    samples, dt, time = _record(data, dt, inspect.currentframe())
    onset, end = _shaking(samples, dt, onset, end)
    latest = LATEST_START * time[-1]
    if not 0 < onset < end <= latest:
        raise ValueError(
            "onset and end must be times within the first 90 % of the record, "
            f"got {onset:g} and {end:g} s"
        )
    velocity = integral(samples, dt)
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


def displacement_polynomial(
    data: FloatArray, dt: float | None = None, order: int = 6
) -> FloatArray:
    """
    Remove the second derivative of the polynomial that fits the displacement from acceleration.

    ``trace.detrend("displacement_polynomial")`` calls it. The polynomial has no constant and no
    linear term: the ground starts at rest.

    Parameters
    ----------
    data : (n_samples,) array_like
        Acceleration, m/s2.
    dt : float, optional
        Sampling interval, s; that of the calling trace if not given.
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
    samples, dt, time = _record(data, dt, inspect.currentframe())
    if order < 2:
        raise ValueError(f"order must be at least 2, got {order}")
    velocity = integral(samples, dt)
    displacement = integral(velocity, dt)
    # Least squares in powers of time over the duration
    duration = time[-1]
    powers = np.arange(2, order + 1)
    terms = (time[:, None] / duration) ** powers
    coefficients, *_ = np.linalg.lstsq(terms, displacement)
    # Second derivative of each power
    curvature = powers * (powers - 1) * (time[:, None] / duration) ** (powers - 2) / duration**2
    return np.asarray(samples - curvature @ coefficients)


def _record(
    data: FloatArray, dt: float | None, frame: FrameType | None
) -> tuple[FloatArray, float, FloatArray]:
    """Return checked samples, their interval and times, s; without one that of ``detrend``."""
    samples = record("data", data)
    if dt is None:
        # ObsPy keeps the trace to itself: it is the ``self`` of the frame that called the plugin
        caller = frame.f_back if frame is not None else None
        trace = caller.f_locals.get("self") if caller is not None else None
        if not isinstance(trace, Trace):
            raise ValueError("dt is required where no trace is detrended: give the interval in s")
        dt = trace.stats.delta
    dt = number("dt", dt, positive)
    return samples, dt, sample_times(samples, dt)


def _shaking(
    samples: FloatArray, dt: float, onset: float | None, end: float | None
) -> tuple[float, float]:
    """Return onset and end of the shaking, s: picked, and of the significant motion, if None."""
    if onset is not None and end is not None:
        return onset, end
    picked = picked_onset(Trace(samples, {"delta": dt}))
    if picked is None:
        raise ValueError("no onset of the shaking can be picked: give the times of the shaking")
    # What is given is not replaced
    first = picked[0]
    last = first + significant_samples(samples[round(first / dt) :]) * dt
    return first if onset is None else onset, last if end is None else end


def sample_times(samples: FloatArray, dt: float) -> FloatArray:
    """Return the times of samples from the first one on, s."""
    return np.arange(float(samples.size)) * dt


def final_line(samples: FloatArray, time: FloatArray, start: float) -> tuple[float, float]:
    """
    Return constant and slope, m/s and m/s2, of the line through the velocity from a time on.

    The samples are acceleration, m/s2; at least two follow the start.
    """
    after = slice(int(np.searchsorted(time, start)), None)
    velocity = integral(samples, time[1] - time[0])[after]
    # Least squares about the means, which are as accurate as orthogonal polynomials
    middle, mean = time[after].mean(), velocity.mean()
    times = time[after] - middle
    slope = times @ (velocity - mean) / (times @ times)
    return float(mean - slope * middle), float(slope)


def residual_velocity(samples: FloatArray, time: FloatArray, end: float) -> float:
    """
    Return the size of the residual velocity at the end of the shaking, m/s.

    It is that of the line through the velocity from then on. The ground has come to rest by then,
    so that this is the integral of the baseline's shifts during the shaking.

    Examples
    --------
    >>> shifted = np.zeros(1000)
    >>> shifted[200:300] = 0.05  # m/s2 for 1 s
    >>> round(residual_velocity(shifted, sample_times(shifted, 0.01), 5.0), 12)
    0.05
    """
    constant, slope = final_line(samples, time, end)
    return abs(constant + slope * end)
