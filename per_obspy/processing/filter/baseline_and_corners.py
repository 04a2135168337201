"""Baseline and corners of one record, chosen together so that the displacement is clean."""

from collections.abc import Callable, Iterator

import numpy as np
from obspy import Stream, Trace

from per_obspy.config import Processing
from per_obspy.errors import RecordRejected
from per_obspy.processing.filter.baseline_spread import (
    Shaking,
    longest_certain_period,
    without_drift,
)
from per_obspy.processing.filter.butterworth import tapered
from per_obspy.processing.filter.corners import (
    SHIFTED_BASELINE,
    Corner,
    clean_corner,
    highest_corner,
    lowest_highpass,
    measured_noise,
)
from per_obspy.processing.filter.polynomial import detrended, mean_removed, trend_removed
from per_obspy.processing.filter.velocity import (
    LATEST_START,
    boore_segments,
    crossing_time,
    displacement_polynomial,
    residual_velocity,
    velocity_residual,
)
from per_obspy.processing.noise.signal_to_noise import (
    NoiseSpectra,
    clear_band,
    significant_samples,
    sustained_ratio,
    weakest_ratio,
    within,
)
from per_obspy.processing.notes import copied, noted, remembered
from per_obspy.processing.quality.findings import Finding, below, judged

#: Fewest samples of noise to which a parabola is fitted.
FEWEST = 10


def corners_noted(stream: Stream, settings: Processing, fallback: Callable[[], Corner]) -> Stream:
    """
    Return a copy of one record without its baseline, tapered, with the corners of its filter.

    Parameters
    ----------
    stream : obspy Stream
        One trace, m/s2, with ``noise`` (s) in ``stats.per_obspy``.
    settings : Processing
        Every number of the chain.
    fallback : callable
        Returns the high-pass corner of a record without measurable noise, see
        :func:`.corners.fallback_highpass`.

    Returns
    -------
    obspy Stream

    Raises
    ------
    RecordRejected
        If the signal never clears the noise, or no corner cleans the displacement.
    """
    level = trend_removed(_without_mean(stream))
    # Spectra of signal and noise between the corners that length and sampling allow
    outer = _outer_corners(level[0], settings)
    spectra = measured_noise(level[0], settings.smoothing)
    if spectra is not None:
        spectra = within(spectra, *(corner.frequency for corner in outer))
    checked = judged(level[0], _noise_findings(spectra, settings))
    # Corners by noise, then the baseline and the high-pass corner by displacement
    lowest, lowpass = _limits(checked[0], spectra, outer, settings, fallback)
    if settings.highpass is not None:
        ready = tapered(checked, settings.taper)
        highpass = Corner(settings.highpass, "configuration")
    else:
        ready, highpass = _clean_baseline(checked, lowest, settings)
    _certain_period_noted(_without_mean(stream)[0], ready[0], highpass.frequency, settings)
    width = lowpass.frequency / highpass.frequency
    meaning = "low-pass over high-pass corner:"
    wide = judged(ready[0], below("bandwidth", settings.checks.bandwidth, width, meaning))
    return _noted(wide, highpass, lowpass)


def _without_mean(stream: Stream) -> Stream:
    """Return one record without the mean of its noise, with its residual velocity noted."""
    return _residual_noted(mean_removed(stream, float(stream[0].stats.per_obspy.noise)))


def offset_kept(stream: Stream, settings: Processing) -> Stream:
    """
    Return a copy of one record that keeps its permanent displacement.

    Its residual velocity is removed, and it is not high-passed.

    Parameters
    ----------
    stream : obspy Stream
        One trace, m/s2, with ``noise`` (s) in ``stats.per_obspy``.
    settings : Processing
        Every number of the chain.

    Returns
    -------
    obspy Stream
        Tapered. ``highpass`` is one cycle in the record: it limits the usable periods and is not
        applied.

    Raises
    ------
    RecordRejected
        If the record is not quiet before and after the shaking.
    """
    level = mean_removed(stream, float(stream[0].stats.per_obspy.noise))
    onset, end, quiet = _shaking_times(level[0])
    if not quiet:
        raise RecordRejected(
            level[0].id,
            f"permanent offset needs quiet ends, shakes from {onset:.1f} to {end:.1f} s",
        )
    straight = detrended(level, velocity_residual, onset=onset, end=end)
    out = tapered(straight, settings.taper)
    remembered(out[0], baseline="velocity residual")
    _certain_period_noted(level[0], out[0], 0.0, settings)
    # Corners that limit the usable periods
    lowest = Corner(lowest_highpass(out[0]).frequency, "not applied: permanent offset kept")
    highest = highest_corner(out[0], settings.lowpass or settings.highest_lowpass)
    return _noted(out, lowest, highest)


def _residual_noted(stream: Stream) -> Stream:
    """Return a copy with the residual velocity after the shaking, if the record has quiet ends."""
    out = copied(stream)
    _, end, has_quiet_ends = _shaking_times(out[0])
    if has_quiet_ends:
        velocity = residual_velocity(out[0].data, out[0].stats.delta, end)
        remembered(out[0], residual_velocity=velocity)
    return out


def _certain_period_noted(
    plain: Trace, ready: Trace, highpass: float, settings: Processing
) -> None:
    """Note on the tapered record the period from which on PER depends on the baseline's shift."""
    onset, end, has_quiet_ends = _shaking_times(plain)
    if has_quiet_ends:
        shaking = Shaking(onset, end)
        longest = longest_certain_period(
            plain.data, ready.data, plain.stats.delta, shaking, highpass, settings
        )
        if np.isfinite(longest):
            remembered(ready, certain_period=longest)


