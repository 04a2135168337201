"""
Correlation of two bilinear structures under stationary ground motion, by statistical linearization.

Each structure is replaced by the linear system that is closest to it for the standard deviations of
its response, which follow from the joint covariance of both structures and the ground.

Two estimates are made. That of Caughey averages over Rayleigh amplitudes (Krylov-Bogoliubov). The
other has three Gaussian states per structure: displacement u, velocity v and plastic displacement
d; the elastoplastic part carries y = u - d, and the rate
``y' = v [1 - H(v) H(y - uy) - H(-v) H(-y - uy)]`` is replaced by ``y' = c v + k y``.
"""

import math
from collections.abc import Callable
from itertools import compress
from statistics import NormalDist
from typing import NamedTuple

import numpy as np
from scipy.integrate import quad
from scipy.special import erfc, owens_t

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray
from per_obspy.pounding.kernel_tables import both_components
from per_obspy.pounding.stationary_ground import (
    StochasticGround,
    correlation,
    linear_oscillator,
    stationary_covariance,
)
from per_obspy.pounding.structure import Structure


class LinearizedEstimate(NamedTuple):
    """
    One estimate of a pair.

    ``correlation`` of the displacements, dimensionless; for both structures (2,) the equivalent
    ``period`` (s), ``damping`` (fraction of critical) and ``sigma``, the standard deviation of
    displacement (m): right for the correlation, but 17 to 42 % too small as a displacement of
    structures that yield. NaN unless ``converged``.
    """

    correlation: float
    period: FloatArray
    damping: FloatArray
    sigma: FloatArray
    converged: bool


#: Share of each change that an iteration makes, relative change that ends the iterations, and their
#: largest number: of frequency and damping (Krylov-Bogoliubov), of 1 - c and k (Gauss-3).
KRYLOV_STEPS, GAUSS_STEPS = (0.5, 1e-12, 1000), (0.3, 1e-11, 3000)

#: Exponent from which on an exponential is negligible: exp(-46) is 1e-20.
NEGLIGIBLE = 46.0

NORMAL = NormalDist()

#: Standard deviations beyond which yielding has a probability below 1e-15.
ELASTIC = 8.0


def _fixed_point(
    values: FloatArray,
    fitted: Callable[[FloatArray], FloatArray],
    steps: tuple[float, float, int],
) -> FloatArray | None:
    """Return the values that a function returns unchanged, by relaxed iteration; None without."""
    share, tolerance, iterations = steps
    for _ in range(iterations):
        change = fitted(values) - values
        if np.all(np.abs(change) <= tolerance * values):
            return values
        values = values + share * change
    return None


def _estimate(
    periods: ArrayLike, dampings: ArrayLike, covariance: FloatArray, second: int
) -> LinearizedEstimate:
    """Return an estimate; ``second`` is the state of the displacement of structure 2."""
    sigma = np.sqrt(covariance[[0, second], [0, second]])
    rho = correlation(covariance, 0, second)
    return LinearizedEstimate(rho, np.array(periods), np.array(dampings), sigma, converged=True)


def _failed() -> LinearizedEstimate:
    period, damping, sigma = np.full((3, 2), np.nan)
    return LinearizedEstimate(math.nan, period, damping, sigma, converged=False)


def krylov_bogoliubov(
    structures: tuple[Structure, Structure],
    ground: StochasticGround,
    levels_of: Callable[[FloatArray], FloatArray],
) -> LinearizedEstimate:
    """
    Return the estimate that averages over Rayleigh amplitudes.

    ``levels_of`` returns the yield displacements over the standard deviations of displacement, of
    these deviations (m).
    """
    # At first elastic
    start = np.array([(one.frequency, one.damping) for one in structures])
    oscillators = _fixed_point(
        start, lambda values: _fitted(structures, ground, levels_of, values), KRYLOV_STEPS
    )
    if oscillators is None:
        return _failed()
    frequency, damping = oscillators.T
    return _estimate(2.0 * np.pi / frequency, damping, _response(ground, oscillators), 2)


def _response(ground: StochasticGround, oscillators: FloatArray) -> FloatArray:
    """Return the covariance of displacement and velocity of oscillator 1, then of 2."""
    frequency, damping = oscillators.T
    periods = 2.0 * np.pi / frequency
    systems = [linear_oscillator(*one) for one in zip(periods, damping, strict=True)]
    return stationary_covariance(ground, *systems)


def _fitted(
    structures: tuple[Structure, Structure],
    ground: StochasticGround,
    levels_of: Callable[[FloatArray], FloatArray],
    oscillators: FloatArray,
) -> FloatArray:
    """Return frequency and damping (columns) that fit structures at the response of oscillators."""
    sigma, rate = np.sqrt(np.diag(_response(ground, oscillators))[:4]).reshape(2, 2).T
    fitted = []
    for one, level, inverse in zip(structures, levels_of(sigma), sigma / rate, strict=True):
        softened = 1.0 - one.hardening
        stiffness = one.hardening + softened * equivalent_stiffness(level)
        frequency = one.frequency * math.sqrt(stiffness)

        # Viscous damping and that of the loops, per mass
        loops = softened * one.frequency**2 * equivalent_viscosity(level) * inverse
        viscosity = 2.0 * one.damping * one.frequency + loops
        fitted.append((frequency, viscosity / (2.0 * frequency)))
    return np.array(fitted)


