"""Totals of a risk table: the same in pieces, by each kind of area."""

import numpy as np
import pandas as pd
import pytest
import shapely

from per_obspy.config import Totals
from per_obspy.results import totals as tables
from per_obspy.results.table_files import rounded_table
from per_obspy.results.totals import (
    CountedTotals,
    piece_totals,
    region_totals,
    totals_columns,
    write_totals,
)

COUNT = 300
CLASSES = ["severe", "moderate", "low"]
KINDS = [{}, {"cell": 300.0}, {"area": "ward"}, {"h3": 9}]


@pytest.fixture(scope="module")
def risk():
    """A risk table of a small region, with the names of its wards."""
    random = np.random.default_rng(5)
    # A region of two kilometres; no pair is of the class moderate
    columns = {
        "rank": np.arange(1, COUNT + 1),
        "pair_id": [f"p{i}" for i in range(COUNT)],
        "state": random.choice(["yes", "likely", "no"], COUNT),
        "risk_class": random.choice(["severe", "low"], COUNT),
        "probability": random.uniform(0, 1, COUNT),
        "expected_impact_velocity": random.uniform(0, 2, COUNT),
        "longitude": random.uniform(-67.96, -67.94, COUNT),
        "latitude": random.uniform(-20.36, -20.34, COUNT),
        "ward": random.choice(["north", "south", None], COUNT),
        "place": "",
    }
    return pd.DataFrame(columns)


def totals(risk, kind, size):
    """Return the totals of a table in pieces of some rows."""
    settings = Totals(**kind)
    table = risk[totals_columns(settings)]
    pieces = [table.iloc[first : first + size] for first in range(0, COUNT, size)]
    return region_totals((piece_totals(piece, settings, CLASSES) for piece in pieces), settings)


@pytest.mark.parametrize("kind", KINDS)
def test_pieces_do_not_change_totals(risk, kind):
    whole, pieces = totals(risk, kind, COUNT), totals(risk, kind, 11)
    pd.testing.assert_frame_equal(pieces.table, whole.table, rtol=1e-12)  # sums in another order
    assert whole.table["pairs"].sum() == COUNT
    # would catch outlines of the last piece only
    assert (pieces.outlines is None) == (whole.outlines is None)
    for first, second in zip(pieces.outlines or (), whole.outlines or (), strict=True):
        np.testing.assert_array_equal(first, second)


@pytest.mark.parametrize("kind", KINDS)
def test_pieces_that_are_joined_on_the_way_do_not_change_totals(risk, kind, monkeypatch):
    # Mutations: the joined piece without its boxes; pairs of probability 1 counted once per area;
    # the worst pair of the last pieces instead of all.
    monkeypatch.setattr(tables, "TOGETHER", 3)
    some = risk.assign(probability=risk["probability"].round(0).where(risk["rank"] % 3 > 0, 0.4))
    settings = Totals(**kind)
    table, found = some[totals_columns(settings)], CountedTotals()
    for first in range(COUNT - 12, -1, -12):  # the worst pairs come last
        found.append(piece_totals(table.iloc[first : first + 12], settings, CLASSES))
    assert len(list(found)) <= 3
    joined, whole = region_totals(found, settings), totals(some, kind, COUNT)
    pd.testing.assert_frame_equal(joined.table, whole.table, rtol=1e-12)  # sums in another order
    # the expected number is the sum of all probabilities, with zeros and ones
    assert joined.table["expected_pounding"].sum() == pytest.approx(some["probability"].sum())


@pytest.mark.parametrize("kind", KINDS)
def test_every_class_has_a_column(risk, kind):
    # would catch columns that come and go with what a region happens to hold, and zeros where a
    # piece lacks a class
    table = totals(risk, kind, 11).table
    counts = table[[f"class_{name}" for name in CLASSES]].sum()
    assert counts["class_moderate"] == 0
    assert counts.sum() == COUNT


def test_named_areas_have_no_outline(risk):
    found = totals(risk, {"area": "ward"}, COUNT)
    assert found.outlines is None
    assert found.table["area"].tolist() == ["", "north", "south"]


@pytest.mark.parametrize("kind", [{}, {"cell": 300.0}, {"h3": 9}])
def test_cells_contain_their_pairs(risk, kind):
    # the middle of its pairs lies in each cell: these are convex, and small enough to be flat
    found = totals(risk, kind, COUNT)
    assert len(found.table) > 3
    places = shapely.points(found.table["longitude"], found.table["latitude"])
    for corners, place in zip(found.outlines, places, strict=True):
        assert shapely.Polygon(corners).contains(place)


def test_totals_as_text_are_the_totals(risk, tmp_path):
    table = totals(risk, {"area": "ward"}, COUNT).table
    write_totals(table, tmp_path / "totals.csv")
    read = pd.read_csv(tmp_path / "totals.csv", keep_default_na=False)
    # five digits: half a unit of the last of 10 000; two of velocities of impacts
    velocity = "worst_expected_impact_velocity"
    others = table.columns.drop(velocity)
    pd.testing.assert_frame_equal(read[others], table[others], check_dtype=False, rtol=5e-5)
    np.testing.assert_allclose(read[velocity], table[velocity], rtol=5e-2)
    # and no digit is lost but by that rounding
    same = rounded_table(table, own=table.columns)
    pd.testing.assert_frame_equal(read, same, check_dtype=False, check_exact=True)


def test_a_pair_counts_in_its_place_or_else_in_its_cell(risk):
    # would catch a pair that counts twice, and the outline of a cell for a street
    named = risk["ward"] == "north"
    some = risk.assign(place=np.where(named, "Cumhuriyet, 14. Sokak", ""))
    whole, cells = totals(some, {}, 11), totals(risk, {}, 11)
    counted = whole.table.set_index("area")["pairs"]
    assert counted["Cumhuriyet, 14. Sokak"] == named.sum()
    assert counted.sum() == COUNT
    assert set(counted.index) <= {"Cumhuriyet, 14. Sokak", *cells.table["area"]}
    assert whole.outlines is None
    assert len(cells.outlines) == len(cells.table)
    # Never the row and column of a grid
    assert not cells.table["area"].str.fullmatch(r"r-?\d+ c\d+").any()


def test_names_of_areas_are_no_formulas(tmp_path):
    # areas and pairs are named by a carried column and by the inventory
    table = pd.DataFrame({"area": ["=1+1", "north"], "worst_pair": ["@a", "-b"], "pairs": [1, 2]})
    write_totals(table, tmp_path / "totals.csv")
    text = (tmp_path / "totals.csv").read_text()
    assert text == "area,worst_pair,pairs\n'=1+1,'@a,1\nnorth,'-b,2\n"
