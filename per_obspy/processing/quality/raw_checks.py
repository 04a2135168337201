"""Checks of raw samples for faults of sensor and recorder, and for other events in the record."""

from collections.abc import Iterator
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from obspy import Trace
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

#: Reasons of recorders that reached a limit begin with this word: see :mod:`..instrument`.
CLIPPED = "clipped"

#: An excursion goes beyond this share of an extreme; bands below the extreme whose samples are
#: counted: a sine has 1.3 times as many in the upper one, strong motion fewer.
EXCURSION, UPPER_BAND, LOWER_BAND = 0.5, 0.95, 0.85

#: Fewest excursions and samples that reach the upper band, and least share of the samples of these
#: excursions in it (a sine has 0.30): a single flat top may be ground motion.
FEWEST_EXCURSIONS, FEWEST_AT_TOP, FLATNESS = 2, 10, 0.3

#: The extreme is repeated at least so many times as often as any other value of its size.
OTHER_REPEATS = 3

#: Least step of an overflow, and least distance of both its ends from the middle in the median of
#: all steps; shares of the range.
OVERFLOW_STEP, OVERFLOW_END = 0.5, 0.2

#: Samples lie on a straight line if their jumps are below this share of those of moving ground.
STRAIGHT = 3e-3

#: Fewest samples of a fill, and the place among the longest straight runs of the one that it is
#: compared with: coarse recorders and film have many, a record has fewer fills than that.
FEWEST_FILLED, ORDINARY_RUN = 8, 20

#: A fill is more than so many times as long as an ordinary straight run.
OTHER_RUNS = 4


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
    levels = np.unique(trace.data).size
    yield from _sampling_findings(trace, levels, checks)
    if _is_record(trace, levels):
        yield from _recorder_findings(trace, checks)
        yield from _shaking_findings(without_trend(trace.data, 1), trace.stats.delta, checks)
        yield from header_findings(trace, checks)


def final_sample_findings(trace: Trace, checks: Checks) -> Iterator[Finding]:
    """
    Yield the failed checks of the samples of a record that others have processed.

    As :func:`raw_findings`, but that rate, duration, spikes and the header's peak are warnings, and
    that start and other events are those that its processing has chosen.
    """
    levels = np.unique(trace.data).size
    for finding in _sampling_findings(trace, levels, checks):
        is_certain = finding.check in ("levels", "sampling_interval")
        yield finding if is_certain else finding._replace(level="warn")
    if _is_record(trace, levels):
        # What the processing may have left, and what no processing mends
        for finding in (*_recorder_findings(trace, checks), *header_findings(trace, checks)):
            is_warning = finding.check in ("spike", "header_peak")
            yield finding._replace(level="warn") if is_warning else finding
        yield from _cut_off(without_trend(trace.data, 1), trace.stats.delta, checks)


def _is_record(trace: Trace, levels: int) -> bool:
    """Return whether a trace has samples and different values enough for further checks."""
    return trace.stats.npts >= FEWEST and levels >= FEWEST_LEVELS


def _sampling_findings(trace: Trace, levels: int, checks: Checks) -> Iterator[Finding]:
    """Yield the failed checks of rate, interval, duration and number of values of any record."""
    stats = trace.stats
    yield from below(
        "sampling_rate", checks.sampling_rate, stats.sampling_rate, "sampling rate, Hz:"
    )
    meaning = "sampling interval, s (are its times in milliseconds?):"
    yield from above("sampling_interval", checks.sampling_interval, stats.delta, meaning)
    # A record that was resampled by hand has another rate than its channel as well
    channel_rate = stats.get("channel_rate")
    if channel_rate:
        meaning = f"sampling rate off the {channel_rate:g} Hz of StationXML by a share of"
        error = abs(stats.sampling_rate / channel_rate - 1)
        yield from above("channel_rate", checks.channel_rate, error, meaning)
    seconds = stats.npts * stats.delta
    yield from below("duration", checks.duration, seconds, "duration, s:")
    yield from below("levels", checks.levels, levels, "different values (dead channel):")
    # Further checks need a record
    if not _is_record(trace, levels):
        reason = f"{levels} different values in {stats.npts} samples are no record"
        yield Finding("levels", "reject", reason)