def equivalent_stiffness(level: float) -> float:
    """
    Return the in-phase part of an elastoplastic force over the elastic force (I_C), dimensionless.

    ``level`` is yield displacement over standard deviation of displacement. With the amplitude A
    Rayleigh distributed and ``ν = 2/level²``, ``I_C = E[A C(A)]/E[A²]`` is
    ``1 - (8/π) ∫ (1/s³ + 1/(ν s)) sqrt(s - 1) exp(-s²/ν) ds`` from 1; s = 1 + t² below.
    """
    spread = 2.0 / level**2 if level > 0.0 else math.inf
    if spread < 1.0 / NEGLIGIBLE:
        return 1.0

    def integrand(t: float) -> float:
        """Return the integrand over t, whose root at s = 1 is smooth."""
        s = 1.0 + t * t
        return (1.0 / s**3 + 1.0 / (spread * s)) * 2.0 * t * t * math.exp(-s * s / spread)

    # Integrate up to where the exponential is negligible
    end = math.sqrt(math.sqrt(NEGLIGIBLE * spread))
    integral = quad(integrand, 0.0, end, epsabs=1e-14, epsrel=1e-13, limit=200)[0]
    return float(1.0 - 8.0 / math.pi * integral)


def equivalent_viscosity(level: float) -> float:
    """
    Return the part of an elastoplastic force in phase with velocity (I_S), dimensionless.

    ``level`` is yield displacement over standard deviation of displacement.
    """
    if not math.isfinite(level):
        return 0.0
    return float(math.sqrt(2.0 / math.pi) * level * erfc(level / math.sqrt(2.0)))


def gauss_3(
    structures: tuple[Structure, Structure], ground: StochasticGround
) -> LinearizedEstimate:
    """
    Return the estimate of three Gaussian states.

    Without hardening a yielding structure drifts for ever and the estimate does not converge.
    """
    # Structures that can be expected to yield
    owns, is_plastic = _elastic_response(structures, ground)
    if 0.0 in [one.hardening for one in compress(structures, is_plastic)]:
        return _failed()

    def response(slips: FloatArray) -> tuple[FloatArray, list[FloatArray]]:
        """Return covariance and systems of both structures at plastic rates (rows)."""
        systems = [_system(*one) for one in zip(structures, slips, is_plastic, strict=True)]
        return stationary_covariance(ground, *systems), systems

    def fitted(owns: list[FloatArray]) -> FloatArray:
        """Return the plastic rates that fit covariances of the states of each structure."""
        return np.array([_slip(*one) for one in zip(structures, owns, is_plastic, strict=True)])

    # Iterate between the covariance of linear systems and the systems that fit it
    slips = _fixed_point(
        fitted(owns), lambda values: fitted(_of_each(*response(values))), GAUSS_STEPS
    )
    return _failed() if slips is None else _fitting_oscillators(structures, *response(slips))


def _fitting_oscillators(
    structures: tuple[Structure, Structure], covariance: FloatArray, systems: list[FloatArray]
) -> LinearizedEstimate:
    """Return the estimate with the oscillators whose forces fit those of the structures best."""
    periods, dampings = [], []
    for one, own in zip(structures, _of_each(covariance, systems), strict=True):
        force, _ = _force(own)
        stiffness, softened = one.frequency**2, 1.0 - one.hardening

        # In-phase part of the force over displacement, out-of-phase part over velocity
        omega = math.sqrt(stiffness * (one.hardening + softened * force[0] / own[0, 0]))
        loops = softened * stiffness * force[1] / own[1, 1]
        viscosity = 2.0 * one.damping * one.frequency + loops
        periods.append(2.0 * math.pi / omega)
        dampings.append(viscosity / (2.0 * omega))
    return _estimate(periods, dampings, covariance, len(systems[0]))


def _elastic_response(
    structures: tuple[Structure, Structure], ground: StochasticGround
) -> tuple[list[FloatArray], list[bool]]:
    """Return covariances of elastic structures, and whether they reach their yield displacement."""
    systems = [linear_oscillator(one.period, one.damping) for one in structures]
    owns = _of_each(stationary_covariance(ground, *systems), systems)
    both = zip(structures, owns, strict=True)
    return owns, [one.yield_displacement < ELASTIC * math.sqrt(own[0, 0]) for one, own in both]


def _of_each(covariance: FloatArray, systems: list[FloatArray]) -> list[FloatArray]:
    second, end = len(systems[0]), len(systems[0]) + len(systems[1])
    return [covariance[:second, :second], covariance[second:end, second:end]]


