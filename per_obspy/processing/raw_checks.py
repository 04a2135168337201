"""
Checks of raw samples for faults of sensor and recorder, and for other events in the record.

In order: sampling, limits of the recorder, overflow of its counter, missing samples, spikes, what
the motion is, the peak of the header.
"""

from functools import partial

import numpy as np
from numpy.typing import NDArray
from obspy import Trace
from scipy.ndimage import maximum_filter1d

from per_obspy.checks import FloatArray
from per_obspy.config import Checks
from per_obspy.processing.account import CLIPPED, Finding, Findings, lenient
from per_obspy.processing.series import (
    SIGNIFICANT,
    blocks,
    filter_blocks,
    running_rms,
    runs,
    without_line,
)

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


#: Checks that only warn of a record that others have processed: its samples are final.
WARNINGS_OF_FINAL_SAMPLES = ("sampling_rate", "channel_rate", "duration", "spike", "header_peak")


def raw_findings(trace: Trace, checks: Checks, is_final: bool = False) -> Findings:
    """
    Return every failed check of one raw trace, counts or m/s2.

    Of a record that others have processed, which is final, rate, duration, spikes and the header's
    peak are warnings, and start and other events are those that its processing has chosen.
    """
    findings = Findings(lenient(checks, WARNINGS_OF_FINAL_SAMPLES) if is_final else checks)
    if not _is_record(trace, findings):
        return findings
    # The recorder, then the motion
    level = without_line(trace.data)
    _check_recorder(trace, level, findings)
    _check_motion(level, trace.stats.delta, findings, is_final)
    # Largest sample, with the mean and without: some headers give the peak before it was removed
    if peak := trace.stats.get("header_peak"):
        sizes = np.abs(trace.data).max(), np.abs(trace.data - trace.data.mean()).max()
        findings.compare("header_peak", min(abs(float(one) / peak - 1) for one in sizes), peak)
    return findings


def _check_motion(level: FloatArray, dt: float, findings: Findings, is_final: bool) -> None:
    """Check a record without trend for what the motion is, at its ends and in between."""
    # Sizes of the first and the last second over the peak
    second = max(round(1 / dt), 1)
    starts, ends = (
        float(np.sqrt(np.mean(part**2)) / np.abs(level).max())
        for part in (level[:second], level[-second:])
    )
    if not is_final:
        rate = np.count_nonzero(np.diff(np.signbit(level))) / (level.size * dt)
        findings.compare("zero_crossings", rate)
        findings.compare("late_trigger", starts)
    findings.compare("cut_off", ends)
    if not is_final:
        findings.compare("second_event", later_event(level, dt))


def _is_record(trace: Trace, findings: Findings) -> bool:
    """Check rate, interval, duration and number of values; return whether further checks can be."""
    stats, levels = trace.stats, np.unique(trace.data).size
    findings.compare("sampling_rate", stats.sampling_rate)
    findings.compare("sampling_interval", stats.delta)
    # A record that was resampled by hand has another rate than its channel as well
    if rate := stats.get("channel_rate"):
        findings.compare("channel_rate", abs(stats.sampling_rate / rate - 1), rate)
    findings.compare("duration", stats.npts * stats.delta)
    findings.compare("levels", levels)
    if stats.npts >= FEWEST and levels >= FEWEST_LEVELS:
        return True
    reason = f"{levels} different values in {stats.npts} samples are no record"
    findings.append(Finding("levels", "reject", reason))
    return False


def _check_recorder(trace: Trace, level: FloatArray, findings: Findings) -> None:
    """Check samples, as they are and without trend, for limits, overflow, fills and spikes."""
    samples, dt, checks = trace.data, trace.stats.delta, findings.checks
    run, pinned = longest_extreme_run(samples), pinned_samples(samples)
    if run >= checks.clipped_run.threshold:
        findings.add("clipped_run", f"clipped: {run} equal samples at an extreme")
    elif pinned >= checks.pinned.threshold:
        findings.add("pinned", f"{CLIPPED}: {pinned} samples are equal to an extreme")
    # Below full scale, with noise on top; physical units have no full scale
    findings.compare("saturation", piled_samples(samples))
    if trace.stats.get("units", "counts") == "counts":
        findings.compare("counter_use", float(np.abs(samples).max()) / FULL_SCALE)
    roughness = overflow_roughness(samples)
    if roughness < checks.wrapped.threshold:
        reason = f"wrapped: an overflow turned back leaves {roughness:.2g} of the steps around it"
        findings.add("wrapped", reason)
    # Missing samples: none, zeros, or a line between the last and the next
    still, count = longest_gaps(samples, dt)
    findings.compare("dropout", still)
    findings.compare("filled", count * dt, count)
    findings.compare("spike", largest_spike(level, dt))


