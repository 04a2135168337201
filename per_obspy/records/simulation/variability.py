"""
Variability of a simulated ground motion between places and between frequencies.

The logarithm of the Fourier spectrum at a place is that of the source, path and site model plus a
Gaussian random field. Its correlation decays exponentially with the distance between places and
with the logarithm of the ratio of two frequencies. The field is a sum of waves whose numbers have
the spectral density of that correlation, so that its value at a place depends on no other place.
"""

import numpy as np

from per_obspy.checks import FloatArray

#: Decay length of the correlation in ln frequency. Response spectra at 1 and 2 s then have a
#: correlation near 0.75, at 0.2 and 2 s near 0.4, as residuals of recorded ones have (Baker &
#: Jayaram 2008, Earthquake Spectra 24, 299-317).
FREQUENCY_LENGTH = 1.2

#: Waves of the sum; the marginal distribution is then normal within 0.2 % of the kurtosis.
WAVES = 1000

#: Frequencies per e-fold at which the sum is evaluated; values between are interpolated.
PER_FOLD = 8

#: Lowest and highest frequency of the field, Hz; it is constant beyond.
FREQUENCIES = (0.01, 100.0)


def log_variation(
    generator: np.random.Generator, place: tuple[float, float], reach: float, frequency: FloatArray
) -> FloatArray:
    """
    Compute the standard normal random field at a place.

    Parameters
    ----------
    generator : Generator
        Random numbers of the field: those of every place of an earthquake in the same state.
    place : (float, float)
        East and north of any fixed point, m.
    reach : float
        Distance at which the correlation has fallen to 0.05, m (``exp(-3 h / reach)``, as Jayaram &
        Baker 2009 define it).
    frequency : (n,) ndarray
        Hz.

    Returns
    -------
    variation : (n,) ndarray
        Dimensionless, of mean 0 and standard deviation 1 over all fields.
    """
    share, direction, slope, phase = generator.random((4, WAVES))
    at_place = _numbers_in_the_plane(share, direction, reach) @ np.array(place)
    # Wave numbers in ln frequency: a Cauchy distribution
    along = np.tan(np.pi * (slope - 0.5)) / FREQUENCY_LENGTH
    lowest, highest = np.log(FREQUENCIES)
    nodes = np.linspace(lowest, highest, round(PER_FOLD * (highest - lowest)) + 1)
    waves = np.cos(at_place[:, None] + along[:, None] * nodes + 2.0 * np.pi * phase[:, None])
    # The sum at the nodes, then between them
    field = np.sqrt(2.0 / WAVES) * waves.sum(axis=0)
    logs = np.log(np.clip(frequency, *FREQUENCIES))
    variation: FloatArray = np.interp(logs, nodes, field)
    return variation


def _numbers_in_the_plane(share: FloatArray, direction: FloatArray, reach: float) -> FloatArray:
    """Return wave numbers to east and north, 1/m, (n, 2): those of ``exp(-3 h / reach)``."""
    radial = np.sqrt((1.0 - share) ** -2 - 1.0) * 3.0 / reach
    angle = 2.0 * np.pi * direction
    return np.stack([radial * np.cos(angle), radial * np.sin(angle)], axis=1)
