"""Rules of codes against their clauses worked by hand, and empty cells where inputs lack."""

import re
from pathlib import Path
from typing import get_args

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose
from pydantic import ValidationError

from per_obspy.config import Building, Codes
from per_obspy.config.screening import CodeRule
from per_obspy.inventory.completion import completed_pairs
from per_obspy.screening.codes import NTC_SIMPLIFIED, code_columns, code_rules, required_gaps
from per_obspy.screening.ranking import kept_apart, without_gap

REGION = Codes(ntc_zone="III", gb_intensity=8)


def _pairs(**columns):
    """Return completed pairs of 24 m concrete frames of 8 aligned storeys, with these changes."""
    size = {"height_1": 24.0, "height_2": 24.0, "storeys_1": 8.0, "storeys_2": 8.0}
    kind = {"system_1": "concrete_mrf", "system_2": "concrete_mrf", "position": "inside"}
    given = {"gap": 0.1} | size | kind | columns
    # as many pairs as the longest change; all at one place
    count = max(np.size(values) for values in given.values())
    place = dict.fromkeys(("longitude_1", "latitude_1", "longitude_2", "latitude_2"), 0.0)
    table = pd.DataFrame({"pair_id": [f"p{i}" for i in range(count)], **place})
    return completed_pairs(table.assign(**given), Building())


def _rule(name, pairs, displacement_1=0.03, displacement_2=0.04, codes=REGION):
    count = len(pairs)
    return required_gaps(
        pairs, np.full(count, displacement_1), np.full(count, displacement_2), codes
    )[name].tolist()


def test_every_column_is_in_the_table_of_rules_with_its_source():
    # would catch a rule without a source, and a stale row of the table
    rules = code_rules().set_index("column")
    columns = required_gaps(_pairs(), [0.03], [0.04], REGION).columns
    assert columns.tolist() == rules.index.tolist()
    for name, rule in rules.iterrows():
        assert ("event_based" in name) == ("SD" in rule["inputs"])
        assert all(rule[["clause", "edition", "inputs", "source", "meaning"]])


def test_a_configuration_names_every_rule_and_no_other():
    names = code_rules()["rule"].tolist()
    assert set(get_args(CodeRule)) == set(names)
    assert Codes(rules=names, gb_intensity=7).rules == tuple(names)
    for rules in (["asce7"], ["required_gap_gem"], [""]):
        with pytest.raises(ValidationError, match="rules"):
            Codes(rules=rules)
    # Without its intensity the Chinese rule would be an empty column
    with pytest.raises(ValidationError, match=r"needs gb_intensity, 6 to 9"):
        Codes(rules=["gb50011-2010"])


def test_only_rules_that_are_asked_for_have_a_column():
    pairs, moved = _pairs(gap=[0.05, 0.04]), np.full((2, 2), 0.025)
    assert code_columns(pairs, *moved, Codes()).shape == (2, 0)
    # The sum of both is 0.05 m, which the first gap just reaches
    one = code_columns(pairs, *moved, Codes(rules=["asce7-16"]))
    assert one.columns.tolist() == ["required_gap_asce7_event_based", "gap_suffices"]
    assert one["gap_suffices"].tolist() == ["yes", "no"]
    # A rule that is not met decides, and a rule without its zone is not guessed
    two = code_columns(pairs, *moved, Codes(rules=["asce7-16", "gem"]))
    assert two["gap_suffices"].tolist() == ["no", "no"]
    zone = code_columns(pairs, *moved, Codes(rules=["asce7-16", "ntc2004"]))
    assert zone["gap_suffices"].tolist() == ["unknown", "no"]


@pytest.mark.parametrize("assumed", [None, 0.5])
def test_an_unknown_gap_suffices_for_no_rule(assumed):
    # would catch the gap of 1000 m that stands for an unknown one, and one that is assumed
    silent = _pairs().drop(columns=["derived", "gap_std"]).assign(gap=np.nan)
    apart = kept_apart(completed_pairs(silent, Building(gap=assumed)))
    table = apart.join(code_columns(apart, [0.03], [0.04], Codes(rules=["asce7-16"])))
    table = without_gap(table.assign(risk_class="low", state="no"))
    assert table["gap_suffices"].tolist() == ["unknown"]