def longest_extreme_run(samples: FloatArray) -> int:
    """
    Return the longest run of equal samples at the largest or the smallest value.

    A clipped signal has such runs. Coarse recorders repeat values at every turn of the motion: a
    run that is not twice the longest one between the extremes counts as 1.

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
    energy = samples - samples.mean()
    np.cumsum(np.square(energy, out=energy), out=energy)
    first, last = (1 - SIGNIFICANT) * energy[-1], SIGNIFICANT * energy[-1]
    return np.asarray((energy >= first) & (energy <= last))


def pinned_samples(samples: FloatArray) -> int:
    """
    Return how many samples are equal to the largest or to the smallest value.

    1 if another value beyond half of that extreme is repeated a third as often: coarse recorders
    repeat all of them.

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
    are more samples than 5 to 15 % below it. The larger one of both extremes counts; 0 without two
    flat excursions.

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
    smooth motion there; steps of ground motion become as large in the other direction. It is the
    root mean square of the jumps around these steps, after over before; infinite with fewer than
    two such steps.
    """
    middle, full = np.median(samples), np.ptp(samples)
    changes = np.diff(samples)
    steps = np.flatnonzero(np.abs(changes) > OVERFLOW_STEP * full)
    # Both ends of an overflow are near opposite extremes, those of a spike are not
    ends = np.minimum(np.abs(samples[steps] - middle), np.abs(samples[steps + 1] - middle))
    if steps.size < 2 or np.median(ends) < OVERFLOW_END * full:
        return np.inf
    # Jumps around the steps as they are, and turned back
    around = np.unique(np.clip(steps[:, None] + np.arange(-2, 4), 1, samples.size - 2))
    sides = np.stack([changes[around - 1], changes[around]])
    turned = sides - full * np.round(sides / full)
    return float(np.linalg.norm(np.diff(turned, axis=0)) / np.linalg.norm(np.diff(sides, axis=0)))


def longest_gaps(samples: FloatArray, dt: float) -> tuple[float, int]:
    """
    Return the longest time without change, s, and the most samples on a line, in moving ground.

    Gaps that were filled with zeros, with the last sample or by interpolation are such runs. The
    ground moves if the root mean square over 2 s exceeds a fifth of its largest value at both ends:
    the samples of coarse recorders may be constant before and after. Coarse recorders and film have
    many lines: a line that is not four times an ordinary one counts as 0.
    """
    envelope = running_rms(samples - np.median(samples), STANDSTILL_ENVELOPE, dt, "reflect")
    is_moving = envelope > MOVING * envelope.max()
    del envelope
    # Equal samples
    starts, stops = runs(np.diff(samples) == 0)
    still = (stops - starts)[is_moving[starts] & is_moving[stops]].max(initial=0)
    return float(still * dt), _longest_line(samples, is_moving, dt)


def _longest_line(samples: FloatArray, is_moving: NDArray[np.bool_], dt: float) -> int:
    """Return the most samples on a line in moving ground, with both its ends; 0 if others do."""
    jumps = _jumps(samples)
    is_straight = jumps <= STRAIGHT * np.sqrt(np.mean(jumps[_shaking(samples)] ** 2))
    is_straight[[0, -1]] = False
    starts, stops = runs(is_straight)
    if not starts.size:
        return 0
    # Jumps at both ends are much larger than the largest one in the run
    jumping = running_rms(jumps, STANDSTILL_ENVELOPE, dt, "reflect")
    largest = np.maximum.reduceat(jumps, np.stack((starts, stops), axis=1).ravel())[::2]
    is_fill = is_moving[starts - 1] & is_moving[stops]
    is_fill &= largest <= STRAIGHT * np.minimum(jumping[starts - 1], jumping[stops])
    # With both ends of the line, against an ordinary one
    lengths = np.sort((stops - starts)[is_fill])[::-1] + 2
    ordinary = lengths[ORDINARY_RUN] if lengths.size > ORDINARY_RUN else 2
    longest = int(lengths.max(initial=0))
    return longest if longest >= max(FEWEST_FILLED, OTHER_RUNS * ordinary) else 0


def largest_spike(samples: FloatArray, dt: float) -> float:
    """
    Return the largest jump of a single sample over the largest other jump around it.

    Others are those within half a second, without the two neighbours on each side. The jump of a
    sample is its distance from the mean of its two neighbours. Jumps below 5 % of the record's peak
    do not count. Near 1 for ground motion.
    """
    peak = np.abs(samples).max()
    jumps = _jumps(samples)
    # Largest jump in windows before and after, clear of the spike itself
    width = max(round(VICINITY / dt), NEIGHBOURS + 2)
    side = filter_blocks(partial(maximum_filter1d, size=width, mode="constant"), jumps, width)
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
    Return the peak of another event over the peak of the record, both of a running size.

    Another event comes after the record has become quiet, or ends before it was quiet. Quiet is a
    running root mean square over 5 s below 5 % of its largest value.
    """
    envelope = running_rms(samples, ENVELOPE, dt, "constant")
    # First quiet sample after the main event, last one before it
    main, largest = int(envelope.argmax()), float(envelope.max())
    is_quiet = envelope < QUIET * largest
    after, before = is_quiet[main + 1 :], is_quiet[:main][::-1]
    later = envelope[main + 1 + after.argmax() :].max() if after.any() else 0.0
    earlier = envelope[: main - before.argmax()].max() if before.any() else 0.0
    return float(max(later, earlier) / largest)
