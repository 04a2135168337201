"""Energy balance: closed forms of simple motions, and the imbalance of a missing term."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.pounding.kernel_tables import structure_table
from per_obspy.pounding.row_history import Energies, closure_of, energies_of
from per_obspy.pounding.structure import Structure

TIME = np.linspace(0.0, 3.0, 301)


def test_free_vibration_keeps_its_energy():
    # mutation: a factor of half, stiffness without the mass
    structure = Structure(2.0, 0.0, 5.0)
    displacement = 0.1 * np.cos(structure.frequency * TIME)
    velocity = -0.1 * structure.frequency * np.sin(structure.frequency * TIME)
    motion = np.stack([displacement, velocity, 0.0 * TIME], axis=1)[:, None, :]
    energies = energies_of(structure_table([structure]), motion, np.zeros((TIME.size, 1, 4)))
    total = 0.5 * 5.0 * structure.frequency**2 * 0.1**2
    assert_allclose(energies.kinetic + energies.elastic, total, rtol=1e-12)


def test_elastic_energy_of_a_yielded_structure_is_that_of_its_springs():
    # mutation: total displacement in place of its elastic part. Two parallel springs: one of the
    # hardened stiffness, one that has slipped by 0.03 m
    structure = Structure(1.0, 0.0, 2.0, yield_displacement=0.02, hardening=0.25)
    motion = np.array([[[0.05, 0.0, 0.03]]])
    found = energies_of(structure_table([structure]), motion, np.zeros((1, 1, 4)))
    stiffness = 2.0 * structure.frequency**2
    expected = 0.5 * stiffness * (0.25 * 0.05**2 + 0.75 * 0.02**2)
    assert_allclose(found.elastic, expected, rtol=1e-12)


def test_work_belongs_to_its_name_and_a_wall_has_no_energies():
    # mutation: columns of the work exchanged, infinite energies of infinite masses
    structures = [Structure(1.0, 0.05, 2.0), Structure(1.0, 0.0, np.inf)]
    work = np.tile([1.0, 2.0, 3.0, 4.0], (1, 2, 1))
    found = energies_of(structure_table(structures), np.zeros((1, 2, 3)), work)
    named = found.input, found.damping, found.hysteretic, found.transfer
    assert [float(energy[0, 0]) for energy in named] == [1.0, 2.0, 3.0, 4.0]
    assert all(np.isnan(energy[1, 0]) for energy in found)


@pytest.mark.parametrize("lost", ["kinetic", "damping", "elastic", "hysteretic", "transfer"])
def test_the_closure_sees_every_term(lost):
    # mutation: a term left out of (3), (4)
    unit = np.ones((1, 4))
    balanced = Energies(5 * unit, unit, unit, unit, unit, unit)
    assert closure_of(balanced) == 0.0
    assert closure_of(balanced._replace(**{lost: 0.5 * unit})) == pytest.approx(0.1)


def test_walls_and_structures_at_rest_are_balanced():
    wall, rest = np.full((1, 4), np.nan), np.zeros((1, 4))
    assert closure_of(Energies(*[np.concatenate([wall, rest])] * 6)) == 0.0
