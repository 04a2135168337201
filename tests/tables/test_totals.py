"""Totals of a risk table on disk: the same in pieces, by each kind of area."""

import numpy as np
import pandas as pd
import pytest
import shapely

from per_obspy.config import Totals
from per_obspy.tables import risk as ranked
from per_obspy.tables.totals import region_totals

COUNT = 300
CLASSES = ["severe", "moderate", "low"]


@pytest.fixture
def risk(tmp_path):
    random = np.random.default_rng(5)
    table = pd.DataFrame(
        {
            "rank": np.arange(1, COUNT + 1),
            "pair_id": [f"p{i}" for i in range(COUNT)],
            "state": random.choice(["yes", "possible", "no"], COUNT),
            "risk_class": random.choice(["severe", "low"], COUNT),
            "probability": random.uniform(0, 1, COUNT),
            "demand_ratio": random.uniform(0, 2, COUNT),
            "longitude": random.uniform(-67.96, -67.94, COUNT),
            "latitude": random.uniform(-20.36, -20.34, COUNT),
            "ward": random.choice(["north", "south", None], COUNT),
        }
    )
    table.to_parquet(tmp_path / "risk.parquet")
    return tmp_path / "risk.parquet"


@pytest.mark.parametrize("kind", [{}, {"cell": 300.0}, {"area": "ward"}, {"h3": 9}])
def test_pieces_do_not_change_totals(risk, monkeypatch, kind):
    # would catch outlines of the last piece only
    whole = region_totals(risk, Totals(**kind), CLASSES)
    monkeypatch.setattr(ranked, "ROWS", 11)
    pieces = region_totals(risk, Totals(**kind), CLASSES)
    pd.testing.assert_frame_equal(pieces.table, whole.table, rtol=1e-12)  # sums in another order
    assert whole.table["pairs"].sum() == COUNT
    # would catch columns that come and go with what a region happens to hold, and zeros where a
    # piece lacks a class
    counts = whole.table[[f"class_{name}" for name in CLASSES]].sum()
    assert counts["class_moderate"] == 0
    assert counts.sum() == COUNT
    if "area" in kind:
        assert whole.outlines is None
        assert whole.table["area"].tolist() == ["", "north", "south"]
        return
    assert len(whole.table) > 3
    assert all(np.array_equal(a, b) for a, b in zip(pieces.outlines, whole.outlines, strict=True))
    # the middle of its pairs lies in each cell: these are convex, and small enough to be flat
    places = shapely.points(whole.table["longitude"], whole.table["latitude"])
    assert all(
        shapely.Polygon(corners).contains(place)
        for corners, place in zip(whole.outlines, places, strict=True)
    )
