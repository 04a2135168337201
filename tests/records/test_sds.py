"""SDS archives."""

import errno
import os
from pathlib import Path

import numpy as np
import obspy
import pytest
from obspy import Inventory, Trace, UTCDateTime
from obspy.core.inventory import Channel, Network, Response, Station
from obspy.core.inventory.response import InstrumentSensitivity

from per_obspy.errors import CatalogError
from per_obspy.records.sds import find_sds_stations, read_sds_station

MIDNIGHT = UTCDateTime(2020, 1, 1)


def write_day(folder: Path, station: str, first: int, last: int) -> None:
    """Write a file named by the day of its first sample; samples count seconds from midnight."""
    start = MIDNIGHT + first
    name = f"CI.{station}..HNN.D.{start.year}.{start.julday:03d}"
    path = folder / str(start.year) / "CI" / station / "HNN.D" / name
    path.parent.mkdir(parents=True)
    # One sample per second
    codes = {"network": "CI", "station": station, "channel": "HNN"}
    samples = np.arange(first, last, dtype=np.int32)
    trace = Trace(samples, {**codes, "starttime": start, "delta": 1.0})
    trace.write(str(path), format="MSEED")


def write_stations(path: Path) -> None:
    """Write the metadata of both stations."""
    place = {"latitude": 35.0, "longitude": -117.0, "elevation": 0.0}
    # One channel each, on both places the same
    response = Response(instrument_sensitivity=InstrumentSensitivity(2e5, 1.0, "M/S**2", "COUNTS"))
    channel = Channel("HNN", "", **place, depth=0, azimuth=0, dip=0, response=response)
    stations = [Station(code, **place, channels=[channel]) for code in ("ONE", "TWO")]
    metadata = Inventory([Network("CI", stations)], source="test")
    metadata.write(str(path), format="STATIONXML")


@pytest.fixture
def archive(tmp_path: Path) -> Path:
    """Return an archive of two stations; the first day's file reaches 20 s into the next day."""
    for station in ("ONE", "TWO"):
        write_day(tmp_path, station, -100, 20)
        write_day(tmp_path, station, 20, 200)
    write_stations(tmp_path / "s.xml")
    return tmp_path


def read(archive: Path, station: str, start: UTCDateTime, end: UTCDateTime):
    """Return the traces of a station in a window, by time, and its rejections."""
    contents = find_sds_stations(archive, start, end, archive / "s.xml")
    assert list(contents.stations) == ["CI.ONE", "CI.TWO"]
    paths = contents.stations[station]
    stream, rejected = read_sds_station(paths, contents.inventory, station, start, end)
    return stream.sort(["starttime"]), rejected


def test_the_window_over_midnight_is_whole(archive: Path):
    stream, rejected = read(archive, "CI.ONE", MIDNIGHT - 10, MIDNIGHT + 50)
    assert rejected == ()
    samples = np.concatenate([trace.data for trace in stream])
    np.testing.assert_array_equal(samples, np.arange(-10, 51))
    assert {trace.stats.units for trace in stream} == {"counts"}


def test_a_last_block_of_the_day_before_is_found(archive: Path):
    stream, _ = read(archive, "CI.TWO", MIDNIGHT + 1, MIDNIGHT + 10)
    np.testing.assert_array_equal(stream[0].data, np.arange(1, 11))


def test_a_station_without_samples_is_a_rejection(archive: Path):
    stream, rejected = read(archive, "CI.ONE", MIDNIGHT + 1000, MIDNIGHT + 1010)
    assert not stream
    window = "2020-01-01T00:16:40.000000Z to 2020-01-01T00:16:50.000000Z"
    assert rejected[0].reasons == (f"no samples from {window}",)


def test_wrong_archives_and_windows_are_refused(archive: Path):
    with pytest.raises(ValueError, match="end must be later than start"):
        find_sds_stations(archive, MIDNIGHT, MIDNIGHT)
    with pytest.raises(CatalogError, match=r"none: no such folder"):
        find_sds_stations(archive / "none", MIDNIGHT, MIDNIGHT + 1)
    with pytest.raises(CatalogError, match="no day file"):
        find_sds_stations(archive, MIDNIGHT + 1e7, MIDNIGHT + 1e7 + 1)


def test_an_unreadable_folder_does_not_stop_the_others(archive: Path, monkeypatch):
    # rights are no obstacle to the superuser, so the system's answer is made here
    listed = Path.iterdir

    def refused(self: Path):
        if self.name == "ONE":
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(self))
        return listed(self)

    monkeypatch.setattr(Path, "iterdir", refused)
    contents = find_sds_stations(archive, MIDNIGHT - 10, MIDNIGHT + 50)
    assert list(contents.stations) == ["CI.TWO"]
    # Two years of the window hold a folder of this station each
    assert {rejection.name for rejection in contents.rejected} == {"ONE"}
    for rejection in contents.rejected:
        assert rejection.reasons == ("the folder cannot be listed: Permission denied",)


@pytest.mark.parametrize(
    ("codes", "seconds", "reason"),
    [
        ({}, -365 * 86400, "holds records of 2018-12-31T23:58:20.000000Z to 2019-"),
        ({}, 3 * 86400, "under the name of another day"),
        ({"channel": "HNE"}, 0, "holds records of CI.ONE..HNE under the name of another channel"),
        ({"station": "TWO"}, 0, "holds records of CI.TWO..HNN under the name of another channel"),
        ({"location": "00"}, 0, "holds records of CI.ONE.00.HNN under"),
    ],
)
def test_a_file_of_another_day_or_channel_than_its_name_says(archive, codes, seconds, reason):
    (path,) = archive.glob("2019/CI/ONE/HNN.D/*")
    (trace,) = obspy.read(path)
    trace.stats.starttime += seconds
    trace.stats.update(codes)
    trace.write(str(path), format="MSEED")
    stream, (rejection,) = read(archive, "CI.ONE", MIDNIGHT - 10, MIDNIGHT + 50)
    assert reason in rejection.reasons[0]
    # the file of the next day serves
    np.testing.assert_array_equal(stream[0].data, np.arange(20, 51))


def test_a_pipe_among_the_day_files_does_not_hang(archive: Path):
    (path,) = archive.glob("2020/CI/ONE/HNN.D/*")
    path.unlink()
    os.mkfifo(path)
    stream, (rejection,) = read(archive, "CI.ONE", MIDNIGHT - 10, MIDNIGHT + 50)
    assert len(stream) == 1
    assert rejection.reasons == ("is no regular file",)