def test_the_page_of_the_documentation_names_every_rule():
    page = (Path(__file__).parents[2] / "docs" / "screening.md").read_text(encoding="utf-8")
    named = re.findall(r"^\| `(required_gap_\w+)` \|", page, re.MULTILINE)
    assert named == code_rules()["column"].tolist()


def test_asce_adds_displacements_unless_both_buildings_are_known_to_be_one_property():
    # would catch a root of squares across a property line, which is up to 0.71 of the sum
    name = "required_gap_asce7_event_based"
    given = _rule(name, _pairs(same_property=["yes", "no", ""]))
    assert_allclose([*given, *_rule(name, _pairs())], [0.05, 0.07, 0.07, 0.07])


@pytest.mark.parametrize(
    ("zone", "expected"),
    # each side SD + share of 24 m: 0.054 + 0.064, 0.102 + 0.112, 0.174 + 0.184; halved, for the
    # buildings are alike
    [("I", 0.059), ("II", 0.107), ("III", 0.179)],
)
def test_ntc_by_zone(zone, expected):
    codes = Codes(ntc_zone=zone)
    assert_allclose(_rule("required_gap_ntc2004_event_based", _pairs(), codes=codes), expected)
    of_the_pair = _pairs(ntc_zone=zone)
    assert_allclose(_rule("required_gap_ntc2004_event_based", of_the_pair, codes=Codes()), expected)


@pytest.mark.parametrize(
    "change",
    [{"system_2": "steel_mrf"}, {"floor_offset": 1.0}, {"system_1": "", "system_2": ""}],
)
def test_ntc_halves_only_pairs_known_to_be_alike(change):
    assert_allclose(_rule("required_gap_ntc2004_event_based", _pairs(**change)), 2 * 0.179)


def test_ntc_takes_the_contact_height_and_at_least_50_mm_on_each_side():
    name = "required_gap_ntc2004_event_based"
    assert_allclose(_rule(name, _pairs(height_2=21.0, storeys_2=7.0)), 0.03 + 0.04 + 2 * 0.006 * 21)
    assert_allclose(_rule(name, _pairs(system_2="other"), 0.0, 0.0, Codes(ntc_zone="I")), 0.1)


@pytest.mark.parametrize(
    ("intensity", "height", "expected"),
    [
        (6, 15.0, 0.10),
        (6, 20.0, 0.12),
        (7, 19.0, 0.12),
        (8, 24.0, 0.16),
        (9, 24.0, 0.20),
        (9, 24.1, 0.20),
        (8, 6.0, 0.1),
    ],
)
def test_gb_widens_by_started_steps_above_15_m_of_the_lower_building(intensity, height, expected):
    pairs = _pairs(height_1=height, storeys_1=round(height / 3), height_2=45.0, storeys_2=15.0)
    assert_allclose(
        _rule("required_gap_gb50011_2010", pairs, codes=Codes(gb_intensity=intensity)), expected
    )


@pytest.mark.parametrize(
    ("systems", "factor"),
    [
        (("concrete_frame_wall", "concrete_frame_wall"), 0.7),
        (("concrete_wall", "concrete_wall"), 0.5),
        (("steel_mrf", "steel_mrf"), 1.5),
        (("ebf_brbf", "steel_mrf"), 1.5),
        # the system that requires more decides
        (("concrete_wall", "concrete_mrf"), 1.0),
        (("steel_mrf", "concrete_wall"), 1.5),
    ],
)
def test_gb_by_system(systems, factor):
    size = {"height_1": 45.0, "height_2": 45.0, "storeys_1": 15.0, "storeys_2": 15.0}
    pairs = _pairs(**size, system_1=systems[0], system_2=systems[1])
    # 100 mm + 10 steps of 3 m above 15 m
    assert_allclose(_rule("required_gap_gb50011_2010", pairs), factor * 0.3)


def test_gb_asks_for_100_mm_at_least():
    walls = _pairs(system_1="concrete_wall", system_2="concrete_wall")
    assert_allclose(_rule("required_gap_gb50011_2010", walls), 0.1)


