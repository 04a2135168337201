"""
Corners of the filter and the usable periods that follow from them.

A corner comes from noise, displacement, sampling or the fallback table; the two horizontals of an
instrument share the narrower band.
"""

from typing import NamedTuple

import numpy as np
from obspy import Stream, Trace

from per_obspy.processing.filter.displacement_drift import clean_highpass, displacement_drift
from per_obspy.processing.noise.signal_to_noise import NoiseSpectra, noise_spectra
from per_obspy.processing.notes import copied, noted, remembered

#: Highest low-pass corner, fraction of the Nyquist frequency.
LOWPASS_OF_NYQUIST = 0.75

#: Fewest samples of noise of which a spectrum can be computed.
FEWEST_NOISE_SAMPLES = 4

#: Sampling intervals in the shortest usable period.
SAMPLES_PER_PERIOD = 5

#: Parts of the reasons of corners that neither the noise of the record nor its header gives.
SILENT_HEADER, FROM_TABLE, FROM_CONSTANT = "the header is silent", "table: no noise", "constant: "
ASSUMED_REASONS = (SILENT_HEADER, FROM_TABLE, FROM_CONSTANT)

#: Part of the reason of a corner that was raised as far as allowed.
SHIFTED_BASELINE = "the baseline shifts during the shaking"


class Corner(NamedTuple):
    """A corner, Hz, and the reason for it."""

    frequency: float
    reason: str


def measured_noise(trace: Trace, bandwidth: float) -> NoiseSpectra | None:
    """
    Return the spectra of signal and noise of a record without its baseline.

    None where no noise is recorded.
    """
    seconds = float(trace.stats.per_obspy.get("noise", 0.0))
    if seconds < FEWEST_NOISE_SAMPLES * trace.stats.delta:
        return None
    return noise_spectra(trace.data, trace.stats.delta, seconds, bandwidth)


def fallback_highpass(
    magnitude: float | None, by_magnitude: dict[float, float], unknown: float
) -> Corner:
    """
    Return the high-pass corner of a record without measurable noise.

    Parameters
    ----------
    magnitude : float or None
        Of the event.
    by_magnitude : dict
        Smallest magnitude -> corner, Hz.
    unknown : float
        Corner without a magnitude, Hz.

    Returns
    -------
    Corner

    Examples
    --------
    >>> fallback_highpass(6.1, {-10.0: 0.5, 3.5: 0.3, 5.5: 0.1}, 0.08).frequency
    0.1
    """
    if magnitude is None:
        return Corner(unknown, f"{FROM_CONSTANT}neither noise nor magnitude known")
    reached = [size for size in by_magnitude if magnitude >= size]
    if not reached:
        return Corner(unknown, f"{FROM_CONSTANT}the magnitude is below the table")
    # The row, not the magnitude: an update within the row changes no record
    reason = f"{FROM_TABLE} recorded, magnitude from {max(reached):g}"
    return Corner(by_magnitude[max(reached)], reason)


def lowest_highpass(trace: Trace) -> Corner:
    """Return the high-pass corner with one cycle in the record."""
    return Corner(1 / (trace.stats.npts * trace.stats.delta), "one cycle in the record")


def highest_corner(trace: Trace, highest_lowpass: float) -> Corner:
    """Return the highest low-pass corner that sampling allows."""
    nyquist = trace.stats.sampling_rate / 2
    by_sampling = Corner(LOWPASS_OF_NYQUIST * nyquist, "0.75 Nyquist")
    return min(Corner(highest_lowpass, "largest allowed"), by_sampling)


def clean_corner(
    tapered: Trace, lowest: Corner, highest: float, target: float, order: int
) -> Corner | None:
    """
    Return the lowest high-pass corner whose displacement is clean, or None if no corner is.

    Parameters
    ----------
    tapered : obspy Trace
        Without its baseline, m/s2.
    lowest : Corner
        Allowed by noise and duration.
    highest, target, order
        As in `clean_highpass` and `displacement_drift`.

    Returns
    -------
    Corner or None
    """
    highest = max(highest, lowest.frequency)
    drift = displacement_drift(tapered.data, tapered.stats.delta, lowest.frequency, order)
    frequency = clean_highpass(drift, lowest.frequency, highest, target)
    if frequency is None:
        return None
    if np.isclose(frequency, lowest.frequency):
        return lowest
    return Corner(frequency, "displacement polynomial")


def corners_shared(stream: Stream) -> Stream:
    """
    Return a copy whose traces all have the narrowest of their bands.

    Parameters
    ----------
    stream : obspy Stream
        The two horizontals of an instrument, with ``highpass``, ``lowpass`` (Hz) and their
        ``_source`` in ``stats.per_obspy``.

    Returns
    -------
    obspy Stream
        With shared corners; ``own_highpass`` and ``own_lowpass`` are those before.
    """
    out = copied(stream)
    for name, narrowest in (("highpass", max), ("lowpass", min)):
        shared = narrowest((trace.stats.per_obspy[name] for trace in out), default=0.0)
        for trace in out:
            own = trace.stats.per_obspy[name]
            remembered(trace, **{f"own_{name}": own, name: shared})
            # Only a corner that changed has a new source
            if own != shared:
                step = f"{name} {shared:.4g} Hz shared with the other horizontal"
                noted(trace, step, **{f"{name}_source": "shared"})
    return out


def usable_periods_noted(stream: Stream, usable: float) -> Stream:
    """
    Return a copy with the usable periods of each trace, from its corners.

    Longest: usable / highpass, or the period from which on PER depends on when the baseline
    shifted, the shorter. Shortest: 1 / (usable lowpass) or 5 sampling intervals, the longer.

    Parameters
    ----------
    stream : obspy Stream
        ``stats.per_obspy`` has ``highpass`` and ``lowpass``, Hz, and may have
        ``certain_period``, s.
    usable : float
        Fraction of a corner's period that is usable, dimensionless.

    Returns
    -------
    obspy Stream
        With ``longest_period`` and ``shortest_period``, s, in ``stats.per_obspy``.

    References
    ----------
    Boore 2004, J. Earthq. Eng. 8, 193-207; Akkar & Bommer 2006, Earthq. Eng. Struct. Dyn. 35,
    1275-1299.
    """
    out = copied(stream)
    for trace in out:
        corners = trace.stats.per_obspy
        longest = min(usable / corners.highpass, corners.get("certain_period", np.inf))
        shortest = max(1 / (usable * corners.lowpass), SAMPLES_PER_PERIOD * trace.stats.delta)
        # Spectra are computed at all periods and marked as usable between these two
        step = f"usable from {shortest:.3g} to {longest:.3g} s"
        noted(trace, step, shortest_period=shortest, longest_period=longest)
    return out
