"""
Correlation of two bilinear structures under stationary ground motion, by statistical linearization.

Each structure is replaced by the linear system that is closest to it for the standard deviations of
its response, which follow from the joint covariance of both structures and the ground.
"""

from typing import NamedTuple

import numpy as np

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray
from per_obspy.pounding.correlation.stochastic_ground import StochasticGround
from per_obspy.pounding.structure import Structure
from per_obspy.pounding.yielding.estimate import LinearizedEstimate
from per_obspy.pounding.yielding.gauss import gauss_3
from per_obspy.pounding.yielding.krylov import krylov_bogoliubov, prescribed_ductility

#: Vanmarcke bandwidth below which a ground motion counts as narrow: a threshold of this package,
#: dimensionless
NARROW = 0.35
#: The moments end where this share of the power is reached: those of filtered white noise do not
#: converge
POWER = 0.95
#: rad/s (25 Hz), where a ground motion ends in any case
LARGEST_FREQUENCY = 50.0 * np.pi


class LinearizedCorrelation(NamedTuple):
    """Both estimates and the correlation to use, NaN where the estimates did not converge."""

    krylov_bogoliubov: LinearizedEstimate
    gauss_3: LinearizedEstimate
    recommended: float


def linearized_correlation(
    structure_1: Structure, structure_2: Structure, ground: StochasticGround, narrow: float = NARROW
) -> LinearizedCorrelation:
    """
    Compute the correlation of two bilinear displacements under stationary ground motion.

    Parameters
    ----------
    structure_1, structure_2 : Structure
        Periods, dampings (above 0), yield displacements and hardening; masses and participations do
        not matter.
    ground : WhiteNoise, KanaiTajimi or CloughPenzien
        Its intensity decides how far the structures yield.
    narrow : float, optional
        Bandwidth below which the ground motion counts as narrow, dimensionless.

    Returns
    -------
    LinearizedCorrelation
        ``krylov_bogoliubov`` and ``gauss_3`` estimates, and ``recommended``: the smaller of the two
        correlations where the ground motion is narrow, Gauss-3 otherwise, Krylov-Bogoliubov where a
        structure yields without hardening (Gauss-3 then has no stationary displacement).

    Raises
    ------
    ValueError
        If a damping is 0: there is no stationary response.

    Notes
    -----
    Against simulation (hardening 0.1) the Gauss-3 correlation is within 0.07 under broad ground
    motion while the elastic standard deviation is 0.7 to 1.5 yield displacements, and within 0.11
    up to 3; under narrow ground motion the smaller of both was never more than 0.15 above
    simulation. Yielding raises the correlation under broad ground motion.

    References
    ----------
    Caughey (1960), Journal of Applied Mechanics 27, for the first; Valles-Mattox & Reinhorn (1996),
    11WCEE.

    Examples
    --------
    >>> from per_obspy.pounding.correlation.stochastic_ground import WhiteNoise
    >>> pair = Structure(1.0, 0.05, 1.0), Structure(1.2, 0.05, 1.0)
    >>> linear = linearized_correlation(*pair, WhiteNoise(0.01))
    >>> print(round(linear.recommended, 6), linear.gauss_3.converged)
    0.229814 True
    """
    structures = _damped(structure_1), _damped(structure_2)
    first, second = krylov_bogoliubov(structures, ground), gauss_3(structures, ground)
    recommended = second.correlation if second.converged else first.correlation
    if second.converged and bandwidth(ground) < narrow:
        recommended = min(first.correlation, second.correlation)
    return LinearizedCorrelation(first, second, recommended)


def ductility_correlation(
    structure_1: Structure,
    structure_2: Structure,
    ductility_1: float,
    ductility_2: float,
    ground: StochasticGround,
    peak_factor: float = 3.0,
) -> LinearizedEstimate:
    """
    Compute the correlation of two bilinear displacements at given ductilities.

    Parameters
    ----------
    structure_1, structure_2 : Structure
        Periods, dampings (above 0) and hardening; yield displacements do not matter.
    ductility_1, ductility_2 : float
        Peak over yield displacement, dimensionless; up to 1 the structure is linear.
    ground : WhiteNoise, KanaiTajimi or CloughPenzien
        Its intensity does not matter for the correlation.
    peak_factor : float, optional
        Peak over standard deviation of displacement, dimensionless; see
        :func:`davenport_peak_factor`.

    Returns
    -------
    LinearizedEstimate
        Krylov-Bogoliubov estimate at ``yield displacement = peak_factor / ductility`` standard
        deviations; ``correlation`` is dimensionless.

    Raises
    ------
    ValueError
        If a damping is 0, or a ductility or the peak factor is not positive.

    See Also
    --------
    per_obspy.linearized_correlation : Structures with given yield displacements.

    References
    ----------
    Caughey (1960), Journal of Applied Mechanics 27; Valles-Mattox & Reinhorn (1996), 11WCEE.

    Examples
    --------
    >>> from per_obspy.pounding.correlation.stochastic_ground import WhiteNoise
    >>> pair = Structure(1.0, 0.05, 1.0, hardening=0.05), Structure(1.2, 0.05, 1.0, hardening=0.05)
    >>> print(ductility_correlation(*pair, 4.0, 4.0, WhiteNoise(0.01)).correlation > 0.5)
    True
    """
    ductilities = (
        checks.number("ductility_1", ductility_1, checks.positive),
        checks.number("ductility_2", ductility_2, checks.positive),
    )
    peak_factor = checks.number("peak_factor", peak_factor, checks.positive)
    return prescribed_ductility(
        (_damped(structure_1), _damped(structure_2)), ductilities, peak_factor, ground
    )


