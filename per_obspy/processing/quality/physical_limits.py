"""
Limits of what the ground can do, for every record however it was processed.

A unit, a sampling interval or a component that is wrong leaves a motion that looks like one. Peaks
are compared with the largest ones ever recorded, and the components of an instrument with each
other: they recorded one motion. Every number was tried on 58 real stations, as they are and with
each fault (``workflows/damaged_records.py``).
"""

from collections import defaultdict
from collections.abc import Iterator
from itertools import combinations

import numpy as np
from obspy import Stream, Trace
from scipy.fft import irfft, next_fast_len, rfft
from scipy.ndimage import uniform_filter1d

from per_obspy.checks import FloatArray
from per_obspy.config import Checks
from per_obspy.processing.filter.polynomial import without_trend
from per_obspy.processing.long_records import is_long
from per_obspy.processing.quality.findings import Finding, above, below
from per_obspy.processing.station.components import is_horizontal

#: Fewest samples of a record whose components are compared.
FEWEST = 500

#: A vertical may be so many times weaker, relative to horizontals, than a horizontal may.
WEAKER_VERTICAL = 4.0

#: Envelopes are smoothed over a time and taken at steps, s; their logarithms are compared, down to
#: a share of the peak, at shifts of at most some time, s.
SMOOTHING, STEP, ENVELOPE_FLOOR, LONGEST_SHIFT = 0.5, 0.05, 1e-3, 10.0

#: Least correlation of two envelopes that are shifted, and how much less it is without a shift.
#: Of real horizontals 1 in 58 pairs reaches the first with a shift of 1 s, none the second.
ALIKE, BETTER = 0.75, 0.03

#: Share of the energy of all components that arrives in the early motion.
EARLY = 0.05


def acceleration_findings(trace: Trace, checks: Checks) -> Iterator[Finding]:
    """
    Yield a finding if the peak of a record is beyond the largest one recorded, or below feeling.

    Parameters
    ----------
    trace : obspy Trace
        Acceleration, m/s2, raw or processed; its mean does not count.
    checks : Checks
        Thresholds and levels.

    Yields
    ------
    Finding
    """
    peak = float(np.abs(trace.data - trace.data.mean()).max())
    meaning = "peak acceleration, m/s2 (wrong unit?):"
    impossible = above("impossible_acceleration", checks.impossible_acceleration, peak, meaning)
    unusual = above("unusual_acceleration", checks.unusual_acceleration, peak, meaning)
    yield from impossible or unusual
    yield from below("weak_motion", checks.weak_motion, peak, meaning)


def velocity_findings(trace: Trace, velocity: float, checks: Checks) -> Iterator[Finding]:
    """
    Yield a finding if a peak velocity is beyond the largest one recorded, or large for the peak.

    Parameters
    ----------
    trace : obspy Trace
        Processed acceleration, m/s2.
    velocity : float
        Peak velocity, m/s.
    checks : Checks
        Thresholds and levels.

    Yields
    ------
    Finding
    """
    meaning = "peak velocity, m/s (wrong unit or sampling interval?):"
    impossible = above("impossible_velocity", checks.impossible_velocity, velocity, meaning)
    yield from impossible or above("unusual_velocity", checks.unusual_velocity, velocity, meaning)
    # A sampling interval that is too long enlarges the velocity, not the acceleration
    peak = float(np.abs(trace.data).max())
    ratio = velocity / peak if peak else 0.0
    meaning = "peak velocity over peak acceleration, s (wrong sampling interval?):"
    yield from above("velocity_time", checks.velocity_time, ratio, meaning)


def component_findings(stream: Stream, checks: Checks) -> dict[str, list[Finding]]:
    """
    Return the findings of components that cannot have recorded the motion of the others.

    Parameters
    ----------
    stream : obspy Stream
        Components of one instrument, m/s2.
    checks : Checks
        Thresholds and levels.

    Returns
    -------
    dict
        Trace identifier to findings.
    """
    findings = defaultdict[str, list[Finding]](list)
    for name, finding in _comparisons(stream, checks):
        findings[name].append(finding)
    return findings


