"""
Corners of the filter, chosen with the baseline so that the displacement is clean; usable periods.

A corner comes from noise, displacement, sampling or the fallback table; the two horizontals of an
instrument share the narrower band.
"""

from collections.abc import Callable, Iterable, Iterator
from functools import lru_cache

import numpy as np
from obspy import Stream, Trace
from scipy.fft import irfft
from scipy.optimize import brentq

from per_obspy.checks import FloatArray
from per_obspy.config import Processing
from per_obspy.errors import RecordRejected
from per_obspy.processing.account import (
    SHIFTED_BASELINE,
    Findings,
    Value,
    judge,
    with_note,
    with_numbers,
)
from per_obspy.processing.earthquake import Corner
from per_obspy.processing.filter.baseline import (
    LATEST_START,
    boore_segments,
    crossing_time,
    displacement_polynomial,
    residual_velocity,
    velocity_residual,
    without_baseline,
    without_line,
    without_mean,
)
from per_obspy.processing.filter.baseline_spread import (
    Shaking,
    longest_certain_period,
    without_drift,
)
from per_obspy.processing.filter.butterworth import butterworth_amplitude, taper, thin_spectrum
from per_obspy.processing.series import significant_samples
from per_obspy.processing.signal_to_noise import (
    NoiseSpectra,
    clear_band,
    noise_spectra,
    sustained_ratio,
    weakest_ratio,
    within,
)

#: Highest low-pass corner, fraction of the Nyquist frequency.
LOWPASS_OF_NYQUIST = 0.75

#: Fewest samples of noise of which a spectrum can be computed.
FEWEST_NOISE_SAMPLES = 4

#: Fewest samples of noise to which a parabola is fitted.
FEWEST = 10

#: Sampling intervals in the shortest usable period.
SAMPLES_PER_PERIOD = 5

#: Order of the polynomial that is the drift.
POLYNOMIAL_ORDER = 5

#: Ratio of successive trial corners.
STEP = 1.2

#: Frequencies above move the displacement by less than a thousandth and are left out, Hz.
FASTEST = 10.0

#: A corner is found to this difference of its logarithm.
TOLERANCE = 1e-3


def choose_corners(trace: Trace, settings: Processing, fallback: Callable[[], Corner]) -> Trace:
    """
    Return a copy of one record without its baseline, tapered, with the corners of its filter.

    Parameters
    ----------
    trace : obspy Trace
        m/s2, with ``noise`` (s) in ``stats.per_obspy``.
    settings : Processing
        Every number of the chain.
    fallback : callable
        Returns the high-pass corner of a record without measurable noise, see
        :func:`.fallback_highpass`.

    Returns
    -------
    obspy Trace

    Raises
    ------
    RecordRejected
        If the signal never clears the noise, or no corner cleans the displacement.
    """
    plain = without_mean(trace, float(trace.stats.per_obspy.noise))
    shaking, is_quiet = shaking_of(plain)
    if is_quiet:
        residual = residual_velocity(plain.data, plain.stats.delta, shaking.end)
        plain = with_numbers(plain, residual_velocity=residual)
    level = without_line(plain)
    # Corners by noise, then the baseline and the high-pass corner by displacement
    level, lowest, lowpass = _limits(level, settings, fallback)
    if settings.highpass is not None:
        ready = taper(level, settings.taper)
        highpass = Corner(settings.highpass, "configuration")
    else:
        ready, highpass = _clean_baseline(level, lowest, settings)
    if is_quiet:
        ready = _with_certain_period(plain, ready, shaking, highpass.frequency, settings)
    findings = Findings(settings.checks)
    findings.compare("bandwidth", lowpass.frequency / highpass.frequency)
    return with_corners(judge(ready, findings), highpass, lowpass)


def keep_offset(trace: Trace, settings: Processing) -> Trace:
    """
    Return a copy of one record that keeps its permanent displacement.

    Its residual velocity is removed, and it is not high-passed.

    Parameters
    ----------
    trace : obspy Trace
        m/s2, with ``noise`` (s) in ``stats.per_obspy``.
    settings : Processing
        Every number of the chain.

    Returns
    -------
    obspy Trace
        Tapered. ``highpass`` is one cycle in the record: it limits the usable periods and is not
        applied.

    Raises
    ------
    RecordRejected
        If the record is not quiet before and after the shaking.
    """
    plain = without_mean(trace, float(trace.stats.per_obspy.noise))
    shaking, is_quiet = shaking_of(plain)
    if not is_quiet:
        raise RecordRejected(
            trace.id,
            "permanent offset needs quiet ends, shakes from "
            f"{shaking.onset:.1f} to {shaking.end:.1f} s",
        )
    straight = without_baseline(plain, velocity_residual, **shaking._asdict())
    out = with_numbers(taper(straight, settings.taper), baseline="velocity residual")
    out = _with_certain_period(plain, out, shaking, 0.0, settings)
    # Corners that limit the usable periods
    lowest = Corner(lowest_highpass(out).frequency, "not applied: permanent offset kept")
    return with_corners(
        out, lowest, highest_corner(out, settings.lowpass or settings.highest_lowpass)
    )