def _shaking_times(trace: Trace) -> tuple[float, float, bool]:
    """Return onset and end of the shaking, s, and whether the record is quiet before and after."""
    dt, onset = trace.stats.delta, float(trace.stats.per_obspy.noise)
    # A baseline that shifted has more energy at the end of the record than the shaking
    level = without_drift(trace.data, dt)
    end = onset + significant_samples(level[round(onset / dt) :]) * dt
    latest = LATEST_START * (trace.stats.npts - 1) * dt
    return onset, end, FEWEST * dt <= onset < end <= latest


def _outer_corners(trace: Trace, settings: Processing) -> tuple[Corner, Corner]:
    """Return the outermost corners that length and sampling of the record allow."""
    low = max(lowest_highpass(trace), Corner(settings.highpass_range[0], "lowest allowed"))
    return low, highest_corner(trace, settings.highest_lowpass)


def _clean_baseline(stream: Stream, lowest: Corner, settings: Processing) -> tuple[Stream, Corner]:
    """
    Return the record with the plain baseline if any corner cleans that, else with the best one.

    A baseline that shifts during the shaking can look clean at low corners without being right
    there: with it the highest corner is used.
    """
    plain = _cleaned(stream, "mean and line", lowest, settings)
    if plain is not None:
        return plain
    # Baselines that some corner cleans
    clean = []
    for name, other in _other_baselines(stream):
        cleaned = _cleaned(other, name, lowest, settings)
        if cleaned is not None:
            clean.append(cleaned)
    highest = settings.highpass_range[1]
    if not clean:
        reason = f"displacement drifts with every baseline and the corner at {highest:g} Hz"
        raise RecordRejected(stream[0].id, reason)
    record, corner = min(clean, key=lambda cleaned: cleaned[1].frequency)
    reason = f"highest allowed: {SHIFTED_BASELINE}"
    return record, max(corner, Corner(highest, reason))


def _cleaned(
    stream: Stream, baseline: str, lowest: Corner, settings: Processing
) -> tuple[Stream, Corner] | None:
    """Return the tapered record and the corner that cleans its displacement, None without one."""
    candidate = tapered(stream, settings.taper)
    remembered(candidate[0], baseline=baseline)
    highest = settings.highpass_range[1]
    corner = clean_corner(candidate[0], lowest, highest, settings.drift, settings.order)
    return None if corner is None else (candidate, corner)


def _other_baselines(stream: Stream) -> Iterator[tuple[str, Stream]]:
    """Yield name and record without each baseline that may shift during the shaking."""
    onset, end, has_quiet_ends = _shaking_times(stream[0])
    yield "displacement polynomial", detrended(stream, displacement_polynomial)
    if has_quiet_ends:
        second = crossing_time(stream[0].data, stream[0].stats.delta, onset, end)
        yield "two segments", detrended(stream, boore_segments, first=onset, second=second)
        yield "velocity residual", detrended(stream, velocity_residual, onset=onset, end=end)


def _noise_findings(spectra: NoiseSpectra | None, settings: Processing) -> Iterator[Finding]:
    """Yield a finding if the signal never exceeds the noise, or not in the required band."""
    if spectra is None:
        return
    checks = settings.checks
    best = sustained_ratio(spectra)
    meaning = "signal-to-noise ratio of the best octave"
    yield from below("signal_to_noise", checks.signal_to_noise, best, meaning)
    # Band in which periods of buildings lie
    low, high = settings.required_band
    weakest = weakest_ratio(spectra, settings.required_band)
    meaning = f"signal-to-noise ratio in {low:g}-{high:g} Hz"
    yield from below("clear_band", checks.clear_band, weakest, meaning)


def _limits(
    trace: Trace,
    spectra: NoiseSpectra | None,
    outer: tuple[Corner, Corner],
    settings: Processing,
    fallback: Callable[[], Corner],
) -> tuple[Corner, Corner]:
    """Return the lowest high-pass and the highest low-pass corner; note the noise on the trace."""
    lowest, lowpass = outer
    threshold = settings.checks.signal_to_noise.threshold
    band = clear_band(spectra, threshold) if spectra else None
    if spectra is None or band is None:
        # Without measurable noise the magnitude decides
        lowest = max(fallback(), lowest)
    else:
        # Ends of the clear band, unless it reaches the outermost corners
        low, high = band
        remembered(trace, clear_from=low, clear_to=high, signal_to_noise=sustained_ratio(spectra))
        lowest = Corner(low, "noise") if low > spectra.frequencies[0] else lowest
        lowpass = Corner(high, "noise") if high < spectra.frequencies[-1] else lowpass
    remembered(trace, lowest_highpass=lowest.frequency, lowest_highpass_source=lowest.reason)
    if settings.lowpass is not None:
        configured = Corner(settings.lowpass, "configuration")
        lowpass = min(configured, highest_corner(trace, settings.lowpass))
    return lowest, lowpass


def _noted(stream: Stream, highpass: Corner, lowpass: Corner) -> Stream:
    """Return a copy with both corners and their reasons."""
    out = copied(stream)
    for name, corner in (("highpass", highpass), ("lowpass", lowpass)):
        noted(out[0], f"{name} corner {corner.frequency:.4g} Hz: {corner.reason}")
        remembered(out[0], **{name: corner.frequency}, **{f"{name}_source": corner.reason})
    return out