def _comparisons(stream: Stream, checks: Checks) -> Iterator[tuple[str, Finding]]:
    """Yield the name of a component with each finding."""
    peaks = {trace.id: float(np.abs(trace.data - trace.data.mean()).max()) for trace in stream}
    yield from _outliers(peaks, checks)
    horizontals = [trace.id for trace in stream if is_horizontal(trace)]
    yield from _weak_components(peaks, horizontals, checks)
    # Samples at the same times
    motions = _common_motions(stream)
    copies = list(_copies(motions, checks))
    yield from copies
    if not copies and motions:
        yield from _late_components(motions, horizontals, stream[0].stats.delta, checks)
        # Simulated motion has no P waves
        if not any(trace.stats.get("simulated") for trace in stream):
            yield from _exchanged_components(motions, horizontals, checks)


def _outliers(peaks: dict[str, float], checks: Checks) -> Iterator[tuple[str, Finding]]:
    """Yield the component whose peak is several times that of both others."""
    # Of two none can be called wrong
    if len(peaks) < 3:
        return
    largest, second = sorted(peaks, key=peaks.__getitem__, reverse=True)[:2]
    ratio = peaks[largest] / peaks[second] if peaks[second] else np.inf
    for finding in above("outlier", checks.outlier, ratio, f"peak over that of {second}:"):
        yield largest, finding


def _weak_components(
    peaks: dict[str, float], horizontals: list[str], checks: Checks
) -> Iterator[tuple[str, Finding]]:
    """Yield the components that are several times weaker than a horizontal."""
    if len(horizontals) != 2:
        return
    weak, strong = sorted(horizontals, key=peaks.__getitem__)
    has_vertical = len(peaks) > 2
    # An outlier, which is left out, is no measure of the others
    if has_vertical and peaks[strong] > checks.outlier.threshold * max(
        peaks[name] for name in peaks if name != strong
    ):
        return
    for name in peaks:
        reference = weak if name not in horizontals else strong
        factor = WEAKER_VERTICAL if name not in horizontals else 1.0
        ratio = peaks[reference] / peaks[name] / factor if peaks[name] else np.inf
        meaning = f"peak of {reference} over its own{f' and {factor:g}' if factor > 1 else ''}:"
        for finding in above("weak_component", checks.weak_component, ratio, meaning):
            yield name, finding
            # Without a vertical either of them may be wrong
            if not has_vertical:
                reason = finding.reason.replace("its own", f"that of {weak}")
                yield strong, finding._replace(reason=reason)


def _common_motions(stream: Stream) -> dict[str, FloatArray]:
    """Return the samples of the components at their common times, without trend; {} if too few."""
    intervals = {trace.stats.delta for trace in stream}
    if len(stream) < 2 or len(intervals) > 1 or any(is_long(trace.stats.npts) for trace in stream):
        return {}
    # Samples before the common time, and in it
    dt, latest = intervals.pop(), max(trace.stats.starttime for trace in stream)
    skips = {trace.id: round((latest - trace.stats.starttime) / dt) for trace in stream}
    count = min(trace.stats.npts - skips[trace.id] for trace in stream)
    if count < FEWEST:
        return {}
    motions = dict[str, FloatArray]()
    for trace in stream:
        first = skips[trace.id]
        motions[trace.id] = without_trend(trace.data[first : first + count], 1)
    # A dead component has nothing to compare
    return motions if all(np.any(motion) for motion in motions.values()) else {}


def _copies(motions: dict[str, FloatArray], checks: Checks) -> Iterator[tuple[str, Finding]]:
    """Yield both of two components that have equal samples, but for a factor."""
    for one, other in combinations(motions, 2):
        first, second = motions[one], motions[other]
        size = np.sqrt(np.sum(first**2) * np.sum(second**2))
        correlation = float(abs(np.sum(first * second)) / size)
        # Either of them may be the copy
        for name, partner in ((one, other), (other, one)):
            meaning = f"its samples are those of {partner}: correlation"
            for finding in above("copied_component", checks.copied_component, correlation, meaning):
                yield name, finding