def shaking_of(trace: Trace) -> tuple[Shaking, bool]:
    """Return the shaking of a record with ``noise``, and whether it is quiet before and after."""
    dt, onset = trace.stats.delta, float(trace.stats.per_obspy.noise)
    # A baseline that shifted has more energy at the end of the record than the shaking
    level = without_drift(trace.data, dt)
    end = onset + significant_samples(level[round(onset / dt) :]) * dt
    latest = LATEST_START * (trace.stats.npts - 1) * dt
    return Shaking(onset, end), FEWEST * dt <= onset < end <= latest


def _with_certain_period(
    plain: Trace, ready: Trace, shaking: Shaking, highpass: float, settings: Processing
) -> Trace:
    """Return the tapered record with the period from which on PER depends on when it shifted."""
    longest = longest_certain_period(
        plain.data, ready.data, plain.stats.delta, shaking, highpass, settings
    )
    return with_numbers(ready, certain_period=longest) if np.isfinite(longest) else ready


def _limits(
    trace: Trace, settings: Processing, fallback: Callable[[], Corner]
) -> tuple[Trace, Corner, Corner]:
    """Return the record with its noise, the lowest high-pass and the highest low-pass corner."""
    # Outermost corners that length and sampling of the record allow
    lowest = max(lowest_highpass(trace), Corner(settings.highpass_range[0], "lowest allowed"))
    lowpass = highest_corner(trace, settings.highest_lowpass)
    trace, band = _clear_band(trace, lowest, lowpass, settings)
    # Without measurable noise the magnitude decides
    lowest, lowpass = band or (max(fallback(), lowest), lowpass)
    if settings.lowpass is not None:
        configured = Corner(settings.lowpass, "configuration")
        lowpass = min(configured, highest_corner(trace, settings.lowpass))
    source = {"lowest_highpass_source": lowest.reason}
    return with_numbers(trace, lowest_highpass=lowest.frequency, **source), lowest, lowpass


def _clear_band(
    trace: Trace, lowest: Corner, lowpass: Corner, settings: Processing
) -> tuple[Trace, tuple[Corner, Corner] | None]:
    """Return the record with its signal-to-noise ratio, and the corners of the clear band."""
    spectra = measured_noise(trace, settings.smoothing)
    if spectra is None:
        return trace, None
    spectra = within(spectra, lowest.frequency, lowpass.frequency)
    best, findings = sustained_ratio(spectra), Findings(settings.checks)
    findings.compare("signal_to_noise", best)
    # Band in which periods of buildings lie
    weakest = weakest_ratio(spectra, settings.required_band)
    findings.compare("clear_band", weakest, *settings.required_band)
    trace = judge(trace, findings)
    band = clear_band(spectra, settings.checks.signal_to_noise.threshold)
    if band is None:
        return trace, None
    # Ends of the clear band, unless it reaches the outermost corners
    low, high = band
    lowest = Corner(low, "noise") if low > spectra.frequencies[0] else lowest
    lowpass = Corner(high, "noise") if high < spectra.frequencies[-1] else lowpass
    trace = with_numbers(trace, clear_from=low, clear_to=high, signal_to_noise=best)
    return trace, (lowest, lowpass)


def measured_noise(trace: Trace, bandwidth: float) -> NoiseSpectra | None:
    """Return the spectra of signal and noise of a record without baseline, None without noise."""
    seconds = float(trace.stats.per_obspy.get("noise", 0.0))
    if seconds < FEWEST_NOISE_SAMPLES * trace.stats.delta:
        return None
    return noise_spectra(trace.data, trace.stats.delta, seconds, bandwidth)


