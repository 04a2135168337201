"""
Statistical linearization of the rate equation of elastoplastic force, with three Gaussian states a structure.

The states are displacement u, velocity v and plastic displacement d; the elastoplastic part carries
y = u - d. In ``y' = v [1 - H(v) H(y - uy) - H(-v) H(-y - uy)]`` the bracket is replaced by ``y' = c
v + k y``.
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

RELAXATION = 0.3
TOLERANCE = 1e-11  # of 1 - c and k between two iterations, relative
ITERATIONS = 3000
ELASTIC = 8.0  # standard deviations: beyond them yielding has a probability below 1e-15


def gauss_3(
    structures: tuple[Structure, Structure], ground: StochasticGround
) -> LinearizedEstimate:
    """Return the estimate; without hardening a yielding structure drifts for ever and nothing converges."""
    linear = stationary_covariance(
        ground, *(linear_oscillator(s.period, s.damping) for s in structures)
    )
    responses = [
        _Response(math.sqrt(linear[i, i]), math.sqrt(linear[i + 1, i + 1]), 0.0) for i in (0, 2)
    ]
    yielding = [
        s.yield_displacement < ELASTIC * r.sigma_force
        for s, r in zip(structures, responses, strict=True)
    ]
    if any(
        soft and structure.hardening == 0.0
        for soft, structure in zip(yielding, structures, strict=True)
    ):
        return failed()
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


def _slips(
    structures: tuple[Structure, Structure], responses: list[_Response], yielding: list[bool]
) -> FloatArray:
    """Return the plastic rates of both structures (rows); none where a structure stays elastic."""
    return np.array(
        [
            slip(structure.yield_displacement, *response) if soft else (0.0, 0.0)
            for structure, response, soft in zip(structures, responses, yielding, strict=True)
        ]
    )


def _system(structure: Structure, slips: FloatArray, yields: bool) -> FloatArray:
    """Return the state matrix of u, v and, where the structure yields, d."""
    linear = linear_oscillator(structure.period, structure.damping)
    if not yields:
        return linear
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
    force = _elastoplastic(covariance)
    sigma_force = math.sqrt(force[0] - force[2] if len(covariance) == 3 else force[0])
    sigma_velocity = math.sqrt(covariance[1, 1])
    return _Response(sigma_force, sigma_velocity, force[1] / (sigma_force * sigma_velocity))


def _own(covariance: FloatArray, systems: list[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Return the covariance of each structure's own states."""
    second, end = len(systems[0]), len(systems[0]) + len(systems[1])
    return covariance[:second, :second], covariance[second:end, second:end]


def _estimate(
    structures: tuple[Structure, Structure], covariance: FloatArray, systems: list[FloatArray]
) -> LinearizedEstimate:
    """Return the correlation, and the oscillators whose forces are closest to those of the structures."""
    periods, dampings = np.empty(2), np.empty(2)
    for place, (structure, own) in enumerate(
        zip(structures, _own(covariance, systems), strict=True)
    ):
        force = _elastoplastic(own)
        stiffness, softened = structure.frequency**2, 1.0 - structure.hardening
        omega = math.sqrt(stiffness * (structure.hardening + softened * force[0] / own[0, 0]))
        viscosity = (
            2.0 * structure.damping * structure.frequency
            + softened * stiffness * force[1] / own[1, 1]
        )
        periods[place], dampings[place] = 2.0 * math.pi / omega, viscosity / (2.0 * omega)
    second = len(systems[0])
    sigma = np.sqrt(covariance[[0, second], [0, second]])
    return LinearizedEstimate(
        correlation(covariance, 0, second), periods, dampings, sigma, converged=True
    )


def slip(
    limit: float, sigma_force: float, sigma_velocity: float, coherence: float
) -> tuple[float, float]:
    """
    Return ``1 - c`` (dimensionless) and ``-k`` (1/s) of the closest linear rate equation.

    ``limit`` is the yield displacement, ``sigma_force`` the standard deviation of y, ``coherence``
    the correlation R of v and y. ``1 - c = 2 P(v > 0, y > uy)``; ``-k = 2 φ(h)/σy E[v⁺ | y = uy]``,
    ``h = uy/σy``.
    """
    h = limit / sigma_force
    side = math.sqrt(1.0 - coherence**2)
    plastic = 0.25 * erfc(h / math.sqrt(2.0)) + owens_t(h, coherence / side)
    mean, spread = coherence * sigma_velocity * h, sigma_velocity * side
    forward = mean * ndtr(mean / spread) + spread * _normal(mean / spread)
    return float(2.0 * plastic), float(2.0 * _normal(h) / sigma_force * forward)


def _normal(x: float) -> float:
    return math.exp(-0.5 * x * x) / math.sqrt(2.0 * math.pi)
