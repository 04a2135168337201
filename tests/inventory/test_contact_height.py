"""Participation and generalised mass: published values, limits, energy and modal sums."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.inventory.contact_height import (
    contact_mass,
    contact_participation,
    effective_mass_ratio,
    floor_offset,
)

STOREYS = np.array([1, 2, 3, 5, 10])


def test_participation_at_the_roof():
    # 1, 6/5, 9/7, 15/11, 10/7; the literature prints two decimals
    assert_allclose(
        contact_participation(STOREYS, 30.0, 30.0), [1.0, 1.2, 1.29, 1.36, 1.43], atol=0.005
    )
    assert_allclose(contact_participation(1e9, 30.0, 30.0), 1.5, rtol=1e-8)  # limit, off by 1/(2N)


def _first_mode(stiffness):
    """Return omega² and the shape of the first mode of a shear building of unit masses."""
    above = np.append(stiffness[1:], 0.0)
    matrix = np.diag(stiffness + above) - np.diag(above[:-1], 1) - np.diag(above[:-1], -1)
    values, shapes = np.linalg.eigh(matrix)
    return values[0], shapes[:, 0]


@pytest.mark.parametrize("storeys", [1, 2, 3, 6, 10, 30])
def test_effective_mass_of_a_shear_building(storeys):
    # storeys whose stiffness carries the inertia of a mode phi = 1, 2, ..., N with omega² = 1
    shape = np.arange(1.0, storeys + 1.0)
    stiffness = np.cumsum(shape[::-1])[::-1]
    square, mode = _first_mode(stiffness)
    assert_allclose(square, 1.0, rtol=1e-9)
    effective = mode.sum() ** 2 / (mode @ mode) / storeys
    # eigenvalues of a matrix of 30 storeys are good to 1e-12 or better
    assert_allclose(effective_mass_ratio(storeys), effective, rtol=1e-9)
    # its own base shear at an oscillator displacement u: the first storey's drift times stiffness
    participation = mode.sum() / (mode @ mode)
    base_shear = stiffness[0] * participation * mode[0]
    assert_allclose(base_shear / storeys, effective_mass_ratio(storeys) * square, rtol=1e-9)


@pytest.mark.parametrize("storeys", [1, 2, 7, 30])
@pytest.mark.parametrize("level", [0.2, 0.5, 1.0])
def test_closed_forms_are_the_modal_sums(storeys, level):
    # would catch a wrong power of z_c/H, or the effective modal mass in place of the generalised
    # one
    floor = np.arange(1, storeys + 1) / storeys
    mass = np.full(storeys, 1.7e5)
    participation = mass @ floor / (mass @ floor**2) * level
    generalised = mass @ floor**2 / level**2
    assert_allclose(contact_participation(storeys, 40.0, 40.0 * level), participation, rtol=1e-13)
    assert_allclose(contact_mass(mass.sum(), storeys, 40.0, 40.0 * level), generalised, rtol=1e-13)


def test_floor_offset_does_not_depend_on_the_order():
    # would catch the storey height taken from the lower building
    assert_allclose(floor_offset(9.0, 3, 16.0, 4), 1.0, rtol=1e-14)
    assert_allclose(floor_offset(16.0, 4, 9.0, 3), 1.0, rtol=1e-14)
    assert_allclose(floor_offset([9.0, 12.0], [3, 4], 30.0, 10), 0.0, atol=1e-14)


def test_ground_is_no_floor_to_hit():
    # a 1.4 m wall next to storeys of 3 m is 1.6 m below the first floor, not 1.4 m above ground
    assert_allclose(floor_offset(1.4, 1, 9.0, 3), 1.6, rtol=1e-14)


def test_one_storey_is_an_oscillator():
    assert contact_participation(1, 3.0, 3.0) == 1.0
    assert contact_mass(2e5, 1, 3.0, 3.0) == 2e5


def test_effective_mass_of_equal_storeys_is_a_little_larger():
    # the assumption of a linear shape errs by 14 % at most: 8 / pi² in the limit of a uniform beam
    for storeys in (1, 3, 10):
        _, mode = _first_mode(np.ones(storeys))
        effective = mode.sum() ** 2 / (mode @ mode) / storeys
        assert 1.0 <= effective / effective_mass_ratio(storeys) < 1.14


def test_effective_mass_falls_from_one_to_three_quarters():
    ratio = effective_mass_ratio([1, 2, 5, 50, 1e9])
    assert ratio[0] == 1.0
    assert np.all(np.diff(ratio) < 0.0)
    assert_allclose(ratio[-1], 0.75, rtol=1e-8)  # limit, off by 1/(2N)


@pytest.mark.parametrize("level", [0.1, 0.6, 1.0])
def test_energy_does_not_depend_on_where_it_is_seen(level):
    # kinetic energy of an oscillator of velocity 1: m*_c q**2 / 2 is the same at every level, that
    # of the mode itself
    storeys, height = 6, 18.0
    seen = (
        contact_mass(9e5, storeys, height, level * height)
        * contact_participation(storeys, height, level * height) ** 2
    )
    floor = np.arange(1, storeys + 1) / storeys
    mode = 9e5 / storeys * (floor.sum() ** 2) / (floor**2).sum()
    assert_allclose(seen, mode, rtol=1e-13)
