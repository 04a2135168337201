"""Each fault that a row can have, its wording, and all faults of one row together."""

import numpy as np
import pandas as pd
import pytest

from per_obspy.errors import CatalogError
from per_obspy.inventory.checking import check_columns, checked_pairs
from per_obspy.inventory.schema import COLUMNS, COMPLETED, ONE_OF, SYSTEMS


def _row(**changes):
    row = {
        "pair_id": "a",
        "gap": 0.1,
        "longitude_1": 10.0,
        "latitude_1": 50.0,
        "height_1": 12.0,
        "storeys_1": 4.0,
    }
    row |= {"longitude_2": 10.0001, "latitude_2": 50.0, "height_2": 9.0, "storeys_2": 3.0}
    return row | changes


def _reasons(**changes):
    (rejection,) = checked_pairs(pd.DataFrame([_row(**changes)]), "pairs.csv").attrs["rejected"]
    assert rejection[:4] == ("pair", changes.get("pair_id", "a"), "pairs.csv", 2)
    return rejection.reasons


def test_a_good_row_in_the_order_of_the_schema():
    row = dict(reversed(_row(extra="kept").items()))
    pairs = checked_pairs(pd.DataFrame([row]), "pairs.csv")
    assert pairs.attrs["rejected"] == ()
    assert list(pairs.columns) == [*(name for name in COLUMNS if name in row), "extra"]


@pytest.mark.parametrize("east", [179.99995, 180.0, 180.02, 359.9])
def test_longitudes_from_0_to_360_degrees_are_places(east):
    row = _row(longitude_1=east, longitude_2=east + 1e-4)
    pairs = checked_pairs(pd.DataFrame([row]), "pairs.csv")
    for name, given in (("longitude_1", east), ("longitude_2", east + 1e-4)):
        # Degrees of 360 are rounded to 6e-14
        expected = given if given <= 180.0 else given - 360.0
        assert pairs[name][0] == pytest.approx(expected, abs=1e-12)


UNIT_OF_GAP = "(given in millimetres or centimetres by mistake?)"
FRACTION = "(a fraction is expected, not per cent)"


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"gap": -0.01}, "gap = -0.01 m is outside 0 to 10 m"),
        ({"gap": 50.0}, f"gap = 50 m is outside 0 to 10 m {UNIT_OF_GAP}"),
        ({"gap": np.inf}, f"gap = inf m is outside 0 to 10 m {UNIT_OF_GAP}"),
        ({"longitude_1": "east"}, "longitude_1 = 'east' is not a number"),
        ({"latitude_2": ""}, "latitude_2 is empty"),
        ({"height_1": 0.0, "storeys_1": np.nan}, "height_1 = 0 m is outside 2 to 1000 m"),
        ({"height_2": 28.0, "storeys_2": 1.0},
         "height_2 = 28 m with storeys_2 = 1 makes floors of 28 m, outside 2 to 12 m"),
        ({"height_2": 9.0, "storeys_2": 9.0},
         "height_2 = 9 m with storeys_2 = 9 makes floors of 1 m, outside 2 to 12 m"),
        ({"period_1": 0.001}, "period_1 = 0.001 s is outside 0.01 to 20 s"),
        ({"damping_2": 1.0}, f"damping_2 = 1 is outside 0 to 1 {FRACTION}"),
        ({"damping_2": 5.0}, f"damping_2 = 5 is outside 0 to 1 {FRACTION}"),
        ({"damping_1": -0.1}, "damping_1 = -0.1 is outside 0 to 1"),
        ({"mass_1": -2e5}, "mass_1 = -200000 kg is outside 1 to 1e+12 kg"),
        ({"period_1": 500.0}, "period_1 = 500 s is outside 0.01 to 20 s (in milliseconds?)"),
        ({"mass_1": 0.5}, "mass_1 = 0.5 kg is outside 1 to 1e+12 kg"),
        ({"height_1": 999.0, "storeys_1": "3+1"},
         "none of height_1, storeys_1, period_1 is a number, one is needed: storeys_1 = '3+1' is "
         "not a number; height_1 = 999 is a placeholder, not a size"),
        ({"restitution": 1.2},
          "restitution = 1.2 is outside 0 to 1 (a fraction is expected, not per cent)"),
        ({"hardening_1": 1.0}, "hardening_1 = 1 is outside 0 to 1"),
        ({"contact_height": 9.5}, "contact_height = 9.5 m is above the lower building, 9 m"),
        ({"azimuth": -10.0}, "azimuth = -10 degrees is outside 0 to 360 degrees"),
        ({"yield_displacement_1": 1e-9},
         "yield_displacement_1 = 1e-09 m is outside 0.0001 m or more"),
        ({"observed": 0.5}, "observed = 0.5 is neither 0 nor 1"),
        ({"building_id_1": "b7", "building_id_2": "b7"},
         "building_id_1 = building_id_2 = 'b7': a building has no gap to itself"),
    ],
)  # fmt: skip
def test_one_fault(changes, reason):
    assert _reasons(**changes) == (reason,)