def _clean_baseline(trace: Trace, lowest: Corner, settings: Processing) -> tuple[Trace, Corner]:
    """
    Return the record with the plain baseline if any corner cleans that, else with the best one.

    A baseline that shifts during the shaking can look clean at low corners without being right
    there: with it the highest corner is used.
    """
    highest = settings.highpass_range[1]
    clean = list[tuple[Trace, Corner]]()
    for name, candidate in _baselines(trace):
        record = with_numbers(taper(candidate, settings.taper), baseline=name)
        corner = clean_corner(record, lowest, highest, settings)
        # The plain baseline goes before all others
        if corner is not None and candidate is trace:
            return record, corner
        clean += [(record, corner)] if corner is not None else []
    if not clean:
        reason = f"displacement drifts with every baseline and the corner at {highest:g} Hz"
        raise RecordRejected(trace.id, reason)
    record, corner = min(clean, key=lambda one: one[1].frequency)
    return record, max(corner, Corner(highest, f"highest allowed: {SHIFTED_BASELINE}"))


def _baselines(trace: Trace) -> Iterator[tuple[str, Trace]]:
    """Yield the record, then the record without each baseline that may shift in the shaking."""
    yield "mean and line", trace
    yield "displacement polynomial", without_baseline(trace, displacement_polynomial)
    shaking, is_quiet = shaking_of(trace)
    # Shifts between quiet ends
    if is_quiet:
        onset, end = shaking
        second = crossing_time(trace.data, trace.stats.delta, onset, end)
        yield "two segments", without_baseline(trace, boore_segments, first=onset, second=second)
        yield "velocity residual", without_baseline(trace, velocity_residual, onset=onset, end=end)


def lowest_highpass(trace: Trace) -> Corner:
    """Return the high-pass corner with one cycle in the record."""
    return Corner(1 / (trace.stats.npts * trace.stats.delta), "one cycle in the record")


def highest_corner(trace: Trace, highest_lowpass: float) -> Corner:
    """Return the highest low-pass corner that sampling allows."""
    nyquist = trace.stats.sampling_rate / 2
    by_sampling = Corner(LOWPASS_OF_NYQUIST * nyquist, "0.75 Nyquist")
    return min(Corner(highest_lowpass, "largest allowed"), by_sampling)


def clean_corner(
    tapered: Trace, lowest: Corner, highest: float, settings: Processing
) -> Corner | None:
    """
    Return the lowest high-pass corner whose displacement is clean, or None if no corner is.

    Parameters
    ----------
    tapered : obspy Trace
        Without its baseline, m/s2.
    lowest : Corner
        Allowed by noise and duration.
    highest : float
        Allowed corner, Hz.
    settings : Processing
        ``drift`` of a clean displacement, and ``order`` of the filter.

    Returns
    -------
    Corner or None
    """
    low, dt = lowest.frequency, tapered.stats.delta
    drift = displacement_drift(tapered.data, dt, low, settings.order)
    frequency = clean_highpass(drift, low, max(highest, low), settings.drift)
    if frequency is None:
        return None
    return lowest if np.isclose(frequency, low) else Corner(frequency, "displacement polynomial")


def displacement_drift(
    acceleration: FloatArray, dt: float, lowest: float, order: int
) -> Callable[[float], float]:
    r"""
    Return the share of drift in a record's displacement as a function of the high-pass corner.

    .. math:: d(f_{hp}) = \max_t |p_5(t)| / \max_t |u(t)|

    where u is the displacement of the filtered record, without its pads, and p5 the polynomial of
    fifth order fitted to it.

    Parameters
    ----------
    acceleration : (n_samples,) ndarray
        Tapered, m/s2.
    dt : float
        Sampling interval, s.
    lowest : float
        Lowest corner to be tried, Hz: it decides the length of the pads.
    order : int
        Of the Butterworth filter.

    Returns
    -------
    callable
        From the corner, Hz, to the drift, dimensionless.

    References
    ----------
    Ramos-Sepulveda et al. 2023 (algorithm auto_fchp of Brandenberg and others; gmprocess adopted
    it): the criterion and its target; the polynomial of fifth order and the search from above are
    choices of this package.
    """
    # Spectrum of the displacement before the filter, on a grid thinner by a whole number
    thin = max(int(0.5 / (FASTEST * dt)), 1)
    frequencies, spectrum, points, first = thin_spectrum(acceleration, dt, lowest, order, thin)
    angular = 2 * np.pi * np.where(frequencies > 0, frequencies, np.inf)
    spectrum = -spectrum / (angular**2 * thin)
    count = acceleration.size // thin
    basis = _polynomial_basis(count)

    def drift(highpass: float) -> float:
        amplitude = butterworth_amplitude(frequencies, highpass, np.inf, order)
        displacement = irfft(spectrum * amplitude, points)
        # Least-squares polynomial over the record without its pads
        record = displacement[first : first + count]
        largest = np.abs(record).max()
        return float(np.abs(basis @ (basis.T @ record)).max() / largest) if largest > 0 else 0.0

    return drift


