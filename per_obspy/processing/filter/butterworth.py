"""
Taper, zero padding and the acausal Butterworth filter.

The pads stay: the filtered motion leaks into them.
"""

from functools import reduce

import numpy as np
from numpy.typing import NDArray
from obspy import Trace
from scipy.fft import irfft, next_fast_len, rfft, rfftfreq

from per_obspy.checks import FloatArray, finite, number, positive
from per_obspy.processing.account import with_note
from per_obspy.processing.series import blocks, forget_plans, is_long

#: Length of each pad in periods of the corner per order of the filter (Boore 2005).
PAD = 0.75


def taper(trace: Trace, fraction: float) -> Trace:
    """
    Return a copy with ends that rise from and fall to zero as half a Hann window each.

    The fraction of the record at each end is at most 0.5; with 0 the trace stays as it is.
    """
    if not fraction:
        return trace
    from scipy.signal.windows import hann  # in workers only, see instrument_response

    # The ends alone: a window of the whole record takes the memory of two more
    samples = trace.data.copy()
    count = min(int(fraction * samples.size), samples.size // 2)
    window = hann(2 * count + (2 * count < samples.size))
    samples[:count] *= window[:count]
    samples[samples.size - count :] *= window[window.size - count :]
    return with_note(trace, f"{fraction:g} of each end tapered", samples, taper=fraction)


def pad(trace: Trace, highpass: float, order: int) -> Trace:
    """
    Return a copy with zeros before and after, for the filter of a corner, Hz, and an order.

    They last 1.5 order / highpass seconds in total, half on each side, and hold the transients of
    the acausal filter. They are kept: velocity and displacement integrated from the filtered record
    return to rest in them, and oscillators start from rest only before them. ``starttime`` moves to
    the first zero. The end gets the few samples more that make the length quick to transform.

    References
    ----------
    Boore 2005, Bull. Seism. Soc. Am. 95, 745-750.
    """
    number("highpass", highpass, positive)
    dt, count = trace.stats.delta, trace.stats.npts
    # The end gets the samples up to the next length that is quick to transform
    before = int(np.ceil(PAD * order / highpass / dt))
    after = next_fast_len(count + 2 * before, real=True) - count - before
    # Seconds of zeros
    pads = {"pad_before": before * dt, "pad_after": after * dt}
    step = f"{pads['pad_before']:g} s of zeros before and {pads['pad_after']:g} s after"
    out = with_note(trace, step, np.pad(trace.data, (before, after)), **pads)
    out.stats.starttime -= before * dt
    return out


def thin_spectrum(
    signals: FloatArray, dt: float, highpass: float, order: int, thin: int
) -> tuple[FloatArray, NDArray[np.complex128], int, int]:
    """
    Return the low frequencies of signals with zero pads: those of a grid with fewer points.

    A long record is transformed as the sum of its interleaved parts, each turned by its delay: at
    the low frequencies alone that takes a tenth of the memory. Corner and order of the filter to
    come decide the length of the pads (a corner of 0 needs none); ``thin`` samples of the signals,
    (..., n_samples), make one point of the grid.

    Returns
    -------
    frequencies : (n_frequencies,) ndarray
        Hz.
    spectrum : (..., n_frequencies) ndarray
        To be divided by the factor of thinning: its inverse transform has fewer points.
    points, pad : int
        Number of points of the grid, and of those in the pad before the record.
    """
    # Pads and signals on a grid that is thinner by a whole number
    samples = signals.shape[-1]
    pad = int(np.ceil(PAD * order / highpass / dt / thin)) if highpass else 0
    points = next_fast_len(int(np.ceil(samples / thin)) + 2 * pad, real=True)
    padded = np.zeros((*signals.shape[:-1], points * thin))
    padded[..., pad * thin : pad * thin + samples] = signals
    # The low frequencies alone: a view would hold all of them
    frequencies = rfftfreq(points * thin, dt)[: points // 2 + 1].copy()
    spectrum = _low_frequencies(padded, frequencies.size, thin if is_long(samples) else 1)
    return frequencies, spectrum, points, pad


def _low_frequencies(signals: FloatArray, count: int, parts: int) -> NDArray[np.complex128]:
    """Return the first lines of spectra, as the sum of interleaved parts turned by their delays."""
    # One part of ordinary records
    spectrum: NDArray[np.complex128] = rfft(signals[..., ::parts])[..., :count]
    for first in range(1, parts):
        turn = np.exp(-2j * np.pi * first / signals.shape[-1] * np.arange(count))
        spectrum = spectrum + rfft(signals[..., first::parts])[..., :count] * turn
    return spectrum


def butterworth_amplitude(
    frequencies: FloatArray, highpass: float, lowpass: float, order: int
) -> FloatArray:
    r"""
    Compute the amplitude of a Butterworth band-pass without phase.

    .. math:: |H(f)| = [1 + (f_{hp}/f)^{2n}]^{-1/2} \, [1 + (f/f_{lp})^{2n}]^{-1/2}

    Parameters
    ----------
    frequencies : (n_frequencies,) ndarray
        At least 0, Hz.
    highpass, lowpass : float
        Corners, at which each factor is 1/sqrt(2), Hz; 0 and infinity leave the factor out.
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
    # Both terms of the equation; a high-pass has amplitude 0 at frequency 0
    at_zero = np.inf if highpass else 0.0
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        low = np.where(frequencies > 0, _power(highpass / frequencies, 2 * order), at_zero)
        high = _power(frequencies / lowpass, 2 * order)
    return np.asarray(1 / np.sqrt((1 + low) * (1 + high)))


def _power(values: FloatArray, exponent: int) -> FloatArray:
    """Return values to an even power by products, 10 times faster than ``**`` by logarithms."""
    return reduce(np.multiply, [np.square(values)] * (exponent // 2))


def acausal_bandpass(
    samples: FloatArray, df: float, highpass: float, lowpass: float, order: int = 5
) -> FloatArray:
    """
    Filter samples at a rate, Hz, without phase in the frequency domain, circularly: pad them first.

    Corners and order are those of `butterworth_amplitude`.
    """
    return _filtered(rfft(samples), samples.size, df, (highpass, lowpass), order)


def _filtered(
    spectrum: NDArray[np.complex128],
    count: int,
    df: float,
    corners: tuple[float, float],
    order: int,
) -> FloatArray:
    """Return the filtered samples of a spectrum, which is overwritten."""
    frequencies = rfftfreq(count, 1 / df)
    # Block by block: powers of all frequencies of a day take more memory than the record
    for block in blocks(0, frequencies.size):
        spectrum[block] *= butterworth_amplitude(frequencies[block], *corners, order)
    out = irfft(spectrum, count, overwrite_x=True)
    forget_plans(count)
    return np.asarray(out)


def bandpass(trace: Trace, highpass: float, lowpass: float, order: int) -> Trace:
    """Return a copy of a padded trace filtered by `acausal_bandpass`."""
    spectrum, count, rate = rfft(trace.data), trace.stats.npts, trace.stats.sampling_rate
    # Corners as applied: a high-pass at 0 is none
    applied = {"highpass": highpass, "lowpass": lowpass} if highpass else {"lowpass": lowpass}
    step = f"acausal Butterworth, order {order}, {highpass:g}-{lowpass:g} Hz"
    out = with_note(trace, step, np.empty(0), order=order, **applied)
    # The unfiltered samples of a day leave memory, if no other code holds them
    del trace
    out.data = _filtered(spectrum, count, rate, (highpass, lowpass), order)
    return out


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
    nyquist = number("df", df, positive) / 2.0
    low = _corner(nyquist, highpass=highpass, freqmin=freqmin)
    high = _corner(nyquist, lowpass=lowpass, freqmax=freqmax)
    # At least one of them, and rising
    if low is None and high is None:
        raise ValueError("give highpass or freqmin, lowpass or freqmax, or both; got neither")
    if low is not None and high is not None and low >= high:
        raise ValueError(f"highpass = {low:g} Hz must be below lowpass = {high:g} Hz")
    samples = finite("data", data)
    return acausal_bandpass(samples, df, low or 0.0, np.inf if high is None else high, order)


def _corner(nyquist: float, **names: float | None) -> float | None:
    """Return a corner that has two names, of which only one may be used, up to the Nyquist, Hz."""
    given = {name: value for name, value in names.items() if value is not None}
    if len(given) > 1:
        both = " and ".join(f"{name} = {value:g} Hz" for name, value in given.items())
        raise ValueError(f"{both} are the same corner: give one")
    # Under the name that is not ObsPy's
    name, value = next(iter(names)), next(iter(given.values()), None)
    if value is not None and not number(name, value, positive) <= nyquist:
        raise ValueError(f"{name} = {value:g} Hz is above the Nyquist frequency {nyquist:g} Hz")
    return value
