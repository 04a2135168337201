"""Completion of the pair table: given values stay, others are derived and marked."""

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from per_obspy import asce7_period, ec8_period
from per_obspy.config import Building
from per_obspy.inventory.completion import completed_pairs
from per_obspy.inventory.contact_height import contact_participation
from per_obspy.inventory.schema import COLUMNS, COMPLETED

PLACE = {
    "pair_id": "a",
    "gap": 0.1,
    "longitude_1": 10.0,
    "latitude_1": 50.0,
    "longitude_2": 10.001,
    "latitude_2": 50.0,
}
SIZES = {"height_1": 12.0, "height_2": 9.0}


def _completed(building=None, **columns):
    table = pd.DataFrame([PLACE | columns])
    return completed_pairs(table, building or Building()).iloc[0]


def test_what_is_given_stays_and_is_not_marked():
    # every quantity of a building, building 2 with 1.1 times the numbers of building 1
    building = {
        "height": 12.0,
        "period": 0.7,
        "damping": 0.02,
        "mass": 4e5,
        "participation": 1.1,
        "yield_displacement": 0.03,
        "hardening": 0.05,
        "period_log_std": 0.1,
        "damping_log_std": 0.2,
    }
    given = {f"{name}_1": value for name, value in building.items()}
    given |= {f"{name}_2": 1.1 * value for name, value in building.items()}
    for i in (1, 2):
        given |= {f"storeys_{i}": 4.0, f"system_{i}": "steel_mrf"}
    # every quantity of the pair
    given |= {"contact_height": 11.0, "floor_offset": 0.2, "restitution": 0.4}
    given |= {"gap_std": 0.01, "azimuth": 30.0, "period_correlation": 0.3}
    row = _completed(**given)
    assert row["derived"] == ""
    assert {name: row[name] for name in given} == given


def test_a_bare_row_is_marked_where_it_was_filled():
    row = _completed(**SIZES)
    both = ("system", "storeys", "period", "damping", "participation", "mass")
    expected = {f"{name}_{i}" for name in both for i in (1, 2)}
    expected |= {"contact_height", "restitution", "period_correlation"}
    assert set(row["derived"].split()) == expected
    assert (row["storeys_1"], row["storeys_2"]) == (4.0, 3.0)
    assert row["contact_height"] == 9.0
    assert_allclose(row["mass_1"] / row["mass_2"], 4 / 3, rtol=1e-14)  # equal areas are assumed
    assert row[["damping_1", "restitution", "gap_std", "hardening_1"]].tolist() == [
        0.05,
        0.65,
        0.0,
        0.0,
    ]
    assert row["yield_displacement_1"] == np.inf
    assert np.isnan(row["azimuth"])


def test_periods_of_alike_neighbours_are_correlated():
    rows = [
        {"system_1": "concrete_mrf", "system_2": "concrete_mrf"},
        {"system_1": "concrete_mrf", "system_2": "concrete_mrf", "storeys_2": 9.0},
        {"system_1": "concrete_mrf", "system_2": "steel_mrf"},
        {"system_1": "concrete_mrf", "period_1": 0.5},
        {"system_1": "concrete_mrf", "period_correlation": 0.7},
        {},
    ]
    alike = {"storeys_1": 4.0, "storeys_2": 4.0, "system_1": "", "system_2": ""}
    table = pd.DataFrame([PLACE | alike | row for row in rows])
    complete = completed_pairs(table, Building())
    # the same system and storeys, one system, two; one period given; given; unknown systems
    assert_allclose(complete["period_correlation"], [0.85, 0.5, 0.2, 0.0, 0.7, 0.655], rtol=1e-14)
    derived = ["period_correlation" in text.split() for text in complete["derived"]]
    assert derived == [True, True, True, False, False, True]


def test_soft_ground_makes_derived_periods_less_certain():
    rows = [
        {"vs30": 179.0},
        {"vs30": 180.0, "site_class": "E"},
        {"vs30": np.nan, "site_class": "E"},
    ]
    rows += [{"site_class": "D"}, {"vs30": 100.0, "period_1": 0.5}]
    table = pd.DataFrame([PLACE | SIZES | row for row in rows]).fillna({"site_class": ""})
    complete = completed_pairs(table, Building())
    # a Vs30 before a class
    assert complete["soft_ground"].tolist() == [True, False, True, False, True]
    expected = [np.hypot(0.4, 0.15), 0.4, np.hypot(0.4, 0.15), 0.4, 0.0]
    assert_allclose(complete["period_log_std_1"], expected, rtol=1e-14)


