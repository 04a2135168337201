"""Band-limited interpolation of a record, before spectra at periods close to its interval."""

from typing import NamedTuple

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray


class Interpolated(NamedTuple):
    """A record with more samples, m/s², and the time between them, s."""

    acceleration: FloatArray
    dt: float


def band_limited(acceleration: ArrayLike, dt: float, factor: int = 8) -> Interpolated:
    """
    Interpolate a record so that its straight lines stay close to the band-limited motion.

    Parameters
    ----------
    acceleration : (n_samples,) array_like
        Ground acceleration, m/s², that starts and ends near zero.
    dt : float
        Time between samples, s.
    factor : int
        New samples for each old one, at least 2.

    Returns
    -------
    Interpolated
        Acceleration ``((n_samples - 1) * factor + 1,)``, m/s², and ``dt / factor``, s.

    Raises
    ------
    ValueError
        If an argument is not finite, out of range or of the wrong shape.

    Notes
    -----
    Straight lines between samples act on the record as a low-pass ``sinc²(f dt)``: 1 - 1.6 (f dt)²
    at low frequencies, an error of the spectra of 10 % at T = 4 dt. The record is padded with zeros
    to twice its length against wrapping round, interpolated by its Fourier transform, and divided
    by ``sinc²(f dt / factor)``, the low-pass of the new straight lines. Old samples are changed by
    this division.

    Examples
    --------
    >>> record = np.sin(np.arange(5) * np.pi / 4)
    >>> band_limited(record, 0.02, 4).dt
    0.005
    """
    record = checks.record("acceleration", acceleration)
    dt = checks.number("dt", dt, checks.positive)
    if checks.number("factor", factor, checks.finite) != int(factor) or factor < 2:
        raise ValueError(f"factor must be a whole number of at least 2, got {factor}")

    # Zeros to twice the length; the Nyquist frequency is shared between both signs
    size = next_fast_len(2 * record.size, real=True)
    size += size % 2
    spectrum = rfft(record, size)
    spectrum[-1] *= 0.5

    # The new straight lines act as sinc²(f dt / factor), which is taken out beforehand
    spectrum /= np.sinc(np.arange(spectrum.size) / (size * factor)) ** 2
    dense = irfft(spectrum, size * int(factor)) * factor
    samples = (record.size - 1) * int(factor) + 1
    return Interpolated(np.ascontiguousarray(dense[:samples]), dt / int(factor))
