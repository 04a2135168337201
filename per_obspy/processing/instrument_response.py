"""Conversion of counts to m/s2 by the full response, the sensitivity, or the reader's factor."""

import re
from collections.abc import Callable, Iterable
from copy import copy, deepcopy

import numpy as np
from numpy.typing import NDArray
from obspy import Trace
from obspy.core.inventory import Response
from obspy.core.inventory.response import InstrumentSensitivity, ResponseStage
from scipy.fft import irfft, next_fast_len, rfft
from scipy.interpolate import CubicSpline

from per_obspy.checks import FloatArray
from per_obspy.constants import GAL, SEED_CODE
from per_obspy.errors import RecordRejected
from per_obspy.processing.account import Finding, judge, with_note
from per_obspy.processing.series import blocks, forget_plans
from per_obspy.spectra.trace_arguments import unit_after_steps
from per_obspy.units import unit_of_si

#: Unit of the sensor -> band in which the pre-filter rises from 0 to 1, Hz; that of accelerometers
#: leaves low frequencies unchanged.
LOW_BANDS = {"m/s": (0.005, 0.01), "m/s2": (-2.0, -1.0)}

#: The pre-filter falls from 1 to 0 in this band, fractions of the Nyquist frequency: above it
#: recorders record no motion, and dividing by a response near zero makes noise.
NYQUIST_BAND = (0.8, 0.9)

#: Codes of accelerometers, and frequencies, Hz, between which their response to acceleration falls
#: by no more than this factor: that of a velocity sensor falls 5 times.
ACCELEROMETER, FLAT_BAND, FLAT = re.compile(r"[A-Z]N[A-Z0-9]"), (1.0, 5.0), 2.5

#: Most seconds of zeros behind a record: the response of the filter is much shorter.
LONGEST_PAD = 3600.0

#: Samples around the peak that show whether they are whole numbers; their largest distance from
#: them, least share of them, and fewest steps between them (reasoned).
AROUND_PEAK, OFF_WHOLE, MOSTLY_WHOLE, FEWEST_STEPS = 5000, 0.05, 0.99, 20

#: Samples that are no whole numbers may be ground motion up to 100 m/s2 or m/s. Up to 3000 (gal)
#: they are no counts where these would be less than 0.02 m/s2 or m/s, with more than 100 of them to
#: a unit: a filtered record of weak motion is refused as well (reasoned).
LARGEST_MOTION, LARGEST_NUMBER, SMALLEST_MOTION, FEWEST_COUNTS = 100.0, 3000.0, 0.02, 100.0

#: Zeros and poles below this are at zero frequency, rad/s or Hz.
AT_ZERO = 1e-9

#: Factor within which the peak of the header decides between units of the samples (reasoned).
PEAK_FACTOR = 3.0


def as_recorded(trace: Trace) -> Trace:
    """
    Return a trace in the unit that its samples have, which ObsPy's header may not tell.

    ObsPy removes responses and sensitivities and multiplies by ``calib``, and leaves all of them in
    the header. ``stats.processing`` names the step; where that is lost, as in a file, the peak of
    the header decides, or the factor that makes the samples whole numbers of counts. A copy with
    another unit has no response. Samples of an unknown unit that are no counts are rejected.
    """
    unit, reason = unit_after_steps(trace.stats), "steps of ObsPy"
    if unit is not None and unit.startswith("unknown"):
        raise RecordRejected(trace.id, f"units {unit}, needs m/s2 or counts with a response")
    if unit in (None, "counts"):
        unit, reason = _unit_by_samples(trace)
    if unit is None or unit == trace.stats.get("units", "counts"):
        return trace
    # The header is that of the samples as they are
    out = with_note(trace, f"in {unit} already, by {reason}", conversion=reason)
    # Response, factor and peak describe counts, which these samples are not
    out.stats.pop("response", None)
    if trace.stats.get("units", "counts") == "counts":
        out.stats.pop("header_peak", None)
    out.stats.calib, out.stats.units = 1.0, unit
    if motion := unit_of_si(unit):
        out.stats.quantity = motion.quantity
    return out


