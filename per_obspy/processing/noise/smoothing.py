"""Konno-Ohmachi smoothing of spectra by a sparse matrix, computed once per grid."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from per_obspy.checks import FloatArray

#: Most spectral lines whose weights are stored for the next record: they take 600 bytes a line.
MOST_STORED = 2**17 + 1


def konno_ohmachi(
    amplitudes: FloatArray, step: float, centres: tuple[float, ...], bandwidth: float
) -> FloatArray:
    r"""
    Smooth spectra with a window of constant width on a logarithmic axis.

    .. math:: w(f) = \left[ \frac{\sin(b \log_{10}(f/f_c))}{b \log_{10}(f/f_c)} \right]^4

    Parameters
    ----------
    amplitudes : (..., n_frequencies) ndarray
        At 0, step, 2 step, ...; any unit.
    step : float
        Between frequencies, Hz.
    centres : tuple of float
        Frequencies of the smoothed spectrum, Hz; hashable, because the weights are cached.
    bandwidth : float
        b, dimensionless.

    Returns
    -------
    (..., n_centres) ndarray
        In the unit of the amplitudes.

    Notes
    -----
    Only the main lobe is used: the side lobes weigh at most 0.2 % of it.

    References
    ----------
    Konno & Ohmachi 1998, Bull. Seism. Soc. Am. 88, 228-241, eq. (4).
    """
    count = amplitudes.shape[-1]
    if count > MOST_STORED:
        return _by_windows(amplitudes, step, centres, bandwidth)
    weights = _weights(count, step, centres, bandwidth)
    return np.asarray((weights @ amplitudes.T).T)


def _by_windows(
    amplitudes: FloatArray, step: float, centres: tuple[float, ...], bandwidth: float
) -> FloatArray:
    """Smooth long spectra with one window at a time: all of them take gigabytes."""
    smooth = np.empty((*amplitudes.shape[:-1], len(centres)))
    # The lines of a centre follow each other
    for place, centre in enumerate(centres):
        lines, weights = _window(amplitudes.shape[-1], step, centre, bandwidth)
        smooth[..., place] = amplitudes[..., lines[0] : lines[-1] + 1] @ weights
    return smooth


@lru_cache(maxsize=8)
def _weights(count: int, step: float, centres: tuple[float, ...], bandwidth: float) -> csr_array:
    """Return the weights of the spectral lines, one row per centre, each row of sum 1."""
    columns, values, ends = [], [], [0]
    for centre in centres:
        lines, weights = _window(count, step, centre, bandwidth)
        values.append(weights)
        columns.append(lines)
        ends.append(ends[-1] + lines.size)
    # Compressed sparse rows
    stored = np.concatenate(values), np.concatenate(columns), ends
    return csr_array(stored, shape=(len(centres), count))


def _window(
    count: int, step: float, centre: float, bandwidth: float
) -> tuple[NDArray[np.int64], FloatArray]:
    """Return the spectral lines of one centre and their weights, of sum 1."""
    lines = _lines(count, step, centre, bandwidth)
    # Eq. (4) of Konno & Ohmachi; equal weights where it vanishes at every line
    window = np.sinc(bandwidth * np.log10(lines * step / centre) / np.pi) ** 4
    total = window.sum()
    return lines, window / total if total > 0 else np.full(lines.size, 1 / lines.size)


def _lines(count: int, step: float, centre: float, bandwidth: float) -> NDArray[np.int64]:
    """Return the spectral lines in the main lobe around a centre, Hz, or the nearest line."""
    lobe = 10 ** (np.pi / bandwidth)
    first = max(int(np.ceil(centre / lobe / step)), 1)
    last = min(int(centre * lobe / step), count - 1)
    # Below the first lines the main lobe may hold none
    if last >= first:
        return np.arange(first, last + 1)
    return np.array([min(max(round(centre / step), 1), count - 1)])
