"""Pickers of the first P wave: three independent methods and their median."""

from statistics import median

import numpy as np
from obspy import Trace
from obspy.signal.trigger import pk_baer
from scipy.signal import butter, sosfilt

from per_obspy.checks import FloatArray
from per_obspy.processing.filter.polynomial import without_trend
from per_obspy.processing.long_records import blocks

TINY = np.finfo(float).tiny

#: Fewest samples, and shortest time in s, up to the peak of a record that can be picked.
FEWEST, SHORTEST = 20, 0.5

#: Windows before and after a pick whose root mean squares are compared, s.
CLEAR_WINDOW = 2.0

#: Variances of fewer samples at the ends of a record are not reliable.
EDGE = 10


def picked_onset(trace: Trace, clearest: float = 3.0) -> tuple[float, float] | None:
    """
    Pick the first wave of a record as the median of three pickers.

    Parameters
    ----------
    trace : obspy Trace
        Not padded; any unit.
    clearest : float
        Smallest ratio of the root mean squares 2 s after and before the pick, dimensionless.

    Returns
    -------
    (onset, spread) or None
        Seconds from the first sample, and between the earliest and the latest picker; None if no
        wave is clear.
    """
    dt = trace.stats.delta
    samples = _band_passed(trace.data, dt)
    until_peak = samples[: int(np.abs(samples).argmax()) + 1]
    if until_peak.size < max(SHORTEST / dt, FEWEST):
        return None
    # Median of the pickers that find a wave inside the record
    picks = [
        aic_onset(until_peak),
        energy_ratio_onset(until_peak, max(round(1.0 / dt), 2)),
        baer_onset(samples, dt),
    ]
    found = sorted(pick for pick in picks if pick is not None and 0 < pick < samples.size - 1)
    if not found:
        return None
    onset = int(median(found))
    # The wave must be larger than the samples before it
    if not _is_clear(samples, onset, round(CLEAR_WINDOW / dt), clearest):
        return None
    return onset * dt, (found[-1] - found[0]) * dt


def _is_clear(samples: FloatArray, onset: int, window: int, clearest: float) -> bool:
    """Return whether the root mean square after an onset exceeds that before it enough."""
    before = samples[max(onset - window, 0) : onset]
    after = samples[onset : onset + window]
    return not np.sqrt(np.mean(after**2)) < clearest * np.sqrt(np.mean(before**2))


def _band_passed(samples: FloatArray, dt: float) -> FloatArray:
    """Return the samples between 1 and 20 Hz, filtered causally so that no wave arrives early."""
    corners = [min(1.0, 0.1 / dt), min(20.0, 0.4 / dt)]
    sections = butter(2, corners, "bandpass", fs=1 / dt, output="sos")
    return np.asarray(sosfilt(sections, without_trend(samples, 1)))


def aic_onset(samples: FloatArray) -> int:
    r"""
    Return the sample that best divides a record into two stationary parts.

    .. math:: AIC(k) = k \log \sigma^2(x_1 \ldots x_k)
                       + (N - k - 1) \log \sigma^2(x_{k+1} \ldots x_N)

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
    sums, squares = np.cumsum(samples), np.cumsum(samples**2)
    # Smallest criterion of every block, with the number of samples before it; the first of equals
    edge = min(EDGE, (samples.size - 1) // 4)
    smallest = list[tuple[float, int]]()
    for block in blocks(edge, samples.size - 1 - edge):
        criterion = _aic(sums, squares, block)
        place = int(criterion.argmin())
        smallest.append((float(criterion[place]), block.start + place + 1))
    return min(smallest)[1]


def _aic(sums: FloatArray, squares: FloatArray, block: slice) -> FloatArray:
    """Return the criterion of `aic_onset` at a block of places, from running sums."""
    # Variances of both parts
    count = np.arange(block.start + 1, block.stop + 1)
    rest = sums.size - count
    left = squares[block] / count - (sums[block] / count) ** 2
    right = (squares[-1] - squares[block]) / rest - ((sums[-1] - sums[block]) / rest) ** 2
    # Variances are not below the rounding of the running sums
    floor = 1e-12 * max(squares[-1] / sums.size, TINY)
    first = count * np.log(np.maximum(left, floor))
    second = (rest - 1) * np.log(np.maximum(right, floor))
    return np.asarray(first + second)


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
        None if the record is shorter than two windows.

    References
    ----------
    Akram & Eaton 2016, Geophysics 81, KS71-KS91: energy ratio.
    """
    # Energies of windows as differences of the running energy
    energy = np.zeros(samples.size + 1)
    np.cumsum(samples**2, out=energy[1:])
    floor = 1e-12 * energy[-1]
    # Largest ratio of every block with its place, negative so that the first of equals is the least
    largest = []
    for block in blocks(window, samples.size - window):
        middle = energy[block]
        before = middle - energy[block.start - window : block.stop - window]
        after = energy[block.start + window : block.stop + window] - middle
        ratio = after / (before + floor + TINY)
        place = int(ratio.argmax())
        largest.append((-ratio[place], block.start + place))
    return min(largest, default=(0.0, None))[1]


def baer_onset(samples: FloatArray, dt: float) -> int | None:
    """
    Return the sample picked by the method of Baer & Kradolfer, or None.

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
    # The picker works in single precision
    scaled = (samples / np.abs(samples).max()).astype(np.float32)
    pick, _ = pk_baer(
        scaled, 1 / dt, round(0.2 * second), round(0.6 * second), 7.0, 12.0, second, second
    )
    return int(pick) or None