def test_hazus_gives_a_strength_to_known_systems_without_one():
    rows = [{"system_1": "concrete_mrf"}, {"system_1": ""}, {"yield_coefficient_1": 0.2}]
    given = {"system_1": "concrete_mrf", "system_2": "", "storeys_1": 5.0, "period_1": 0.75}
    table = pd.DataFrame([PLACE | SIZES | given | row for row in rows])
    linear = completed_pairs(table, Building(strength="none"))
    complete = completed_pairs(table, Building())
    # HAZUS-MH, C1M, moderate code: 0.58 inches at 0.75 s, two digits each, the period squared
    assert linear["yield_displacement_1"].tolist()[:2] == [np.inf, np.inf]
    assert_allclose(complete["yield_displacement_1"][0], 0.58 * 0.0254, rtol=0.02)
    assert_allclose(complete["hardening_1"], [0.18, 0.0, 0.0])
    assert complete["yield_log_std_1"].tolist() == [0.4, 0.0, 0.0]
    marked = ["yield_displacement_1" in text.split() for text in complete["derived"]]
    assert marked == [True, False, True]
    # a given strength stays, an unknown system is linear
    assert complete["yield_displacement_1"][1] == complete["yield_displacement_2"][0] == np.inf
    assert complete["yield_displacement_1"][2] == linear["yield_displacement_1"][2]


def test_marks_belong_to_their_row():
    # would catch marks of one row written into another
    table = pd.DataFrame([PLACE | SIZES, PLACE | SIZES | {"period_1": 0.5}, PLACE | SIZES])
    derived = completed_pairs(table, Building())["derived"]
    assert derived[0] == derived[2]
    assert set(derived[0].split()) - set(derived[1].split()) == {"period_1", "period_correlation"}


def test_heights_and_storeys_from_each_other():
    row = _completed(storeys_1=5.0, height_2=10.4)
    assert row["height_1"] == 15.0
    assert row["storeys_2"] == 3.0
    assert {"height_1", "storeys_2"} <= set(row["derived"].split())
    assert _completed(height_1=2.2, height_2=2.2)["storeys_1"] == 1.0  # never less than one


@pytest.mark.parametrize(("formula", "function"), [("asce7", asce7_period), ("ec8", ec8_period)])
def test_periods_come_from_the_configured_formula(formula, function):
    row = _completed(Building(period_formula=formula), **SIZES, system_1="steel_mrf")
    assert row["period_1"] == function(12.0, "steel_mrf")
    assert row["period_2"] == function(9.0, "other")
    assert (row["period_log_std_1"], row["period_log_std_2"]) == (0.3, 0.4)


def test_given_periods_are_taken_as_certain_unless_the_table_says_otherwise():
    row = _completed(**SIZES, period_1=0.4, damping_2=0.03, period_2=0.3, period_log_std_2=0.15)
    assert (row["period_log_std_1"], row["period_log_std_2"]) == (0.0, 0.15)
    assert (row["damping_log_std_1"], row["damping_log_std_2"]) == (0.3, 0.0)


def test_participation_is_seen_at_the_roof_of_the_lower_building():
    row = _completed(height_1=30.0, storeys_1=10.0, height_2=9.0, storeys_2=3.0)
    assert_allclose(row["participation_1"], contact_participation(10, 30.0, 9.0), rtol=1e-15)
    assert_allclose(row["participation_2"], 9 / 7, rtol=1e-15)


def test_a_building_of_unknown_size_is_a_plain_oscillator():
    row = _completed(period_1=0.8, height_2=9.0, mass_2=3e5)
    assert row["participation_1"] == 1.0
    assert_allclose(row["participation_2"], 9 / 7, rtol=1e-15)
    assert row["mass_1"] == row["contact_mass_1"] == 3e5  # as heavy as its neighbour
    assert {"participation_1", "mass_1"} <= set(row["derived"].split())
    assert np.isnan([row["height_1"], row["storeys_1"]]).all()
    bare = _completed(period_1=0.8, period_2=0.9)
    assert bare["mass_1"] == bare["mass_2"] > 0
    assert np.isnan(bare["contact_height"])


def test_mass_from_area_and_storeys():
    row = _completed(Building(mass_per_area=800.0), storeys_1=4.0, area_1=100.0, height_2=9.0)
    assert row["mass_1"] == 800.0 * 100.0 * 4
    assert "mass_1" in row["derived"].split()


@pytest.mark.parametrize(
    ("size", "effective"),
    # 3 (N + 1) / (2 (2 N + 1)); all the mass where neither height nor storeys are known
    [
        ({"storeys_1": 1.0}, 1.0),
        ({"storeys_1": 3.0}, 6 / 7),
        ({"height_1": 30.0}, 11 / 14),
        ({}, 1.0),
    ],
)
def test_yield_displacement_from_coefficient(size, effective):
    # a period of 2 pi makes u_y = C_y g / effective; the coefficient is a share of the whole weight
    row = _completed(**size, storeys_2=3.0, period_1=2 * np.pi, yield_coefficient_1=0.1)
    assert_allclose(row["yield_displacement_1"], 0.980665 / effective, rtol=1e-14)
    assert "yield_displacement_1" in row["derived"].split()
    assert "yield_displacement_2" not in row["derived"].split()


