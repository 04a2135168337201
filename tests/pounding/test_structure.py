"""A structure checks its numbers, and arrays of structures name the argument that is wrong."""

import math

import numpy as np
import pytest

from per_obspy.pounding.structure import PAIR_CHECKS, Pairs, Structure, refuse_bilinear

GOOD = {"period": 1.0, "damping": 0.05, "mass": 1.0}


def test_frequency_is_that_of_the_elastic_branch():
    assert Structure(0.5, 0.05, 1.0, 0.01, 0.1).frequency == pytest.approx(4.0 * math.pi)


def test_defaults_are_those_of_a_linear_structure_on_the_ground():
    structure = Structure(**GOOD)
    assert structure.yield_displacement == math.inf
    assert (structure.hardening, structure.participation) == (0.0, 1.0)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("period", 0.0),
        ("damping", 1.0),
        ("mass", -1.0),
        ("yield_displacement", 0.0),
        ("hardening", 1.0),
        ("participation", -0.1),
        ("period", [1.0, 2.0]),
        ("mass", math.nan),
    ],
)
def test_bad_numbers_are_named(name, value):
    with pytest.raises(ValueError, match=name):
        Structure(**GOOD | {name: value})


def test_a_structure_is_not_changed():
    structure = Structure(**GOOD)
    with pytest.raises(AttributeError):
        structure.period = 2.0


def test_structures_that_yield_are_refused_where_only_linear_ones_belong():
    linear, bilinear = Structure(**GOOD), Structure(**GOOD, yield_displacement=0.02)
    refuse_bilinear([linear, linear])
    with pytest.raises(ValueError, match=r"yield_displacement must be infinite here, got 0\.02"):
        refuse_bilinear([linear, bilinear])


def test_arguments_broadcast_to_one_value_per_pair():
    # mutation: structures exchanged, a default of another field
    pairs = Pairs.of(period_1=[[1.0], [2.0]], gap=[0.1, 0.2, 0.3], mass_2=5.0, mass_1=4.0)
    assert pairs.shape == (2, 3)
    assert pairs.gap.tolist() == [0.1, 0.2, 0.3] * 2
    assert (pairs.mass[:, 0].tolist(), pairs.mass.shape) == ([4.0, 5.0], (2, 6))
    assert np.isinf(pairs.yield_displacement).all()
    assert (pairs.participation == 1.0).all()


@pytest.mark.parametrize("name", PAIR_CHECKS)
def test_every_argument_of_pairs_is_checked_under_its_own_name(name):
    # mutation: a check left out, the name of structure 1 for structure 2
    for argument in (name, f"{name}_2"):
        with pytest.raises(ValueError, match=rf"^{argument} "):
            Pairs.of(**{argument: np.nan})