def davenport_peak_factor(frequency: float, duration: float) -> float:
    """
    Compute the mean peak of a stationary Gaussian response over its standard deviation.

    Parameters
    ----------
    frequency : float
        Circular frequency of the mean up-crossings (sigma of velocity over sigma of displacement),
        rad/s.
    duration : float
        For example the 5-95 % significant duration of the record, s.

    Returns
    -------
    peak_factor : float
        Dimensionless.

    Raises
    ------
    ValueError
        If an argument is not positive, or there is not one crossing in the duration.

    References
    ----------
    Davenport (1964), Proceedings of the Institution of Civil Engineers 28.

    Examples
    --------
    A period of 1 s during 20 s of strong shaking:

    >>> print(round(davenport_peak_factor(2.0 * np.pi, 20.0), 3))
    2.684
    """
    crossings = checks.number("frequency", frequency, checks.positive) / (2.0 * np.pi)
    crossings *= checks.number("duration", duration, checks.positive)
    if crossings <= 1.0:
        raise ValueError(f"duration must hold more than one crossing, got {crossings:.3g} of them")
    spread = float(np.sqrt(2.0 * np.log(crossings)))
    return spread + float(np.euler_gamma) / spread


def bandwidth(ground: StochasticGround) -> float:
    """
    Compute the Vanmarcke bandwidth of a ground motion, from 0 (a sine) to 1.

    Parameters
    ----------
    ground : WhiteNoise, KanaiTajimi or CloughPenzien
        Its intensity does not matter.

    Returns
    -------
    bandwidth : float
        ``sqrt(1 - λ1²/(λ0 λ2))`` of the spectral moments over the band with 95 % of the power below
        25 Hz.
    """
    frequency = np.linspace(0.0, LARGEST_FREQUENCY, 20001)
    return _bandwidth(frequency, ground.psd(frequency))


def record_bandwidth(north: ArrayLike, east: ArrayLike, dt: float) -> float:
    """
    Compute the Vanmarcke bandwidth of a record, from the power of both components together.

    Parameters
    ----------
    north, east : (n_samples,) array_like
        Ground acceleration, m/s²; the sum of their powers is that of any two directions at right
        angles.
    dt : float
        Sampling interval, s.

    Returns
    -------
    bandwidth : float
        As :func:`bandwidth`; 1 without motion.

    Raises
    ------
    ValueError
        If a component is no record or the interval is not positive.
    """
    motion = np.stack([checks.record("north", north), checks.record("east", east)])
    power: FloatArray = (np.abs(np.fft.rfft(motion)) ** 2).sum(axis=0)
    step = checks.number("dt", dt, checks.positive)

    # Only frequencies of ground motion count
    hertz = np.fft.rfftfreq(motion.shape[1], step).astype(np.float64)
    frequency: FloatArray = 2.0 * np.pi * hertz
    inside = frequency <= LARGEST_FREQUENCY
    return _bandwidth(frequency[inside], power[inside]) if power.any() else 1.0


def _bandwidth(frequency: FloatArray, density: FloatArray) -> float:
    """Return the bandwidth of a density at equally spaced frequencies."""
    power = np.cumsum(density)
    # The frequency at which the share is reached belongs to the band
    inside = power - density <= POWER * power[-1]
    frequency, density = frequency[inside], density[inside]
    moments = [float(np.sum(density * frequency**order)) for order in range(3)]
    return float(np.sqrt(max(1.0 - moments[1] ** 2 / (moments[0] * moments[2]), 0.0)))


def _damped(structure: Structure) -> Structure:
    """Return a structure whose damping is above 0."""
    checks.number("damping", structure.damping, checks.positive)
    return structure
