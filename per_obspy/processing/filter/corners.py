"""The corners of the filter, from noise, displacement or the fallback table; the two horizontals share them."""

from typing import NamedTuple

import numpy as np
from obspy import Stream, Trace

from per_obspy.processing.filter.displacement_drift import clean_highpass, displacement_drift
from per_obspy.processing.noise.signal_to_noise import NoiseSpectra, noise_spectra
from per_obspy.processing.notes import noted, remembered

LOWPASS_OF_NYQUIST = 0.75


class Corner(NamedTuple):
    """A corner, Hz, and why it is there."""

    frequency: float
    reason: str


def measured_noise(trace: Trace, bandwidth: float) -> NoiseSpectra | None:
    """Return the spectra of signal and noise of a record without its baseline, or None where no noise is recorded."""
    quiet = float(trace.stats.per_obspy.get("noise", 0.0))
    if quiet < 4 * trace.stats.delta:
        return None
    return noise_spectra(trace.data, trace.stats.delta, quiet, bandwidth)


def fallback_highpass(
    magnitude: float | None, by_magnitude: dict[float, float], unknown: float
) -> Corner:
    """
    Return the high-pass corner of a record without noise to measure.

    Parameters
    ----------
    magnitude : float or None
        Of the event.
    by_magnitude : dict
        Magnitude from which on -> corner, Hz.
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
        return Corner(unknown, "constant: neither noise nor magnitude known")
    reached = [size for size in by_magnitude if magnitude >= size]
    if not reached:
        return Corner(unknown, f"constant: magnitude {magnitude:g} is below the table")
    return Corner(by_magnitude[max(reached)], f"table: no noise recorded, magnitude {magnitude:g}")


def lowest_highpass(trace: Trace) -> Corner:
    """Return the corner with one period in the record."""
    return Corner(1 / (trace.stats.npts * trace.stats.delta), "one cycle in the record")


def highest_corner(trace: Trace, highest_lowpass: float) -> Corner:
    """Return the low-pass corner that sampling allows."""
    nyquist = trace.stats.sampling_rate / 2
    return min(
        Corner(highest_lowpass, "largest allowed"),
        Corner(LOWPASS_OF_NYQUIST * nyquist, "0.75 Nyquist"),
    )


def clean_corner(
    tapered: Trace, lowest: Corner, highest: float, target: float, order: int
) -> Corner | None:
    """
    Return the corner from the lowest on whose displacement is clean, or None where no corner up to the highest is.

    Parameters
    ----------
    tapered : obspy Trace
        Without its baseline, m/s2.
    lowest : Corner
        What noise and duration allow.
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
    return (
        lowest
        if np.isclose(frequency, lowest.frequency)
        else Corner(frequency, "displacement polynomial")
    )


def corners_shared(stream: Stream) -> Stream:
    """
    Return a copy whose traces all have the narrowest of their bands; for the two horizontals of an instrument.

    Parameters
    ----------
    stream : obspy Stream
        With ``highpass``, ``lowpass`` (Hz) and their ``_source`` in ``stats.per_obspy``.

    Returns
    -------
    obspy Stream
        The same, shared; ``own_highpass`` and ``own_lowpass`` keep what each would have had.
    """
    out = stream.copy()
    for name, narrowest in (("highpass", max), ("lowpass", min)):
        shared = narrowest((trace.stats.per_obspy[name] for trace in out), default=0.0)
        for trace in out:
            own = trace.stats.per_obspy[name]
            remembered(trace, **{f"own_{name}": own, name: shared})
            if own != shared:
                noted(
                    trace,
                    f"{name} {shared:.4g} Hz shared with the other horizontal",
                    **{f"{name}_source": "shared"},
                )
    return out
