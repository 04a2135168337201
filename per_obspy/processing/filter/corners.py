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
from per_obspy.processing import series
from per_obspy.processing.account import (
    SHIFTED_BASELINE,
    Findings,
    Value,
    judge,
    with_note,
    with_numbers,
)
from per_obspy.processing.components import is_horizontal
from per_obspy.processing.earthquake import Corner
from per_obspy.processing.filter.baseline import (
    LATEST_START,
    boore_segments,
    crossing_time,
    displacement_polynomial,
    residual_velocity,
    sample_times,
    velocity_residual,
    without_baseline,
    without_mean,
)
from per_obspy.processing.filter.baseline_spread import (
    Shaking,
    longest_certain_period,
    without_drift,
)
from per_obspy.processing.filter.butterworth import taper, thin_spectrum
from per_obspy.processing.signal_to_noise import (
    NoiseSpectra,
    clear_band,
    noise_spectra,
    sustained_ratio,
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

    With ``permanent_offset`` the record keeps its permanent displacement: its residual velocity is
    removed, and one cycle in the record limits the usable periods without being applied.

    Parameters
    ----------
    trace : obspy Trace
        m/s2, with ``noise`` (s) in ``stats.per_obspy``.
    settings : Processing
        Every number of the chain.
    fallback : callable
        Returns the high-pass corner of a record without measurable noise, see
        :func:`.fallback_highpass`.

    Raises
    ------
    RecordRejected
        If the signal never clears the noise, no corner cleans the displacement, or a record whose
        offset is kept is not quiet before and after the shaking.
    """
    plain = without_mean(trace, float(trace.stats.per_obspy.noise))
    del trace  # the raw record of a day leaves memory
    dt = plain.stats.delta
    shaking, is_quiet = shaking_of(plain)
    if is_quiet and not settings.permanent_offset:
        residual = residual_velocity(plain.data, sample_times(plain.data, dt), shaking.end)
        plain = with_numbers(plain, residual_velocity=residual)
    # Corners by noise, then the baseline and the high-pass corner by displacement
    if settings.permanent_offset:
        ready, highpass, lowpass, applied = _keep_offset(plain, shaking, is_quiet, settings)
    else:
        ready, highpass, lowpass = _limit_band(plain, settings, fallback)
        applied = highpass.frequency
    # Period from which on PER depends on when the baseline shifted
    if is_quiet:
        certain = longest_certain_period(plain.data, ready.data, dt, shaking, applied, settings)
        ready = with_numbers(ready, certain_period=certain) if np.isfinite(certain) else ready
    if applied:
        findings = Findings(settings.checks)
        findings.compare("bandwidth", lowpass.frequency / applied)
        ready = judge(ready, findings)
    return with_corners(ready, highpass, lowpass)


def with_corners(trace: Trace, highpass: Corner, lowpass: Corner) -> Trace:
    """Return a copy with both corners and their reasons."""
    for name, (frequency, reason) in (("highpass", highpass), ("lowpass", lowpass)):
        numbers: dict[str, Value] = {name: frequency, f"{name}_source": reason}
        trace = with_note(trace, f"{name} corner {frequency:.4g} Hz: {reason}", **numbers)
    return trace


def _keep_offset(
    plain: Trace, shaking: Shaking, is_quiet: bool, settings: Processing
) -> tuple[Trace, Corner, Corner, float]:
    """Return the record with its permanent displacement, its corners, and no high-pass, 0 Hz."""
    if not is_quiet:
        raise RecordRejected(
            plain.id,
            "permanent offset needs quiet ends, shakes from "
            f"{shaking.onset:.1f} to {shaking.end:.1f} s",
        )
    straight = without_baseline(plain, velocity_residual, **shaking._asdict())
    ready = with_numbers(taper(straight, settings.taper), baseline="velocity residual")
    lowest = Corner(lowest_highpass(ready).frequency, "not applied: permanent offset kept")
    # One cycle in the record limits the usable periods alone
    return ready, lowest, highest_corner(ready, settings.lowpass or settings.highest_lowpass), 0.0


def _limit_band(
    plain: Trace, settings: Processing, fallback: Callable[[], Corner]
) -> tuple[Trace, Corner, Corner]:
    """Return the tapered record without its baseline, and its corners."""
    level, lowest, lowpass = _limits(plain, settings, fallback)
    if settings.highpass is None:
        return *_clean_baseline(level, lowest, settings), lowpass
    return taper(level, settings.taper), Corner(settings.highpass, "configuration"), lowpass


def shaking_of(trace: Trace) -> tuple[Shaking, bool]:
    """Return the shaking of a record with ``noise``, and whether it is quiet before and after."""
    dt, onset = trace.stats.delta, float(trace.stats.per_obspy.noise)
    # A baseline that shifted has more energy at the end of the record than the shaking
    level = without_drift(trace.data, dt)
    end = onset + series.significant_samples(level[round(onset / dt) :]) * dt
    latest = LATEST_START * (trace.stats.npts - 1) * dt
    return Shaking(onset, end), FEWEST * dt <= onset < end <= latest


def _limits(
    plain: Trace, settings: Processing, fallback: Callable[[], Corner]
) -> tuple[Trace, Corner, Corner]:
    """Return the record without a line, the lowest high-pass and the highest low-pass corner."""
    samples = series.without_line(plain.data)
    trace = with_note(plain, "polynomial trend of order 1 removed", samples, trend_order=1)
    # Outermost corners that length and sampling of the record allow
    lowest = max(lowest_highpass(trace), Corner(settings.highpass_range[0], "lowest allowed"))
    lowpass = highest_corner(trace, settings.highest_lowpass)
    dt, seconds, band = trace.stats.delta, float(trace.stats.per_obspy.noise), None
    if seconds >= FEWEST_NOISE_SAMPLES * dt:
        spectra = noise_spectra(trace.data, dt, seconds, settings.smoothing)
        spectra = spectra.within(lowest.frequency, lowpass.frequency)
        trace, band = _clear_band(trace, spectra, lowest, lowpass, settings)
    # Without measurable noise the magnitude decides
    lowest, lowpass = band or (max(fallback(), lowest), lowpass)
    if settings.lowpass is not None:
        configured = Corner(settings.lowpass, "configuration")
        lowpass = min(configured, highest_corner(trace, settings.lowpass))
    source = {"lowest_highpass_source": lowest.reason}
    return with_numbers(trace, lowest_highpass=lowest.frequency, **source), lowest, lowpass


def _clear_band(
    trace: Trace, spectra: NoiseSpectra, lowest: Corner, lowpass: Corner, settings: Processing
) -> tuple[Trace, tuple[Corner, Corner] | None]:
    """Return the record with its signal-to-noise ratio, and the corners of the clear band."""
    best, findings = sustained_ratio(spectra), Findings(settings.checks)
    findings.compare("signal_to_noise", best)
    # Band in which periods of buildings lie
    weakest = spectra.within(*settings.required_band).ratio.min(initial=np.inf)
    findings.compare("clear_band", float(weakest), *settings.required_band)
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


def _clean_baseline(trace: Trace, lowest: Corner, settings: Processing) -> tuple[Trace, Corner]:
    """
    Return the record with the plain baseline if any corner cleans that, else with the best one.

    A baseline that shifts during the shaking can look clean at low corners without being right
    there: with it the highest corner is used.
    """
    highest = settings.highpass_range[1]
    clean = list[tuple[Corner, Trace]]()
    for name, candidate in _baselines(trace):
        record = with_numbers(taper(candidate, settings.taper), baseline=name)
        corner = clean_corner(record, lowest, highest, settings)
        # The plain baseline goes before all others
        if corner is not None and candidate is trace:
            return record, corner
        clean += [(corner, record)] if corner is not None else []
    if not clean:
        reason = f"displacement drifts with every baseline and the corner at {highest:g} Hz"
        raise RecordRejected(trace.id, reason)
    corner, record = min(clean, key=lambda one: one[0].frequency)
    return record, max(corner, Corner(highest, f"highest allowed: {SHIFTED_BASELINE}"))


def _baselines(trace: Trace) -> Iterator[tuple[str, Trace]]:
    """Yield the record, then the record without each baseline that may shift in the shaking."""
    yield "mean and line", trace
    yield "displacement polynomial", without_baseline(trace, displacement_polynomial)
    (onset, end), is_quiet = shaking_of(trace)
    # Shifts between quiet ends
    if is_quiet:
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

    The record, m/s2, is without its baseline; the lowest corner is that of noise and duration.
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
    Return the share of drift in a record's displacement as a function of the high-pass corner, Hz.

    .. math:: d(f_{hp}) = \max_t |p_5(t)| / \max_t |u(t)|

    where u is the displacement of the filtered record, without its pads, and p5 the polynomial of
    fifth order fitted to it. The acceleration, m/s2, is tapered; the lowest corner to be tried
    decides the length of the pads.

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
    # Power of the Butterworth amplitude that is the same for every corner
    slopes = angular ** (-2 * order)

    def drift(highpass: float) -> float:
        amplitude = 1 / np.sqrt(1 + slopes * (2 * np.pi * highpass) ** (2 * order))
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
    Return the lowest corner at which, and above which, the displacement is clean, Hz.

    Corners are tried from the highest down in steps of a fifth until the drift, from
    `displacement_drift`, exceeds the target; the root inside that step is found by Brent's method
    in logarithmic frequency, to 0.1 % of the corner. None if even the highest leaves too much.
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


def share_corners(components: Iterable[Trace]) -> Stream:
    """
    Return the components of an instrument whose horizontals all have the narrowest of their bands.

    ``own_highpass`` and ``own_lowpass`` of a horizontal are its corners before; the vertical, which
    keeps its corners, comes last.
    """
    traces = list[Trace]()
    verticals = list[Trace]()
    for trace in components:
        (traces if is_horizontal(trace) else verticals).append(trace)
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
    return Stream(traces + verticals)


def with_usable_periods(trace: Trace, usable: float) -> Trace:
    """
    Return a copy with the usable periods of a record, s, from its corners.

    Longest: usable / highpass, or the period from which on PER depends on when the baseline
    shifted (``certain_period``), the shorter. Shortest: 1 / (usable lowpass) or 5 sampling
    intervals, the longer. ``usable`` is the fraction of a corner's period that is usable.

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
