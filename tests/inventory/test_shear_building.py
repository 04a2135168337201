"""Modes of shear buildings against closed forms, another eigensolver and the laws they obey."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh

from per_obspy import equivalent_sdof, shear_building


@pytest.mark.parametrize("storeys", [1, 2, 5, 40])
def test_uniform_building_in_closed_form(storeys):
    # omega_j = 2 sqrt(k/m) sin((2j-1) pi / (2 (2N+1))), phi_ij ~ sin(i (2j-1) pi / (2N+1))
    mass, stiffness = 2e5, 3e8
    angle = (2 * np.arange(1, storeys + 1) - 1) * np.pi / (2 * storeys + 1)
    found = shear_building(np.full(storeys, mass), np.full(storeys, stiffness))
    # eigenvalues are right to round-off of the largest, 4 k/m: the smallest of 40 loses three
    # digits
    assert_allclose(
        found.periods, np.pi / (np.sqrt(stiffness / mass) * np.sin(angle / 2)), rtol=1e-12
    )
    shapes = np.sin(np.arange(1, storeys + 1)[:, None] * angle)
    assert_allclose(found.shapes, shapes / shapes[-1], rtol=1e-9, atol=1e-11)


def _random_building(storeys: int) -> tuple[np.ndarray, np.ndarray]:
    generator = np.random.default_rng(storeys)
    return generator.uniform(1e5, 9e5, storeys), generator.uniform(1e8, 9e8, storeys)


def test_irregular_building_against_a_general_eigensolver():
    # would catch a storey's stiffness attached to the floor below it
    masses, stiffnesses = _random_building(9)
    matrix = np.diag(stiffnesses + np.append(stiffnesses[1:], 0)) - np.diag(stiffnesses[1:], 1)
    matrix -= np.diag(stiffnesses[1:], -1)
    values, vectors = eigh(matrix, np.diag(masses))
    found = shear_building(masses, stiffnesses)
    assert_allclose(
        found.periods, 2 * np.pi / np.sqrt(values), rtol=1e-10
    )  # two solvers' round-off
    assert_allclose(found.shapes, vectors / vectors[-1], rtol=1e-8, atol=1e-10)


def test_modes_are_orthogonal_and_participations_make_one():
    masses, stiffnesses = _random_building(6)
    shapes = shear_building(masses, stiffnesses).shapes
    generalised = shapes.T @ (masses[:, None] * shapes)
    diagonal = np.diag(generalised)
    assert_allclose(generalised / np.sqrt(np.outer(diagonal, diagonal)), np.eye(6), atol=1e-12)
    # a rigid translation is the sum of all modal contributions
    assert_allclose(shapes @ (masses @ shapes / diagonal), 1.0, rtol=1e-10)


@pytest.mark.parametrize("factor", [0.01, 4.0, 1e3])
def test_scaling(factor):
    # T ~ sqrt(m/k); participation does not change; mass ~ m
    masses, stiffnesses = _random_building(4)
    once, heavier = (
        equivalent_sdof(masses, stiffnesses, 2),
        equivalent_sdof(factor * masses, stiffnesses, 2),
    )
    assert_allclose(
        heavier, [once.period * np.sqrt(factor), once.participation, once.mass * factor], rtol=1e-11
    )
    stiffer = equivalent_sdof(masses, factor * stiffnesses, 2)
    assert_allclose(
        stiffer, [once.period / np.sqrt(factor), once.participation, once.mass], rtol=1e-11
    )


def test_energy_is_the_same_seen_from_any_floor():
    masses, stiffnesses = _random_building(5)
    oscillators = [equivalent_sdof(masses, stiffnesses, level) for level in range(5)]
    energies = [sdof.mass * sdof.participation**2 for sdof in oscillators]
    assert_allclose(energies, energies[0], rtol=1e-11)


def test_level_counts_from_the_lowest_floor():
    low, roof = equivalent_sdof([1e5] * 3, [1e8] * 3, 0), equivalent_sdof([1e5] * 3, [1e8] * 3, 2)
    assert low.participation < 1 < roof.participation
    assert equivalent_sdof([1e5] * 3, [1e8] * 3, -1) == roof


@pytest.mark.parametrize(
    ("masses", "stiffnesses", "level", "message"),
    [
        ([1e5, 0.0], [1e8, 1e8], 0, "masses must be positive, got 0.0 at index 1"),
        ([1e5], [-1e8], 0, "stiffnesses must be positive"),
        ([1e5, 1e5], [1e8], 0, "rows of equal length"),
        ([], [], 0, "rows of equal length"),
        ([1e5], [1e8], 1, "level must be below the number of floors, 1, got 1"),
    ],
)
def test_bad_models(masses, stiffnesses, level, message):
    with pytest.raises(ValueError, match=message):
        equivalent_sdof(masses, stiffnesses, level)


def test_inputs_stay():
    masses, stiffnesses = _random_building(3)
    before = masses.copy(), stiffnesses.copy()
    shear_building(masses, stiffnesses)
    assert (masses == before[0]).all()
    assert (stiffnesses == before[1]).all()


def test_one_storey_is_the_oscillator_itself():
    found = equivalent_sdof([2e5], [8e6], 0)
    assert_allclose(found, [2 * np.pi / np.sqrt(40.0), 1.0, 2e5], rtol=1e-14)


def test_static_deflection_bounds_the_period_from_above():
    # Rayleigh's quotient of any other shape is above the lowest frequency squared
    masses, stiffnesses = _random_building(7)
    storeys_below = np.cumsum(np.cumsum(masses[::-1])[::-1] / stiffnesses)
    trial = np.diff(storeys_below, prepend=0.0)
    rayleigh = (stiffnesses @ trial**2) / (masses @ storeys_below**2)
    period = shear_building(masses, stiffnesses).periods[0]
    assert 2 * np.pi / np.sqrt(rayleigh) <= period * (1 + 1e-12)
    assert 2 * np.pi / np.sqrt(rayleigh) > 0.95 * period  # and it is a good shape
