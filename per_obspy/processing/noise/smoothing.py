"""Konno-Ohmachi smoothing of spectra, as a sparse matrix that is made once for a grid and kept."""

from functools import lru_cache

import numpy as np
from scipy.sparse import csr_array

from per_obspy.checks import FloatArray


def konno_ohmachi(
    amplitudes: FloatArray, step: float, centres: tuple[float, ...], bandwidth: float = 20.0
) -> FloatArray:
    r"""
    Return spectra smoothed with a window of constant width on a logarithmic axis.

    .. math:: w(f) = \left[ \frac{\sin(b \log_{10}(f/f_c))}{b \log_{10}(f/f_c)} \right]^4

    Parameters
    ----------
    amplitudes : (..., n_frequencies) ndarray
        At 0, step, 2 step, ...; any unit.
    step : float
        Between frequencies, Hz.
    centres : tuple of float
        Where the smoothed spectrum is wanted, Hz; hashable, because the weights are kept.
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
    weights = _weights(amplitudes.shape[-1], step, centres, bandwidth)
    return np.asarray((weights @ amplitudes.T).T)


@lru_cache(maxsize=8)
def _weights(count: int, step: float, centres: tuple[float, ...], bandwidth: float) -> csr_array:
    lobe = 10 ** (np.pi / bandwidth)
    columns, values, ends = [], [], [0]
    for centre in centres:
        first = max(int(np.ceil(centre / lobe / step)), 1)
        last = min(int(centre * lobe / step), count - 1)
        lines = (
            np.arange(first, last + 1)
            if last >= first
            else np.array([min(max(round(centre / step), 1), count - 1)])
        )
        window = np.sinc(bandwidth * np.log10(lines * step / centre) / np.pi) ** 4
        values.append(
            window / window.sum() if window.sum() > 0 else np.full(lines.size, 1 / lines.size)
        )
        columns.append(lines)
        ends.append(ends[-1] + lines.size)
    return csr_array(
        (np.concatenate(values), np.concatenate(columns), ends), shape=(len(centres), count)
    )