def test_swapped_coordinates_outside_their_range_are_suspected():
    reasons = _reasons(longitude_1=19.4, latitude_1=-99.1, longitude_2=19.4, latitude_2=-99.1)
    hint = (
        "is outside -90 to 90 degrees (longitude and latitude swapped, or metres of a projection?)"
    )
    assert reasons == (f"latitude_1 = -99.1 degrees {hint}", f"latitude_2 = -99.1 degrees {hint}")


def test_metres_are_no_degrees_and_no_distance_is_told_of_them():
    metres = dict.fromkeys(("longitude_1", "longitude_2"), 485_000.0) | dict.fromkeys(
        ("latitude_1", "latitude_2"), 2_149_000.0
    )
    reasons = _reasons(**metres)
    assert len(reasons) == 4
    assert all("metres of a projection?" in reason for reason in reasons)


def test_one_building_swapped_within_range_is_found_by_its_neighbour():
    (reason,) = _reasons(longitude_1=50.0, latitude_1=10.0)
    assert "km apart" in reason
    assert "longitude_1 = 50, latitude_1 = 10" in reason


def test_zero_zero_is_no_place():
    reasons = _reasons(longitude_1=0.0, latitude_1=0.0, longitude_2=0.0, latitude_2=0.0)
    assert [reason.split(" = 0 is")[0] for reason in reasons] == [
        "longitude_1 = latitude_1",
        "longitude_2 = latitude_2",
    ]


def test_neighbours_across_the_date_line():
    table = pd.DataFrame([_row(longitude_1=179.9999, longitude_2=-179.9999)])
    assert checked_pairs(table, "pairs.csv").attrs["rejected"] == ()


def test_every_reason_of_a_row_is_told():
    # would catch a check that stops at the first fault
    reasons = _reasons(gap=-1.0, period_1=50.0, longitude_2="east", height_2=1.0, damping_1=2.0)
    assert [reason.split(" = ")[0] for reason in reasons] == [
        "gap",
        "period_1",
        "damping_1",
        "longitude_2",
        "height_2",
        "height_2",
    ]


#: Cells without which a row can be screened -> the note on them.
UNREAD = [
    ({"gap": "a lot"}, "gap = 'a lot' is not a number"),
    ({"system_1": "paper"}, f"system_1 = 'paper' is unknown, expected {', '.join(SYSTEMS)}"),
    ({"system_2": "3"}, f"system_2 = '3' is unknown, expected {', '.join(SYSTEMS)}"),
    ({"same_property": "maybe"}, "same_property = 'maybe' is unknown, expected yes, no"),
    ({"position": "middle"}, "position = 'middle' is unknown, expected end, inside"),
    ({"azimuth": "north"}, "azimuth = 'north' is not a number"),
    ({"damping_1": "five"}, "damping_1 = 'five' is not a number"),
    ({"yield_coefficient_1": "low"}, "yield_coefficient_1 = 'low' is not a number"),
    ({"occupants_2": "many"}, "occupants_2 = 'many' is not a number"),
    ({"vs30": "rock"}, "vs30 = 'rock' is not a number"),
    ({"height_1": "tall"}, "height_1 = 'tall' is not a number"),
    ({"storeys_1": "3+1"}, "storeys_1 = '3+1' is not a number"),
    ({"observed": "perhaps"}, "observed = 'perhaps' is not a number"),
]


@pytest.mark.parametrize(("changes", "note"), UNREAD)
def test_a_cell_that_is_not_needed_keeps_its_row(changes, note):
    pairs = checked_pairs(pd.DataFrame([_row(**changes), _row(pair_id="b")]), "pairs.csv")
    assert pairs.attrs["rejected"] == ()
    assert pairs["cell_notes"].tolist() == [note, ""]
    (name,) = changes
    value = pairs[name][0]
    assert value == "" if COLUMNS[name].dtype == "str" else np.isnan(value)


