"""A map in text: places where they are, one scale, the date line."""

import re

import pytest

from per_obspy.cli.text_map import COLUMNS, ROWS, text_map


def _cells(lines):
    return [line[line.index("|") + 1 : line.rindex("|")] for line in lines if line.count("|") == 2]


def test_corners_are_where_they_belong():
    cells = _cells(text_map({"a": ([10.0], [1.0]), "b": ([13.0], [1.0]), "c": ([10.0], [0.0])}))
    assert cells[0].strip() == f"a{'b':>{len(cells[0].strip()) - 1}}"
    assert cells[-1].strip() == "c"
    assert cells[0].index("a") == cells[-1].index("c")


@pytest.mark.parametrize("latitude", [0.0, 60.0])
def test_the_scale_is_the_same_both_ways(latitude):
    # an L of equal arms, in metres: a degree of longitude is half as long at 60 degrees
    arm = 0.1 if latitude == 0.0 else 0.2
    east, north = [0.0, arm, 0.0], [latitude, latitude, latitude + 0.1]
    lines = text_map({"x": (east, north)})
    cells = _cells(lines)
    width = cells[-1].rindex("x") - cells[-1].index("x")
    # a character is twice as high as wide; whole characters, hence 2
    assert width == pytest.approx(2 * (len(cells) - 1), abs=2)
    assert len(cells) == ROWS
    assert max(map(len, lines)) <= COLUMNS + 13


def test_numbers_of_points_have_signs():
    east = [0.0] + [0.01] * 5 + [0.02] * 50 + [0.03] * 500
    lines = text_map({"": (east, [0.0] * len(east))})
    assert "".join("".join(_cells(lines)).split()) == ".oO@"
    assert lines[-1].endswith(". 1   o 2-9   O 10-99   @ 100 or more")


def test_places_on_both_sides_of_the_date_line_are_near():
    lines = text_map({"^": ([179.9, -179.9], [0.0, 0.1])})
    # 0.1 degrees of latitude over eight rows of two columns each: 696 m
    assert re.search(r"1 column (69|70)\d m", lines[-1])
    west, east = float(lines[-1].split()[0]), float(lines[-1].split()[-1])
    assert west > 179.0
    assert east < -179.0


def test_one_place_or_none_is_no_map():
    assert text_map({}) == []
    assert text_map({"^": ([1.0, 1.0], [2.0, 2.0])}) == []
    assert text_map({"^": ([float("nan"), 1.0], [2.0, 2.0])}) == []


def test_the_whole_earth_fits():
    lines = text_map({"x": ([-180.0, 180.0, 0.0], [-90.0, 90.0, 0.0])})
    assert "".join(_cells(lines)).count("x") >= 2
    assert "e+" not in lines[-1]