def _unit_by_samples(trace: Trace) -> tuple[str | None, str]:
    """Return the unit of samples that should be counts, None if they are, and what shows it."""
    samples = np.ma.getdata(trace.data)
    units = _physical_units(trace)
    if not units or not samples.size or _are_whole(samples, 1.0):
        return None, ""
    tiny = np.finfo(float).tiny
    peaks = [float(np.abs(part).max()) or tiny for part in (samples, samples - samples.mean())]
    header_peak = _header_peak(trace)
    for step, (unit, factor) in units.items():
        # The peak of the header is that of counts or of motion; a part of the record has less
        if _are_near(peaks, header_peak):
            return None, ""
        if _are_near(peaks, header_peak * factor):
            return unit, f"{step}, as the header's peak shows"
        most = PEAK_FACTOR * header_peak * factor or LARGEST_MOTION
        if peaks[1] < most and _are_whole(samples, 1 / factor):
            return unit, f"{step}, without which they are whole numbers"
        # No counts of any use: the factor is the small one of a count
        _refuse_physical(trace, peaks, unit, factor)
    return None, ""


def _are_near(peaks: list[float], expected: float) -> bool:
    """Return whether a peak, with or without the mean, is about that of the header, if any."""
    ratios = [peak / expected for peak in peaks if expected > 0]
    return any(1 / PEAK_FACTOR < ratio < PEAK_FACTOR for ratio in ratios)


def _refuse_physical(trace: Trace, peaks: list[float], unit: str, factor: float) -> None:
    """Refuse samples that could be motion in some unit, and as counts would be next to none."""
    motion = peaks[1] * factor
    if peaks[0] < LARGEST_NUMBER and motion < SMALLEST_MOTION and factor < 1 / FEWEST_COUNTS:
        raise RecordRejected(
            trace.id,
            f"samples: no whole numbers up to {peaks[0]:.4g}, as counts no more than "
            f"{motion:.2g} {unit}: they seem to be physical already; needs counts, or stats.units",
        )


def _physical_units(trace: Trace) -> dict[str, tuple[str, float]]:
    """Return what may have been applied to counts -> unit of the result, and unit per count."""
    # The reader's factor, and the response
    stats, units = trace.stats, {}
    if stats.calib not in (0.0, 1.0):
        unit = "m/s2" if _gives_acceleration(trace) else "counts times calib"
        units["apply_calib"] = (unit, abs(float(stats.calib)))
    sensitivity = getattr(stats.get("response"), "instrument_sensitivity", None)
    motion = unit_of_si(getattr(sensitivity, "input_units", ""))
    if sensitivity and motion and sensitivity.value:
        units["remove_sensitivity"] = (motion.name, 1 / abs(float(sensitivity.value)))
    return units


def _gives_acceleration(trace: Trace) -> bool:
    """Return whether ``calib`` gives m/s2: ObsPy's K-NET reader does not name the quantity."""
    return trace.stats.get("quantity") == "acceleration" or "knet" in trace.stats


def _header_peak(trace: Trace) -> float:
    """Return the peak of the header, counts; 0 if there is none."""
    if "header_peak" in trace.stats:
        return float(trace.stats.header_peak or 0.0)
    peak = trace.stats.get("knet", {}).get("accmax") or 0.0
    return float(peak) * GAL / trace.stats.calib if trace.stats.calib else 0.0


def _are_whole(samples: FloatArray, factor: float) -> bool:
    """
    Return whether samples times a factor are whole numbers but for their mean and a line.

    Second differences are free of both. They must not be zeros alone. Samples that are not finite,
    which are rejected elsewhere, count as whole.
    """
    # Around the peak, where steps are largest
    first = max(int(np.abs(samples).argmax()) - AROUND_PEAK, 0)
    if np.issubdtype(samples.dtype, np.integer) and factor == 1.0:
        return True
    part = samples[first : first + 2 * AROUND_PEAK].astype(np.float64) * factor
    if not np.isfinite(part).all():
        return True
    if np.array_equal(part, np.round(part)):
        return bool(part.any()) or factor == 1.0
    bends = np.diff(part, 2)
    nearest = np.round(bends)
    is_near = np.abs(bends - nearest) < OFF_WHOLE
    return bool(np.count_nonzero(nearest) >= FEWEST_STEPS and is_near.mean() >= MOSTLY_WHOLE)


def in_acceleration(trace: Trace, gain_tolerance: float) -> Trace:
    """
    Return a copy in m/s2; a record that is physical already stays as it is.

    Counts are deconvolved with the full response where the metadata have one, without a water
    level, which would distort accelerometers; the pre-filter does not change accelerometers at low
    frequency, where their response is flat. Without stages the overall sensitivity divides; without
    any response the factor ``calib`` multiplies, if the reader gives ``quantity = "acceleration"``.
    Rejected are unknown units, and a response whose product of stage gains is farther from the
    overall sensitivity than a relative tolerance.

    References
    ----------
    Havskov & Alguacil 2016, Instrumentation in Earthquake Seismology, chapter 6.
    """
    units = trace.stats.get("units", "counts")
    if units == "m/s2":
        return trace
    if units != "counts":
        problem = f"units {units!r}, needs m/s2 or counts with a response"
        if units == "m/s":
            problem += "; remove_response with output='ACC', or differentiate"
        raise RecordRejected(trace.id, problem)
    out = _convert(trace, gain_tolerance)
    # The response describes counts, which these samples no longer are
    out.stats.pop("response", None)
    out.stats.calib, out.stats.units, out.stats.quantity = 1.0, "m/s2", "acceleration"
    return out


