"""Lengths in text: units by their definition, and ambiguous lengths."""

import numpy as np
import pandas as pd
import pytest

from per_obspy.inventory.footprints.lengths import count, metres, read_numbers

#: The international foot is 0.3048 m and the inch 0.0254 m by definition (1959).
LENGTHS = {
    "6": 6.0,
    "6 m": 6.0,
    "6m": 6.0,
    " 6.50 M ": 6.5,
    "6,5": 6.5,
    "6,5 m": 6.5,
    "12.500": 12.5,
    "20 ft": 6.096,
    "20 feet": 6.096,
    "20'": 6.096,
    "7'4\"": 7 * 0.3048 + 4 * 0.0254,
    "7 ft 4 in": 7 * 0.3048 + 4 * 0.0254,
    "650 cm": 6.5,
    "6500 mm": 6.5,
    "240 in": 6.096,
    "1e1": 10.0,
    "-3": -3.0,
}


@pytest.mark.parametrize("text", LENGTHS)
def test_lengths_with_units(text):
    assert metres(text) == pytest.approx(LENGTHS[text], rel=1e-12)


#: Text without one meaning: other units, thousands or decimals, several numbers, nothing.
WRONG = ["6 yards", "12,500", "1,000.5", "6;7", "3-4", "~6", "6 m 7", "six", "m", "", "nan", "inf",
         "1" * 41, "6..5", "6 5", "٦", "0x10", "1_0"]  # fmt: skip


@pytest.mark.parametrize("text", WRONG)
def test_texts_that_are_no_length(text):
    assert np.isnan(metres(text))


def test_counts_have_no_unit():
    assert [count(text) for text in ("3", "2,5", "1.0")] == [3.0, 2.5, 1.0]
    assert np.isnan([count(text) for text in ("3 m", "2;3", "two", "12,500")]).all()


def test_columns_of_text_numbers_and_empty_cells():
    numbers, wrong = read_numbers(pd.Series(["6 m", None, "-", "six", "20 ft"]), True)
    assert numbers.round(9).tolist()[::4] == [6.0, 6.096]
    assert numbers[1:4].isna().all()
    assert wrong.tolist() == [False, False, False, True, False]
    # truth values are no numbers
    _, wrong = read_numbers(pd.Series([True, False]), False)
    assert wrong.all()
    numbers, wrong = read_numbers(pd.Series([6, 7]), True)
    assert numbers.tolist() == [6.0, 7.0]
    assert not wrong.any()
