"""
Decimal marks of whole columns: decisive, ambiguous and unchanged cells.

Also of per_obspy.inventory.files.words.
"""

import math

import pandas as pd
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from per_obspy.inventory.cells import CellForm, read_numbers
from per_obspy.inventory.files.decimal_marks import Evidence, marks_of, with_points
from per_obspy.inventory.files.words import unit_of, unit_problem


def _decided(**columns):
    length = max(map(len, columns.values()))
    evidence = {name: Evidence() for name in columns}
    for name, cells in columns.items():
        padded = pa.chunked_array([[*cells, *[""] * (length - len(cells))]])
        evidence[name].add(padded, range(2, length + 2))
    marks, doubtful = marks_of(evidence)
    return marks, {name: (found.line, found.example) for name, found in doubtful.items()}


@pytest.mark.parametrize(
    ("columns", "marks", "doubtful"),
    [
        ({"gap": ["0,05", "1,234"]}, {"gap": ","}, {}),
        ({"gap": ["0,123"]}, {"gap": ","}, {}),
        ({"gap": [",5"]}, {"gap": ","}, {}),
        ({"mass_1": ["1.234,5"]}, {"mass_1": ","}, {}),
        ({"mass_1": ["1 234 567,5"]}, {"mass_1": ","}, {}),
        ({"mass_1": ["1,234.5"]}, {"mass_1": "."}, {}),
        ({"mass_1": ["1,234,567", "1,234"]}, {"mass_1": "."}, {}),
        # A number that may be either: by the others of the table, if they agree
        ({"gap": ["1", "1,234"]}, {}, {"gap": (3, "1,234")}),
        ({"gap": ["1,234"], "height_1": ["9,5"]}, {"gap": ",", "height_1": ","}, {}),
        ({"gap": ["1,234"], "mass_1": ["1,234,567"]}, {"gap": ".", "mass_1": "."}, {}),
        (
            {"gap": ["1,234"], "height_1": ["9,5"], "latitude_1": ["0.5"]},
            {"height_1": ","},
            {"gap": (2, "1,234")},
        ),
        ({"gap": ["1,234"], "latitude_1": ["0.5"]}, {}, {"gap": (2, "1,234")}),
        # Contradictions and plain numbers
        ({"gap": ["0,05", "0.05"]}, {}, {}),
        ({"mass_1": ["1,5", "1,234.5"]}, {}, {}),
        ({"gap": ["0.05", "7", "five", "", "1e5"]}, {}, {}),
    ],
)
def test_the_numbers_of_a_column_decide(columns, marks, doubtful):
    assert _decided(**columns) == (marks, doubtful)


@pytest.mark.parametrize(
    ("mark", "cells", "expected"),
    [
        (",", ["0,05", " -1,5 ", "1.234,5", "1 234,5", "1'234,5", "1,5e3"],
         ["0.05", " -1.5", "1234.5", "1234.5", "1234.5", "1.5e3"]),
        (",", ["1.234.567", "1 234", "7", "9.5"], ["1234567", "1234", "7", "9.5"]),
        (",", ["1.234", "12.345"], ["1.234 (or 1234?)", "12.345 (or 12345?)"]),
        (",", ["five, six", "1,2,3", ""], ["five, six", "1,2,3", ""]),
        (".", ["1,234.5", "1,234", "1,23", "x"], ["1234.5", "1234", "1,23", "x"]),
    ],
)  # fmt: skip
def test_cells_become_plain_numbers(mark, cells, expected):
    assert with_points(pa.chunked_array([cells]), mark).to_pylist() == expected


@given(st.floats(-1e6, 1e6, allow_nan=False), st.integers(0, 6))
def test_any_number_with_a_decimal_comma_comes_back(number, digits):
    text = f"{number:.{digits}f}"
    (found,) = with_points(pa.chunked_array([[text.replace(".", ",")]]), ",").to_pylist()
    assert float(found) == float(text)


#: Definitions of units: the international foot and pound, the standard acceleration of gravity.
DEFINED = [
    ("gap", "cm", 7.0, 0.07),
    ("gap", "in", 1.0, 0.0254),
    ("height_1", "ft", 10.0, 3.048),
    ("area_1", "ft2", 1.0, 0.3048**2),
    ("mass_1", "lb", 1.0, 0.45359237),
    ("mass_1", "kN", 9.80665, 1000.0),
    ("mass_1", "kip", 1.0, 453.59237),
    ("azimuth", "rad", math.pi, 180.0),
    ("period_1", "ms", 500.0, 0.5),
    ("damping_1", "%", 5.0, 0.05),
    ("vs30", "km/s", 0.3, 300.0),
]


@pytest.mark.parametrize(("column", "name", "value", "expected"), DEFINED)
def test_units_by_their_definition(column, name, value, expected):
    form = CellForm({column: unit_of(name, column)})
    # Of its column, as a number and as text, and of the cell itself
    (number,) = read_numbers(column, pd.Series([value]), form).values
    text, empty = read_numbers(column, pd.Series([str(value), "x"]), form).values
    (own,) = read_numbers(column, pd.Series([f"{value} {name}"])).values
    # A product and a quotient of doubles
    assert_allclose([number, text, own], expected, rtol=1e-15)
    assert math.isnan(empty)


def test_units_of_another_dimension_are_none():
    assert unit_of("kg", "gap") is None
    assert unit_of("cm", "pair_id") is None
    assert "expected one of m, mm, cm" in unit_problem("ton", "gap")
