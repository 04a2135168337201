"""Counts in pieces: per_obspy.report.tally and per_obspy.report.tally."""

import numpy as np
import pandas as pd

from per_obspy.report.tally import MOST_CELLS, PAGE_PAIRS, SMALLEST_CELL, CellCounts, PairTally
from per_obspy.screening.ranking import EVERY_STATE, UNKNOWN_CLASS

from .made_up import CLASSES, pair_table

PLACE = ["longitude", "latitude"]


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
    assert pieces.derived == 30_000
    counts = [tally.cells.table().drop(columns=PLACE).sum() for tally in (whole, pieces)]
    # Only the pairs beyond the worst are in cells: moderate and possible, low and no
    expected = {f"2 {EVERY_STATE.index('possible')}": 2_500, f"3 {EVERY_STATE.index('no')}": 7_500}
    assert counts[0].to_dict() == counts[1].to_dict() == expected
    assert counts[0].sum() == 30_000 - PAGE_PAIRS


def test_a_pair_is_within_half_a_cell_of_its_cell():
    cells = CellCounts(["low"], ["no"])
    place = {"longitude": [-0.0301], "latitude": [51.2]}
    cells.add(pd.DataFrame({**place, "risk_class": ["low"], "state": ["no"]}))
    (row,) = cells.table().itertuples(index=False)
    assert abs(row.longitude + 0.0301) <= SMALLEST_CELL / 2
    assert abs(row.latitude - 51.2) <= SMALLEST_CELL / 2


def test_cells_grow_until_they_are_few_and_lose_no_pair():
    random = np.random.default_rng(1)
    cells = CellCounts(["severe", UNKNOWN_CLASS], ["yes", "no"])
    for _ in range(3):
        place = {name: random.uniform(-5, 5, 30_000) for name in ("longitude", "latitude")}
        cells.add(pd.DataFrame({**place, "risk_class": "severe", "state": "no"}))
    table = cells.table()
    assert len(table) <= MOST_CELLS
    assert table["0 1"].sum() == 90_000
    assert cells.size > SMALLEST_CELL


def test_pairs_without_place_are_in_no_cell_and_without_class_in_the_last():
    cells = CellCounts(["low", UNKNOWN_CLASS], ["yes", "unknown"])
    place = {"longitude": [1.0, np.nan], "latitude": [1.0, 1.0]}
    cells.add(pd.DataFrame({**place, "risk_class": ["", "low"], "state": ["", "yes"]}))
    assert cells.table().drop(columns=PLACE).to_dict("list") == {"1 1": [1]}


def test_a_table_without_columns_is_counted_as_far_as_it_goes():
    tally = PairTally(CLASSES)
    tally.add(pd.DataFrame({"rank": [1, 2]}))
    assert (tally.pairs, tally.states.total()) == (2, 0)
    assert np.isnan(tally.median_distance())
    assert tally.cells.table().empty
