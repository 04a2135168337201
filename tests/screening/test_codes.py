"""Rules of codes against their clauses worked by hand, and empty cells where inputs lack."""

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from per_obspy.config import Building, Codes
from per_obspy.inventory.completion import completed_pairs
from per_obspy.screening.codes import code_columns, code_rules

REGION = Codes(ntc_zone="III", gb_intensity=8, fema_seismicity="high")
INCH = 0.0254


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
    return code_columns(
        pairs, np.full(count, displacement_1), np.full(count, displacement_2), codes
    )[name].tolist()


def test_every_column_is_in_the_table_of_rules_with_its_source():
    # would catch a rule without a source, an unverified one without its label, and a stale row of
    # the table
    rules = code_rules().set_index("column")
    columns = code_columns(_pairs(), [0.03], [0.04], REGION).columns
    assert columns.tolist() == rules.index.tolist()
    assert set(rules["verified"]) == {"yes", "no"}
    for name, rule in rules.iterrows():
        assert name.endswith("_unverified") == (rule["verified"] == "no")
        assert ("event_based" in name) == ("SD" in rule["inputs"])
        assert all(rule[["clause", "edition", "inputs", "source", "meaning"]])


def test_the_page_of_the_documentation_names_every_rule():
    page = (Path(__file__).parents[2] / "docs" / "screening.md").read_text(encoding="utf-8")
    named = re.findall(r"^\| `(\w+)` \|", page, re.MULTILINE)
    assert named == code_rules()["column"].tolist()


def test_asce_and_eurocode_combine_by_the_root_of_the_squares():
    assert_allclose(_rule("required_gap_asce7_event_based", _pairs()), 0.05)
    assert_allclose(_rule("required_gap_ec8_event_based_unverified", _pairs()), 0.7 * 0.05)
    misaligned = _pairs(floor_offset=1.0)
    assert_allclose(_rule("required_gap_ec8_event_based_unverified", misaligned), 0.05)


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


def test_gb_is_empty_for_other_systems():
    assert np.isnan(_rule("required_gap_gb50011_2010", _pairs(system_2="other")))


def test_the_turkish_rule_takes_the_larger_of_height_and_displacement():
    name = "required_gap_tbdy2018_event_based_unverified"
    assert_allclose(_rule(name, _pairs(), 0.0, 0.0), 0.09)  # 30 mm + 6 steps of 3 m above 6 m
    assert_allclose(_rule(name, _pairs(height_1=6.0, storeys_1=2.0), 0.0, 0.0), 0.03)
    assert_allclose(_rule(name, _pairs(), 0.4, 0.4), 0.2)
    assert_allclose(_rule(name, _pairs(floor_offset=1.0), 0.4, 0.4), 0.4)


def test_rules_of_sum_and_height():
    assert_allclose(_rule("required_gap_is1893_event_based_unverified", _pairs()), 0.035)
    assert_allclose(
        _rule("required_gap_is1893_event_based_unverified", _pairs(floor_offset=1.0)), 0.07
    )
    assert_allclose(_rule("required_gap_e030_unverified", _pairs()), 0.144)
    assert_allclose(
        _rule("required_gap_e030_unverified", _pairs(height_1=3.0, storeys_1=1.0)), 0.03
    )
    assert_allclose(_rule("required_gap_gem", _pairs(height_2=12.0, storeys_2=4.0)), 0.48)


@pytest.mark.parametrize(
    ("seismicity", "inches"),
    [("very_high", 2.0), ("high", 1.5), ("moderately_high", 1.0), ("lower", 0.5)],
)
def test_fema_asks_for_inches_a_storey_of_the_shorter_building(seismicity, inches):
    pairs = _pairs(storeys_2=12.0, height_2=36.0)
    codes = Codes(fema_seismicity=seismicity)
    assert_allclose(
        _rule("required_gap_fema_p154_unverified", pairs, codes=codes), 8 * inches * INCH
    )


@pytest.mark.parametrize(
    ("change", "flags"),
    [
        ({"gap": 0.5}, ""),
        ({"gap": 0.1}, "separation"),
        ({"gap": 0.5, "floor_offset": 0.62}, "floor_misalignment"),
        ({"gap": 0.1, "floor_offset": 0.60}, "separation"),
        ({"gap": 0.1, "floor_offset": -0.62}, "separation floor_misalignment pounding"),
        (
            {"gap": 0.1, "storeys_2": 10.0, "height_2": 30.0},
            "separation height_difference pounding",
        ),
        ({"gap": 0.1, "storeys_2": 9.0, "height_2": 27.0}, "separation"),
        ({"gap": 0.1, "position": "end"}, "separation end_of_row pounding"),
        ({"gap": 0.5, "position": "end"}, "end_of_row"),
    ],
)
def test_fema_flags(change, flags):
    assert _rule("fema_p154_flags_unverified", _pairs(**change)) == [flags]


@pytest.mark.parametrize(
    ("gap", "aligned", "misaligned"),
    [(0.0, 0.7, 0.4), (0.119, 0.7, 0.4), (0.2, 0.8, 0.7), (0.25, 1.0, 0.8)],
)
def test_nzsee_factors(gap, aligned, misaligned):
    assert _rule("nzsee_iep_factor_unverified", _pairs(gap=gap)) == [aligned]
    assert _rule("nzsee_iep_factor_unverified", _pairs(gap=gap, floor_offset=1.0)) == [misaligned]


def test_a_rule_without_its_inputs_stays_empty_instead_of_guessing():
    # would catch unknown floors taken as aligned, and a region assumed
    silent = dict.fromkeys(("height_1", "height_2", "storeys_1", "storeys_2"), np.nan)
    pairs = _pairs(**silent, period_1=0.5, period_2=0.8, system_1="", system_2="")
    row = code_columns(pairs, [0.03], [0.04], Codes()).iloc[0]
    known = row.drop("fema_p154_flags_unverified").dropna()
    assert set(known.index) == {
        "required_gap_asce7_event_based",
        "required_gap_ec8_event_based_unverified",
        "required_gap_is1893_event_based_unverified",
    }
    assert_allclose(known.astype(float), [0.05, 0.05, 0.07])  # unknown floors are not aligned
    assert row["fema_p154_flags_unverified"] == ""


def test_event_based_rules_keep_the_order_and_scale_of_the_buildings():
    # would catch a building taken twice, and a displacement in other units
    pairs = _pairs(system_2="other", gap=[0.0, 0.1, 0.2])
    once = code_columns(pairs, [0.1, 0.2, 0.3], [0.3, 0.1, 0.2], REGION)
    swapped = code_columns(pairs, [0.3, 0.1, 0.2], [0.1, 0.2, 0.3], REGION)
    pd.testing.assert_frame_equal(once, swapped)
    double = code_columns(pairs, [0.2, 0.4, 0.6], [0.6, 0.2, 0.4], REGION)
    for name in (
        "asce7_event_based",
        "ec8_event_based_unverified",
        "is1893_event_based_unverified",
    ):
        assert_allclose(double[f"required_gap_{name}"], 2 * once[f"required_gap_{name}"])


def test_a_displacement_that_is_none_is_refused():
    with pytest.raises(ValueError, match=r"displacement_2 must be zero or more, got -0.1"):
        code_columns(_pairs(), [0.1], [-0.1], REGION)