def _recorder_findings(trace: Trace, checks: Checks) -> Iterator[Finding]:
    """Yield the failed checks of the recorder: limits, overflow, missing samples, spikes."""
    samples, dt = trace.data, trace.stats.delta
    yield from _limit_findings(samples, checks)
    # Physical units have no full scale
    if trace.stats.get("units", "counts") == "counts":
        use = float(np.abs(samples).max()) / FULL_SCALE
        meaning = "peak over the full scale of a 24-bit counter:"
        yield from above("counter_use", checks.counter_use, use, meaning)
    roughness = overflow_roughness(samples)
    if roughness < checks.wrapped.threshold:
        reason = f"wrapped: an overflow turned back leaves {roughness:.2g} of the steps around it"
        yield Finding("wrapped", checks.wrapped.level, reason)
    # Missing samples: none, zeros, or a line between the last and the next
    still = longest_standstill(samples, dt)
    yield from above("dropout", checks.dropout, still, "dropout, s without change:")
    count = longest_fill(samples, dt)
    meaning = f"filled: {count} samples on a straight line during the shaking, s:"
    yield from above("filled", checks.filled, count * dt, meaning)
    spike = largest_spike(without_trend(samples, 1), dt)
    yield from above("spike", checks.spike, spike, "spike or step, over its vicinity:")


def _limit_findings(samples: FloatArray, checks: Checks) -> Iterator[Finding]:
    """Yield the failed checks of a recorder or sensor that reached the limit of its range."""
    run, pinned = longest_extreme_run(samples), pinned_samples(samples)
    if run >= checks.clipped_run.threshold:
        reason = f"clipped: {run} equal samples at an extreme"
        yield Finding("clipped_run", checks.clipped_run.level, reason)
    elif pinned >= checks.pinned.threshold:
        reason = f"clipped: {pinned} samples are equal to an extreme"
        yield Finding("pinned", checks.pinned.level, reason)
    # Below full scale, with noise on top
    pile = piled_samples(samples)
    meaning = "clipped: samples within 5 % of an extreme over those 5 to 15 % below it:"
    saturated = above("saturation", checks.saturation, pile, meaning)
    yield from saturated or above("possible_saturation", checks.possible_saturation, pile, meaning)


def _shaking_findings(samples: FloatArray, dt: float, checks: Checks) -> Iterator[Finding]:
    """Yield the failed checks of the motion: zero crossings, its ends, further events."""
    rate = np.count_nonzero(np.diff(np.signbit(samples))) / (samples.size * dt)
    yield from below("zero_crossings", checks.zero_crossings, rate, "zero crossings a second:")
    # Root mean square of the first second over the peak
    first, peak = samples[: max(round(1 / dt), 1)], np.abs(samples).max()
    meaning = "late trigger: first second over the peak:"
    late = float(np.sqrt(np.mean(first**2)) / peak)
    yield from above("late_trigger", checks.late_trigger, late, meaning)
    yield from _cut_off(samples, dt, checks)
    # Shaking before or after a quiet time
    later = later_event(samples, dt)
    yield from above("second_event", checks.second_event, later, "another event, over the peak:")


def _cut_off(samples: FloatArray, dt: float, checks: Checks) -> list[Finding]:
    """Return a finding if the last second is large for the peak of a record without trend."""
    last, peak = samples[-max(round(1 / dt), 1) :], np.abs(samples).max()
    meaning = "ends while shaking: last second over the peak:"
    return above("cut_off", checks.cut_off, float(np.sqrt(np.mean(last**2)) / peak), meaning)


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


def pinned_samples(samples: FloatArray) -> int:
    """
    Return how many samples are equal to the largest or to the smallest value.

    1 if another value beyond half of that extreme is repeated a third as often: coarse recorders
    repeat all of them.

    Parameters
    ----------
    samples : (n_samples,) ndarray
        Raw.

    Returns
    -------
    int

    Examples
    --------
    >>> pinned_samples(np.array([0.0, 3.0, 2.0, 3.0, 0.0, -1.0, -2.0, 3.0]))
    3
    """
    most, middle = 1, np.median(samples)
    for side in (samples - middle, middle - samples):
        # How often the largest value and the others are repeated
        _, repeats = np.unique(side[side > EXCURSION * side.max()], return_counts=True)
        others = repeats[:-1].max(initial=1)
        if repeats.size and repeats[-1] >= OTHER_REPEATS * others:
            most = max(most, int(repeats[-1]))
    return most


