"""
Statistical linearization of the rate of elastoplastic force: three Gaussian states per structure.

The states are displacement u, velocity v and plastic displacement d; the elastoplastic part carries
y = u - d. The rate ``y' = v [1 - H(v) H(y - uy) - H(-v) H(-y - uy)]`` is replaced by
``y' = c v + k y``.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.special import erfc, ndtr, owens_t

from per_obspy.checks import FloatArray
from per_obspy.pounding.correlation.covariance import (
    correlation,
    linear_oscillator,
    stationary_covariance,
)
from per_obspy.pounding.correlation.stochastic_ground import StochasticGround
from per_obspy.pounding.structure import Structure
from per_obspy.pounding.yielding.estimate import LinearizedEstimate, failed

#: Share of each change that an iteration makes.
RELAXATION = 0.3

#: Relative change of 1 - c and k between two iterations that ends them.
TOLERANCE = 1e-11

#: Largest number of iterations.
ITERATIONS = 3000

#: Standard deviations beyond which yielding has a probability below 1e-15.
ELASTIC = 8.0


def gauss_3(
    structures: tuple[Structure, Structure], ground: StochasticGround
) -> LinearizedEstimate:
    """
    Return the estimate of the correlation of two bilinear structures.

    Without hardening a yielding structure drifts for ever and the estimate does not converge.
    """
    # Structures whose elastic response reaches their yield displacement
    responses = _elastic_responses(structures, ground)
    yielding = [_yields(*pair) for pair in zip(structures, responses, strict=True)]
    if any(_drifts(*pair) for pair in zip(structures, yielding, strict=True)):
        return failed()

    # Alternate between the covariance of linear systems and the systems that fit it
    slips = _slips(structures, responses, yielding)
    for _ in range(ITERATIONS):
        systems = [_system(*item) for item in zip(structures, slips, yielding, strict=True)]
        covariance = stationary_covariance(ground, *systems)
        responses = [_response(own) for own in _own(covariance, systems)]
        change = _slips(structures, responses, yielding) - slips
        if np.all(np.abs(change) <= TOLERANCE * slips):
            return _estimate(structures, covariance, systems)
        slips += RELAXATION * change
    return failed()


class _Response(NamedTuple):
    """Standard deviations of y (m) and v (m/s), and their correlation."""

    sigma_force: float
    sigma_velocity: float
    coherence: float


def _elastic_responses(
    structures: tuple[Structure, Structure], ground: StochasticGround
) -> list[_Response]:
    """Return the responses of both structures while they stay elastic."""
    systems = [linear_oscillator(structure.period, structure.damping) for structure in structures]
    variances = np.diag(stationary_covariance(ground, *systems))
    responses = []
    for displacement in (0, 2):
        sigma = math.sqrt(variances[displacement])
        sigma_velocity = math.sqrt(variances[displacement + 1])
        responses.append(_Response(sigma, sigma_velocity, 0.0))
    return responses


def _yields(structure: Structure, response: _Response) -> bool:
    """Return True if a structure can be expected to yield."""
    return structure.yield_displacement < ELASTIC * response.sigma_force


def _drifts(structure: Structure, yields: bool) -> bool:
    """Return True if a structure yields without hardening."""
    return yields and structure.hardening == 0.0


def _slips(
    structures: tuple[Structure, Structure], responses: list[_Response], yielding: list[bool]
) -> FloatArray:
    """Return the plastic rates of both structures (rows); none where a structure stays elastic."""
    rows = []
    for structure, response, yields in zip(structures, responses, yielding, strict=True):
        rows.append(slip(structure.yield_displacement, *response) if yields else (0.0, 0.0))
    return np.array(rows)


def _system(structure: Structure, slips: FloatArray, yields: bool) -> FloatArray:
    """Return the state matrix of u, v and, where the structure yields, d."""
    linear = linear_oscillator(structure.period, structure.damping)
    if not yields:
        return linear

    # d' = (1 - c) v - k (u - d), and d relieves the elastoplastic spring
    plastic, creep = slips
    system = np.zeros((3, 3))
    system[:2, :2] = linear
    system[1, 2] = (1.0 - structure.hardening) * structure.frequency**2
    system[2] = creep, plastic, -creep
    return system


def _elastoplastic(covariance: FloatArray) -> FloatArray:
    """Return the covariances of y = u - d with u, v (and d) of one structure."""
    force: FloatArray = covariance[0] - covariance[2] if len(covariance) == 3 else covariance[0]
    return force


def _response(covariance: FloatArray) -> _Response:
    """Return the response of one structure from the covariance of its states."""
    force = _elastoplastic(covariance)
    sigma_force = math.sqrt(force[0] - force[2] if len(covariance) == 3 else force[0])
    sigma_velocity = math.sqrt(covariance[1, 1])
    return _Response(sigma_force, sigma_velocity, force[1] / (sigma_force * sigma_velocity))


def _own(covariance: FloatArray, systems: list[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Return the covariance of the states of each structure."""
    second, end = len(systems[0]), len(systems[0]) + len(systems[1])
    return covariance[:second, :second], covariance[second:end, second:end]


def _estimate(
    structures: tuple[Structure, Structure], covariance: FloatArray, systems: list[FloatArray]
) -> LinearizedEstimate:
    """Return the correlation, and the oscillators whose forces fit those of the structures best."""
    own_1, own_2 = _own(covariance, systems)
    period_1, damping_1 = _oscillator(structures[0], own_1)
    period_2, damping_2 = _oscillator(structures[1], own_2)

    # Displacements are the first states of both structures
    second = len(systems[0])
    return LinearizedEstimate(
        correlation=correlation(covariance, 0, second),
        period=np.array([period_1, period_2]),
        damping=np.array([damping_1, damping_2]),
        sigma=np.sqrt(covariance[[0, second], [0, second]]),
        converged=True,
    )


def _oscillator(structure: Structure, own: FloatArray) -> tuple[float, float]:
    """Return period (s) and damping of the oscillator that fits one structure's force best."""
    force = _elastoplastic(own)
    stiffness, softened = structure.frequency**2, 1.0 - structure.hardening

    # In-phase part of the force over displacement, out-of-phase part over velocity
    omega = math.sqrt(stiffness * (structure.hardening + softened * force[0] / own[0, 0]))
    loops = softened * stiffness * force[1] / own[1, 1]
    viscosity = 2.0 * structure.damping * structure.frequency + loops
    return 2.0 * math.pi / omega, viscosity / (2.0 * omega)


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
    forward = mean * ndtr(mean / spread) + spread * _normal(mean / spread)
    return float(2.0 * plastic), float(2.0 * _normal(h) / sigma_force * forward)


def _normal(x: float) -> float:
    """Return the standard normal density."""
    return math.exp(-0.5 * x * x) / math.sqrt(2.0 * math.pi)
