"""Files that describe stations, and the metadata, coordinates and kinds that come from them."""

from pathlib import Path

import numpy as np
import obspy
import pytest
from format_samples import SAMPLES
from obspy import Trace, UTCDateTime
from obspy.core import AttribDict
from obspy.core.inventory import Channel, Comment, Inventory, Network, Response, Station
from obspy.core.inventory.response import PolesZerosResponseStage, ResponseStage
from station_files import (
    THREE,
    inventory,
    read_all,
    record,
    response,
    write_inventory,
    write_records,
)

from per_obspy.records.folder import find_stations, read_station
from per_obspy.records.metadata import (
    HEADER,
    STATIONXML,
    kind_of,
    metadata_text,
    set_coordinates,
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_records(tmp_path)
    return tmp_path


def commented(*comments: str) -> Inventory:
    """Return the metadata of a station with comments."""
    metadata = inventory(THREE)
    metadata[0][0].comments = [Comment(comment) for comment in comments]
    return metadata


def test_records_get_orientation_coordinates_and_response(folder: Path):
    traces, reasons = read_all(folder)
    assert reasons == ()
    assert [trace.stats.get("sensor_azimuth") for trace in traces] == [30, 120, None]
    assert [trace.stats.sensor_dip for trace in traces] == [0, 0, -90]
    # The words of each of them
    for trace in traces:
        words = (trace.stats.units, trace.stats.quantity, trace.stats.processing_level)
        assert words == ("counts", "acceleration", "raw")
        assert trace.stats.coordinates == {"latitude": 35, "longitude": -117, "elevation": 700}
        assert trace.stats.response.instrument_sensitivity.value == 2e5
        assert trace.data.dtype == np.float64


def test_comments_of_the_station_hold_its_ground(folder: Path):
    write_inventory(commented("a park", "site_class = lakebed", "vs30=180.5"), folder)
    traces, _ = read_all(folder)
    assert {(trace.stats.site_class, trace.stats.vs30) for trace in traces} == {("lakebed", 180.5)}
    write_inventory(commented("site_class="), folder)
    for trace in read_all(folder)[0]:
        assert not {"site_class", "vs30"} & set(trace.stats)


@pytest.mark.parametrize("velocity", ["soft", "-200", "0", "nan", "inf", "1e5"])
def test_a_vs30_that_is_no_velocity_is_a_reason(folder: Path, velocity: str):
    write_inventory(commented(f"vs30={velocity}"), folder)
    traces, reasons = read_all(folder)
    assert not traces
    assert set(reasons) == {f"vs30={velocity} in StationXML is not a velocity in m/s"}


def test_without_stationxml_raw_records_are_rejected_with_a_reason(folder: Path):
    (folder / "station.xml").unlink()
    traces, reasons = read_all(folder)
    assert not traces
    assert set(reasons) == {"there is no StationXML, so the unit of its samples is unknown"}


def test_a_channel_that_stationxml_lacks_is_one_rejection(folder: Path):
    write_inventory(inventory({code: THREE[code] for code in ("HN1", "HNZ")}), folder)
    traces, reasons = read_all(folder)
    assert [trace.stats.channel for trace in traces] == ["HN1", "HNZ"]
    assert len(reasons) == 1
    assert reasons[0].startswith("StationXML has no channel CI.CLC..HN2 at 2020-01-02T03:04:05")


def test_the_epoch_of_the_record_decides(folder: Path):
    begin, change = UTCDateTime(2000, 1, 1), UTCDateTime(2010, 1, 1)
    old = inventory(THREE, latitude=10.0, start_date=begin, end_date=change)
    new = inventory(THREE, latitude=36.0, start_date=change)
    write_inventory(old + new, folder)
    assert {trace.stats.coordinates.latitude for trace in read_all(folder)[0]} == {36}


def test_stationxml_that_contradicts_itself_is_a_reason(folder: Path):
    write_inventory(inventory(THREE, latitude=36.0), folder, "other.xml")
    traces, reasons = read_all(folder)
    assert not traces
    assert "contradicts itself about the channel" in reasons[0]
    assert "latitude 36.0 and 35.0" in reasons[0]


def test_the_same_stationxml_twice_is_no_contradiction(folder: Path):
    write_inventory(inventory(THREE), folder, "other.xml")
    assert len(read_all(folder)[0]) == 3


def test_the_product_of_the_stages_stands_for_a_sensitivity_that_stationxml_leaves_out(
    folder: Path,
):
    # mutation: all records of the station are rejected, although every stage has a gain
    silent = response()
    laplace = "LAPLACE (RADIANS/SECOND)"
    sensor = PolesZerosResponseStage(1, 500.0, 1.0, "M/S**2", "V", laplace, 1.0, [], [], 1.0)
    silent.response_stages = [sensor, ResponseStage(2, 400.0, 1.0, "V", "COUNTS")]
    silent.instrument_sensitivity = None
    write_inventory(inventory(THREE, answer=silent), folder)
    traces, reasons = read_all(folder)
    assert reasons == ()
    for trace in traces:
        sensitivity = trace.stats.response.instrument_sensitivity
        assert (sensitivity.value, sensitivity.input_units) == (2e5, "M/S**2")
        assert trace.stats.quantity == "acceleration"


@pytest.mark.parametrize(
    ("answer", "reason"),
    [
        (response("PA"), "the instrument measures 'PA' by its StationXML, not ground motion"),
        (Response(), "StationXML gives no sensitivity at 2020"),
    ],
)
def test_a_response_that_gives_no_motion_is_a_reason(folder: Path, answer: Response, reason: str):
    write_inventory(inventory(THREE, answer=answer), folder)
    traces, reasons = read_all(folder)
    assert not traces
    assert len(reasons) == 3
    assert all(found.startswith(reason) for found in reasons)


def test_samples_that_are_not_numbers_are_a_reason(folder: Path):
    samples = np.ones(300)
    samples[[16, 20]] = np.nan, np.inf
    record("HN1", samples).write(str(folder / "deep" / "er" / "HN1.mseed"), format="MSEED")
    traces, reasons = read_all(folder)
    assert len(traces) == 2
    assert reasons == ("2 samples are not finite, the first is sample 17",)


def test_a_vertical_channel_without_dip_points_up(folder: Path):
    metadata = inventory(THREE)
    for channel in metadata[0][0]:
        channel.dip = None
    write_inventory(metadata, folder)
    traces, reasons = read_all(folder)
    assert reasons == ()
    assert [trace.stats.get("sensor_azimuth") for trace in traces] == [30, 120, None]
    assert [trace.stats.sensor_dip for trace in traces] == [0, 0, -90]  # SEED: Z is vertical


def test_the_text_of_metadata_does_not_depend_on_time_or_source():
    metadata = inventory(THREE)
    text = metadata_text(metadata)
    metadata.created, metadata.source = UTCDateTime(1999, 1, 1), "elsewhere"
    assert metadata_text(metadata) == text
    # but on the metadata themselves
    assert metadata_text(inventory(THREE, latitude=36.0)) != text


@pytest.mark.real_data
def test_knet_counts_keep_their_gain(real_data: Path):
    contents = find_stations(real_data / "records" / "aomori2018_knet")
    assert len(contents.stations) == 9
    for paths in contents.stations.values():
        stream, rejected = read_station(paths, None)
        assert (len(stream), rejected) == (3, ())
        assert {trace.stats.get("sensor_azimuth") for trace in stream} == {0, 90, None}
        # Counts, whose header has the peak about the mean, to 0.001 gal
        for trace in stream:
            assert trace.stats.units == "counts"
            assert trace.stats.coordinates.latitude == pytest.approx(41, abs=1)
            peak = np.abs(trace.data - trace.data.mean()).max() * trace.stats.calib
            header_peak = trace.stats.header_peak * trace.stats.calib
            assert peak == pytest.approx(header_peak, abs=2e-5)


STATION_TEXT = """#Network|Station|Latitude|Longitude|Elevation|SiteName|StartTime|EndTime
|ANGOL|-37.79|-72.71|100.0|Angol Hospital|1970-01-01T00:00:00|
"""


@pytest.fixture
def angol(real_data: Path, tmp_path: Path) -> Path:
    """Return a folder with a real record whose coordinates are 0, 0: a mark for unknown."""
    folder = tmp_path / "records"
    folder.mkdir()
    source = real_data / "records" / "maule2010_renadic" / "angol1002271parte1.v1"
    (folder / "angol.v1").write_bytes(source.read_bytes())
    return folder


@pytest.mark.real_data
@pytest.mark.parametrize("same_folder", [True, False])
def test_station_text_gives_the_coordinates_that_renadic_leaves_out(
    angol: Path, tmp_path: Path, same_folder: bool
):
    text = (angol if same_folder else tmp_path) / "stations.txt"
    text.write_text(STATION_TEXT)
    contents = find_stations(angol, None if same_folder else text)
    assert contents.rejected == ()
    stream, rejected = read_station(contents.stations[".ANGOL"], contents.inventory, ".ANGOL")
    # The station's place, and the file's own directions
    assert rejected == ()
    assert [trace.stats.coordinates.latitude for trace in stream] == [-37.79] * 3
    assert [trace.stats.get("sensor_azimuth") for trace in stream] == [90, 0, None]


@pytest.mark.real_data
def test_unknown_coordinates_stay_absent(angol: Path):
    paths = find_stations(angol).stations[".ANGOL"]
    stream, rejected = read_station(paths, None, ".ANGOL")
    assert (len(stream), rejected) == (3, ())
    assert not any("coordinates" in trace.stats for trace in stream)


AFAD = SAMPLES["afad"]


def place(latitude: float, longitude: float, **elevation: float) -> AttribDict:
    return AttribDict(latitude=latitude, longitude=longitude, **elevation)


def noted(header: AttribDict | None, *places: tuple[str, AttribDict]) -> AttribDict:
    trace = Trace(header={"coordinates": header} if header else {})
    set_coordinates(trace, places)
    return trace.stats


def test_the_table_goes_before_the_header_and_the_header_before_stationxml():
    table = ("stations.csv", place(1.0, 2.0))
    xml = (STATIONXML, place(1.001, 2.001))
    header = place(1.002, 2.002)
    for known, source in (((table, xml), "stations.csv"), ((xml,), HEADER)):
        stats = noted(header, *known)
        assert stats.coordinates_source == source
        assert "coordinates_conflict" not in stats
    assert noted(None, xml).coordinates_source == STATIONXML
    assert not {"coordinates", "coordinates_source"} & set(noted(None))


def test_an_elevation_comes_from_another_source_of_the_same_place():
    stats = noted(place(1.001, 2.0, elevation=90.0), ("stations.csv", place(1.0, 2.0)))
    assert stats.coordinates == {"latitude": 1.0, "longitude": 2.0, "elevation": 90.0}
    far = noted(place(5.0, 2.0, elevation=90.0), ("stations.csv", place(1.0, 2.0)))
    assert "elevation" not in far.coordinates


@pytest.mark.parametrize(("metres", "contradicts"), [(900.0, False), (1100.0, True)])
def test_more_than_a_kilometre_is_a_contradiction_with_both_places(metres, contradicts):
    degrees = metres / 111_195.0  # of latitude, on a sphere of 6371 km
    stats = noted(place(30.0, 40.0), (STATIONXML, place(30.0 + degrees, 40.0)))
    assert ("coordinates_conflict" in stats) == contradicts
    if contradicts:
        text = f"header 30.0000, 40.0000 used, StationXML {30.0 + degrees:.4f}, 40.0000"
        assert stats.coordinates_conflict == f"{text} is 1.1 km away"


def test_a_processed_record_keeps_where_its_coordinates_came_from():
    trace = Trace(header={"coordinates": place(1.0, 2.0), "coordinates_source": "stations.csv"})
    trace.stats.coordinates_conflict = "stations.csv 1, 2 used, header 3, 4 is 314 km away"
    set_coordinates(trace, ())
    assert trace.stats.coordinates_source == "stations.csv"
    assert "314 km" in trace.stats.coordinates_conflict


def afad_folder(folder: Path) -> str:
    """Write a record of AFAD and return the name of its station."""
    (folder / "record.asc").write_bytes(AFAD.text.encode("latin-1"))
    (name,) = find_stations(folder).stations
    return name


def test_each_source_of_a_record_of_afad(tmp_path: Path):
    name = afad_folder(tmp_path)
    network, station = name.split(".")
    header = read_one(tmp_path, name)
    assert header.coordinates_source == HEADER
    # A table beside it corrects it, and says so
    latitude = header.coordinates.latitude
    moved = latitude + 0.5
    lines = ("station,latitude,longitude,Vs30,site_class", f"{station},{moved},30.0,321,C")
    (tmp_path / "stations.csv").write_text("\n".join(lines))
    table = read_one(tmp_path, name)
    assert (table.coordinates.latitude, table.coordinates_source) == (moved, "stations.csv")
    assert f"header {latitude:.4f}" in table.coordinates_conflict
    assert (table.vs30, table.site_class) == (321.0, "C")
    # StationXML is the last, and differs too
    here = {"latitude": 1.0, "longitude": 2.0, "elevation": 3.0}
    channel = Channel(header.channel, header.location, depth=0.0, **here)
    metadata = Inventory([Network(network, [Station(station, channels=[channel], **here)])])
    write_inventory(metadata, tmp_path)
    both = read_one(tmp_path, name)
    assert both.coordinates_source == "stations.csv"
    assert both.coordinates_conflict.count("km away") == 2
    (tmp_path / "stations.csv").unlink()
    assert read_one(tmp_path, name).coordinates_source == HEADER


def read_one(folder: Path, name: str) -> AttribDict:
    found = find_stations(folder)
    (trace,), rejected = read_station(found.stations[name], found.inventory, name)
    assert rejected == ()
    return trace.stats


def test_a_table_goes_before_stationxml_for_raw_records(tmp_path: Path):
    write_records(tmp_path)
    (tmp_path / "stations.csv").write_text("station,lat,lon\nCLC,35.5,-117.0\n")
    traces, reasons = read_all(tmp_path)
    assert reasons == ()
    assert {trace.stats.coordinates_source for trace in traces} == {"stations.csv"}
    assert all("StationXML 35.0000, -117.0000" in t.stats.coordinates_conflict for t in traces)
    # The elevation of a place 55 km away is not that of this one
    assert traces[0].stats.coordinates == {"latitude": 35.5, "longitude": -117.0}


def test_two_rows_of_one_table_that_differ_are_a_reason(tmp_path: Path):
    write_records(tmp_path)
    rows = "station,lat,lon\nCLC,35.5,-117.0\nCLC,35.6,-117.0\n"
    (tmp_path / "stations.csv").write_text(rows)
    _, reasons = read_all(tmp_path)
    assert "the table stations.csv contradicts itself about the station" in reasons[0]
    assert "latitude 35.5 and 35.6" in reasons[0]


@pytest.mark.parametrize("word", ["-5", "fast", "1e3", "20000", "nan"])
def test_a_wrong_vs30_of_a_table_is_refused_with_its_line(tmp_path: Path, word: str):
    write_records(tmp_path)
    rows = f"station,lat,lon,vs30\nCLC,35.5,-117.0,{word}\n"
    (tmp_path / "stations.csv").write_text(rows)
    (row,) = find_stations(tmp_path).rejected
    assert (row.name, row.reasons[0][:13]) == ("stations.csv", "line 2, vs30:")


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