def piled_samples(samples: FloatArray) -> float:
    """
    Return the number of samples close below an extreme over the number further below.

    Ground motion seldom comes close to its peak. A sensor that saturates, or a recorder that clips
    before noise is added, has plateaus of unequal samples there: within 5 % of the extreme there
    are more samples than 5 to 15 % below it.

    Parameters
    ----------
    samples : (n_samples,) ndarray
        Raw.

    Returns
    -------
    float
        The larger one of both extremes, dimensionless; 0 without two flat excursions.

    References
    ----------
    Kleckner and others 2021, SRL 93, 880-896: of their criteria, that of the histogram.
    """
    middle = np.median(samples)
    return max(_pile(samples - middle), _pile(middle - samples))


def _pile(side: FloatArray) -> float:
    """Return the pile of samples below the largest one of a record without its median."""
    peak = side.max()
    starts, stops = runs(side > EXCURSION * peak)
    upper = (side > UPPER_BAND * peak).astype(np.int64)
    # Samples in the upper band of each excursion, and of all of it
    counts = np.add.reduceat(upper, starts) if starts.size else np.zeros(0, dtype=np.int64)
    reaching = counts > 0
    at_top, inside = int(counts.sum()), int((stops - starts)[reaching].sum())
    is_flat = at_top >= max(FEWEST_AT_TOP, FLATNESS * inside)
    if np.count_nonzero(reaching) < FEWEST_EXCURSIONS or not is_flat:
        return 0.0
    below_top = np.count_nonzero(side > LOWER_BAND * peak) - at_top
    return at_top / (below_top + 1)


def overflow_roughness(samples: FloatArray) -> float:
    """
    Return how rough a record stays where steps across its range are turned back.

    A counter that overflows continues at its other end. Adding its range to what follows leaves a
    smooth motion there; steps of ground motion become as large in the other direction.

    Parameters
    ----------
    samples : (n_samples,) ndarray
        Raw.

    Returns
    -------
    float
        Root mean square of the jumps around these steps, after over before; infinite with fewer
        than two such steps.
    """
    middle, full = np.median(samples), np.ptp(samples)
    steps = np.flatnonzero(np.abs(np.diff(samples)) > OVERFLOW_STEP * full)
    # Both ends of an overflow are near opposite extremes, those of a spike are not
    ends = np.minimum(np.abs(samples[steps] - middle), np.abs(samples[steps + 1] - middle))
    if steps.size < 2 or np.median(ends) < OVERFLOW_END * full:
        return np.inf
    # Jumps around the steps as they are, and turned back
    around = np.unique(np.clip(steps[:, None] + np.arange(-2, 4), 1, samples.size - 2))
    turned = np.unwrap(samples, period=full)
    before, after = (np.square(_jumps(motion)[around]).mean() for motion in (samples, turned))
    return float(np.sqrt(after / before))


def longest_fill(samples: FloatArray, dt: float) -> int:
    """
    Return the longest run of samples on a straight line while the ground moves.

    Gaps that were filled with zeros, with the last sample or by interpolation are such runs.
    Coarse recorders and film have many: a run that is not four times an ordinary one counts as 0.

    Parameters
    ----------
    samples : (n_samples,) ndarray
        Raw.
    dt : float
        Sampling interval, s.

    Returns
    -------
    int
    """
    jumps = _jumps(samples)
    is_straight = jumps <= STRAIGHT * np.sqrt(np.mean(jumps[_shaking(samples)] ** 2))
    is_straight[[0, -1]] = False
    starts, stops = runs(is_straight)
    if not starts.size:
        return 0
    # The ground moves at both ends, and jumps there are much larger than in the run
    before = starts - 1
    motion = _running_rms(samples - np.median(samples), STANDSTILL_ENVELOPE, dt, "reflect")
    is_fill = np.minimum(motion[before], motion[stops]) > MOVING * motion.max()
    jumping = _running_rms(jumps, STANDSTILL_ENVELOPE, dt, "reflect")
    # The largest jump of each run
    largest = np.maximum.reduceat(jumps, np.stack((starts, stops), axis=1).ravel())[::2]
    is_fill &= largest <= STRAIGHT * np.minimum(jumping[before], jumping[stops])
    return _unusual_run((stops - starts)[is_fill])


def _unusual_run(lengths: NDArray[np.int64]) -> int:
    """Return the samples on the longest line, with both its ends; 0 if others are as long."""
    longest = np.sort(lengths)[::-1] + 2
    ordinary = longest[ORDINARY_RUN] if longest.size > ORDINARY_RUN else 2
    needed = max(FEWEST_FILLED, OTHER_RUNS * ordinary)
    return int(longest[0]) if longest.size and longest[0] >= needed else 0


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