@lru_cache(maxsize=4)
def _polynomial_basis(count: int) -> FloatArray:
    """Return orthonormal polynomials over evenly spaced points, (count, order + 1)."""
    return np.linalg.qr(np.vander(np.linspace(-1, 1, count), POLYNOMIAL_ORDER + 1))[0]


def clean_highpass(
    drift: Callable[[float], float], lowest: float, highest: float, target: float
) -> float | None:
    """
    Return the lowest corner at which, and above which, the displacement is clean.

    Corners are tried from the highest down in steps of a fifth until the drift exceeds the target;
    the root inside that step is found by Brent's method in logarithmic frequency, to 0.1 % of the
    corner.

    Parameters
    ----------
    drift : callable
        From `displacement_drift`.
    lowest, highest : float
        Corners allowed, Hz.
    target : float
        Largest drift of a clean displacement, dimensionless.

    Returns
    -------
    float or None
        Hz; None if even the highest corner leaves too much.
    """
    lower = highest
    if drift(lower) > target:
        return None

    def excess(log_corner: float) -> float:
        return drift(np.exp(log_corner)) - target

    # Steps down to the first corner that is not clean, then the root inside the last step
    while lower > lowest:
        upper, lower = lower, max(lower / STEP, lowest)
        if drift(lower) > target:
            root = brentq(excess, np.log(lower), np.log(upper), xtol=TOLERANCE)
            return float(np.exp(root))
    return float(lower)


def with_corners(trace: Trace, highpass: Corner, lowpass: Corner) -> Trace:
    """Return a copy with both corners and their reasons."""
    for name, (frequency, reason) in (("highpass", highpass), ("lowpass", lowpass)):
        numbers: dict[str, Value] = {name: frequency, f"{name}_source": reason}
        trace = with_note(trace, f"{name} corner {frequency:.4g} Hz: {reason}", **numbers)
    return trace


def share_corners(horizontals: Iterable[Trace]) -> Stream:
    """
    Return a copy whose traces all have the narrowest of their bands.

    Parameters
    ----------
    horizontals : iterable of obspy Trace
        The two horizontals of an instrument, with ``highpass``, ``lowpass`` (Hz) and their
        ``_source`` in ``stats.per_obspy``.

    Returns
    -------
    obspy Stream
        With shared corners; ``own_highpass`` and ``own_lowpass`` are those before.
    """
    traces = list(horizontals)
    for name, narrowest in (("highpass", max), ("lowpass", min)):
        corners = [trace.stats.per_obspy[name] for trace in traces]
        for place, own in enumerate(corners):
            shared = narrowest(corners)
            out = with_numbers(traces[place], **{f"own_{name}": own, name: shared})
            # Only a corner that changed has a new source
            if own != shared:
                step = f"{name} {shared:.4g} Hz shared with the other horizontal"
                out = with_note(out, step, **{f"{name}_source": "shared"})
            traces[place] = out
    return Stream(traces)


def with_usable_periods(trace: Trace, usable: float) -> Trace:
    """
    Return a copy with the usable periods of a record, from its corners.

    Longest: usable / highpass, or the period from which on PER depends on when the baseline
    shifted, the shorter. Shortest: 1 / (usable lowpass) or 5 sampling intervals, the longer.

    Parameters
    ----------
    trace : obspy Trace
        ``stats.per_obspy`` has ``highpass`` and ``lowpass``, Hz, and may have
        ``certain_period``, s.
    usable : float
        Fraction of a corner's period that is usable, dimensionless.

    Returns
    -------
    obspy Trace
        With ``longest_period`` and ``shortest_period``, s, in ``stats.per_obspy``.

    References
    ----------
    Boore 2004, J. Earthq. Eng. 8, 193-207; Akkar & Bommer 2006, Earthq. Eng. Struct. Dyn. 35,
    1275-1299.
    """
    corners = trace.stats.per_obspy
    longest = min(usable / corners.highpass, corners.get("certain_period", np.inf))
    shortest = max(1 / (usable * corners.lowpass), SAMPLES_PER_PERIOD * trace.stats.delta)
    # Spectra are computed at all periods and marked as usable between these two
    step = f"usable from {shortest:.3g} to {longest:.3g} s"
    return with_note(trace, step, shortest_period=shortest, longest_period=longest)
