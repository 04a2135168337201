"""One row per building, from its sides and their pairs."""

import duckdb
import numpy as np
import pandas as pd
import pytest

from per_obspy.buildings.columns import BUILDINGS, ROWS
from per_obspy.buildings.sides import (
    ELSEWHERE,
    MEASURE,
    NOTHING,
    OF_PAIRS,
    UNKNOWN,
    building_table,
    directions,
)
from per_obspy.buildings.tables import sides_query
from per_obspy.screening.ranking import UNKNOWN_CLASS

CLASSES = {"high": 0.2, "low": 0.0}

#: A row a-b-c to the east whose second pair is turned, and a pair c-d to the north.
NAMES = ["a", "b", "c", "d"]


def interfaces(**columns):
    table = pd.DataFrame(
        {
            "row_id": ["R-p0", "R-p0", "R-p2"],
            "buildings": [3, 3, 2],
            "interface": [1, 2, 1],
            "pair_id": ["p0", "p1", "p2"],
            "turned": [False, True, False],
            "building_number_left": [0, 1, 2],
            "building_number_right": [1, 2, 3],
            "amplification_left": [1.1, 2.0, 1.2],
            "amplification_right": [2.0, 1.3, 1.0],
            "amplification_alone_left": [1.0, 1.5, 1.2],
            "amplification_alone_right": [1.6, 1.2, 1.0],
            "displacement_left": 0.1,
            "displacement_right": 0.1,
            "azimuth": [90.0, 90.0, 0.0],
            "station": "XX.A",
            "gap": 0.1,
            "impacts": [3.0, 0.0, 2.0],
            "impact_velocity": [0.3, 0.0, 0.1],
            "impact_velocity_84": [0.36, 0.0, 0.11],
            "impacts_alone": [1.0, 0.0, 2.0],
            "impact_velocity_alone": [0.1, 0.0, 0.1],
            "flags": ["", "fork", ""],
            "area": ["x", "y", "x"],
            "rank": [2, 3, 1],
            "state": ["yes", "no", "possible"],
            "probability": [0.9, 0.001, 0.2],
            "weighted_velocity": [0.05, 0.0, 0.15],
            "missing_gap": [0.02, 0.0, 0.01],
            "supplemental_damping": [np.nan, 0.0, 0.1],
            "bumper_restitution": [0.4, 1.0, 0.3],
            "floors_misaligned": [False, False, True],
            UNKNOWN: 0.0,
        }
    ).assign(**columns)
    for side in ("left", "right"):
        table[f"building_id_{side}"] = [NAMES[k] for k in table[f"building_number_{side}"]]
    # position and importance by building 1 and 2 of each pair
    for i in (1, 2):
        first = (table["turned"] == (i == 2)).to_numpy()
        number = np.where(first, table["building_number_left"], table["building_number_right"])
        table[f"longitude_{i}"], table[f"latitude_{i}"] = 10.0 + number, 40.0 + number
        table[f"importance_{i}"], table[f"occupants_{i}"] = number.astype(float), np.nan
    return table


def buildings(angle=30.0, **columns):
    table = interfaces(**columns)
    table = table.assign(**directions(table["azimuth"], table["flags"]))
    with duckdb.connect() as database:
        database.register("interfaces", table)
        sides = database.sql(sides_query(list(table))).to_arrow_table().to_pandas()
    return building_table(sides, CLASSES, angle).set_index("building_id")


def test_the_sides_use_columns_that_the_tables_have():
    known = {column.name for column in ROWS} | set(OF_PAIRS) | {"area", UNKNOWN}
    assert set(interfaces()) <= known


def test_every_column_is_there():
    assert set(buildings().reset_index()) == {
        *(column.name for column in BUILDINGS if column.name != "rank"),
        "building_number",
        UNKNOWN,
    }


def test_a_building_has_its_own_place_whichever_the_order_of_the_pair():
    found = buildings()
    assert found["longitude"].to_dict() == {"a": 10.0, "b": 11.0, "c": 12.0, "d": 13.0}
    assert found["importance"].tolist() == [0.0, 1.0, 2.0, 3.0]


def test_severity_is_that_of_the_pair_and_what_the_row_adds():
    found = buildings()
    # a, b: 0.05 + (0.3 - 0.1); c, d: 0.15
    assert found["severity"].tolist() == pytest.approx([0.25, 0.25, 0.15, 0.15])
    assert found["risk_class"].tolist() == ["high", "high", "low", "low"]
    assert found["worst_neighbour"].tolist() == ["b", "a", "d", "c"]
    assert found["worst_azimuth"].tolist() == [90.0, 270.0, 0.0, 180.0]
    assert found["area"].tolist() == ["x"] * 4


def test_a_row_that_softens_a_hit_takes_nothing_away():
    found = buildings(impact_velocity=0.0)
    assert found["severity"].tolist() == pytest.approx([0.05, 0.05, 0.15, 0.15])


def test_the_probability_lies_between_both_bounds():
    found = buildings()
    assert found.loc["b", "probability_common"] == 0.9
    # either of two independent neighbours: 1 - 0.1 * 0.999
    assert found.loc["b", "probability_independent"] == pytest.approx(1 - 0.1 * 0.999)
    assert found.loc["a", "probability_independent"] == pytest.approx(0.9)
    assert (found["probability_independent"] >= found["probability_common"]).all()


