"""
Checks of motion in m/s2: limits of the ground, agreement of the components, rest at the end.

A unit, a sampling interval or a component that is wrong leaves a motion that looks like one. Peaks
are compared with the largest ones ever recorded, and the components of an instrument with each
other: they recorded one motion. Every number was tried on 58 real stations, as they are and with
each fault (``workflows/damaged_records.py``).
"""

from collections import defaultdict
from collections.abc import Mapping
from itertools import permutations

import numpy as np
from obspy import Stream, Trace
from scipy.fft import irfft, next_fast_len, rfft

from per_obspy.checks import FloatArray
from per_obspy.config import Checks
from per_obspy.processing.account import Finding, Findings
from per_obspy.processing.components import align, is_horizontal
from per_obspy.processing.series import integral, is_long, running_rms, without_line

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

#: Checks of whether the motion comes to rest: only warnings where others have processed a record.
AT_REST = ("final_velocity", "final_displacement", "baseline_shift")


def acceleration_findings(trace: Trace, checks: Checks) -> Findings:
    """Return findings if the peak of a record, m/s2, is beyond any recorded, or below feeling."""
    findings, peak = Findings(checks), _peak(trace)
    findings.compare("impossible_acceleration", peak)
    findings.compare("weak_motion", peak)
    return findings


def _peak(trace: Trace) -> float:
    """Return the peak of a record, m/s2; its mean does not count."""
    return float(np.abs(trace.data - trace.data.mean()).max())


def _ratio(figure: float, reference: float, without: float = 0.0) -> float:
    """Return a figure over its reference, or another number where that is 0."""
    return figure / reference if reference else without


# Components of an instrument


def component_findings(stream: Stream, checks: Checks) -> dict[str, Findings]:
    """
    Return the findings of components, m/s2, that cannot have recorded the motion of the others.

    Identifiers of the traces of one instrument -> findings, where there are any.
    """
    findings: dict[str, Findings] = defaultdict(lambda: Findings(checks))
    peaks = {trace.id: _peak(trace) for trace in stream}
    horizontals = [trace.id for trace in stream if is_horizontal(trace)]
    _find_outlier(peaks, findings)
    if len(horizontals) == 2:
        _find_weak(peaks, horizontals, findings, checks.outlier.threshold)
    # Samples at the same times
    motions = _common_motions(stream)
    if not _find_copies(motions, findings) and len(horizontals) == 2 and motions:
        _compare_times(motions, horizontals, stream[0].stats.delta, findings)
        # Simulated motion has no P waves
        if len(motions) == 3 and not any(trace.stats.get("simulated") for trace in stream):
            _compare_early_motion(motions, horizontals, findings)
    return {name: failed for name, failed in findings.items() if failed}


def _find_copies(motions: dict[str, FloatArray], findings: dict[str, Findings]) -> bool:
    """Find two components that have equal samples but for a factor; return whether there are."""
    is_copy = False
    for name, partner in permutations(motions, 2):
        product = np.sum(motions[name] * motions[partner])
        size = np.sqrt(np.sum(motions[name] ** 2) * np.sum(motions[partner] ** 2))
        # Either of them may be the copy
        correlation = float(abs(product) / size)
        is_copy |= findings[name].compare("copied_component", correlation, partner)
    return is_copy


def _find_outlier(peaks: dict[str, float], findings: dict[str, Findings]) -> None:
    """Find the component whose peak is several times that of both others."""
    # Of two none can be called wrong
    if len(peaks) > 2:
        largest, second = sorted(peaks, key=peaks.__getitem__, reverse=True)[:2]
        ratio = _ratio(peaks[largest], peaks[second], np.inf)
        findings[largest].compare("outlier", ratio, second)