def _convert(trace: Trace, tolerance: float) -> Trace:
    """Return a copy of counts with samples in m/s2, by what the metadata have."""
    # The full response, its value at one frequency, or the factor of the reader
    response = trace.stats.get("response")
    if response is not None:
        response = with_overall_sensitivity(response)
    if response is None or response.instrument_sensitivity is None:
        calib = trace.stats.calib
        if not _gives_acceleration(trace) or calib == 1.0:
            raise RecordRejected(trace.id, "counts without a response or a calibration factor")
        step = f"multiplied by calib {calib:g} m/s2"
        return with_note(trace, step, trace.data * calib, conversion="calibration factor")
    # One that does not contradict itself
    _require_consistent(trace, response, tolerance)
    unit, response, findings = _response_of_sensor(trace, response)
    trace = judge(trace, findings)
    if any(type(stage) is not ResponseStage for stage in response.response_stages):
        if unit == "m/s":
            _require_flat(trace, response)
        return _deconvolve(trace, response, LOW_BANDS[unit])
    if unit != "m/s2":
        raise RecordRejected(
            trace.id, "a velocity sensor with an overall sensitivity but no response stages"
        )
    sensitivity = response.instrument_sensitivity.value
    return with_note(
        trace,
        f"divided by sensitivity {sensitivity:g} counts/(m/s2)",
        trace.data / sensitivity,
        conversion="sensitivity",
    )


def with_overall_sensitivity(response: Response) -> Response:
    """
    Return a response with an overall sensitivity, which is optional in StationXML.

    It is the product of the gains of the stages, as in ObsPy. Unchanged where it is there already,
    or where no stage has a gain.
    """
    stages = response.response_stages
    gains = [stage.stage_gain for stage in stages if stage.stage_gain is not None]
    if response.instrument_sensitivity is not None or not gains:
        return response
    # A shallow copy: the stages stay those of the input
    out = copy(response)
    out.instrument_sensitivity = InstrumentSensitivity(
        float(np.prod(gains)),
        stages[0].stage_gain_frequency or 0.0,
        next((stage.input_units for stage in stages if stage.input_units), None),
        stages[-1].output_units,
    )
    return out


def _response_of_sensor(
    trace: Trace, response: Response
) -> tuple[str, Response, Iterable[Finding]]:
    """
    Return the unit of ground motion of a response, the response with that unit, and warnings.

    Instrument code N is an accelerometer. Where StationXML names M/S for it and its poles and zeros
    pass a constant motion, the name is wrong: a sensor of velocity has no such response, as it
    needs moving ground. Its record is then converted as acceleration, with a warning.
    """
    name = str(response.instrument_sensitivity.input_units)
    motion = unit_of_si(name)
    unit = motion.name if motion else ""
    if unit not in ("m/s2", "m/s"):
        raise RecordRejected(trace.id, f"response from {name!r}, needs M/S**2 or M/S")
    channel = trace.stats.channel.upper()
    if unit == "m/s2" or not (re.fullmatch(SEED_CODE, channel) and channel[1] == "N"):
        return unit, response, ()
    # The first stage with zeros is the sensor
    sensor = next((one for one in response.response_stages if hasattr(one, "zeros")), None)
    if sensor is None or any(abs(zero) < AT_ZERO for zero in sensor.zeros):
        text = f"response from {name!r}, but instrument code N is an accelerometer"
        return unit, response, [Finding("response_units", "warn", text)]
    # Samples and stages stay, the unit is the other one
    text = f"response from {name!r}, but an accelerometer (code N) flat to zero frequency"
    out = deepcopy(response)
    out.instrument_sensitivity.input_units = out.response_stages[0].input_units = "M/S**2"
    return "m/s2", out, [Finding("response_units", "warn", f"{text}: taken as M/S**2")]


