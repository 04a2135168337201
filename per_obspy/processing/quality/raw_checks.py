"""Checks of raw samples: what a sensor or a recorder did that the ground did not."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from obspy import Stream, Trace
from scipy.ndimage import maximum_filter1d, uniform_filter1d
from scipy.signal import detrend

from per_obspy.checks import FloatArray
from per_obspy.config import Checks
from per_obspy.processing.noise.signal_to_noise import SIGNIFICANT
from per_obspy.processing.quality.findings import Finding, above, below

FEWEST = 50  # samples of which anything can be said
FULL_SCALE = 2**23  # of a 24-bit counter
NEIGHBOURS = 2  # samples on each side that belong to a spike
VICINITY = 0.5  # s
SMALLEST_SPIKE = 0.05  # of the peak
QUIET, ENVELOPE = 0.05, 5.0  # of the peak; s
MOVING = 0.2  # of the largest root mean square


def raw_findings(trace: Trace, checks: Checks) -> Iterator[Finding]:
    """
    Give every failed check of one raw trace.

    Parameters
    ----------
    trace : obspy Trace
        Counts or m/s2, not yet changed by any step.
    checks : Checks
        Thresholds and levels.

    Yields
    ------
    Finding
    """
    different = np.unique(trace.data).size
    yield from below(
        "sampling_rate", checks.sampling_rate, trace.stats.sampling_rate, "sampling rate, Hz:"
    )
    yield from below(
        "duration", checks.duration, trace.stats.npts * trace.stats.delta, "duration, s:"
    )
    yield from below("levels", checks.levels, different, "different values (dead channel):")
    if different < 3 or trace.stats.npts < FEWEST:
        yield Finding(
            "levels",
            "reject",
            f"{different} different values in {trace.stats.npts} samples are no record",
        )
    else:
        yield from _recorder_findings(trace, checks)
        yield from _shaking_findings(detrend(trace.data), trace.stats.delta, checks)
        yield from header_findings(trace, checks)


def _recorder_findings(trace: Trace, checks: Checks) -> Iterator[Finding]:
    run = longest_extreme_run(trace.data)
    if run >= checks.clipped_run.threshold:
        yield Finding(
            "clipped_run", checks.clipped_run.level, f"clipped: {run} equal samples at an extreme"
        )
    if trace.stats.get("units", "counts") == "counts":
        use = float(np.abs(trace.data).max()) / FULL_SCALE
        yield from above(
            "counter_use", checks.counter_use, use, "peak over the full scale of a 24-bit counter:"
        )
    still = longest_standstill(trace.data, trace.stats.delta)
    yield from above("dropout", checks.dropout, still, "dropout, s without change:")
    spike = largest_spike(detrend(trace.data), trace.stats.delta)
    yield from above("spike", checks.spike, spike, "spike or step, over its vicinity:")


def _shaking_findings(samples: FloatArray, dt: float, checks: Checks) -> Iterator[Finding]:
    rate = np.count_nonzero(np.diff(np.signbit(samples))) / (samples.size * dt)
    yield from below("zero_crossings", checks.zero_crossings, rate, "zero crossings a second:")
    second, peak = max(round(1 / dt), 1), np.abs(samples).max()
    first, last = (
        float(np.sqrt(np.mean(part**2)) / peak) for part in (samples[:second], samples[-second:])
    )
    yield from above(
        "late_trigger", checks.late_trigger, first, "late trigger: first second over the peak:"
    )
    yield from above(
        "cut_off", checks.cut_off, last, "ends while shaking: last second over the peak:"
    )
    yield from above(
        "second_event",
        checks.second_event,
        later_event(samples, dt),
        "another event, over the peak:",
    )


def header_findings(trace: Trace, checks: Checks) -> list[Finding]:
    """
    Return a finding if the largest sample, with or without the mean, is not the peak that the header tells.

    Parameters
    ----------
    trace : obspy Trace
        With ``header_peak``, in the unit of the samples, where the header has one.
    checks : Checks
        Thresholds and levels.

    Returns
    -------
    list of Finding
    """
    told = trace.stats.get("header_peak")
    if not told:
        return []
    peaks = np.abs(trace.data).max(), np.abs(trace.data - trace.data.mean()).max()
    error = min(abs(float(peak) / told - 1) for peak in peaks)
    return above(
        "header_peak",
        checks.header_peak,
        error,
        f"largest sample off the header's {told:g} by a share of",
    )


def runs(same: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return where the runs of true values begin and where the first value after each is."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], same, [False]))))
    return edges[::2], edges[1::2]


def longest_extreme_run(samples: FloatArray) -> int:
    """
    Return the longest run of equal samples at the largest or the smallest value: a signal pinned at the rails.

    Coarse recorders stand still at every turn of the motion: a run that is not twice the longest
    one between the extremes counts as 1.

    Parameters
    ----------
    samples : (n_samples,) ndarray
        Raw: a trend hides the rails.

    Returns
    -------
    int

    Examples
    --------
    >>> longest_extreme_run(np.array([0.0, 3.0, 3.0, 3.0, -1.0, -2.0]))
    3
    """
    close = 1e-6 * np.ptp(samples)
    low, high = samples <= samples.min() + close, samples >= samples.max() - close
    pinned = max(int(np.subtract(*runs(at)[::-1]).max()) for at in (low, high))
    between = np.concatenate(
        ([False], (np.diff(samples) == 0) & ~(low | high)[1:] & _shaking(samples)[1:])
    )
    starts, stops = runs(between)
    longest = int((stops - starts).max()) + 1 if starts.size else 1
    return pinned if pinned >= 2 * longest else 1


def _shaking(samples: FloatArray) -> NDArray[np.bool_]:
    """Tell which samples lie between 5 and 95 % of the squared motion."""
    energy = np.cumsum((samples - samples.mean()) ** 2)
    return np.asarray(
        (energy >= (1 - SIGNIFICANT) * energy[-1]) & (energy <= SIGNIFICANT * energy[-1])
    )


def longest_standstill(samples: FloatArray, dt: float) -> float:
    """
    Return how long a record stands still while the ground moves, s.

    The ground moves where, at both ends of the standstill, the root mean square over 2 s exceeds a
    fifth of its largest value: coarse recorders may stand still before and after.

    Parameters
    ----------
    samples : (n_samples,) ndarray
        Raw.
    dt : float
        Sampling interval, s.

    Returns
    -------
    float
    """
    squares = (samples - samples.mean()) ** 2
    envelope = np.sqrt(np.maximum(uniform_filter1d(squares, max(round(2.0 / dt), 1)), 0))
    starts, stops = runs(np.diff(samples) == 0)
    moving = np.minimum(envelope[starts], envelope[stops]) > MOVING * envelope.max()
    return float((stops - starts)[moving].max() * dt) if moving.any() else 0.0


def largest_spike(samples: FloatArray, dt: float) -> float:
    """
    Return by how much a single sample stands out, over the largest such jump within half a second around it.

    The jump of a sample is its distance from the mean of its two neighbours. Jumps below 5 % of the
    record's peak do not count.

    Parameters
    ----------
    samples : (n_samples,) ndarray
    dt : float
        Sampling interval, s.

    Returns
    -------
    float
        Dimensionless; near 1 for ground motion.
    """
    jumps = np.zeros(samples.size)
    jumps[1:-1] = np.abs(samples[1:-1] - 0.5 * (samples[:-2] + samples[2:]))
    width = max(round(VICINITY / dt), NEIGHBOURS + 2)
    side = maximum_filter1d(jumps, width, mode="constant", origin=0)
    shift = NEIGHBOURS + 1 + width // 2
    around = np.maximum(np.roll(side, shift), np.roll(side, -shift))
    large = jumps > SMALLEST_SPIKE * np.abs(samples).max()
    floor = 1e-9 * np.abs(samples).max()
    return float((jumps[large] / np.maximum(around[large], floor)).max()) if large.any() else 0.0


def later_event(samples: FloatArray, dt: float) -> float:
    """
    Return the peak of what comes after the record has become quiet, or before it was, over the peak.

    Quiet is a running root mean square over 5 s below 5 % of its largest value.

    Parameters
    ----------
    samples : (n_samples,) ndarray
        Without trend.
    dt : float
        Sampling interval, s.

    Returns
    -------
    float
        Of the running root mean square, dimensionless.
    """
    envelope = np.sqrt(
        np.maximum(uniform_filter1d(samples**2, max(round(ENVELOPE / dt), 1), mode="constant"), 0)
    )
    main, largest = int(envelope.argmax()), float(envelope.max())
    quiet = np.flatnonzero(envelope < QUIET * largest)
    after, before = quiet[quiet > main], quiet[quiet < main]
    later = envelope[after[0] :].max() if after.size else 0.0
    earlier = envelope[: before[-1] + 1].max() if before.size else 0.0
    return float(max(later, earlier) / largest)


def outlier_findings(stream: Stream, checks: Checks) -> dict[str, list[Finding]]:
    """
    Return, by trace, the components of one instrument whose peak is several times that of both their sisters.

    Parameters
    ----------
    stream : obspy Stream
        Components of one instrument, m/s2.
    checks : Checks
        Thresholds and levels.

    Returns
    -------
    dict
        Trace identifier to findings; with fewer than three components nobody can tell which is
        wrong.
    """
    peaks = {trace.id: float(np.abs(trace.data - trace.data.mean()).max()) for trace in stream}
    if len(peaks) < 3:
        return {}
    largest, second = sorted(peaks, key=peaks.__getitem__, reverse=True)[:2]
    ratio = peaks[largest] / peaks[second] if peaks[second] else np.inf
    return {largest: above("outlier", checks.outlier, ratio, f"peak over that of {second}:")}
