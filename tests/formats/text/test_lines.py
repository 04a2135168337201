"""Lines, number fields and blocks of text files."""

import io
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from sample_file import block

from per_obspy.errors import RecordRejected
from per_obspy.formats.text.lines import (
    DECIMAL,
    LONGEST_LINE,
    LONGEST_NUMBER,
    Text,
    block_lines,
    count,
    fixed_block,
    free_block,
    head,
    interval,
    line_at,
    match_line,
    read_text,
)

THOUSANDTHS = st.integers(-99_999, 999_999)


def text_of(content: str) -> Text:
    return Text("some.file", content.split("\n"))


@given(st.lists(THOUSANDTHS, min_size=1, max_size=30), st.integers(1, 8))
def test_blocks_in_columns_are_read_as_written(thousandths: list[int], per_line: int):
    # numbers of seven characters touch: would catch splitting at blanks
    values = np.array(thousandths) / 1000
    text = text_of(block(values, "%7.3f", per_line))
    assert len(text.lines) == block_lines(len(values), per_line)
    assert_array_equal(fixed_block(text, 0, len(values), 7, per_line), values)


@given(st.lists(THOUSANDTHS, min_size=1, max_size=30), st.integers(1, 8))
def test_free_blocks_do_not_depend_on_their_lines(thousandths: list[int], per_line: int):
    values = np.array(thousandths) / 1000
    text = text_of(block(values, " %.3f", per_line))
    assert_array_equal(free_block(text, 0, len(values)), values)


@pytest.mark.parametrize(
    ("content", "samples", "message"),
    [
        (
            "  1.0  2.0\n  3.0",
            5,
            "line 3, samples: the header promises 5 on 3 lines, the file ends",
        ),
        ("  1.0  2.0\n  x.0", 3, r"line 2, sample 3: '  x\.0' is not a number"),
        ("  1.0\n  3.0", 3, "line 1, samples: 1 numbers instead of 2 of the 3"),
        ("  1.0  2.0  3.0\n  3.0", 3, "line 1, samples: 15 characters, the format has 10"),
        ("  1.0  2.0\n  3.0  4.0", 3, "line 2, samples: 2 numbers instead of 1 of the 3"),
    ],
)
def test_faults_of_a_block_are_named(content: str, samples: int, message: str):
    with pytest.raises(RecordRejected, match=f"some.file: {message}"):
        fixed_block(text_of(content), 0, samples, 5, 2)


def test_a_free_block_must_hold_what_is_promised():
    with pytest.raises(RecordRejected, match="line 2, samples: the header promises 4, the file"):
        free_block(text_of("1 2\n3"), 0, 4)
    with pytest.raises(RecordRejected, match="line 1, samples: none"):
        free_block(text_of(""), 0, 4)


@pytest.mark.parametrize("word", ["0", "-3", "2.5", "nan", "1_000", "", "1e400"])
def test_what_counts_nothing_is_refused(word: str):
    with pytest.raises(RecordRejected, match=r"some\.file: line 3, points: "):
        count(text_of(""), 2, "points", word)


@pytest.mark.parametrize("value", ["0", "-0.01", "1e6", "1e-6", 0.0, float("nan")])
def test_implausible_intervals_are_refused(value: str | float):
    with pytest.raises(RecordRejected, match="must be positive and plausible"):
        interval(text_of(""), 0, "interval", value)


def test_missing_lines_are_named():
    with pytest.raises(RecordRejected, match="line 3, unit: missing, the file ends after 2 lines"):
        line_at(text_of("a\nb"), 2, "unit")


def test_any_line_end_and_any_byte_can_be_read():
    assert read_text(io.BytesIO(b"a\r\nb\rc\nd\r\r\n\xff\x1a")).lines == [
        "a",
        "b",
        "c",
        "d",
        "\xff",
    ]
    assert head(io.BytesIO(b"abc"), 2) == b"ab"
    assert head("no such file", 2) == b""


def test_a_line_that_fits_no_pattern_is_quoted():
    text = text_of("a = 5\n  b")
    assert match_line(text, 0, "a", re.compile(r"a = (\d)"))[1] == "5"
    with pytest.raises(RecordRejected, match="line 2, a: 'b' gives none"):
        match_line(text, 1, "a", re.compile("a"))


LONG = "1" * (LONGEST_NUMBER + 1)


def test_a_line_too_long_for_any_format_is_refused_before_it_is_searched():
    assert read_text(io.BytesIO(b"a\n" + b"1" * LONGEST_LINE)).lines[1] == "1" * LONGEST_LINE
    with pytest.raises(RecordRejected, match=r"line 2, line: 1000000 characters, at most 2000$"):
        read_text(io.BytesIO(b"a\n" + b"1" * 1_000_000))


def test_a_word_too_long_for_a_number_is_refused():
    message = f"{len(LONG)} characters, a number has at most {LONGEST_NUMBER}"
    with pytest.raises(RecordRejected, match=f"line 2, samples: {message}"):
        free_block(text_of(f"1 2\n{LONG}"), 0, 3)
    with pytest.raises(RecordRejected, match=f"line 1, points: {message}"):
        count(text_of(""), 0, "points", LONG)
    # Blanks around a number do not count
    assert count(text_of(""), 0, "points", f"{' ' * 100}7") == 7


@pytest.mark.parametrize(("width", "per_line"), [(LONGEST_NUMBER + 1, 1), (30, 100)])
def test_a_format_of_columns_too_wide_is_refused(width: int, per_line: int):
    # lines padded to such a width would take thousands of times the memory of the file
    with pytest.raises(RecordRejected, match=f"line 1, format: {per_line} numbers of {width}"):
        fixed_block(text_of("title\n1\n2"), 1, 2 * per_line, width, per_line)


def test_a_message_does_not_repeat_a_whole_damaged_file():
    with pytest.raises(RecordRejected) as caught:
        free_block(text_of("y" * 9999), 0, 1)
    assert len(str(caught.value)) < 400  # the longest problem has 300 characters


@given(st.from_regex(r"-?(\d{1,20}(\.\d{0,30})?|\.\d{1,30})", fullmatch=True))
def test_a_decimal_number_is_found_whole(number: str):
    assert re.fullmatch(DECIMAL, number)
    assert re.search(f"= {DECIMAL} Hz", f"f = {number} Hz")[1] == number


@pytest.mark.parametrize("run", ["1" * 21, "0." + "1" * 31, "." + "1" * 31])
def test_a_run_of_digits_longer_than_a_number_is_not_cut_to_one(run: str):
    assert re.search(f"= {DECIMAL}", f"= {run}") is None
