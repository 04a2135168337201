"""The table of processed records: one row per record, every column described."""

import pandas as pd

from per_obspy.results.station_summary import RECORD_COLUMNS, processed_table, write_processed_table

DESCRIPTIONS = {
    "stations/XX.S1.mseed": [
        {"id": "XX.S1..HNE", "coordinates": {"latitude": 1.0}, "per_obspy": {"highpass": 0.1}},
        {"id": "XX.S1..HNN", "source": "b.mseed", "unknown": 3},
    ],
    "structures/XX.S1.mseed": [{"id": "XX.S1.02.HNE"}],
}


def test_every_record_has_a_row_with_its_numbers():
    table = processed_table(DESCRIPTIONS)
    assert list(table) == list(RECORD_COLUMNS)
    assert table["id"].tolist() == ["XX.S1..HNE", "XX.S1..HNN", "XX.S1.02.HNE"]
    assert table["file"].tolist() == ["stations/XX.S1.mseed"] * 2 + ["structures/XX.S1.mseed"]
    # place and corner are groups of their own in a description
    assert (table["latitude"][0], table["highpass"][0]) == (1.0, 0.1)
    assert table.loc[1:, ["latitude", "highpass"]].isna().all(axis=None)


def test_no_record_leaves_the_header():
    assert processed_table({}).empty
    assert list(processed_table({})) == list(RECORD_COLUMNS)


def test_files_have_the_same_columns(tmp_path):
    write_processed_table(DESCRIPTIONS, tmp_path)
    table = pd.read_csv(tmp_path / "processed.csv")
    columns = pd.read_csv(tmp_path / "processed.columns.csv", keep_default_na=False)
    assert list(table) == columns["name"].tolist() == list(RECORD_COLUMNS)
    assert columns.set_index("name")["unit"]["highpass"] == "Hz"
