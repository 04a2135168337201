"""Taper, zero padding and the acausal Butterworth filter; the pads stay, for the filtered motion leaks into them."""

from functools import reduce

import numpy as np
from obspy import Stream
from scipy.fft import irfft, next_fast_len, rfft, rfftfreq

from per_obspy.checks import FloatArray, finite, number, positive
from per_obspy.processing.notes import noted


def tapered(stream: Stream, fraction: float = 0.05) -> Stream:
    """
    Return a copy whose ends rise from and fall to zero as half a Hann window each.

    Parameters
    ----------
    stream : obspy Stream
    fraction : float
        Of the record at each end, dimensionless, at most 0.5.

    Returns
    -------
    obspy Stream
    """
    out = stream.copy()
    if fraction:
        for trace in out:
            trace.taper(fraction, type="hann")
            noted(trace, f"{fraction:g} of each end tapered", taper=fraction)
    return out


def padded(stream: Stream, highpass: float, order: int = 5) -> Stream:
    """
    Return a copy with zeros before and after, 1.5 order / highpass seconds in total, half on each side.

    The pads hold the transients of the acausal filter. They are kept: velocity and displacement
    integrated from the filtered record return to rest in them, and oscillators start from rest only
    before them. ``starttime`` moves to the first zero. The end gets the few samples more that make
    the length quick to transform.

    Parameters
    ----------
    stream : obspy Stream
    highpass : float
        Corner of the filter to come, Hz.
    order : int
        Order n of the filter to come.

    Returns
    -------
    obspy Stream

    References
    ----------
    Boore 2005, Bull. Seism. Soc. Am. 95, 745-750.
    """
    number("highpass", highpass, positive)
    out = stream.copy()
    for trace in out:
        dt, count = trace.stats.delta, trace.stats.npts
        side = int(np.ceil(0.75 * order / highpass / dt))
        length = next_fast_len(count + 2 * side, real=True)
        trace.data = np.pad(trace.data, (side, length - count - side))
        trace.stats.starttime -= side * dt
        after = (length - count - side) * dt
        noted(
            trace,
            f"{side * dt:g} s of zeros before and {after:g} s after",
            pad_before=side * dt,
            pad_after=after,
        )
    return out


def butterworth_amplitude(
    frequencies: FloatArray, highpass: float, lowpass: float, order: int
) -> FloatArray:
    r"""
    Return the amplitude of a Butterworth band-pass without phase.

    .. math:: |H(f)| = [1 + (f_{hp}/f)^{2n}]^{-1/2} \, [1 + (f/f_{lp})^{2n}]^{-1/2}

    Parameters
    ----------
    frequencies : (n_frequencies,) ndarray
        At least 0, Hz.
    highpass, lowpass : float
        Corners, where each factor is 1/sqrt(2), Hz; 0 and infinity leave the factor out.
    order : int
        n, dimensionless.

    Returns
    -------
    (n_frequencies,) ndarray
        Dimensionless; 0 at frequency 0 if there is a high-pass.

    References
    ----------
    Boore 2005, Bull. Seism. Soc. Am. 95, 745-750, with the amplitude applied once.

    Examples
    --------
    >>> butterworth_amplitude(np.array([0.0, 0.1, 1.0, 30.0]), 0.1, 30.0, 5).round(4)
    array([0.    , 0.7071, 1.    , 0.7071])
    """
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        low = np.where(
            frequencies > 0, _power(highpass / frequencies, 2 * order), np.inf if highpass else 0.0
        )
        high = _power(frequencies / lowpass, 2 * order)
    return np.asarray(1 / np.sqrt((1 + low) * (1 + high)))


def _power(values: FloatArray, exponent: int) -> FloatArray:
    """Return values to an even power by products: 10 times faster than ``**``, which takes logarithms."""
    return reduce(np.multiply, [np.square(values)] * (exponent // 2))


def acausal_bandpass(
    data: FloatArray, df: float, highpass: float, lowpass: float, order: int = 5
) -> FloatArray:
    """
    Return samples filtered without phase, in the frequency domain, circularly: pad them first.

    ``trace.filter("acausal_butterworth", highpass=..., lowpass=...)`` calls it.

    Parameters
    ----------
    data : (n_samples,) array_like
        Any unit.
    df : float
        Sampling rate, Hz (ObsPy's name for it).
    highpass, lowpass, order
        As in `butterworth_amplitude`.

    Returns
    -------
    (n_samples,) ndarray
        In the unit of the data.
    """
    samples = finite("data", data)
    amplitude = butterworth_amplitude(rfftfreq(samples.size, 1 / df), highpass, lowpass, order)
    return np.asarray(irfft(rfft(samples) * amplitude, samples.size))


def filtered(stream: Stream, highpass: float, lowpass: float, order: int = 5) -> Stream:
    """
    Return a copy filtered by `acausal_bandpass`; for the padded record.

    Parameters
    ----------
    stream : obspy Stream
    highpass, lowpass, order
        As in `butterworth_amplitude`.

    Returns
    -------
    obspy Stream
    """
    out = stream.copy()
    for trace in out:
        trace.data = acausal_bandpass(
            trace.data, trace.stats.sampling_rate, highpass, lowpass, order
        )
        applied = {"highpass": highpass, "lowpass": lowpass} if highpass else {"lowpass": lowpass}
        noted(
            trace,
            f"acausal Butterworth, order {order}, {highpass:g}-{lowpass:g} Hz",
            order=order,
            **applied,
        )
    return out
