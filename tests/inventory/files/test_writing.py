"""A written pair table is the one that is read back."""

import pandas as pd
import pytest

from per_obspy.errors import CatalogError
from per_obspy.inventory.files.reading import read_pairs
from per_obspy.inventory.files.writing import write_pairs
from per_obspy.simulation.buildings import simulated_pairs


@pytest.mark.parametrize("name", ["pairs.csv", "pairs.parquet"])
def test_what_is_written_is_read_back(tmp_path, name):
    table = simulated_pairs([10.0], [50.0], 30, seed=1, radius=2000.0, touching=0.5)
    write_pairs(table, tmp_path / "made.csv")
    pairs = read_pairs(tmp_path / "made.csv")
    pairs.attrs["rejected"] = ("not part of the table",)
    write_pairs(pairs, tmp_path / name)
    again = read_pairs(tmp_path / name)
    # would catch an index column, lost digits, and rows that went with the rejected ones
    pd.testing.assert_frame_equal(again, pairs, check_exact=True)
    assert pairs.attrs["rejected"]  # the table of the caller is as it was


def test_another_suffix_is_refused_before_anything_is_written(tmp_path):
    with pytest.raises(
        CatalogError, match=r"pairs.xlsx: unknown suffix '.xlsx', expected .csv or .parquet"
    ):
        write_pairs(pd.DataFrame({"gap": [0.1]}), tmp_path / "pairs.xlsx")
    assert list(tmp_path.iterdir()) == []