def _system(structure: Structure, slips: FloatArray, is_plastic: bool) -> FloatArray:
    """Return the state matrix of u, v and, where the structure yields, d."""
    linear = linear_oscillator(structure.period, structure.damping)
    if not is_plastic:
        return linear

    # d' = (1 - c) v - k (u - d), and d relieves the elastoplastic spring
    plastic, creep = slips
    system = np.zeros((3, 3))
    system[:2, :2] = linear
    system[1, 2] = (1.0 - structure.hardening) * structure.frequency**2
    system[2] = creep, plastic, -creep
    return system


def _force(own: FloatArray) -> tuple[FloatArray, float]:
    """Return the covariances of y = u - d (u if elastic) with the states, and its variance."""
    combined = np.array([1.0, 0.0, -1.0])[: len(own)]
    return combined @ own, float(combined @ own @ combined)


def _slip(structure: Structure, own: FloatArray, is_plastic: bool) -> tuple[float, float]:
    """Return the plastic rates of one structure from the covariance of its states, 0 if elastic."""
    if not is_plastic:
        return 0.0, 0.0
    force, variance = _force(own)
    sigma, speed = math.sqrt(variance), math.sqrt(own[1, 1])
    return slip(structure.yield_displacement, sigma, speed, force[1] / (sigma * speed))


def slip(
    limit: float, sigma_force: float, sigma_velocity: float, coherence: float
) -> tuple[float, float]:
    """
    Return ``1 - c`` (dimensionless) and ``-k`` (1/s) of the closest linear rate equation.

    ``limit`` is the yield displacement, ``sigma_force`` the standard deviation of y, ``coherence``
    the correlation R of v and y. ``1 - c = 2 P(v > 0, y > uy)``; ``-k = 2 φ(h)/σy E[v⁺ | y = uy]``,
    ``h = uy/σy``.
    """
    # P(v > 0, y > uy) of two normal variables, by Owen's T
    h = limit / sigma_force
    side = math.sqrt(1.0 - coherence**2)
    plastic = 0.25 * erfc(h / math.sqrt(2.0)) + owens_t(h, coherence / side)

    # E[v⁺ | y = uy]: v is normal there
    mean, spread = coherence * sigma_velocity * h, sigma_velocity * side
    forward = mean * NORMAL.cdf(mean / spread) + spread * NORMAL.pdf(mean / spread)
    return float(2.0 * plastic), float(2.0 * NORMAL.pdf(h) / sigma_force * forward)


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
    >>> from per_obspy.pounding.stationary_ground import WhiteNoise
    >>> pair = Structure(1.0, 0.05, 1.0), Structure(1.2, 0.05, 1.0)
    >>> linear = linearized_correlation(*pair, WhiteNoise(0.01))
    >>> print(round(linear.recommended, 6), linear.gauss_3.converged)
    0.229814 True
    """
    structures = _damped(structure_1, structure_2)
    limits = np.array([one.yield_displacement for one in structures])

    # The smaller of both where the ground motion is narrow
    first = krylov_bogoliubov(structures, ground, lambda sigma: limits / sigma)
    second = gauss_3(structures, ground)
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
    >>> from per_obspy.pounding.stationary_ground import WhiteNoise
    >>> pair = Structure(1.0, 0.05, 1.0, hardening=0.05), Structure(1.2, 0.05, 1.0, hardening=0.05)
    >>> print(ductility_correlation(*pair, 4.0, 4.0, WhiteNoise(0.01)).correlation > 0.5)
    True
    """
    ductility_1 = checks.number("ductility_1", ductility_1, checks.positive)
    ductility_2 = checks.number("ductility_2", ductility_2, checks.positive)
    peak_factor = checks.number("peak_factor", peak_factor, checks.positive)

    # Yield displacement over standard deviation of displacement
    levels = [peak_factor / one if one > 1.0 else math.inf for one in (ductility_1, ductility_2)]
    structures = _damped(structure_1, structure_2)
    return krylov_bogoliubov(structures, ground, lambda _: np.array(levels))


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
    Return the Vanmarcke bandwidth of a ground motion, from 0 (a sine) to 1.

    ``sqrt(1 - λ1²/(λ0 λ2))`` of the spectral moments over the band with 95 % of the power below 25
    Hz; the intensity does not matter.
    """
    frequency = np.linspace(0.0, LARGEST_FREQUENCY, 20001)
    return _bandwidth(frequency, ground.psd(frequency))


def record_bandwidth(north: ArrayLike, east: ArrayLike, dt: float) -> float:
    """
    Return the Vanmarcke bandwidth of a record, from the power of both components together.

    North and east (n_samples) are in m/s², dt in s; the sum of their powers is that of any two
    directions at right angles. 1 without motion.
    """
    motion = both_components(north, east)
    power: FloatArray = (np.abs(np.fft.rfft(motion)) ** 2).sum(axis=0)
    step = checks.number("dt", dt, checks.positive)

    # Only frequencies of ground motion count
    frequency = 2.0 * np.pi * np.fft.rfftfreq(motion.shape[1], step).astype(np.float64)
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


def _damped(first: Structure, second: Structure) -> tuple[Structure, Structure]:
    for structure in (first, second):
        checks.number("damping", structure.damping, checks.positive)
    return first, second
