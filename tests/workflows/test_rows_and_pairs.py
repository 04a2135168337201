"""Rows against pairs: workflows/rows_and_pairs.py."""

import sys
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.testing import assert_allclose, assert_array_equal

sys.path.insert(0, str(Path(__file__).parents[2] / "workflows"))
import rows_and_pairs


def test_every_two_neighbours_are_a_pair():
    # catches: the last building of a row with the first of the next
    rows = rows_and_pairs.simulated_rows(25, 0.02)
    pairs, members = rows_and_pairs.pairs_of(rows)
    assert pairs.azimuth.size == rows.period.size - rows.azimuth.size
    assert_array_equal(members[1::2], members[::2] + 1)
    assert not np.isin(members[::2], rows.first[1:] - 1).any()
    assert_array_equal(pairs.gap[::2], rows.gap[members[::2]])


def test_in_a_row_of_two_the_row_is_the_pair():
    # catches: amplification over the radius of another building
    rows, _ = rows_and_pairs.pairs_of(rows_and_pairs.simulated_rows(10, 0.02))
    motion = rows_and_pairs.made_up_motion()[:, :800]
    table = rows_and_pairs.row_over_pair(*motion, rows_and_pairs.DT, rows)
    assert table["hit_in_row"].any()
    assert_allclose(table["ratio"], 1.0, rtol=1e-12)  # the same computation
    assert (table["position"] == "end").all()


def test_the_summary_is_of_buildings_that_are_hit():
    # catches: percentiles of buildings that nothing hits
    table = pd.DataFrame(
        {
            "position": ["end", "inner", "inner", "end"],
            "in_row": [1.0, 2.0, 4.0, 9.0],
            "in_pair": [1.0, 1.0, 2.0, 1.0],
            "ratio": [1.0, 2.0, 2.0, 9.0],
            "hit_in_row": [True, True, True, False],
        }
    )
    found = rows_and_pairs.summary(table)
    assert found.loc["end", "in_row_50"] == 1.0
    assert found.loc["inner", "in_row_50"] == 3.0
    assert found["buildings"].tolist() == [1, 2]