def _late_components(
    motions: dict[str, FloatArray], horizontals: list[str], dt: float, checks: Checks
) -> Iterator[tuple[str, Finding]]:
    """Yield the horizontal that is late or early against the other one."""
    if len(horizontals) != 2:
        return
    envelopes = {name: _logarithmic_envelope(motion, dt) for name, motion in motions.items()}
    one, other = horizontals
    steps, correlation, unshifted = _best_shift(envelopes[one], envelopes[other])
    # Envelopes that agree no better at another time are not shifted
    if correlation < ALIKE or correlation - unshifted < BETTER:
        return
    # The vertical tells which of the two is wrong; without it the later one is left out
    wrong, right = (one, other) if steps > 0 else (other, one)
    for vertical in set(motions) - set(horizontals):
        by_wrong, by_right = (
            abs(_best_shift(envelopes[name], envelopes[vertical])[0]) for name in (wrong, right)
        )
        wrong, right = (right, wrong) if by_wrong < by_right else (wrong, right)
    meaning = f"shifted in time against {right}, s:"
    shift = abs(steps) * _samples_per_step(dt) * dt
    for finding in above("late_component", checks.late_component, shift, meaning):
        yield wrong, finding


def _logarithmic_envelope(motion: FloatArray, dt: float) -> FloatArray:
    """Return the logarithm of the smoothed size of a motion at steps, without its mean."""
    power = uniform_filter1d(motion**2, max(round(SMOOTHING / dt), 1))[:: _samples_per_step(dt)]
    size = np.sqrt(np.maximum(power, 0.0))
    logarithm = np.log(size + ENVELOPE_FLOOR * size.max())
    return np.asarray(logarithm - logarithm.mean())


def _samples_per_step(dt: float) -> int:
    """Return the number of samples in a step of the envelopes."""
    return max(round(STEP / dt), 1)


def _best_shift(one: FloatArray, other: FloatArray) -> tuple[int, float, float]:
    """Return the steps by which envelopes agree best, their correlation there, and at none."""
    length = next_fast_len(2 * one.size, real=True)
    products = irfft(rfft(one, length) * np.conj(rfft(other, length)), length)
    # Shifts before and after none
    most = min(round(LONGEST_SHIFT / STEP), one.size - 1)
    near = np.concatenate((products[-most:], products[: most + 1]))
    near /= np.sqrt(np.sum(one**2) * np.sum(other**2))
    best = int(near.argmax())
    return best - most, float(near[best]), float(near[most])


def _exchanged_components(
    motions: dict[str, FloatArray], horizontals: list[str], checks: Checks
) -> Iterator[tuple[str, Finding]]:
    """Yield the horizontal that has the P waves of a vertical."""
    if len(horizontals) != 2 or len(motions) != 3:
        return
    # Early motion is P waves, which shake the vertical most; of 58 stations no horizontal has a
    # logarithm beyond 0.09, and 54 of their verticals one beyond 0.28
    energies = {name: np.cumsum(motion**2) for name, motion in motions.items()}
    joint = sum(energy / energy[-1] for energy in energies.values()) / len(energies)
    early = int(np.searchsorted(joint, EARLY))
    shares = {
        name: float(np.log(max(energy[early], np.finfo(float).tiny) / energy[-1]))
        for name, energy in energies.items()
    }
    name = max(shares, key=shares.__getitem__)
    if name not in horizontals:
        return
    difference = shares[name] - sorted(shares.values())[-2]
    meaning = "exchanged with the vertical? ln share of early motion over that of the others:"
    for finding in above("exchanged_component", checks.exchanged_component, difference, meaning):
        yield name, finding