def test_gb_is_empty_for_other_systems():
    assert np.isnan(_rule("required_gap_gb50011_2010", _pairs(system_2="other")))
    assert np.isnan(_rule("required_gap_gb50011_2010", _pairs(system_1="")))


def test_the_turkish_rule_takes_the_larger_of_height_and_displacement():
    name = "required_gap_tbdy2018_event_based"
    assert_allclose(_rule(name, _pairs(), 0.0, 0.0), 0.09)  # 30 mm + 6 steps of 3 m above 6 m
    assert_allclose(_rule(name, _pairs(height_1=6.0, storeys_1=2.0), 0.0, 0.0), 0.03)
    assert_allclose(_rule(name, _pairs(), 0.3, 0.4), 0.125)
    assert_allclose(_rule(name, _pairs(floor_offset=1.0), 0.3, 0.4), 0.25)


def test_the_worked_example_of_the_turkish_rule():
    # Published example: reduced displacements of 18 and 24 mm, R / I = 8, 12 m high: 60 mm with
    # floors at one level, 120 mm otherwise, and 50 mm at least
    pairs = _pairs(height_1=12.0, height_2=12.0, storeys_1=4.0, storeys_2=4.0)
    name, elastic = "required_gap_tbdy2018_event_based", (8 * 0.018, 8 * 0.024)
    assert_allclose(_rule(name, pairs, *elastic), 0.060)
    assert_allclose(_rule(name, pairs.assign(floor_offset=1.5), *elastic), 0.120)
    assert_allclose(_rule(name, pairs, 0.0, 0.0), 0.050)


def test_the_indian_rule_with_its_amendment():
    name = "required_gap_is1893_amended_event_based"
    assert_allclose(_rule(name, _pairs()), 0.035)
    assert_allclose(_rule(name, _pairs(floor_offset=1.0)), 0.07)


@pytest.mark.parametrize(
    ("height", "displacements", "expected"),
    # 0.006 of 24 m; 30 mm; two thirds of the sum, which was left out and is the largest here
    [(24.0, (0.03, 0.04), 0.144), (3.0, (0.0, 0.0), 0.03), (24.0, (0.15, 0.15), 0.2)],
)
def test_the_peruvian_rule_is_the_largest_of_three(height, displacements, expected):
    pairs = _pairs(height_1=height, storeys_1=round(height / 3))
    assert_allclose(_rule("required_gap_e030_event_based", pairs, *displacements), expected)


@pytest.mark.parametrize(
    ("ground", "displacement", "expected"),
    # 24 m: 0.01 h 2 a_g S, at most 0.01 h, which also holds where a_g S is unknown
    [(0.25, 0.0, 0.12), (0.8, 0.0, 0.24), (None, 0.0, 0.24), (0.25, 0.2, 0.4)],
)
def test_the_italian_rule(ground, displacement, expected):
    codes = Codes(italy_ground=ground)
    name = "required_gap_ntc2018_italy_event_based"
    assert_allclose(_rule(name, _pairs(), displacement, displacement, codes), expected)


@pytest.mark.parametrize(
    ("change", "expected"),
    # 24 m: 0.12 m on each side; displacements of 0.2 and 0.05 m where they count
    [
        ({"importance_1": 1.0, "importance_2": 1.0}, 0.24),
        ({"importance_1": 1.4, "importance_2": 1.0}, 0.32),
        ({}, 0.32),
        ({"importance_1": 1.0, "importance_2": 1.0, "storeys_1": 9.0}, 0.32),
        # within one property: squares of two displacements, never of a share of the height
        ({"importance_1": 1.0, "importance_2": 1.0, "same_property": "yes"}, 0.24),
        ({"same_property": "yes"}, 0.32),
    ],
)
def test_the_iranian_rule_by_storeys_and_importance(change, expected):
    pairs = _pairs(**change)
    assert_allclose(_rule("required_gap_iran2800_event_based", pairs, 0.2, 0.05), expected)


@pytest.mark.parametrize(("same", "expected"), [("no", 0.35), ("yes", 0.25), ("", 0.35)])
def test_the_iranian_rule_adds_squares_of_displacements_within_one_property(same, expected):
    # Importance is unknown: displacements of 0.15 and 0.2 m count, both above 0.12 m of the share
    pairs = _pairs(same_property=same)
    assert_allclose(_rule("required_gap_iran2800_event_based", pairs, 0.15, 0.2), expected)