def test_rows_without_a_name_have_that_of_their_row():
    table = pd.DataFrame([_row(), _row(pair_id=""), _row(pair_id=None)])
    assert checked_pairs(table, "a")["pair_id"].tolist() == ["a", "row 3", "row 4"]
    bare = table.drop(columns="pair_id")
    assert checked_pairs(bare, "a")["pair_id"].tolist() == ["row 2", "row 3", "row 4"]


@pytest.mark.parametrize("index", [0, 1])
def test_a_building_of_unknown_size(index):
    empty = dict.fromkeys(ONE_OF[index], np.nan)
    assert _reasons(**empty) == (f"none of {', '.join(ONE_OF[index])} is a number, one is needed",)


@pytest.mark.parametrize("name", ONE_OF[0])
def test_any_one_size_is_enough(name):
    sizes = dict.fromkeys(ONE_OF[0], np.nan) | {name: 4.0}
    assert checked_pairs(pd.DataFrame([_row(**sizes)]), "pairs.csv").attrs["rejected"] == ()


def test_duplicates_after_the_first_are_rejected():
    table = pd.DataFrame([_row(), _row(pair_id="b"), _row(gap=0.3), _row(gap=0.2)])
    pairs = checked_pairs(table, "pairs.csv")
    assert pairs["gap"].tolist() == [0.1, 0.1]
    # lines of the file: the header is line 1
    assert [rejection.row for rejection in pairs.attrs["rejected"]] == [4, 5]
    assert pairs.attrs["rejected"][0].reasons == ("pair_id = 'a' occurs in an earlier row already",)


@pytest.mark.parametrize("empty", ["", " ", "NA", "nan", "null", "-", None])
def test_an_empty_cell_of_an_optional_column_is_missing(empty):
    pairs = checked_pairs(
        pd.DataFrame([_row(damping_1=empty), _row(pair_id="b", damping_1="0.1")]), "pairs.csv"
    )
    assert pairs.attrs["rejected"] == ()
    assert np.isnan(pairs["damping_1"][0])
    assert pairs["damping_1"][1] == 0.1


def test_an_infinite_yield_displacement_is_a_linear_building():
    pairs = checked_pairs(pd.DataFrame([_row(yield_displacement_1=np.inf)]), "pairs.csv")
    assert pairs["yield_displacement_1"][0] == np.inf


def test_the_table_stays_as_it_was():
    table = pd.DataFrame([_row(gap="0.1"), _row(gap="x")])
    before = table.copy(deep=True)
    checked_pairs(table, "pairs.csv")
    pd.testing.assert_frame_equal(table, before)


def test_whole_table_faults():
    with pytest.raises(
        CatalogError, match=r"pairs.csv: missing column gap \(columns found: pair_id, longitude_1"
    ):
        checked_pairs(pd.DataFrame([_row()]).drop(columns="gap"), "pairs.csv")
    with pytest.raises(CatalogError, match=r"pairs.csv: the table has no rows"):
        checked_pairs(pd.DataFrame([_row()]).iloc[:0], "pairs.csv")


def test_rejections_are_shared_by_every_copy_of_the_table():
    # would catch a plain tuple, which pandas copies element by element in every operation
    pairs = checked_pairs(pd.DataFrame([_row(), _row(pair_id="b", gap=-1.0)]), "pairs.csv")
    assert pairs.assign(more=1).copy().attrs["rejected"] is pairs.attrs["rejected"]


@pytest.mark.parametrize(
    ("name", "problem"),
    [
        (
            "x" * 10_000,
            r"column x{20}\.\.\. has a name of 10000 characters, at most 200",
        ),
        ("a\x07b", r"column 'a\\x07b' has a control character in its name"),
        ("a\nb", "has a control character"),
        ("gap", "column gap occurs more than once"),
    ],
)
def test_names_of_columns_that_no_file_should_have(name, problem):
    names = [*COLUMNS, name]
    with pytest.raises(CatalogError, match=problem) as error:
        check_columns(names, "table")
    assert "\n" not in str(error.value)


def test_good_rows_survive_bad_ones():
    table = pd.DataFrame([_row(pair_id=str(i), gap=-1.0 if i % 3 == 0 else 0.1) for i in range(9)])
    pairs = checked_pairs(table, "pairs.csv")
    assert pairs["pair_id"].tolist() == ["1", "2", "4", "5", "7", "8"]
    assert pairs.index.tolist() == list(range(6))


def test_every_column_has_a_unit_and_a_meaning():
    for column in (*COLUMNS.values(), *COMPLETED.values()):
        assert column.meaning
        assert bool(column.unit) == (column.dtype == "float64")
        assert column.low <= column.high
