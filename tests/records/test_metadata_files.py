"""Kinds of files that accompany records."""

from pathlib import Path

import obspy
import pytest
from station_files import record

from per_obspy.records.folder import find_stations, read_station
from per_obspy.records.metadata import kind_of

SEED = Path(obspy.__file__).parent / "io" / "xseed" / "tests" / "data"


@pytest.mark.parametrize("name", ["dataless.seed.BW_FURT", "dataless.seed.BW_ROTZ"])
def test_dataless_seed_describes_stations(name: str):
    assert kind_of(Path(name), (SEED / name).read_bytes()) == "inventory"


def test_a_volume_with_data_is_a_record():
    # A volume header and a record of data behind it
    headers = (SEED / "dataless.seed.BW_FURT").read_bytes()
    data = b"000009D " + bytes(504)
    assert kind_of(Path("full.seed"), headers + data) == "record"


def test_the_place_of_a_record_from_dataless_seed(tmp_path: Path):
    metadata = obspy.read_inventory(str(SEED / "dataless.seed.BW_FURT"))
    (station,) = metadata[0]
    channel = station[0]
    trace = record("HN1", station="FURT")
    trace.stats.update({"network": "BW", "channel": channel.code})
    trace.stats.starttime = channel.start_date + 86400
    trace.write(str(tmp_path / "a.mseed"), format="MSEED")
    (tmp_path / "BW.dataless").write_bytes((SEED / "dataless.seed.BW_FURT").read_bytes())
    found = find_stations(tmp_path)
    assert found.rejected == ()
    (read,), rejected = read_station(found.stations["BW.FURT"], found.inventory)
    assert rejected == ()
    place = read.stats.coordinates
    assert (place.latitude, place.longitude) == (channel.latitude, channel.longitude)
    assert read.stats.coordinates_source == "StationXML"