def test_the_algerian_rule():
    name = "required_gap_rpa2024_event_based"
    assert_allclose(_rule(name, _pairs()), 0.05)
    assert_allclose(_rule(name, _pairs(), 0.0, 0.001), 0.04)


def test_the_gem_rule():
    assert_allclose(_rule("required_gap_gem", _pairs(height_2=12.0, storeys_2=4.0)), 0.48)


@pytest.mark.parametrize("zone", list(NTC_SIMPLIFIED))
def test_the_simplified_mexican_rule(zone):
    codes, other = Codes(ntc_zone=zone), _pairs(system_2="other")
    simplified = 2 * 24 * NTC_SIMPLIFIED[zone]
    assert_allclose(_rule("required_gap_ntc2004_simplified", other, codes=codes), simplified)
    alike = _rule("required_gap_ntc2004_simplified", _pairs(), codes=codes)
    assert_allclose(alike, simplified / 2)


def test_gaps_never_shrink_with_displacement_or_height():
    # would catch a minimum in place of a maximum, and a share with the wrong sign
    heights = np.array([3.0, 6.0, 9.0, 15.0, 24.0, 45.0])
    # never as high as the other: between equal buildings Mexico City's gap is halved
    size = {"height_1": heights, "height_2": 48.0, "storeys_1": heights / 3, "storeys_2": 16.0}
    codes = Codes(ntc_zone="II", gb_intensity=7, italy_ground=0.3)
    gaps = {}
    for factor in (0.0, 1.0, 3.0):
        displacement = np.full(len(heights), 0.05 * factor)
        table = required_gaps(_pairs(**size), displacement, displacement, codes)
        gaps[factor] = table.filter(regex="^required_gap_").astype(float)
        assert (gaps[factor].diff().dropna() >= 0).all(axis=None)
    assert (gaps[1.0] >= gaps[0.0]).all(axis=None)
    assert (gaps[3.0] >= gaps[1.0]).all(axis=None)
    # in metres: of 15 cm on both sides no rule asks for less than a quarter or more than 2 m
    based = gaps[3.0].filter(regex="event_based")
    assert ((based > 0.25 * 0.15) & (based < 2.0)).all(axis=None)


def test_a_rule_without_its_inputs_stays_empty_instead_of_guessing():
    # would catch unknown floors taken as aligned, and a region assumed
    silent = dict.fromkeys(("height_1", "height_2", "storeys_1", "storeys_2"), np.nan)
    pairs = _pairs(**silent, period_1=0.5, period_2=0.8, system_1="", system_2="")
    row = required_gaps(pairs, [0.03], [0.04], Codes()).iloc[0]
    known = row.dropna()
    # unknown floors are not aligned, an unknown property is not one
    expected = {
        "asce7_event_based": 0.07,
        "is1893_amended_event_based": 0.07,
        "rpa2024_event_based": 0.05,
    }
    assert known.index.tolist() == [f"required_gap_{name}" for name in expected]
    assert_allclose(known.astype(float), list(expected.values()))


def test_event_based_rules_keep_the_order_and_scale_of_the_buildings():
    # would catch a building taken twice, and a displacement in other units
    pairs = _pairs(system_2="other", gap=[0.0, 0.1, 0.2])
    once = required_gaps(pairs, [0.1, 0.2, 0.3], [0.3, 0.1, 0.2], REGION)
    swapped = required_gaps(pairs, [0.3, 0.1, 0.2], [0.1, 0.2, 0.3], REGION)
    pd.testing.assert_frame_equal(once, swapped)
    double = required_gaps(pairs, [0.2, 0.4, 0.6], [0.6, 0.2, 0.4], REGION)
    for name in ("asce7_event_based", "is1893_amended_event_based"):
        assert_allclose(double[f"required_gap_{name}"], 2 * once[f"required_gap_{name}"])


def test_a_displacement_that_is_none_is_refused():
    with pytest.raises(ValueError, match=r"displacement_2 must be zero or more, got -0.1"):
        required_gaps(_pairs(), [0.1], [-0.1], REGION)
