"""Conversion of counts to m/s2 by the full response, the sensitivity, or the reader's factor."""

import re
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from obspy import Stream, Trace
from obspy.core.inventory import Response
from obspy.core.inventory.response import ResponseStage
from obspy.signal.invsim import cosine_sac_taper
from scipy.fft import irfft, next_fast_len, rfft
from scipy.interpolate import CubicSpline

from per_obspy.checks import FloatArray
from per_obspy.errors import RecordRejected
from per_obspy.processing.long_records import blocks, forget_plans
from per_obspy.processing.notes import copied, noted

#: Units of the ground motion in a response.
ACCELERATION_UNITS = ("M/S**2", "M/S^2", "M/S/S", "M/SEC**2", "M/(S**2)")
VELOCITY_UNITS = ("M/S", "M/SEC")

#: The pre-filter of velocity sensors rises from 0 to 1 in this band, Hz; that of accelerometers
#: leaves low frequencies unchanged.
VELOCITY_BAND, ACCELERATION_BAND = (0.005, 0.01), (-2.0, -1.0)

#: The pre-filter falls from 1 to 0 in this band, fractions of the Nyquist frequency: above it
#: recorders record no motion, and dividing by a response near zero makes noise.
NYQUIST_BAND = (0.8, 0.9)


#: Codes of accelerometers, and frequencies, Hz, between which their response to acceleration falls
#: by no more than this factor: that of a velocity sensor falls 5 times.
ACCELEROMETER, FLAT_BAND, FLAT = re.compile(r"[A-Z]N[A-Z0-9]"), (1.0, 5.0), 2.5

#: Most seconds of zeros behind a record: the response of the filter is much shorter.
LONGEST_PAD = 3600.0


def in_acceleration(stream: Stream, gain_tolerance: float) -> Stream:
    """
    Return a copy in m/s2.

    Physical records pass through. Counts are deconvolved with the full response where the metadata
    have one, without a water level, which would distort accelerometers; the pre-filter does not
    change accelerometers at low frequency, where their response is flat. Without stages the overall
    sensitivity divides; without any response the factor ``calib`` multiplies, if the reader gives
    ``quantity = "acceleration"``.

    Parameters
    ----------
    stream : obspy Stream
    gain_tolerance : float
        Largest relative difference between the product of the stage gains and the overall
        sensitivity.

    Returns
    -------
    obspy Stream

    Raises
    ------
    RecordRejected
        Unknown units, no response, or a response that contradicts itself.

    References
    ----------
    Havskov & Alguacil 2016, Instrumentation in Earthquake Seismology, chapter 6.
    """
    out = copied(stream)
    for trace in out:
        units = trace.stats.get("units", "counts")
        if units not in ("m/s2", "counts"):
            raise RecordRejected(trace.id, f"units {units!r}, needs m/s2 or counts with a response")
        if units == "counts":
            _convert(trace, gain_tolerance)
    return out


def _convert(trace: Trace, tolerance: float) -> None:
    """Convert the copy of a step from counts to m/s2."""
    response = trace.stats.get("response")
    if response is None or response.instrument_sensitivity is None:
        _multiply_calibration(trace)
    else:
        is_accelerometer = _is_accelerometer(trace, response)
        _require_consistent(trace, response, tolerance)
        if any(type(stage) is not ResponseStage for stage in response.response_stages):
            _require_flat(trace, response)
            _deconvolve(trace, ACCELERATION_BAND if is_accelerometer else VELOCITY_BAND)
        elif is_accelerometer:
            _divide_sensitivity(trace, response)
        else:
            raise RecordRejected(
                trace.id, "a velocity sensor with an overall sensitivity but no response stages"
            )
    # The response describes counts, which these samples no longer are
    trace.stats.pop("response", None)
    trace.stats.calib = 1.0
    trace.stats.units, trace.stats.quantity = "m/s2", "acceleration"


def _multiply_calibration(trace: Trace) -> None:
    """Multiply by the reader's factor, if it is one to acceleration."""
    # ObsPy's K-NET reader gives m/s2 without naming the quantity
    is_known = trace.stats.get("quantity") == "acceleration" or "knet" in trace.stats
    if not is_known or trace.stats.calib == 1.0:
        raise RecordRejected(trace.id, "counts without a response or a calibration factor")
    trace.data = trace.data * trace.stats.calib
    noted(trace, f"multiplied by calib {trace.stats.calib:g} m/s2", conversion="calibration factor")


def _is_accelerometer(trace: Trace, response: Response) -> bool:
    """Return whether a response is one to acceleration; reject other units than velocity."""
    units = str(response.instrument_sensitivity.input_units).upper()
    if units not in ACCELERATION_UNITS + VELOCITY_UNITS:
        raise RecordRejected(trace.id, f"response from {units!r}, needs M/S**2 or M/S")
    return units in ACCELERATION_UNITS


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
    units = str(response.instrument_sensitivity.input_units)
    is_doubtful = units.upper() in VELOCITY_UNITS and ACCELEROMETER.fullmatch(trace.stats.channel)
    try:
        low, high = (
            np.abs(response.get_evalresp_response_for_frequencies(FLAT_BAND, "ACC"))
            if is_doubtful
            else (1.0, 1.0)
        )
    except (ValueError, NotImplementedError, ArithmeticError):
        return  # refused when it is removed
    if low > FLAT * high:
        ends = f"from {FLAT_BAND[0]:g} to {FLAT_BAND[1]:g} Hz"
        raise RecordRejected(
            trace.id,
            f"response from {units} of an accelerometer: its response to acceleration falls "
            f"{low / high:.2g} times {ends} (M/S in place of M/S**2?)",
        )


def _divide_sensitivity(trace: Trace, response: Response) -> None:
    """Divide by the overall sensitivity."""
    sensitivity = response.instrument_sensitivity.value
    trace.data = trace.data / sensitivity
    noted(trace, f"divided by sensitivity {sensitivity:g} counts/(m/s2)", conversion="sensitivity")


def _deconvolve(trace: Trace, low: tuple[float, float]) -> None:
    """Divide by the response in the frequency domain; the pre-filter rises in a low band, Hz."""
    band = _pre_filter(low, trace.stats.sampling_rate / 2)
    # Zeros behind the record take up samples that the filter moves around
    count, dt = trace.stats.npts, trace.stats.delta
    length = next_fast_len(count + min(count, round(LONGEST_PAD / dt)), real=True)
    step = 1 / (length * dt)
    try:
        response_at = _interpolated(trace.stats.response, step, length // 2 * step)
    except (ValueError, NotImplementedError, ArithmeticError) as fault:
        raise RecordRejected(trace.id, f"response cannot be evaluated: {fault}") from fault
    # Taper and response of a day would take more memory than the record: block by block
    spectrum = _padded_spectrum(trace.data, length)
    for block in blocks(0, spectrum.size):
        frequencies = step * np.arange(block.start, block.stop)
        spectrum[block] *= cosine_sac_taper(frequencies, flimit=band)
        spectrum[block] /= response_at(frequencies)
    # Back in time, without the zeros
    trace.data = irfft(spectrum, length, overwrite_x=True)[:count].copy()
    forget_plans(length)
    noted(trace, f"response removed, pre-filter {band} Hz", conversion="response")


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
