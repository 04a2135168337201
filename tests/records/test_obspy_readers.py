"""Errors of ObsPy's readers, which become rejections of the file."""

from pathlib import Path

import obspy
import pytest
from station_files import record

from per_obspy.errors import RecordRejected
from per_obspy.records.obspy_readers import read_bytes_with_obspy, read_with_obspy


def test_names_with_wildcards_mean_themselves(tmp_path: Path):
    # would catch obspy.read's own reading of wildcards
    record("HN1").write(str(tmp_path / "[H*]?.mseed"), format="MSEED")
    record("HN2").write(str(tmp_path / "HN2.mseed"), format="MSEED")
    (trace,) = read_with_obspy(obspy.read, tmp_path / "[H*]?.mseed")
    assert trace.stats.channel == "HN1"


def test_a_file_and_its_bytes_are_read_alike(tmp_path: Path):
    path = tmp_path / "record.mseed"
    record("HN1").write(str(path), format="MSEED")
    (trace,) = read_bytes_with_obspy(obspy.read, path.read_bytes(), "service", format="MSEED")
    assert trace == read_with_obspy(obspy.read, path)[0]


@pytest.mark.parametrize(
    ("content", "options", "reason"),
    [
        (b"words", {}, "ObsPy cannot read it: its format is unknown"),
        (b"PEER\n\nACCELERATION TIME SERIES IN UNITS OF G\nNPTS", {}, "line 4, NPTS, DT: "),
        (b"words", {"format": "QUAKEML"}, "ObsPy cannot read it: .*Error: "),
    ],
)
def test_any_error_is_a_rejection_on_one_line(content: bytes, options: dict, reason: str):
    reader = obspy.read_events if options else obspy.read
    with pytest.raises(RecordRejected, match=reason) as rejection:
        read_bytes_with_obspy(reader, content, "service", **options)
    assert "\n" not in str(rejection.value)