def test_positions():
    assert buildings()["position"].to_dict() == {
        "a": "end", "b": "inside", "c": "corner", "d": "single",
    }  # fmt: skip


@pytest.mark.parametrize(("axis", "expected"), [(179.0, "end"), (40.0, "end"), (110.0, "corner")])
def test_a_corner_turns_by_more_than_the_angle(axis, expected):
    # axes of 1 and 179 degrees are near each other
    found = buildings(angle=45.0, azimuth=[1.0, 1.0, axis])
    assert found.loc["c", "position"] == expected


def test_hits_are_counted_by_the_side_from_which_they_come():
    found = buildings()
    assert found["impacts"].tolist() == [3, 3, 2, 2]
    assert found["impacts_east"].tolist() == [3, 0, 0, 0]
    assert found["impacts_west"].tolist() == [0, 3, 0, 0]
    assert found["impacts_north"].tolist() == [0, 0, 2, 0]
    assert found["impacts_south"].tolist() == [0, 0, 0, 2]


def test_hits_from_an_unknown_side_count_only_as_a_whole():
    found = buildings(flags=["", "", "unknown_azimuth"])
    assert found.loc["d", "impacts"] == 2
    assert found.loc["d", ["impacts_north", "impacts_south"]].tolist() == [0, 0]
    assert np.isnan(found.loc["d", "worst_azimuth"])


def test_neighbours_that_can_hit_do_so_by_their_state_or_in_the_row():
    assert buildings()["neighbours"].tolist() == [1, 2, 2, 1]
    assert buildings()["neighbours_that_can_hit"].tolist() == [1, 1, 1, 1]
    hit = buildings(impact_velocity=[0.3, 0.01, 0.1])
    assert hit["neighbours_that_can_hit"].tolist() == [1, 2, 2, 1]


def test_a_neighbour_around_a_corner_counts_once():
    found = buildings(building_number_right=[1, 2, 1])
    assert found.loc["b", "neighbours"] == 2


def test_amplifications_are_the_largest_of_the_rows_and_of_the_pairs_alone():
    found = buildings()
    assert found["amplification_row"].tolist() == [1.1, 2.0, 1.3, 1.0]
    assert found["amplification_pair"].tolist() == [1.0, 1.6, 1.2, 1.0]


def test_measures_must_hold_on_all_sides():
    found = buildings()
    assert found["missing_gap"].tolist() == [0.02, 0.02, 0.01, 0.01]
    # no damping is enough for the pair a-b, 0.1 for c-d
    np.testing.assert_array_equal(found["supplemental_damping"], [np.nan, np.nan, 0.1, 0.1])
    assert found["bumper_restitution"].tolist() == [0.4, 0.4, 0.3, 0.3]
    assert found.loc["c", "prevention"] == (
        "up to 0.010 m more gap (to d first); or 0.10 of critical more damping in it and its "
        "neighbours; softened by bumpers of restitution 0.30 or less"
    )


def test_where_no_gap_is_missing_nothing_or_the_row_would_have_to_change():
    apart = buildings(missing_gap=0.0, impact_velocity=[0.3, 0.0, 0.0])
    assert apart.loc["a", "prevention"] == ELSEWHERE
    assert apart.loc["d", "prevention"] == NOTHING


def test_flags_are_those_of_its_rows_and_its_own():
    found = buildings(impact_velocity=[0.3, 0.1, 0.1])
    assert found["flags"].to_dict() == {
        "a": "",
        "b": "fork hit_only_in_row",
        "c": "fork hit_only_in_row floor_to_column",
        "d": "floor_to_column",
    }


def test_without_histories_what_they_tell_is_empty():
    none = dict.fromkeys(
        ["impacts", "impact_velocity", "impacts_alone", "impact_velocity_alone"], np.nan
    )
    none |= {f"amplification_{side}": np.nan for side in ("left", "right")}
    found = buildings(**none)
    assert (
        found[["impacts", "impacts_east", "impact_velocity", "amplification_row"]]
        .isna()
        .all(axis=None)
    )
    assert found["severity"].tolist() == pytest.approx([0.05, 0.05, 0.15, 0.15])


def test_an_unknown_gap_is_never_taken_for_a_wide_one():
    unknown = {
        "probability": [np.nan, 0.001, np.nan],
        "state": ["unknown", "no", "unknown"],
        "weighted_velocity": [np.nan, 0.0, np.nan],
        "missing_gap": [np.nan, 0.0, np.nan],
    }
    nothing = {"impact_velocity": np.nan, "impact_velocity_alone": np.nan, "impacts": np.nan}
    found = buildings(**unknown, **nothing)
    assert found["neighbours_that_can_hit"].tolist() == [1, 1, 1, 1]
    assert found["prevention"].tolist() == [MEASURE] * 4
    # b and c have one known gap; nothing is known of a and d
    assert found["risk_class"].tolist() == [UNKNOWN_CLASS, "low", "low", UNKNOWN_CLASS]
    np.testing.assert_array_equal(found["severity"], [np.nan, 0.0, 0.0, np.nan])
    np.testing.assert_array_equal(found["probability_common"].isna(), [True, False, False, True])
    assert found["missing_gap"].isna().all()
