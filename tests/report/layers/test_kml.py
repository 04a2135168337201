"""KML and workbook: colours, places, and names that are neither markup nor formula.

Tests of per_obspy.report.layers.spreadsheet too.
"""

from xml.etree import ElementTree

import numpy as np
import openpyxl
import pandas as pd
import pyogrio
import pytest
import shapely

from per_obspy.report.layers.kml import NAMESPACE, ROWS, write_kml
from per_obspy.report.layers.spreadsheet import Sheet, write_workbook

CLASSES = ("severe", "low")
HOSTILE = ["<script>alert(1)</script>", '=HYPERLINK("http://x")', "\u202eevil", "\x00\x1b[31m"]
HOSTILE += ["$[name]", "x" * 10_000, "@SUM(A1)", "-1+1", "]]>", "&lt;b&gt;"]


def make_table(names):
    """Return a risk table of pairs of these names."""
    count = len(names)
    return pd.DataFrame(
        {
            "rank": np.arange(1, count + 1),
            "pair_id": names,
            "risk_class": ["severe"] + ["low"] * (count - 1),
            "state": "yes",
            "gap": 0.123456789,
            "yield_displacement_1": np.inf,
            "demand": np.nan,
            "longitude": -68.0,
            "latitude": -20.0,
            "longitude_1": -68.0001,
            "latitude_1": -20.0,
            "longitude_2": -67.9999,
            "latitude_2": -20.0,
            "floors_misaligned": True,
            "note": None,
        }
    )


def _marks(path):
    return list(ElementTree.parse(path).iter(f"{{{NAMESPACE}}}Placemark"))


def test_pairs_have_their_colours_places_and_numbers(tmp_path):
    write_kml(make_table(["a", "b"]), CLASSES, "old town", tmp_path / "risk.kml")
    worst, mild = _marks(tmp_path / "risk.kml")
    # alpha, blue, green, red of dark red 7f0000
    colours = [
        e.text for e in ElementTree.parse(tmp_path / "risk.kml").iter(f"{{{NAMESPACE}}}color")
    ]
    assert colours[0] == "ff00007f"
    styles = [mark.findtext(f"{{{NAMESPACE}}}styleUrl") for mark in (worst, mild)]
    assert styles == ["#class0", "#class1"]
    # GDAL reads points and lines
    meta, _, geometry, fields = pyogrio.raw.read(tmp_path / "risk.kml")
    shapes = shapely.from_wkb(geometry)
    assert shapely.get_coordinates(shapes[0])[0].tolist() == [-68.0, -20.0]
    values = dict(zip(meta["fields"], fields, strict=True))
    name = next(name for name in values if name.lower() == "name")
    assert values[name].tolist() == ["a", "b"]


@pytest.mark.parametrize("name", HOSTILE)
def test_a_name_is_never_markup_of_a_balloon(tmp_path, name):
    write_kml(make_table([name]), CLASSES, name, tmp_path / "risk.kml")
    (mark,) = _marks(tmp_path / "risk.kml")
    balloon = mark.findtext(f"{{{NAMESPACE}}}description")
    # only our own line breaks are markup once XML is read
    assert "<" not in balloon.replace("<br/>", "")
    assert "$[" not in balloon
    assert len(mark.findtext(f"{{{NAMESPACE}}}name")) <= 60


def test_only_the_worst_are_written(tmp_path):
    names = [f"P{number}" for number in range(ROWS + 5)]
    write_kml(make_table(names), CLASSES, "many", tmp_path / "risk.kml")
    assert len(_marks(tmp_path / "risk.kml")) == ROWS


@pytest.fixture
def page(tmp_path):
    sheet = Sheet("pairs", make_table(HOSTILE).assign(**{"=bad()": "=1+1"}), {"gap": "m"})
    write_workbook([sheet], tmp_path / "risk.xlsx")
    return openpyxl.load_workbook(tmp_path / "risk.xlsx")["pairs"]


def test_no_text_of_a_workbook_is_a_formula(page):
    cells = [cell for row in page.iter_rows() for cell in row]
    # openpyxl marks formulas by their type
    assert "f" not in {cell.data_type for cell in cells}
    texts = [page.cell(row, 2).value for row in range(3, page.max_row + 1)]
    assert texts[:2] == HOSTILE[:2]
    assert page.cell(4, 2).quotePrefix
    assert texts[5].startswith("xxx")
    assert len(texts[5]) == 1000


def test_header_and_units_stay_in_view_and_numbers_are_numbers(page):
    names = [cell.value for cell in page[1]]
    units = dict(zip(names, (cell.value for cell in page[2]), strict=True))
    assert (page.freeze_panes, units["gap"]) == ("C3", "m")
    row = dict(zip(names, (cell.value for cell in page[3]), strict=True))
    # five digits, coordinates in full, nothing for NaN, a word for infinity
    assert (row["gap"], row["longitude_1"], row["demand"]) == (0.12346, -68.0001, None)
    assert (row["yield_displacement_1"], row["floors_misaligned"]) == ("inf", True)