def _find_weak(
    peaks: dict[str, float], horizontals: list[str], findings: dict[str, Findings], outlier: float
) -> None:
    """Find the components that are several times weaker than a horizontal."""
    has_three = len(peaks) > 2
    weak, strong = sorted(horizontals, key=peaks.__getitem__)
    # An outlier, which is left out, is no measure of the others
    others = [peak for name, peak in peaks.items() if name != strong]
    if has_three and peaks[strong] > outlier * max(others):
        return
    for name, peak in peaks.items():
        reference, factor, times = strong, 1.0, ""
        if name not in horizontals:
            reference, factor, times = weak, WEAKER_VERTICAL, f" and {WEAKER_VERTICAL:g}"
        ratio = _ratio(peaks[reference], peak, np.inf) / factor
        is_weak = findings[name].compare("weak_component", ratio, reference, f"its own{times}")
        # Without a vertical either of them may be wrong
        if is_weak and not has_three:
            findings[strong].compare("weak_component", ratio, reference, f"that of {weak}{times}")


def _common_motions(stream: Stream) -> dict[str, FloatArray]:
    """Return the samples of the components at their common times, without trend; {} if too few."""
    intervals = {trace.stats.delta for trace in stream}
    if len(stream) < 2 or len(intervals) > 1 or any(is_long(trace.stats.npts) for trace in stream):
        return {}
    common = align(stream)
    if min(trace.stats.npts for trace in common) < FEWEST:
        return {}
    motions = {trace.id: without_line(trace.data) for trace in common}
    # A dead component has nothing to compare
    return motions if all(map(np.any, motions.values())) else {}


def _compare_times(
    motions: dict[str, FloatArray],
    horizontals: list[str],
    dt: float,
    findings: dict[str, Findings],
) -> None:
    """Find the horizontal that is late or early against the other one."""
    thin = max(round(STEP / dt), 1)
    envelopes = {name: _logarithmic_envelope(motion, dt, thin) for name, motion in motions.items()}
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
    findings[wrong].compare("late_component", abs(steps) * thin * dt, right)


def _logarithmic_envelope(motion: FloatArray, dt: float, thin: int) -> FloatArray:
    """Return the logarithm of the smoothed size of a motion at steps, without its mean."""
    size = running_rms(motion, SMOOTHING, dt, "reflect")[::thin]
    logarithm = np.log(size + ENVELOPE_FLOOR * size.max())
    return np.asarray(logarithm - logarithm.mean())


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


def _compare_early_motion(
    motions: dict[str, FloatArray], horizontals: list[str], findings: dict[str, Findings]
) -> None:
    """Find the horizontal that has the P waves of a vertical."""
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
    if name in horizontals:
        difference = shares[name] - sorted(shares.values())[-2]
        findings[name].compare("exchanged_component", difference)


# The processed record


def final_findings(trace: Trace, checks: Checks) -> Findings:
    """
    Return findings of a velocity that no ground has, and of motion that does not come to rest.

    The trace is processed acceleration, m/s2. Velocity and displacement come to rest with the pads;
    a residual velocity before the filter is a finding too.
    """
    findings, dt = Findings(checks), trace.stats.delta
    velocity = integral(trace.data, dt)
    peak = float(np.abs(velocity).max())
    findings.compare("impossible_velocity", peak)
    # A sampling interval that is too long enlarges the velocity, not the acceleration
    findings.compare("velocity_time", _ratio(peak, float(np.abs(trace.data).max())))
    findings.compare("final_velocity", _ratio(float(abs(velocity[-1])), peak))
    displacement = integral(velocity, dt)
    farthest = float(np.abs(displacement).max())
    findings.compare("final_displacement", _ratio(float(abs(displacement[-1])), farthest))
    _find_shift(trace.stats.get("per_obspy", {}), peak, findings)
    return findings


def _find_shift(account: Mapping[str, float], peak: float, findings: Findings) -> None:
    """Find a residual velocity before the filter, by the numbers of a record and a peak, m/s."""
    residual, certain = account.get("residual_velocity", 0.0), account.get("certain_period", np.inf)
    is_shifted = findings.compare("baseline_shift", _ratio(residual, peak))
    # A smaller one shortens the usable periods
    if not is_shifted and certain <= account.get("longest_period", 0.0):
        reason = "the baseline may have shifted during the shaking: PER beyond"
        reason = f"{reason} {certain:.3g} s depends on when"
        findings.append(Finding("baseline_shift", "warn", reason))