def _require_consistent(trace: Trace, response: Response, tolerance: float) -> None:
    """Reject a trace whose stage gains contradict the overall sensitivity."""
    overall = response.instrument_sensitivity.value
    gains = [stage.stage_gain for stage in response.response_stages if stage.stage_gain is not None]
    product = float(np.prod(gains)) if gains else overall
    # A sensitivity of 0 or None contradicts every gain
    if not overall or not abs(product / overall - 1) <= tolerance:
        raise RecordRejected(
            trace.id,
            f"product of stage gains {product:g}, overall sensitivity {overall!r}: "
            f"more than {tolerance:.0%} apart",
        )


def _require_flat(trace: Trace, response: Response) -> None:
    """Reject an accelerometer, by its code, whose response is that of a velocity sensor."""
    if not ACCELEROMETER.fullmatch(trace.stats.channel):
        return
    try:
        low, high = np.abs(response.get_evalresp_response_for_frequencies(FLAT_BAND, "ACC"))
    except (ValueError, NotImplementedError, ArithmeticError):
        return  # refused when it is removed
    if low > FLAT * high:
        units, ends = response.instrument_sensitivity.input_units, "from {:g} to {:g} Hz"
        raise RecordRejected(
            trace.id,
            f"response from {units} of an accelerometer: its response to acceleration falls "
            f"{low / high:.2g} times {ends.format(*FLAT_BAND)} (M/S in place of M/S**2?)",
        )


def _deconvolve(trace: Trace, response: Response, low: tuple[float, float]) -> Trace:
    """Divide by the response in the frequency domain; the pre-filter rises in a low band, Hz."""
    # ObsPy's signal processing loads SciPy's and pyplot: a fifth of what a run loads at its start,
    # of which only its workers have need
    from obspy.signal.invsim import cosine_sac_taper

    band = _pre_filter(low, trace.stats.sampling_rate / 2)
    # Zeros behind the record take up samples that the filter moves around
    count, dt = trace.stats.npts, trace.stats.delta
    length = next_fast_len(count + min(count, round(LONGEST_PAD / dt)), real=True)
    step = 1 / (length * dt)
    try:
        response_at = _interpolated(response, step, length // 2 * step)
    except (ValueError, NotImplementedError, ArithmeticError) as fault:
        raise RecordRejected(trace.id, f"response cannot be evaluated: {fault}") from fault
    spectrum = _padded_spectrum(trace.data, length)
    # Taper and response of a day would take more memory than the record: block by block
    for block in blocks(0, spectrum.size):
        frequencies = step * np.arange(block.start, block.stop)
        spectrum[block] *= cosine_sac_taper(frequencies, flimit=band)
        spectrum[block] /= response_at(frequencies)
    # Back in time, without the zeros
    samples = irfft(spectrum, length, overwrite_x=True)[:count].copy()
    forget_plans(length)
    note = f"response removed, pre-filter {band} Hz"
    return with_note(trace, note, samples, conversion="response")


def _pre_filter(low: tuple[float, float], nyquist: float) -> tuple[float, float, float, float]:
    """Return the frequencies between which the pre-filter rises and falls, Hz."""
    return (*low, NYQUIST_BAND[0] * nyquist, NYQUIST_BAND[1] * nyquist)


def _padded_spectrum(samples: FloatArray, length: int) -> NDArray[np.complex128]:
    """Return the spectrum of samples without their mean, with zeros up to a length behind."""
    padded = np.zeros(length)
    np.subtract(samples, samples.mean(), out=padded[: samples.size])
    return np.asarray(rfft(padded, overwrite_x=True))


def _interpolated(
    response: Response, low: float, high: float
) -> Callable[[FloatArray], NDArray[np.complex128]]:
    """
    Return the response to acceleration, counts/(m/s2), interpolated from a thousand frequencies.

    Evaluating every line took two thirds of the whole chain. Logarithm of amplitude and phase are
    smooth: the difference is below 1e-8 up to 0.9 of the Nyquist frequency. The value at frequency
    0 is that of the first line.
    """
    # Frequencies that resolve both logarithmic and linear changes
    logarithmic, linear = np.geomspace(low, high, 200), np.linspace(high / 1000, high, 1000)
    lines = np.unique(np.concatenate((logarithmic, linear)))
    values = response.get_evalresp_response_for_frequencies(lines, output="ACC")
    if not np.all(np.abs(values) > 0):
        raise ValueError("it is zero at some frequency")
    # Logarithm of the response: amplitude as real part, phase as imaginary part
    logarithm = np.log(np.abs(values)) + 1j * np.unwrap(np.angle(values))
    smooth = CubicSpline(lines, logarithm)
    return lambda values: np.asarray(np.exp(smooth(np.maximum(values, low))))
