"""
Functions of this room as plugins of ObsPy: ``trace.filter`` and ``trace.detrend``.

ObsPy passes the sampling rate to a filter, but only the samples to a detrend function. The sampling
interval is then that of the trace whose ``detrend`` method calls.
"""

import inspect
from types import FrameType

import numpy as np
from obspy import Trace

from per_obspy.checks import FloatArray, number, positive
from per_obspy.processing.filter import baseline
from per_obspy.processing.filter.butterworth import acausal_bandpass
from per_obspy.processing.noise_window import picked_onset
from per_obspy.processing.series import significant_samples


def acausal_butterworth(
    data: FloatArray,
    df: float,
    highpass: float | None = None,
    lowpass: float | None = None,
    order: int = 5,
    *,
    freqmin: float | None = None,
    freqmax: float | None = None,
) -> FloatArray:
    """
    Filter samples without phase by a Butterworth amplitude; pad them with zeros first.

    ``trace.filter("acausal_butterworth", freqmin=..., freqmax=...)`` calls it.

    Parameters
    ----------
    data : (n_samples,) array_like
        Any unit.
    df : float
        Sampling rate, Hz; ObsPy passes it.
    highpass, lowpass : float, optional
        Corners, Hz; without one of them the filter is a low-pass or a high-pass.
    order : int
        Order n of both factors.
    freqmin, freqmax : float, optional
        ObsPy's names of ``highpass`` and ``lowpass``.

    Returns
    -------
    (n_samples,) ndarray
        In the unit of the data.

    Raises
    ------
    ValueError
        If no corner is set, one is set twice, is not positive or is above the Nyquist
        frequency, or if the low-pass corner is not above the high-pass corner.
    """
    # Corners under either name
    low = _given_once("highpass", highpass, "freqmin", freqmin)
    high = _given_once("lowpass", lowpass, "freqmax", freqmax)
    if low is None and high is None:
        raise ValueError("give highpass or freqmin, lowpass or freqmax, or both; got neither")

    # Corners must rise and lie below the Nyquist frequency
    nyquist = number("df", df, positive) / 2.0
    for name, corner in (("highpass", low), ("lowpass", high)):
        if corner is not None and not number(name, corner, positive) <= nyquist:
            raise ValueError(
                f"{name} = {corner:g} Hz is above the Nyquist frequency {nyquist:g} Hz"
            )
    if low is not None and high is not None and low >= high:
        raise ValueError(f"highpass = {low:g} Hz must be below lowpass = {high:g} Hz")
    return acausal_bandpass(data, df, low or 0.0, np.inf if high is None else high, order)


def boore_segments(
    data: FloatArray,
    dt: float | None = None,
    first: float | None = None,
    second: float | None = None,
) -> FloatArray:
    """
    Remove two baseline shifts from acceleration, one during the shaking and one from then on.

    ``trace.detrend("boore_segments")`` calls it: see
    :func:`~per_obspy.processing.filter.baseline.boore_segments`.

    Parameters
    ----------
    data : (n_samples,) array_like
        Acceleration without the mean of its quiet beginning, m/s2.
    dt : float, optional
        Sampling interval, s; that of the calling trace if not given.
    first, second : float, optional
        Start of the shaking and of the final line, s from the first sample; the picked onset and
        the end of the significant shaking if not given.

    Returns
    -------
    (n_samples,) ndarray
        m/s2.

    Raises
    ------
    ValueError
        If no onset can be picked, or if the times are not within the record.
    """
    step = _sampling_interval(dt, inspect.currentframe())
    return baseline.boore_segments(data, step, *_shaking(data, step, first, second))


def velocity_residual(
    data: FloatArray,
    dt: float | None = None,
    onset: float | None = None,
    end: float | None = None,
) -> FloatArray:
    """
    Remove the slope of the residual velocity before and after the shaking from acceleration.

    ``trace.detrend("velocity_residual")`` calls it: see
    :func:`~per_obspy.processing.filter.baseline.velocity_residual`.

    Parameters
    ----------
    data : (n_samples,) array_like
        Acceleration without the mean of its quiet beginning, m/s2.
    dt : float, optional
        Sampling interval, s; that of the calling trace if not given.
    onset, end : float, optional
        Of the shaking, s from the first sample; the picked onset and the end of the significant
        shaking if not given.

    Returns
    -------
    (n_samples,) ndarray
        m/s2.

    Raises
    ------
    ValueError
        If no onset can be picked, or if the times are not within the first 90 % of the record.
    """
    step = _sampling_interval(dt, inspect.currentframe())
    return baseline.velocity_residual(data, step, *_shaking(data, step, onset, end))


def displacement_polynomial(
    data: FloatArray, dt: float | None = None, order: int = 6
) -> FloatArray:
    """
    Remove the second derivative of the polynomial that fits the displacement from acceleration.

    ``trace.detrend("displacement_polynomial")`` calls it: see
    :func:`~per_obspy.processing.filter.baseline.displacement_polynomial`.

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
    """
    step = _sampling_interval(dt, inspect.currentframe())
    return baseline.displacement_polynomial(data, step, order)


def _given_once(
    name: str, value: float | None, other_name: str, other: float | None
) -> float | None:
    """Return a value that has two names, of which only one may be used."""
    if value is not None and other is not None:
        raise ValueError(
            f"{name} = {value:g} Hz and {other_name} = {other:g} Hz are the same corner: give one"
        )
    return other if value is None else value


def _sampling_interval(dt: float | None, frame: FrameType | None) -> float:
    """Return the given interval, else that of the trace whose ``detrend`` called a plugin, s."""
    if dt is not None:
        return dt
    # ObsPy keeps the trace to itself: it is the ``self`` of the frame that called the plugin
    caller = frame.f_back if frame is not None else None
    trace = caller.f_locals.get("self") if caller is not None else None
    if not isinstance(trace, Trace):
        raise ValueError("dt is required where no trace is detrended: give the interval in s")
    return float(trace.stats.delta)


def _shaking(
    data: FloatArray, dt: float, onset: float | None, end: float | None
) -> tuple[float, float]:
    """Return onset and end of the shaking, s: picked, and of the significant motion, if None."""
    if onset is not None and end is not None:
        return onset, end
    # What is not given is picked
    picked = picked_onset(Trace(np.asarray(data, dtype=np.float64), {"delta": dt}))
    if picked is None:
        raise ValueError("no onset of the shaking can be picked: give the times of the shaking")
    first = picked[0]
    last = first + significant_samples(data[round(first / dt) :]) * dt
    return first if onset is None else onset, last if end is None else end
