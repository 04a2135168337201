"""Inventories of the benchmarks: names are unique however many parts an inventory has."""

import numpy as np
import pyarrow.parquet as pq
import pytest
import screening
import xarray as xr


@pytest.fixture
def stations(tmp_path, monkeypatch):
    """A folder of two station files, of which only the place is read."""
    for number in (1, 2):
        (tmp_path / f"S{number}.nc").touch()

    def place(path):
        return xr.Dataset({"longitude": -67.9 + 0.01 * int(path.stem[1:]), "latitude": -20.3})

    monkeypatch.setattr(screening, "read_spectra", place)
    monkeypatch.setattr(screening, "TOGETHER", 40)
    return tmp_path


def test_no_name_occurs_in_two_parts(stations):
    file = stations / "pairs.parquet"
    screening.write_inventory(file, 100, stations)
    table = pq.read_table(file).to_pandas()
    assert len(table) == 100
    assert table["pair_id"].is_unique
    # a building is in the pairs of one row only, which is within a part
    parts = np.arange(100) // 40
    for name in ("building_id_1", "building_id_2"):
        assert (table[name].groupby(table[name]).transform("size") <= 2).all()
        assert table.assign(part=parts).groupby(name)["part"].nunique().max() == 1
