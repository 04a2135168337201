"""Spectra of signal and noise of a record, and the band in which the signal clears the noise."""

from typing import NamedTuple

import numpy as np
from scipy.fft import rfft
from scipy.ndimage import minimum_filter1d
from scipy.signal.windows import tukey

from per_obspy.checks import FloatArray
from per_obspy.processing.noise.smoothing import konno_ohmachi

#: Smoothed spectral values per decade of frequency, and the lowest frequency, Hz.
CENTRES_PER_DECADE, LOWEST_FREQUENCY = 40, 0.001

#: Share of the squared acceleration at which the significant shaking ends.
SIGNIFICANT = 0.95

#: Share of a window that its cosine tapers cover.
TAPERED = 0.1


class NoiseSpectra(NamedTuple):
    """
    Smoothed Fourier amplitudes of signal and noise.

    Attributes
    ----------
    frequencies : (n_frequencies,) ndarray
        Logarithmically spaced, Hz.
    signal, noise : (n_frequencies,) ndarray
        Amplitudes, m/s; the noise scaled to the length of the signal.
    """

    frequencies: FloatArray
    signal: FloatArray
    noise: FloatArray

    @property
    def ratio(self) -> FloatArray:
        """Return signal to noise, dimensionless; infinite where there is no noise."""
        with np.errstate(divide="ignore"):
            return np.asarray(self.signal / self.noise)


def noise_spectra(
    acceleration: FloatArray, dt: float, onset: float, bandwidth: float
) -> NoiseSpectra:
    """
    Compute the smoothed spectra of the noise before the onset and of the shaking after it.

    The signal lasts until 95 % of the squared acceleration after the onset. Noise is stationary, so
    that its amplitude grows with the root of the window's length: it is scaled to the length of the
    signal. Below one cycle in the noise window the noise is unknown: its lowest resolved amplitude
    is carried on.

    Parameters
    ----------
    acceleration : (n_samples,) ndarray
        Without its baseline, m/s2.
    dt : float
        Sampling interval, s.
    onset : float
        End of the noise, s from the first sample; at least 2 dt.
    bandwidth : float
        Of the Konno-Ohmachi window, dimensionless.

    Returns
    -------
    NoiseSpectra
    """
    # Noise before the onset, significant shaking after it
    first = round(onset / dt)
    noise = acceleration[:first] - acceleration[:first].mean()
    signal = acceleration[first : first + significant_samples(acceleration[first:])]
    # Amplitudes of both at the same frequencies; few lengths, so that smoothing weights are reused
    length = 2 ** int(np.ceil(np.log2(2 * max(noise.size, signal.size))))
    centres = _centres(dt)
    smooth = [
        konno_ohmachi(_amplitudes(part, dt, length), 1 / (length * dt), centres, bandwidth)
        for part in (signal, noise)
    ]
    # Noise over the length of the signal; carried on below one cycle in its window
    frequencies = np.array(centres)
    scaled = smooth[1] * np.sqrt(signal.size / noise.size)
    resolved = min(int(np.searchsorted(frequencies, 1 / (noise.size * dt))), frequencies.size - 1)
    scaled[:resolved] = np.maximum(scaled[:resolved], scaled[resolved])
    return NoiseSpectra(frequencies, smooth[0], scaled)


def _amplitudes(part: FloatArray, dt: float, length: int) -> FloatArray:
    """Return the Fourier amplitudes of a tapered part of a record with zeros behind it."""
    return np.asarray(dt * np.abs(rfft(part * tukey(part.size, TAPERED), length)))


def significant_samples(acceleration: FloatArray) -> int:
    """Return the number of samples from the first on that have 95 % of the squared motion."""
    energy = np.cumsum(acceleration**2)
    return int(np.searchsorted(energy, SIGNIFICANT * energy[-1])) + 1


def _centres(dt: float) -> tuple[float, ...]:
    """Return the frequencies of smoothed spectra up to the Nyquist frequency, Hz."""
    nyquist = 0.5 / dt
    count = int(CENTRES_PER_DECADE * np.log10(nyquist / LOWEST_FREQUENCY)) + 1
    return tuple(np.geomspace(LOWEST_FREQUENCY, nyquist, count).tolist())


def within(spectra: NoiseSpectra, low: float, high: float) -> NoiseSpectra:
    """Return the spectra between two frequencies, Hz."""
    inside = (spectra.frequencies >= low) & (spectra.frequencies <= high)
    return NoiseSpectra(*(values[inside] for values in spectra))


def clear_band(spectra: NoiseSpectra, threshold: float) -> tuple[float, float] | None:
    """
    Return the widest band (in octaves) with signal to noise above the threshold.

    Parameters
    ----------
    spectra : NoiseSpectra
    threshold : float
        Signal to noise, dimensionless.

    Returns
    -------
    (low, high) or None
        Hz; None if there is no such frequency.
    """
    # Edges of the runs of clear frequencies
    is_clear = np.concatenate(([False], spectra.ratio >= threshold, [False]))
    edges = np.flatnonzero(np.diff(is_clear))
    if not edges.size:
        return None
    starts, stops = edges[::2], edges[1::2] - 1
    widest = int((stops - starts).argmax())
    return float(spectra.frequencies[starts[widest]]), float(spectra.frequencies[stops[widest]])


def weakest_ratio(spectra: NoiseSpectra, band: tuple[float, float]) -> float:
    """Return the smallest signal to noise inside a band, Hz; dimensionless."""
    return float(within(spectra, *band).ratio.min(initial=np.inf))


def sustained_ratio(spectra: NoiseSpectra) -> float:
    """
    Return the largest signal to noise that holds over an octave, dimensionless.

    Single spectral lines may exceed the noise by chance.
    """
    octave = round(CENTRES_PER_DECADE * np.log10(2.0))
    over_octave = minimum_filter1d(spectra.ratio, octave, mode="constant", cval=0.0)
    return float(over_octave.max(initial=0.0))
