"""The schema of the pair table is sound in itself."""

import pytest

from per_obspy.inventory.schema import (
    COLUMNS,
    COMPLETED,
    EMPTY,
    ONE_OF,
    ONE_PROPERTY,
    POSITIONS,
    SYSTEMS,
)

EVERY = [*COLUMNS.values(), *COMPLETED.values()]


@pytest.mark.parametrize("column", EVERY, ids=lambda column: column.name)
def test_numbers_have_a_unit_and_a_range_and_text_has_neither(column):
    assert (column.unit != "") == (column.dtype == "float64")
    assert column.low < column.high
    if column.dtype != "float64":
        assert (column.low, column.high) == (-float("inf"), float("inf"))
    assert column.meaning
    assert "\n" not in column.meaning


def test_buildings_have_the_same_columns():
    names = [name.removesuffix("_1") for name in COLUMNS if name.endswith("_1")]
    assert names == [name.removesuffix("_2") for name in COLUMNS if name.endswith("_2")]
    # all but the number of the building
    for name in names:
        first_column, second_column = COLUMNS[f"{name}_1"], COLUMNS[f"{name}_2"]
        meaning = first_column.meaning.replace("building 1", "building 2")
        assert first_column._replace(name=f"{name}_2", meaning=meaning) == second_column


def test_groups_name_columns_and_completed_columns_are_new():
    assert {name for group in ONE_OF for name in group} <= set(COLUMNS)
    assert not set(COMPLETED) & set(COLUMNS)


def test_choices_are_no_words_for_an_empty_cell():
    # would catch a value that the reader takes for a missing one
    assert not EMPTY & {*SYSTEMS, *POSITIONS, *ONE_PROPERTY}
    assert {word.strip().lower() for word in EMPTY} == EMPTY