@pytest.mark.parametrize(
    ("columns", "misaligned"),
    [
        ({"storeys_1": 4.0, "storeys_2": 3.0}, False),
        (
            {"storeys_1": 3.0, "storeys_2": 3.0},
            True,
        ),  # floors of the first at 4, 8, 12 m; roof of the second at 9 m
        ({}, False),  # derived storeys have no floors at known heights
        ({"floor_offset": -1.0}, True),
    ],
)
def test_misaligned_floors(columns, misaligned):
    assert _completed(**SIZES, **columns)["floors_misaligned"] == misaligned


def test_middle_of_the_pair():
    row = _completed(**SIZES)
    assert_allclose(
        [row["longitude"], row["latitude"]], [10.0005, 50.0], rtol=1e-13
    )  # turned by 180 degrees and back
    across = _completed(**SIZES | {"longitude_1": 179.9998, "longitude_2": -179.9996})
    assert_allclose(
        across["longitude"], -179.9999, rtol=1e-12
    )  # would catch a mean of 0.0001 degrees


TALL = {
    "height": 30.0,
    "storeys": 10.0,
    "system": "steel_mrf",
    "area": 300.0,
    "yield_coefficient": 0.1,
}
LOW = {"height": 9.0, "period": 0.4, "damping": 0.02}


def _numbered(building, index):
    return {f"{name}_{index}": value for name, value in building.items()}


@pytest.mark.parametrize(
    "name",
    [
        "period",
        "mass",
        "contact_mass",
        "participation",
        "damping",
        "yield_displacement",
        "storeys",
    ],
)
def test_swapping_the_buildings_swaps_the_columns(name):
    # would catch an index 1 where 2 is meant
    straight = _completed(**_numbered(TALL, 1), **_numbered(LOW, 2))
    swapped = _completed(**_numbered(LOW, 1), **_numbered(TALL, 2))
    assert straight[f"{name}_1"] == swapped[f"{name}_2"]
    assert straight[f"{name}_2"] == swapped[f"{name}_1"]


def test_everything_the_physics_needs_is_there_and_named_in_the_schema():
    table = completed_pairs(pd.DataFrame([PLACE | SIZES | {"note": "kept"}]), Building())
    # Names of buildings only where the table has some
    assert set(COMPLETED) - {"name_1", "name_2"} <= set(table.columns)
    assert set(table.columns) <= {*COLUMNS, *COMPLETED, "note"}


def test_the_input_stays():
    table = pd.DataFrame([PLACE | SIZES])
    before = table.copy(deep=True)
    completed_pairs(table, Building())
    pd.testing.assert_frame_equal(table, before)


def test_a_height_from_storeys_has_the_deviation_of_the_storey_height():
    # ASCE 7: T = C h**0.75 for `other`, h**0.9 for concrete frames
    row = _completed(height_1=12.0, storeys_2=3.0, system_1="concrete_mrf", system_2="concrete_mrf")
    assert (row["height_log_std_1"], row["height_log_std_2"]) == (0.0, 0.13)
    assert row["period_log_std_1"] == pytest.approx(0.3)
    assert row["period_log_std_2"] == pytest.approx(np.hypot(0.3, 0.9 * 0.13))


def test_an_estimated_height_counts_as_derived_and_widens_the_period():
    row = _completed(**SIZES, height_log_std_1=0.5)
    assert "height_1" in row["derived"].split()
    assert "height_2" not in row["derived"].split()
    # and so does a contact height that the table has from it
    assert "contact_height" in row["derived"].split()
    row = _completed(**SIZES, height_log_std_1=0.5, contact_height=9.0)
    assert "contact_height" in row["derived"].split()
    row = _completed(**SIZES, height_log_std_1=0.5, contact_height=8.0)
    assert "contact_height" not in row["derived"].split()
    row = _completed(**SIZES, height_log_std_1=0.5)
    assert row["period_log_std_1"] == pytest.approx(np.hypot(0.4, 0.75 * 0.5))
    # a period that is given does not depend on the height
    assert _completed(**SIZES, height_log_std_1=0.5, period_1=0.3)["period_log_std_1"] == 0.0


def test_estimated_storeys_add_their_deviation_to_that_of_the_storey_height():
    row = _completed(height_1=12.0, storeys_2=3.0, height_log_std_2=0.3)
    assert row["height_log_std_2"] == pytest.approx(np.hypot(0.3, 0.13))


def test_the_storey_heights_of_hazus_have_the_default_deviation():
    # HAZUS 5.1 Earthquake Model Technical Manual, table 5-1: typical storeys and heights in feet
    typical = {
        (1, 14): 1, (2, 24): 5, (5, 60): 4, (13, 156): 4, (1, 15): 3, (2, 20): 6, (5, 50): 6,
        (12, 120): 5, (3, 35): 1, (1, 10): 1,
    }  # fmt: skip
    storey = np.concatenate([np.full(count, h / n) for (n, h), count in typical.items()])
    assert np.std(np.log(storey)) == pytest.approx(Building().storey_height_log_std, abs=0.005)
