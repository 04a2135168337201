"""Checks of raw samples for faults of sensor and recorder, and for other events in the record."""

from collections.abc import Iterator
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from obspy import Stream, Trace
from scipy.ndimage import maximum_filter1d, uniform_filter1d

from per_obspy.checks import FloatArray
from per_obspy.config import Checks
from per_obspy.processing.filter.polynomial import without_trend
from per_obspy.processing.long_records import blocks, by_blocks
from per_obspy.processing.noise.signal_to_noise import SIGNIFICANT
from per_obspy.processing.quality.findings import Finding, above, below

#: Fewest samples and fewest different values of a record.
FEWEST, FEWEST_LEVELS = 50, 3

#: Counts at full scale of a 24-bit counter.
FULL_SCALE = 2**23

#: A spike: samples on each side that belong to it, time around it, s, and least share of the peak.
NEIGHBOURS, VICINITY, SMALLEST_SPIKE = 2, 0.5, 0.05

#: Quiet between two events: share of the peak of the running root mean square over a time, s.
QUIET, ENVELOPE = 0.05, 5.0

#: Moving ground: share of the peak of the running root mean square over a time, s.
MOVING, STANDSTILL_ENVELOPE = 0.2, 2.0

#: Samples nearer to an extreme than this share of the range are at it.
AT_EXTREME = 1e-6

#: A spike is compared with no less than this share of the peak.
SPIKE_FLOOR = 1e-9


def raw_findings(trace: Trace, checks: Checks) -> Iterator[Finding]:
    """
    Yield every failed check of one raw trace.

    Parameters
    ----------
    trace : obspy Trace
        Counts or m/s2, before any step.
    checks : Checks
        Thresholds and levels.

    Yields
    ------
    Finding
    """
    levels, rate, count = np.unique(trace.data).size, trace.stats.sampling_rate, trace.stats.npts
    seconds = count * trace.stats.delta
    yield from below("sampling_rate", checks.sampling_rate, rate, "sampling rate, Hz:")
    yield from below("duration", checks.duration, seconds, "duration, s:")
    yield from below("levels", checks.levels, levels, "different values (dead channel):")
    # Further checks need a record
    if levels < FEWEST_LEVELS or count < FEWEST:
        reason = f"{levels} different values in {count} samples are no record"
        yield Finding("levels", "reject", reason)
    else:
        yield from _recorder_findings(trace, checks)
        yield from _shaking_findings(without_trend(trace.data, 1), trace.stats.delta, checks)
        yield from header_findings(trace, checks)


def _recorder_findings(trace: Trace, checks: Checks) -> Iterator[Finding]:
    """Yield the failed checks of the recorder: clipping, use of the counter, dropouts, spikes."""
    samples, dt = trace.data, trace.stats.delta
    run = longest_extreme_run(samples)
    if run >= checks.clipped_run.threshold:
        reason = f"clipped: {run} equal samples at an extreme"
        yield Finding("clipped_run", checks.clipped_run.level, reason)
    # Physical units have no full scale
    if trace.stats.get("units", "counts") == "counts":
        use = float(np.abs(samples).max()) / FULL_SCALE
        meaning = "peak over the full scale of a 24-bit counter:"
        yield from above("counter_use", checks.counter_use, use, meaning)
    still = longest_standstill(samples, dt)
    yield from above("dropout", checks.dropout, still, "dropout, s without change:")
    spike = largest_spike(without_trend(samples, 1), dt)
    yield from above("spike", checks.spike, spike, "spike or step, over its vicinity:")


def _shaking_findings(samples: FloatArray, dt: float, checks: Checks) -> Iterator[Finding]:
    """Yield the failed checks of the motion: zero crossings, its ends, further events."""
    rate = np.count_nonzero(np.diff(np.signbit(samples))) / (samples.size * dt)
    yield from below("zero_crossings", checks.zero_crossings, rate, "zero crossings a second:")
    # Root mean squares of the first and the last second over the peak
    second, peak = max(round(1 / dt), 1), np.abs(samples).max()
    first = float(np.sqrt(np.mean(samples[:second] ** 2)) / peak)
    last = float(np.sqrt(np.mean(samples[-second:] ** 2)) / peak)
    meaning = "late trigger: first second over the peak:"
    yield from above("late_trigger", checks.late_trigger, first, meaning)
    meaning = "ends while shaking: last second over the peak:"
    yield from above("cut_off", checks.cut_off, last, meaning)
    # Shaking before or after a quiet time
    later = later_event(samples, dt)
    yield from above("second_event", checks.second_event, later, "another event, over the peak:")


def header_findings(trace: Trace, checks: Checks) -> list[Finding]:
    """
    Return a finding if the largest sample, with or without the mean, is not the header's peak.

    Parameters
    ----------
    trace : obspy Trace
        With ``header_peak`` in the unit of the samples, if the header has one.
    checks : Checks
        Thresholds and levels.

    Returns
    -------
    list of Finding
    """
    header_peak = trace.stats.get("header_peak")
    if not header_peak:
        return []
    # Some headers give the peak before the mean was removed
    peaks = np.abs(trace.data).max(), np.abs(trace.data - trace.data.mean()).max()
    error = min(abs(float(peak) / header_peak - 1) for peak in peaks)
    meaning = f"largest sample off the header's {header_peak:g} by a share of"
    return above("header_peak", checks.header_peak, error, meaning)


