"""Columns and flags of the risk table: each has a meaning, and the file lists all of them."""

from per_obspy.inventory.schema import COLUMNS, COMPLETED
from per_obspy.screening.codes import rule_columns
from per_obspy.screening.columns import (
    BY_CONTACT,
    CSV_COLUMNS,
    ORDER,
    RESULTS,
    column_table,
    csv_columns,
    known_column,
)
from per_obspy.screening.meanings import FLAGS


def test_every_leading_column_is_known_and_occurs_once():
    # would catch a misspelt name, which would be carried through as a column of the user's own
    assert len(set(ORDER)) == len(ORDER)
    assert [name for name in ORDER if known_column(name) is None] == []
    assert set(RESULTS) <= set(ORDER)


def test_numbers_have_units_and_texts_have_none():
    for column in RESULTS.values():
        assert column.meaning
        if column.name != "rank":
            assert bool(column.unit) == (column.dtype != "str")


def test_columns_of_both_buildings_differ_by_the_number_only():
    # would catch a meaning that was changed for one building
    for name, first in RESULTS.items():
        if name.endswith("_1"):
            second = RESULTS[name.removesuffix("1") + "2"]
            assert second.meaning == first.meaning.replace("building 1: ", "building 2: ")
            assert (second.unit, second.dtype) == (first.unit, first.dtype)


def test_results_do_not_hide_columns_of_the_pair_table():
    # would catch a result whose meaning is overwritten by an input of the same name
    inputs = set(COLUMNS | COMPLETED)
    assert inputs.isdisjoint(RESULTS)
    assert inputs.isdisjoint(rule_columns())
    assert set(RESULTS).isdisjoint(rule_columns())


def test_the_text_has_at_most_thirty_columns_of_the_table():
    # would catch a misspelt name, which no table has
    assert csv_columns([*ORDER, *COLUMNS, *COMPLETED]) == list(CSV_COLUMNS)
    # With all rules of codes too, whose answer stays
    with_rules = csv_columns([*ORDER, *COLUMNS, *COMPLETED, *rule_columns()])
    assert len(with_rules) == 30
    assert with_rules[-2:] == [next(iter(rule_columns())), "gap_suffices"]
    assert [name for name in CSV_COLUMNS if known_column(name) is None] == []
    # as are the numbers that depend on the contact law, those of totals apart
    assert BY_CONTACT - set(RESULTS) == {"worst_expected_impact_velocity"}


def test_the_file_lists_columns_in_their_order_then_every_flag():
    names = ["rank", "gap", "required_gap_gem", "my_colour"]
    table = column_table(names).set_index("name")
    assert table.index.tolist() == [*names, *(f"flag_{name}" for name in FLAGS)]
    assert table.loc["gap", "unit"] == "m"
    assert table.loc["required_gap_gem", "meaning"].startswith("GEM building taxonomy")
    # the text has few columns
    assert table["in_csv"].tolist()[:4] == ["yes", "yes", "yes", "no"]
    # columns of the user's own
    assert table.loc["my_colour", "meaning"] == "carried through from the pair table"
    assert (table["meaning"] != "").all()
