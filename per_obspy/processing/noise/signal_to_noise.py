"""How far a record stands above its own noise, by frequency."""

from typing import NamedTuple

import numpy as np
from scipy.fft import rfft
from scipy.ndimage import minimum_filter1d
from scipy.signal.windows import tukey

from per_obspy.checks import FloatArray
from per_obspy.processing.noise.smoothing import konno_ohmachi

CENTRES_A_DECADE = 40
SIGNIFICANT = 0.95  # of the squared acceleration


class NoiseSpectra(NamedTuple):
    """
    Smoothed Fourier amplitudes of signal and noise.

    Attributes
    ----------
    frequencies : (n_frequencies,) ndarray
        Logarithmically spaced, Hz.
    signal, noise : (n_frequencies,) ndarray
        Amplitudes, m/s; the noise as it would be over the length of the signal.
    """

    frequencies: FloatArray
    signal: FloatArray
    noise: FloatArray

    @property
    def ratio(self) -> FloatArray:
        """Signal to noise, dimensionless; infinite where there is no noise."""
        with np.errstate(divide="ignore"):
            return np.asarray(self.signal / self.noise)


def noise_spectra(
    acceleration: FloatArray, dt: float, onset: float, bandwidth: float = 20.0
) -> NoiseSpectra:
    """
    Return the smoothed spectra of the noise before the onset and of the shaking after it.

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
        Where the noise ends, s from the first sample; at least 2 dt.
    bandwidth : float
        Of the Konno-Ohmachi window, dimensionless.

    Returns
    -------
    NoiseSpectra
    """
    first = round(onset / dt)
    noise = acceleration[:first] - acceleration[:first].mean()
    signal = acceleration[first : first + significant_samples(acceleration[first:])]
    length = 2 ** int(
        np.ceil(np.log2(2 * max(noise.size, signal.size)))
    )  # few lengths, so that weights are reused
    centres = _centres(dt)
    windows = np.zeros((2, length))
    for row, part in zip(windows, (signal, noise), strict=True):
        row[: part.size] = part * tukey(part.size, 0.1)
    amplitudes = dt * np.abs(rfft(windows))
    smooth = konno_ohmachi(amplitudes, 1 / (length * dt), centres, bandwidth)
    frequencies = np.array(centres)
    scaled = smooth[1] * np.sqrt(signal.size / noise.size)
    resolved = min(int(np.searchsorted(frequencies, 1 / (noise.size * dt))), frequencies.size - 1)
    scaled[:resolved] = np.maximum(scaled[:resolved], scaled[resolved])
    return NoiseSpectra(frequencies, smooth[0], scaled)


def significant_samples(acceleration: FloatArray) -> int:
    """Return how many samples hold 95 % of the squared acceleration, m2/s4, from the first sample on."""
    energy = np.cumsum(acceleration**2)
    return int(np.searchsorted(energy, SIGNIFICANT * energy[-1])) + 1


def _centres(dt: float) -> tuple[float, ...]:
    lowest, nyquist = 0.001, 0.5 / dt
    count = int(CENTRES_A_DECADE * np.log10(nyquist / lowest)) + 1
    return tuple(np.geomspace(lowest, nyquist, count).tolist())


def within(spectra: NoiseSpectra, low: float, high: float) -> NoiseSpectra:
    """Return the spectra between two frequencies, Hz."""
    inside = (spectra.frequencies >= low) & (spectra.frequencies <= high)
    return NoiseSpectra(*(values[inside] for values in spectra))


def clear_band(spectra: NoiseSpectra, threshold: float) -> tuple[float, float] | None:
    """
    Return the widest band (in octaves) in which signal exceeds noise by the threshold.

    Parameters
    ----------
    spectra : NoiseSpectra
    threshold : float
        Signal to noise, dimensionless.

    Returns
    -------
    (low, high) or None
        Hz; None if there is no frequency at which it does.
    """
    clear = np.concatenate(([False], spectra.ratio >= threshold, [False]))
    edges = np.flatnonzero(np.diff(clear))
    if not edges.size:
        return None
    starts, stops = edges[::2], edges[1::2] - 1
    widest = int((stops - starts).argmax())
    return float(spectra.frequencies[starts[widest]]), float(spectra.frequencies[stops[widest]])


def weakest_ratio(spectra: NoiseSpectra, band: tuple[float, float]) -> float:
    """Return the smallest signal to noise inside a band, Hz; dimensionless."""
    return float(within(spectra, *band).ratio.min(initial=np.inf))


def sustained_ratio(spectra: NoiseSpectra) -> float:
    """Return the largest signal to noise that holds over an octave, dimensionless: single lines may stand out."""
    octave = round(CENTRES_A_DECADE * np.log10(2.0))
    return float(
        minimum_filter1d(spectra.ratio, octave, mode="constant", cval=0.0).max(initial=0.0)
    )