def runs(values: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the first position of each run of true values, and the position after its end."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], values, [False]))))
    return edges[::2], edges[1::2]


def longest_extreme_run(samples: FloatArray) -> int:
    """
    Return the longest run of equal samples at the largest or the smallest value.

    A clipped signal has such runs. Coarse recorders repeat values at every turn of the motion: a
    run that is not twice the longest one between the extremes counts as 1.

    Parameters
    ----------
    samples : (n_samples,) ndarray
        Raw: removing a trend hides the extremes.

    Returns
    -------
    int

    Examples
    --------
    >>> longest_extreme_run(np.array([0.0, 3.0, 3.0, 3.0, -1.0, -2.0]))
    3
    """
    # Runs at the extremes
    close = AT_EXTREME * np.ptp(samples)
    low, high = samples <= samples.min() + close, samples >= samples.max() - close
    pinned = max(_longest(low), _longest(high))
    # Runs of equal samples elsewhere during the shaking
    repeats = (np.diff(samples) == 0) & ~(low | high)[1:] & _shaking(samples)[1:]
    longest = _longest(np.concatenate(([False], repeats))) + 1
    return pinned if pinned >= 2 * longest else 1


def _longest(values: NDArray[np.bool_]) -> int:
    """Return the length of the longest run of true values, 0 if there is none."""
    starts, stops = runs(values)
    return int((stops - starts).max()) if starts.size else 0


def _shaking(samples: FloatArray) -> NDArray[np.bool_]:
    """Return the samples between 5 and 95 % of the squared motion."""
    energy = np.cumsum((samples - samples.mean()) ** 2)
    first, last = (1 - SIGNIFICANT) * energy[-1], SIGNIFICANT * energy[-1]
    return np.asarray((energy >= first) & (energy <= last))


def _running_rms(
    samples: FloatArray, seconds: float, dt: float, mode: Literal["reflect", "constant"]
) -> FloatArray:
    """Return the running root mean square of samples over a time, s."""
    width = max(round(seconds / dt), 1)

    def root_mean_square(part: FloatArray) -> FloatArray:
        means = uniform_filter1d(part**2, width, mode=mode)
        # Rounding of the running sum may leave small negative values
        return np.asarray(np.sqrt(np.maximum(means, 0)))

    return by_blocks(root_mean_square, samples, width)


def longest_standstill(samples: FloatArray, dt: float) -> float:
    """
    Return the longest time without change while the ground moves, s.

    The ground moves if the root mean square over 2 s exceeds a fifth of its largest value at both
    ends of that time: the samples of coarse recorders may be constant before and after.

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
    envelope = _running_rms(samples - samples.mean(), STANDSTILL_ENVELOPE, dt, "reflect")
    # Runs of equal samples with moving ground at both ends
    starts, stops = runs(np.diff(samples) == 0)
    moving = np.minimum(envelope[starts], envelope[stops]) > MOVING * envelope.max()
    return float((stops - starts)[moving].max() * dt) if moving.any() else 0.0


def largest_spike(samples: FloatArray, dt: float) -> float:
    """
    Return the largest jump of a single sample over the largest other jump around it.

    Others are those within half a second, without the two neighbours on each side. The jump of a
    sample is its distance from the mean of its two neighbours. Jumps below 5 % of the record's peak
    do not count.

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
    peak = np.abs(samples).max()
    jumps = _jumps(samples)
    # Largest jump in windows before and after, clear of the spike itself
    width = max(round(VICINITY / dt), NEIGHBOURS + 2)
    side = by_blocks(partial(maximum_filter1d, size=width, mode="constant"), jumps, width)
    shift = NEIGHBOURS + 1 + width // 2
    # Jumps large enough to count, over the largest one around each
    largest = 0.0
    for block in blocks(0, jumps.size):
        large = block.start + np.flatnonzero(jumps[block] > SMALLEST_SPIKE * peak)
        before, after = side[(large - shift) % side.size], side[(large + shift) % side.size]
        around = np.maximum(np.maximum(before, after), SPIKE_FLOOR * peak)
        largest = max(largest, float((jumps[large] / around).max(initial=0.0)))
    return largest


def _jumps(samples: FloatArray) -> FloatArray:
    """Return the distance of each sample from the mean of its neighbours, 0 at both ends."""
    jumps = np.zeros(samples.size)
    inner = np.add(samples[:-2], samples[2:], out=jumps[1:-1])
    inner *= 0.5
    np.abs(np.subtract(samples[1:-1], inner, out=inner), out=inner)
    return jumps


def later_event(samples: FloatArray, dt: float) -> float:
    """
    Return the peak of another event over the peak of the record.

    Another event comes after the record has become quiet, or ends before it was quiet. Quiet is a
    running root mean square over 5 s below 5 % of its largest value.

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
    envelope = _running_rms(samples, ENVELOPE, dt, "constant")
    # First quiet sample after the main event, last one before it
    main, largest = int(envelope.argmax()), float(envelope.max())
    is_quiet = envelope < QUIET * largest
    after, before = is_quiet[main + 1 :], is_quiet[:main][::-1]
    later = envelope[main + 1 + after.argmax() :].max() if after.any() else 0.0
    earlier = envelope[: main - before.argmax()].max() if before.any() else 0.0
    return float(max(later, earlier) / largest)


def outlier_findings(stream: Stream, checks: Checks) -> dict[str, list[Finding]]:
    """
    Return a finding for a component whose peak is several times that of both other components.

    Parameters
    ----------
    stream : obspy Stream
        Components of one instrument, m/s2.
    checks : Checks
        Thresholds and levels.

    Returns
    -------
    dict
        Trace identifier to findings; empty with fewer than three components, of which none can be
        called wrong.
    """
    peaks = {trace.id: float(np.abs(trace.data - trace.data.mean()).max()) for trace in stream}
    if len(peaks) < 3:
        return {}
    # The largest peak against the next one
    largest, second = sorted(peaks, key=peaks.__getitem__, reverse=True)[:2]
    ratio = peaks[largest] / peaks[second] if peaks[second] else np.inf
    return {largest: above("outlier", checks.outlier, ratio, f"peak over that of {second}:")}
