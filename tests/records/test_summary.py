"""Summary of records, one row per trace."""

from pathlib import Path

import numpy as np
import pytest
from station_files import START, THREE, record, write_records

from per_obspy.errors import CatalogError
from per_obspy.records.summary import describe_records

RECORDS = [f"CI.CLC..{code}" for code in THREE]


def test_every_record_is_a_row(tmp_path: Path):
    write_records(tmp_path)
    records, rejected = describe_records(tmp_path)
    assert rejected == ()
    assert [row.record for row in records] == RECORDS
    # 300 samples of 0 to 299 counts, 200 000 counts per m/s2
    row = records[0]
    assert (row.format, row.level, row.unit) == ("MSEED", "raw", "m/s2")
    assert (row.start, row.dt) == (str(START), 0.01)
    assert row.duration == pytest.approx(2.99, rel=1e-12)
    assert row.peak == pytest.approx(149.5 / 2e5, rel=1e-12)
    assert (row.azimuth, row.latitude, row.longitude) == (30.0, 35.0, -117.0)
    assert row.file == "deep/er/HN1.mseed"


def test_a_single_file_is_named_without_its_folder(tmp_path: Path):
    write_records(tmp_path)
    path = tmp_path / "deep" / "er" / "HN1.mseed"
    (row,), _ = describe_records(path, tmp_path / "station.xml")
    assert row.file == "HN1.mseed"


def test_an_offset_is_no_peak(tmp_path: Path):
    write_records(tmp_path)
    path = tmp_path / "deep" / "er" / "HN1.mseed"
    record("HN1", np.arange(1000, 1300, dtype=np.int32)).write(str(path), format="MSEED")
    (row,), _ = describe_records(path, tmp_path / "station.xml")
    assert row.peak == pytest.approx(149.5 / 2e5, rel=1e-12)


def test_records_that_cannot_be_used_are_rejected(tmp_path: Path):
    write_records(tmp_path)
    (tmp_path / "station.xml").unlink()
    records, rejected = describe_records(tmp_path)
    assert records == ()
    assert [rejection.name for rejection in rejected] == RECORDS


def test_a_folder_without_records_is_refused(tmp_path: Path):
    (tmp_path / "notes.txt").write_text("bring an umbrella")
    with pytest.raises(CatalogError, match="none of its 1 files is a record"):
        describe_records(tmp_path)
