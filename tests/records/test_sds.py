"""SDS archives."""

from pathlib import Path

import numpy as np
import pytest
from obspy import Inventory, Stream, Trace, UTCDateTime
from obspy.core.inventory import Channel, Network, Response, Station
from obspy.core.inventory.response import InstrumentSensitivity

from per_obspy.errors import CatalogError
from per_obspy.records.sds import find_sds_stations, read_sds_station

MIDNIGHT = UTCDateTime(2020, 1, 1)


@pytest.fixture
def archive(tmp_path: Path) -> Path:
    """Two stations; samples count seconds from midnight, and the first day's file reaches 20 s into the next day."""
    for station in ("ONE", "TWO"):
        for first, last in ((-100, 20), (20, 200)):
            day = MIDNIGHT + first
            name = f"CI.{station}..HNN.D.{day.year}.{day.julday:03d}"
            path = tmp_path / str(day.year) / "CI" / station / "HNN.D" / name
            path.parent.mkdir(parents=True)
            header = {
                "network": "CI",
                "station": station,
                "channel": "HNN",
                "starttime": day,
                "delta": 1.0,
            }
            samples = np.arange(first, last, dtype=np.int32)
            Stream([Trace(samples, header)]).write(str(path), format="MSEED")
    place = {"latitude": 35.0, "longitude": -117.0, "elevation": 0.0}
    response = Response(instrument_sensitivity=InstrumentSensitivity(2e5, 1.0, "M/S**2", "COUNTS"))
    channel = Channel("HNN", "", **place, depth=0, azimuth=0, dip=0, response=response)
    stations = [Station(code, **place, channels=[channel]) for code in ("ONE", "TWO")]
    Inventory([Network("CI", stations)], source="test").write(
        str(tmp_path / "s.xml"), format="STATIONXML"
    )
    return tmp_path


def test_the_window_over_midnight_is_whole(archive: Path):
    start, end = MIDNIGHT - 10, MIDNIGHT + 50
    contents = find_sds_stations(archive, start, end, archive / "s.xml")
    assert list(contents.stations) == ["CI.ONE", "CI.TWO"]
    stream, rejected = read_sds_station(
        contents.stations["CI.ONE"], contents.inventory, "CI.ONE", start, end
    )
    assert rejected == ()
    samples = np.concatenate(
        [trace.data for trace in sorted(stream, key=lambda trace: trace.stats.starttime)]
    )
    np.testing.assert_array_equal(samples, np.arange(-10, 51))
    assert {trace.stats.units for trace in stream} == {"counts"}


def test_a_last_block_of_the_day_before_is_found(archive: Path):
    start, end = MIDNIGHT + 1, MIDNIGHT + 10
    contents = find_sds_stations(archive, start, end, archive / "s.xml")
    stream, _ = read_sds_station(
        contents.stations["CI.TWO"], contents.inventory, "CI.TWO", start, end
    )
    np.testing.assert_array_equal(stream[0].data, np.arange(1, 11))


def test_a_station_without_samples_is_a_rejection(archive: Path):
    start, end = MIDNIGHT + 1000, MIDNIGHT + 1010
    contents = find_sds_stations(archive, start, end, archive / "s.xml")
    stream, rejected = read_sds_station(
        contents.stations["CI.ONE"], contents.inventory, "CI.ONE", start, end
    )
    assert not stream
    assert rejected[0].reasons == (
        "no samples from 2020-01-01T00:16:40.000000Z to 2020-01-01T00:16:50.000000Z",
    )


def test_wrong_archives_and_windows_are_refused(archive: Path):
    with pytest.raises(ValueError, match="end must be later than start"):
        find_sds_stations(archive, MIDNIGHT, MIDNIGHT)
    with pytest.raises(CatalogError, match=r"none: no such folder"):
        find_sds_stations(archive / "none", MIDNIGHT, MIDNIGHT + 1)
    with pytest.raises(CatalogError, match="no day file"):
        find_sds_stations(archive, MIDNIGHT + 1e7, MIDNIGHT + 1e7 + 1)
