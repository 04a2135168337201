"""Spectra of signal and noise of a record, and the band in which the signal clears the noise."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.fft import rfft
from scipy.ndimage import minimum_filter1d
from scipy.sparse import csr_array

from per_obspy.checks import FloatArray
from per_obspy.processing.series import runs, significant_samples

#: Smoothed spectral values per decade of frequency, and the lowest frequency, Hz.
CENTRES_PER_DECADE, LOWEST_FREQUENCY = 40, 0.001

#: Share of a window that its cosine tapers cover.
TAPERED = 0.1

#: Most spectral lines whose weights are stored for the next record: they take 600 bytes a line.
MOST_STORED = 2**17 + 1


class NoiseSpectra(NamedTuple):
    """Smoothed Fourier amplitudes of signal and noise, (n_frequencies,)."""

    #: logarithmically spaced, Hz
    frequencies: FloatArray
    #: amplitudes, m/s; the noise scaled to the length of the signal
    signal: FloatArray
    noise: FloatArray

    @property
    def ratio(self) -> FloatArray:
        """Return signal to noise, dimensionless; infinite where there is no noise."""
        with np.errstate(divide="ignore"):
            return np.asarray(self.signal / self.noise)

    def within(self, low: float, high: float) -> "NoiseSpectra":
        """Return the spectra between two frequencies, Hz."""
        inside = (self.frequencies >= low) & (self.frequencies <= high)
        return NoiseSpectra(*(values[inside] for values in self))


def noise_spectra(
    acceleration: FloatArray, dt: float, onset: float, bandwidth: float
) -> NoiseSpectra:
    """
    Compute the smoothed spectra of the noise before the onset and of the shaking after it.

    The signal lasts until 95 % of the squared acceleration after the onset, which is at least 2 dt
    from the first sample, s. Noise is stationary, so that its amplitude grows with the root of the
    window's length: it is scaled to the length of the signal. Below one cycle in the noise window
    the noise is unknown: its lowest resolved amplitude is carried on. The acceleration, m/s2, is
    without its baseline; the bandwidth is that of the Konno-Ohmachi window, dimensionless.
    """
    # Noise before the onset, significant shaking after it
    noise, shaking = np.split(acceleration, [round(onset / dt)])
    noise, signal = noise - noise.mean(), shaking[: significant_samples(shaking)]
    # Amplitudes of both at the same frequencies; few lengths, so that smoothing weights are reused
    length = 2 ** (2 * max(noise.size, signal.size) - 1).bit_length()
    frequencies = _centres(0.5 / dt)
    centres = tuple(frequencies.tolist())

    def smooth(part: FloatArray) -> FloatArray:
        amplitudes = dt * np.abs(rfft(_tapered(part), length))
        return konno_ohmachi(amplitudes, 1 / (length * dt), centres, bandwidth)

    # Noise over the length of the signal; carried on below one cycle in its window
    scaled = smooth(noise) * np.sqrt(signal.size / noise.size)
    resolved = min(int(np.searchsorted(frequencies, 1 / (noise.size * dt))), frequencies.size - 1)
    scaled[:resolved] = np.maximum(scaled[:resolved], scaled[resolved])
    return NoiseSpectra(frequencies, smooth(signal), scaled)


def _tapered(part: FloatArray) -> FloatArray:
    """Return samples that rise from zero and end there."""
    from scipy.signal.windows import tukey  # in workers only, see instrument_response

    return np.asarray(part * tukey(part.size, TAPERED))


def _centres(nyquist: float) -> FloatArray:
    """Return the frequencies of smoothed spectra up to the Nyquist frequency, Hz."""
    count = int(CENTRES_PER_DECADE * np.log10(nyquist / LOWEST_FREQUENCY)) + 1
    return np.geomspace(LOWEST_FREQUENCY, nyquist, count)


def clear_band(spectra: NoiseSpectra, threshold: float) -> tuple[float, float] | None:
    """Return the widest band, Hz, whose signal to noise reaches a threshold; None without any."""
    starts, stops = runs(spectra.ratio >= threshold)
    if not starts.size:
        return None
    # In octaves: the frequencies are logarithmically spaced
    widest = int((stops - starts).argmax())
    low, high = spectra.frequencies[[starts[widest], stops[widest] - 1]]
    return float(low), float(high)


def sustained_ratio(spectra: NoiseSpectra) -> float:
    """
    Return the largest signal to noise that holds over an octave, dimensionless.

    Single spectral lines may exceed the noise by chance.
    """
    octave = round(CENTRES_PER_DECADE * np.log10(2.0))
    over_octave = minimum_filter1d(spectra.ratio, octave, mode="constant", cval=0.0)
    return float(over_octave.max(initial=0.0))


def konno_ohmachi(
    amplitudes: FloatArray, step: float, centres: tuple[float, ...], bandwidth: float
) -> FloatArray:
    r"""
    Smooth spectra with a window of constant width on a logarithmic axis.

    .. math:: w(f) = \left[ \frac{\sin(b \log_{10}(f/f_c))}{b \log_{10}(f/f_c)} \right]^4

    Amplitudes, (..., n_frequencies), are at 0, step, 2 step ... Hz; the centres f_c, Hz, are a
    tuple, because the weights are cached, and b is the bandwidth. Only the main lobe is used: the
    side lobes weigh at most 0.2 % of it.

    References
    ----------
    Konno & Ohmachi 1998, Bull. Seism. Soc. Am. 88, 228-241, eq. (4).
    """
    count = amplitudes.shape[-1]
    if count <= MOST_STORED:
        return np.asarray((_weights(count, step, centres, bandwidth) @ amplitudes.T).T)
    # Long spectra with one window at a time: all of them take gigabytes
    smooth = np.empty((*amplitudes.shape[:-1], len(centres)))
    for place, centre in enumerate(centres):
        lines, weights = _window(count, step, centre, bandwidth)
        smooth[..., place] = amplitudes[..., lines[0] : lines[-1] + 1] @ weights
    return smooth


@lru_cache(maxsize=8)
def _weights(count: int, step: float, centres: tuple[float, ...], bandwidth: float) -> csr_array:
    """Return the weights of the spectral lines, one row per centre, each row of sum 1."""
    windows = [_window(count, step, centre, bandwidth) for centre in centres]
    columns, values = zip(*windows, strict=True)
    ends = np.cumsum([0, *map(len, columns)])
    # Compressed sparse rows
    stored = np.concatenate(values), np.concatenate(columns), ends
    return csr_array(stored, shape=(len(centres), count))


def _window(
    count: int, step: float, centre: float, bandwidth: float
) -> tuple[NDArray[np.int64], FloatArray]:
    """Return the spectral lines in the main lobe around a centre, Hz, with weights of sum 1."""
    lobe = 10 ** (np.pi / bandwidth)
    first = max(int(np.ceil(centre / lobe / step)), 1)
    last = min(int(centre * lobe / step), count - 1)
    # Below the first lines the main lobe may hold none: the nearest one
    if last < first:
        first = last = min(max(round(centre / step), 1), count - 1)
    lines = np.arange(first, last + 1)
    # Eq. (4) of Konno & Ohmachi; equal weights where it vanishes at every line
    window = np.sinc(bandwidth * np.log10(lines * step / centre) / np.pi) ** 4
    total = window.sum()
    return lines, window / total if total > 0 else np.full(lines.size, 1 / lines.size)
