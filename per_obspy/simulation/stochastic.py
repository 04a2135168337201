"""
Ground acceleration by the stochastic method.

It is shaped noise with the spectrum of an omega-squared point source. Every function works on one
site; numbers are SI. Reference for all: Boore (2003), Pure Appl. Geophys. 160, 635-676.

The logarithm of the Fourier spectrum at a place is that of the source, path and site model plus a
Gaussian random field. Its correlation decays exponentially with the distance between places and
with the logarithm of the ratio of two frequencies. The field is a sum of waves whose numbers have
the spectral density of that correlation, so that its value at a place depends on no other place.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from per_obspy.checks import FloatArray

#: Mean radiation pattern of S waves, free surface, partition onto two horizontals (Boore 2003,
#: after eq. 6).
RADIATION, FREE_SURFACE, PARTITION = 0.55, 2.0, 1.0 / np.sqrt(2.0)

#: Distance at which spreading turns from 1/R (body waves) to 1/sqrt(R) (guided waves), m
#: (Raoof and others 1999).
CROSSOVER = 40_000.0

#: Path duration per distance, s/m (Boore 2003, western North America: 0.05 s/km).
PATH_DURATION = 5e-5

#: Frequency in Hz and amplification of generic rock (Boore & Joyner 1997, table 3).
ROCK_FREQUENCY = (0.01, 0.09, 0.16, 0.51, 0.84, 1.25, 2.26, 3.17, 6.05, 16.6, 61.2)
ROCK_AMPLIFICATION = (1.00, 1.10, 1.18, 1.42, 1.58, 1.74, 2.06, 2.25, 2.58, 3.13, 4.00)

#: Decay length of the correlation in ln frequency. Response spectra at 1 and 2 s then have a
#: correlation near 0.75, at 0.2 and 2 s near 0.4, as residuals of recorded ones have (Baker &
#: Jayaram 2008, Earthquake Spectra 24, 299-317).
FREQUENCY_LENGTH = 1.2

#: Waves of the random field: its marginal distribution is then normal within 0.2 % of the kurtosis.
WAVES = 1000

#: Lowest and highest frequency of the field, Hz, beyond which it is constant; frequencies per
#: e-fold at which the sum is evaluated, between which it is interpolated.
FREQUENCIES, PER_FOLD = (0.01, 100.0), 8

#: Saragoni-Hart window: place of its peak and height of its end, as fractions of its length and
#: peak, and its length as a multiple of the duration (Boore 2003, eq. 24-26).
WINDOW_PEAK, WINDOW_END, WINDOW_STRETCH = 0.2, 0.05, 2.0


def seismic_moment(magnitude: float) -> float:
    """Compute the seismic moment in N m (Hanks & Kanamori 1979)."""
    return float(10.0 ** (1.5 * magnitude + 9.05))


class Source(NamedTuple):
    """Shape of a source spectrum with two corners."""

    low_corner: float  # Hz
    high_corner: float  # Hz
    high_share: float  # of the moment, with the high corner, dimensionless


def source_of(magnitude: float) -> Source:
    """Compute the two corners of a source (Atkinson & Silva 2000, eq. 3 to 6; California)."""
    return Source(
        low_corner=10.0 ** (2.181 - 0.496 * magnitude),
        high_corner=10.0 ** (2.410 - 0.408 * magnitude),
        high_share=10.0 ** (0.605 - 0.255 * magnitude),
    )


def effective_distance(hypocentral: float, magnitude: float) -> float:
    """
    Compute the distance in m with near-source saturation of an extended fault.

    Reference: Atkinson & Silva (2000), with which the source was fitted.
    """
    return float(np.hypot(hypocentral, 1000.0 * 10.0 ** (-0.05 + 0.15 * magnitude)))


def source_spectrum(
    frequency: FloatArray, magnitude: float, shear_velocity: float, density: float
) -> FloatArray:
    """
    Compute the acceleration spectrum of the source times distance, m2/s.

    Reference: Boore (2003), eq. 3, 5 and 6; shape of Atkinson & Silva (2000).
    """
    constant = RADIATION * FREE_SURFACE * PARTITION / (4.0 * np.pi * density * shear_velocity**3)
    # each part of the moment has a separate corner
    source = source_of(magnitude)
    low = (1.0 - source.high_share) / (1.0 + (frequency / source.low_corner) ** 2)
    high = source.high_share / (1.0 + (frequency / source.high_corner) ** 2)
    displacement = constant * seismic_moment(magnitude) * (low + high)
    return np.asarray((2.0 * np.pi * frequency) ** 2 * displacement)


def path_spectrum(
    frequency: FloatArray,
    distance: float,
    shear_velocity: float,
    quality: float,
    quality_exponent: float,
) -> FloatArray:
    """
    Compute spreading and anelastic attenuation ``exp(-pi f R / (Q beta))``, 1/m.

    Reference: Boore (2003), eq. 8.
    """
    factor = np.maximum(frequency, 1e-6) ** (1.0 - quality_exponent)
    spreading = 1.0 / distance if distance < CROSSOVER else 1.0 / np.sqrt(distance * CROSSOVER)
    return np.asarray(spreading * np.exp(-np.pi * factor * distance / (quality * shear_velocity)))


def rock_response(frequency: FloatArray, kappa: float) -> FloatArray:
    """Compute the amplification of generic rock and its diminution ``exp(-pi kappa f)``."""
    amplification = np.interp(
        np.log(np.maximum(frequency, 1e-6)), np.log(ROCK_FREQUENCY), ROCK_AMPLIFICATION
    )
    return np.asarray(amplification * np.exp(-np.pi * kappa * frequency))


def kanai_tajimi(frequency: FloatArray, natural: float, damping: float) -> NDArray[np.complex128]:
    """
    Compute the complex, causal transfer function of a soft layer.

    It is that of the absolute acceleration of a damped oscillator.
    """
    ratio = frequency / natural
    return np.asarray((1.0 + 2j * damping * ratio) / (1.0 - ratio**2 + 2j * damping * ratio))


def duration(magnitude: float, distance: float) -> float:
    """
    Compute the duration of shaking in s: half over the low corner, and that of the path.

    Reference: Atkinson & Silva (2000).
    """
    return 0.5 / source_of(magnitude).low_corner + PATH_DURATION * distance


def saragoni_hart_window(n_samples: int, dt: float, shaking: float) -> FloatArray:
    """Compute the Saragoni-Hart window of a duration in s; its maximum is 1."""
    power = -WINDOW_PEAK * np.log(WINDOW_END) / (1.0 + WINDOW_PEAK * (np.log(WINDOW_PEAK) - 1.0))
    time = np.arange(n_samples) * dt / (WINDOW_STRETCH * shaking)
    return np.asarray((math.e / WINDOW_PEAK * time) ** power * np.exp(-power / WINDOW_PEAK * time))


def shaped_noise(
    noise: FloatArray, shape: FloatArray, spectrum: NDArray[np.complex128], dt: float
) -> FloatArray:
    """
    Compute acceleration in m/s2 with the shape of a window and, on average, a spectrum.

    Noise is (n_components, n_samples), Gaussian, with the phase of the result; the spectrum, m/s,
    (n_components, n_samples // 2 + 1), that at the frequencies of ``rfft`` for a step dt in s.
    """
    transform = fft.rfft(noise * shape)
    transform /= np.sqrt(np.mean(np.abs(transform) ** 2, axis=-1, keepdims=True))
    return np.asarray(fft.irfft(transform * spectrum, n=noise.shape[-1]) / dt)


def log_variation(
    generator: np.random.Generator, place: tuple[float, float], reach: float, frequency: FloatArray
) -> FloatArray:
    """
    Compute the standard normal random field at a place (east and north of a fixed point, m).

    The generator is in the same state for every place of an earthquake. At the distance ``reach``,
    m, the correlation has fallen to 0.05 (``exp(-3 h / reach)``, as Jayaram & Baker 2009 define
    it). The result, (n,), is dimensionless, one number for each frequency, Hz.
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
    return np.asarray(np.interp(np.log(np.clip(frequency, *FREQUENCIES)), nodes, field))


def _numbers_in_the_plane(share: FloatArray, direction: FloatArray, reach: float) -> FloatArray:
    """Return wave numbers to east and north, 1/m, (n, 2): those of ``exp(-3 h / reach)``."""
    radial = np.sqrt((1.0 - share) ** -2 - 1.0) * 3.0 / reach
    angle = 2.0 * np.pi * direction
    return np.stack([radial * np.cos(angle), radial * np.sin(angle)], axis=1)
