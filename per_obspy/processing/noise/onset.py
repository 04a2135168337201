"""When the P wave arrives: three pickers that share no idea, their median, and the travel time of a known event."""

from statistics import median

import numpy as np
from obspy import Trace
from obspy.signal.trigger import pk_baer
from scipy.signal import butter, sosfilt

from per_obspy.checks import FloatArray

TINY = np.finfo(float).tiny
FEWEST = 20  # samples up to the peak


def picked_onset(trace: Trace, clearest: float = 3.0) -> tuple[float, float] | None:
    """
    Return when the first wave arrives, as the median of three pickers.

    Parameters
    ----------
    trace : obspy Trace
        Not padded; any unit.
    clearest : float
        Smallest ratio of the root mean squares 2 s after and before the pick, dimensionless.

    Returns
    -------
    (onset, spread) or None
        Seconds from the first sample, and between the earliest and the latest picker; None if
        nothing stands out.
    """
    dt = trace.stats.delta
    samples = _band_passed(trace.data, dt)
    until = samples[: int(np.abs(samples).argmax()) + 1]
    if until.size < max(0.5 / dt, FEWEST):
        return None
    picks = [
        aic_onset(until),
        energy_ratio_onset(until, max(round(1.0 / dt), 2)),
        baer_onset(samples, dt),
    ]
    found = sorted(pick for pick in picks if pick is not None and 0 < pick < samples.size - 1)
    if not found:
        return None
    onset = int(median(found))
    before = samples[max(onset - round(2.0 / dt), 0) : onset]
    after = samples[onset : onset + round(2.0 / dt)]
    if np.sqrt(np.mean(after**2)) < clearest * np.sqrt(np.mean(before**2)):
        return None
    return onset * dt, (found[-1] - found[0]) * dt


def _band_passed(samples: FloatArray, dt: float) -> FloatArray:
    """Return the samples between 1 and 20 Hz, filtered causally so that nothing arrives early."""
    sections = butter(
        2, [min(1.0, 0.1 / dt), min(20.0, 0.4 / dt)], "bandpass", fs=1 / dt, output="sos"
    )
    place = np.linspace(-1, 1, samples.size)
    return np.asarray(
        sosfilt(sections, samples - np.polynomial.Polynomial.fit(place, samples, 1)(place))
    )


def aic_onset(samples: FloatArray) -> int:
    r"""
    Return the sample that best divides a record into two stationary parts.

    .. math:: AIC(k) = k \log \sigma^2(x_1 \ldots x_k) + (N - k - 1) \log \sigma^2(x_{k+1} \ldots x_N)

    Parameters
    ----------
    samples : (n_samples,) ndarray
        Up to the peak.

    Returns
    -------
    int

    References
    ----------
    Maeda 1985, Zisin 38, 365-379.
    """
    count = np.arange(1, samples.size)
    sums, squares = np.cumsum(samples), np.cumsum(samples**2)
    left = squares[:-1] / count - (sums[:-1] / count) ** 2
    rest = samples.size - count
    right = (squares[-1] - squares[:-1]) / rest - ((sums[-1] - sums[:-1]) / rest) ** 2
    floor = 1e-12 * max(squares[-1] / samples.size, TINY)  # below the rounding of the running sums
    criterion = count * np.log(np.maximum(left, floor)) + (rest - 1) * np.log(
        np.maximum(right, floor)
    )
    edge = min(10, count.size // 4)  # variances of a few samples mean nothing
    return int(criterion[edge : count.size - edge].argmin()) + edge + 1


def energy_ratio_onset(samples: FloatArray, window: int) -> int | None:
    """
    Return the sample with the largest ratio of the energies in windows after and before it.

    Parameters
    ----------
    samples : (n_samples,) ndarray
        Up to the peak.
    window : int
        Samples in each window.

    Returns
    -------
    int or None
        None if the record does not hold two windows.

    References
    ----------
    Akram & Eaton 2016, Geophysics 81, KS71-KS91: energy ratio.
    """
    energy = np.concatenate(([0.0], np.cumsum(samples**2)))
    places = np.arange(window, samples.size - window)
    if not places.size:
        return None
    before = energy[places] - energy[places - window]
    after = energy[places + window] - energy[places]
    return int(places[(after / (before + 1e-12 * energy[-1] + TINY)).argmax()])


def baer_onset(samples: FloatArray, dt: float) -> int | None:
    """
    Return the sample that the picker of Baer & Kradolfer finds, or None.

    Parameters
    ----------
    samples : (n_samples,) ndarray
    dt : float
        Sampling interval, s.

    Returns
    -------
    int or None

    References
    ----------
    Baer & Kradolfer 1987, Bull. Seism. Soc. Am. 77, 1437-1445 (as in ObsPy).
    """
    second = round(1.0 / dt)
    if samples.size < 4 * second or not samples.any():
        return None
    scaled = (samples / np.abs(samples).max()).astype(np.float32)
    pick, _ = pk_baer(
        scaled, 1 / dt, round(0.2 * second), round(0.6 * second), 7.0, 12.0, second, second
    )
    return int(pick) or None
