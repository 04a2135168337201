"""Counts in pieces: per_obspy.report.page.tally and per_obspy.report.page.cells."""

import numpy as np
import pandas as pd

from per_obspy.report.page.cells import MOST_CELLS, SMALLEST_CELL, CellCounts
from per_obspy.report.page.tally import PAGE_PAIRS, PairTally
from per_obspy.screening.uncertainty.unknown_gaps import UNKNOWN_CLASS

from .made_up import CLASSES, pair_table


def test_pieces_count_as_the_whole():
    table = pair_table(30_000)
    whole, pieces = PairTally(CLASSES), PairTally(CLASSES)
    whole.add(table)
    for start in range(0, 30_000, 7_000):
        pieces.add(table[start : start + 7_000])
    assert pieces.states == {"yes": 7_500, "likely": 7_500, "possible": 7_500, "no": 7_500}
    assert pieces.flags == {"far_station": 15_000, "derived_inputs": 15_000, "touching": 15_000}
    assert pieces.median_distance() == 2500.0
    assert np.isclose(pieces.expected, 15_000.0)  # probabilities fall evenly from 1 to 0
    counts = [tally.cells.table()[list(CLASSES)].sum().to_dict() for tally in (whole, pieces)]
    # Only the pairs beyond the worst are in cells: a piece of moderate and low ones
    assert counts[0] == counts[1] == {"severe": 0, "high": 0, "moderate": 2_500, "low": 7_500}
    assert sum(counts[0].values()) == 30_000 - PAGE_PAIRS


def test_a_pair_is_within_half_a_cell_of_its_cell():
    cells = CellCounts(["low"])
    cells.add(pd.DataFrame({"longitude": [-0.0301], "latitude": [51.2], "risk_class": ["low"]}))
    (row,) = cells.table().itertuples(index=False)
    assert abs(row.longitude + 0.0301) <= SMALLEST_CELL / 2
    assert abs(row.latitude - 51.2) <= SMALLEST_CELL / 2


def test_cells_grow_until_they_are_few_and_lose_no_pair():
    random = np.random.default_rng(1)
    cells = CellCounts(["severe", UNKNOWN_CLASS])
    for _ in range(3):
        place = {name: random.uniform(-5, 5, 30_000) for name in ("longitude", "latitude")}
        cells.add(pd.DataFrame({**place, "risk_class": "severe"}))
    table = cells.table()
    assert len(table) <= MOST_CELLS
    assert table["severe"].sum() == 90_000
    assert cells.size > SMALLEST_CELL


def test_pairs_without_place_are_in_no_cell_and_without_class_in_the_last():
    cells = CellCounts(["low", UNKNOWN_CLASS])
    place = {"longitude": [1.0, np.nan], "latitude": [1.0, 1.0]}
    cells.add(pd.DataFrame({**place, "risk_class": ["", "low"]}))
    assert cells.table()[["low", UNKNOWN_CLASS]].to_numpy().tolist() == [[0, 1]]


def test_a_table_without_columns_is_counted_as_far_as_it_goes():
    tally = PairTally(CLASSES)
    tally.add(pd.DataFrame({"rank": [1, 2]}))
    assert (tally.pairs, tally.states.total()) == (2, 0)
    assert np.isnan(tally.median_distance())
    assert tally.cells.table().empty
