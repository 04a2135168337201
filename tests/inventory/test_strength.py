"""Yield displacements by HAZUS: its own table, scaling, and systems without capacity."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.inventory.strength import hazus_yield_displacement

INCH = 0.0254

#: Yield displacement (inches) and period (s) of HAZUS-MH, moderate code, of the same source as the
#: accelerations of the module: low-, mid- and high-rise classes of 2, 5 and 10 storeys.
HAZUS = {
    "steel_mrf": ((0.31, 0.50), (0.89, 1.08), (2.33, 2.21)),
    "concrete_mrf": ((0.20, 0.40), (0.58, 0.75), (1.01, 1.45)),
    "concrete_wall": ((0.24, 0.35), (0.52, 0.56), (1.47, 1.09)),
    "ebf_brbf": ((0.31, 0.40), (1.21, 0.86), (3.87, 1.77)),
    "reinforced_masonry": ((0.32, 0.35), (0.69, 0.56), (1.96, 1.09)),
    # low code, as it has no other; two classes
    "masonry": ((0.24, 0.35), (0.27, 0.50)),
}


@pytest.mark.parametrize("system", HAZUS)
def test_the_displacements_of_the_table_follow_from_accelerations_and_periods(system):
    inches, periods = np.transpose(HAZUS[system])
    found = hazus_yield_displacement(periods, system, [2, 5, 10][: len(periods)], "moderate")
    # two digits of the displacement: 0.005 of 0.20 inches are 2.5 %
    assert_allclose(found, inches * INCH, rtol=0.026)


def test_strength_goes_with_the_code_level_and_the_square_of_the_period():
    moderate = hazus_yield_displacement(1.0, "concrete_mrf", 5, "moderate")
    assert_allclose(hazus_yield_displacement(2.0, "concrete_mrf", 5, "moderate"), 4 * moderate)
    # HAZUS-MH, C1M: 0.208 g of high, 0.104 g of moderate, 0.052 g of low code
    assert_allclose(hazus_yield_displacement(1.0, "concrete_mrf", 5, "high"), 2 * moderate)
    assert_allclose(hazus_yield_displacement(1.0, "concrete_mrf", 5, "low"), moderate / 2)
    # unreinforced masonry has no code
    masonry = [hazus_yield_displacement(1.0, "masonry", 5, level) for level in ("low", "high")]
    assert masonry[0] == masonry[1]


def test_rises_change_at_four_and_eight_storeys():
    storeys = [1, 3, 4, 7, 8, 40]
    found = hazus_yield_displacement(1.0, "concrete_mrf", storeys, "moderate")
    assert_allclose(found / found[0], np.repeat([1.0, 0.104 / 0.125, 0.049 / 0.125], 2))


def test_unknown_systems_and_unknown_storeys_have_none():
    found = hazus_yield_displacement(1.0, ["other", "steel_mrf"], [3.0, np.nan], "moderate")
    assert np.isnan(found).all()
