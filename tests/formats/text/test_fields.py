"""Headers of ``name: value`` lines."""

import pytest

from per_obspy.errors import RecordRejected
from per_obspy.formats.text.fields import (
    count_field,
    interval_field,
    number_field,
    read_fields,
    required_field,
    text_field,
)
from per_obspy.formats.text.lines import Text

TEXT = Text(
    "some.file",
    ["#NAME  OF : Some: Town", "POINTS:  12", "DT: 0.01", "DEPTH: unknown", "CODE:", "POINTS: 13"],
)
FIELDS = read_fields(TEXT, 6)


def test_names_are_single_spaced_and_the_first_of_them_counts():
    assert text_field(FIELDS, "NAME OF") == "Some: Town"
    assert count_field(TEXT, FIELDS, "POINTS") == 12
    assert interval_field(TEXT, FIELDS, "DT") == 0.01


def test_unknown_values_are_absent():
    assert number_field(TEXT, FIELDS, "DEPTH") is None
    assert number_field(TEXT, FIELDS, "NOWHERE") is None
    assert text_field(FIELDS, "CODE") is None
    assert text_field(FIELDS, "NOWHERE") is None


@pytest.mark.parametrize(
    ("name", "message"),
    [("NOWHERE", "line 1, NOWHERE: the header has no such field"), ("CODE", "line 5, CODE: empty")],
)
def test_required_values_must_be_there(name: str, message: str):
    with pytest.raises(RecordRejected, match=f"some.file: {message}"):
        required_field(TEXT, FIELDS, name)


def test_words_are_no_numbers():
    with pytest.raises(RecordRejected, match="line 1, NAME OF: 'Some: Town' is not a number"):
        number_field(TEXT, FIELDS, "NAME OF")


def test_lines_after_the_header_are_no_fields():
    assert set(read_fields(TEXT, 2)) == {"NAME OF", "POINTS"}
