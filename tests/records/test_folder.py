"""Folders of records with StationXML."""

from pathlib import Path

import numpy as np
import obspy
import pytest
from obspy import Stream, Trace, UTCDateTime
from obspy.core.event import Catalog, Event, Origin
from obspy.core.inventory import Channel, Comment, Inventory, Network, Response, Station
from obspy.core.inventory.response import InstrumentSensitivity

from per_obspy.errors import CatalogError
from per_obspy.records.event_file import read_event
from per_obspy.records.folder import find_stations, read_station

START = UTCDateTime(2020, 1, 2, 3, 4, 5)


def response(unit: str = "M/S**2", value: float = 2e5) -> Response:
    return Response(instrument_sensitivity=InstrumentSensitivity(value, 1.0, unit, "COUNTS"))


def inventory(
    channels: dict[str, tuple[float, float]],
    latitude: float = 35.0,
    answer: Response | None = None,
    **epoch: UTCDateTime,
) -> Inventory:
    place = {"latitude": latitude, "longitude": -117.0, "elevation": 700.0}
    described = [
        Channel(
            code,
            "",
            **place,
            depth=0,
            azimuth=azimuth,
            dip=dip,
            response=answer or response(),
            **epoch,
        )
        for code, (azimuth, dip) in channels.items()
    ]
    return Inventory([Network("CI", [Station("CLC", **place, channels=described)])], source="test")


THREE = {"HN1": (30.0, 0.0), "HN2": (120.0, 0.0), "HNZ": (0.0, -90.0)}


def record(channel: str, samples: np.ndarray | None = None) -> Trace:
    samples = np.arange(300, dtype=np.int32) if samples is None else samples
    header = {
        "network": "CI",
        "station": "CLC",
        "channel": channel,
        "starttime": START,
        "delta": 0.01,
    }
    return Trace(samples, header)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "deep" / "er").mkdir(parents=True)
    for code in THREE:
        record(code).write(str(tmp_path / "deep" / "er" / f"{code}.mseed"), format="MSEED")
    inventory(THREE).write(str(tmp_path / "station.xml"), format="STATIONXML")
    return tmp_path


def read_all(folder: Path, stationxml: Path | None = None) -> tuple[Stream, tuple[str, ...]]:
    contents = find_stations(folder, stationxml)
    stream, rejected = read_station(contents.stations["CI.CLC"], contents.inventory)
    return stream, tuple(reason for rejection in rejected for reason in rejection.reasons)


def test_records_in_subfolders_get_their_metadata(folder: Path):
    contents = find_stations(folder)
    assert list(contents.stations) == ["CI.CLC"]
    assert contents.rejected == ()
    stream, reasons = read_all(folder)
    assert reasons == ()
    assert [trace.stats.get("sensor_azimuth") for trace in stream] == [30, 120, None]
    assert [trace.stats.sensor_dip for trace in stream] == [0, 0, -90]
    for trace in stream:
        assert (trace.stats.units, trace.stats.quantity, trace.stats.processing_level) == (
            "counts",
            "acceleration",
            "raw",
        )
        assert trace.stats.coordinates == {"latitude": 35, "longitude": -117, "elevation": 700}
        assert trace.stats.response.instrument_sensitivity.value == 2e5
        assert trace.data.dtype == np.float64


def test_comments_of_the_station_tell_its_ground(folder: Path):
    described = inventory(THREE)
    described[0][0].comments = [
        Comment("a park"),
        Comment("site_class = lakebed"),
        Comment("vs30=180.5"),
    ]
    described.write(str(folder / "station.xml"), format="STATIONXML")
    stream, _ = read_all(folder)
    assert {(trace.stats.site_class, trace.stats.vs30) for trace in stream} == {("lakebed", 180.5)}
    described[0][0].comments = [Comment("site_class=")]
    described.write(str(folder / "station.xml"), format="STATIONXML")
    assert not any(
        "site_class" in trace.stats or "vs30" in trace.stats for trace in read_all(folder)[0]
    )


@pytest.mark.parametrize("velocity", ["soft", "-200", "0", "nan", "inf", "1e5"])
def test_a_vs30_that_is_no_velocity_is_a_reason(folder: Path, velocity: str):
    described = inventory(THREE)
    described[0][0].comments = [Comment(f"vs30={velocity}")]
    described.write(str(folder / "station.xml"), format="STATIONXML")
    stream, reasons = read_all(folder)
    assert not stream
    assert set(reasons) == {f"StationXML says vs30={velocity}, which is no velocity in m/s"}


def test_stationxml_may_lie_elsewhere(folder: Path, tmp_path_factory: pytest.TempPathFactory):
    elsewhere = tmp_path_factory.mktemp("metadata") / "station.xml"
    (folder / "station.xml").rename(elsewhere)
    for place in (elsewhere, elsewhere.parent):
        assert len(read_all(folder, place)[0]) == 3


def test_without_stationxml_raw_records_say_why_they_cannot_be_used(folder: Path):
    (folder / "station.xml").unlink()
    stream, reasons = read_all(folder)
    assert not stream
    assert set(reasons) == {"there is no StationXML, so what its samples measure is unknown"}


def test_a_channel_that_stationxml_lacks_is_one_rejection(folder: Path):
    inventory({code: THREE[code] for code in ("HN1", "HNZ")}).write(
        str(folder / "station.xml"), format="STATIONXML"
    )
    stream, reasons = read_all(folder)
    assert [trace.stats.channel for trace in stream] == ["HN1", "HNZ"]
    assert len(reasons) == 1
    assert reasons[0].startswith("StationXML has no channel CI.CLC..HN2 at 2020-01-02T03:04:05")


def test_the_epoch_of_the_record_decides(folder: Path):
    old = inventory(
        THREE, latitude=10.0, start_date=UTCDateTime(2000, 1, 1), end_date=UTCDateTime(2010, 1, 1)
    )
    new = inventory(THREE, latitude=36.0, start_date=UTCDateTime(2010, 1, 1))
    (old + new).write(str(folder / "station.xml"), format="STATIONXML")
    assert {trace.stats.coordinates.latitude for trace in read_all(folder)[0]} == {36}


def test_stationxml_that_contradicts_itself_is_a_reason(folder: Path):
    inventory(THREE, latitude=36.0).write(str(folder / "other.xml"), format="STATIONXML")
    stream, reasons = read_all(folder)
    assert not stream
    assert "contradicts itself about the channel" in reasons[0]
    assert "latitude 36.0 and 35.0" in reasons[0]


def test_the_same_stationxml_twice_is_no_contradiction(folder: Path):
    inventory(THREE).write(str(folder / "other.xml"), format="STATIONXML")
    assert len(read_all(folder)[0]) == 3


@pytest.mark.parametrize(
    ("answer", "reason"),
    [
        (response("PA"), "StationXML says that the instrument measures 'PA', not ground motion"),
        (Response(), "StationXML gives no sensitivity at 2020"),
    ],
)
def test_a_response_that_gives_no_motion_is_a_reason(folder: Path, answer: Response, reason: str):
    inventory(THREE, answer=answer).write(str(folder / "station.xml"), format="STATIONXML")
    stream, reasons = read_all(folder)
    assert not stream
    assert all(found.startswith(reason) for found in reasons)


def test_samples_that_are_not_numbers_are_a_reason(folder: Path):
    samples = np.ones(300)
    samples[[16, 20]] = np.nan, np.inf
    record("HN1", samples).write(str(folder / "deep" / "er" / "HN1.mseed"), format="MSEED")
    stream, reasons = read_all(folder)
    assert len(stream) == 2
    assert reasons == ("2 samples are not finite, the first is sample 17",)


def test_files_that_are_no_records_are_listed_and_the_rest_goes_on(folder: Path):
    (folder / "notes.txt").write_text("bring an umbrella")
    (folder / "empty.mseed").touch()
    (folder / "broken.xml").write_text("<FDSNStationXML nothing")
    contents = find_stations(folder)
    assert len(contents.stations["CI.CLC"]) == 3
    reasons = {rejection.name: rejection.reasons[0] for rejection in contents.rejected}
    assert set(reasons) == {"notes.txt", "empty.mseed", "broken.xml"}
    assert reasons["empty.mseed"] == "the file is empty"
    assert reasons["notes.txt"].startswith("ObsPy cannot read it: its format is unknown")
    assert {rejection.kind for rejection in contents.rejected} == {"file"}


def test_names_with_wildcards_mean_themselves(folder: Path):
    (folder / "deep" / "er" / "HN1.mseed").rename(folder / "deep" / "er" / "[H*]?.mseed")
    assert len(read_all(folder)[0]) == 3


def test_one_file_of_several_stations_serves_each(folder: Path):
    other = record("HN1")
    other.stats.station = "CCC"
    Stream([record("HN1"), other]).write(str(folder / "both.mseed"), format="MSEED")
    contents = find_stations(folder)
    paths = contents.stations["CI.CCC"]
    assert paths == (folder / "both.mseed",)
    stream, rejected = read_station(paths, contents.inventory, "CI.CLC")
    assert ([trace.id for trace in stream], rejected) == (["CI.CLC..HN1"], ())


def test_folders_without_records_are_refused(tmp_path: Path):
    with pytest.raises(CatalogError, match=r"nowhere: no such folder"):
        find_stations(tmp_path / "nowhere")
    with pytest.raises(CatalogError, match="the folder is empty"):
        find_stations(tmp_path)
    (tmp_path / "a.txt").write_text("words")
    (tmp_path / "b.txt").write_text("more words")
    with pytest.raises(
        CatalogError, match=r"none of its 2 files is a record; a\.txt: ObsPy cannot read it"
    ):
        find_stations(tmp_path)
    with pytest.raises(CatalogError, match=r"none of its 1 files is a record; a\.txt"):
        find_stations(tmp_path / "a.txt")


def test_a_named_stationxml_must_be_readable(folder: Path):
    (folder / "notes.txt").write_text("bring an umbrella")
    with pytest.raises(CatalogError, match=r"notes\.txt: is no StationXML"):
        find_stations(folder, folder / "notes.txt")
    with pytest.raises(CatalogError, match="holds no StationXML"):
        find_stations(folder, folder / "deep")


def test_the_event_of_a_quakeml_file(tmp_path: Path):
    event = Event(origins=[Origin(time=START, latitude=35, longitude=-117, depth=8000)])
    Catalog([event]).write(str(tmp_path / "event.xml"), format="QUAKEML")
    assert read_event(tmp_path / "event.xml").origins[0].time == START
    Catalog([event, Event()]).write(str(tmp_path / "two.xml"), format="QUAKEML")
    with pytest.raises(CatalogError, match=r"two\.xml: must hold one event, holds 2"):
        read_event(tmp_path / "two.xml")
    Catalog([Event()]).write(str(tmp_path / "none.xml"), format="QUAKEML")
    with pytest.raises(CatalogError, match="has no origin"):
        read_event(tmp_path / "none.xml")
    with pytest.raises(CatalogError, match=r"missing\.xml"):
        read_event(tmp_path / "missing.xml")


@pytest.mark.real_data
def test_ridgecrest(real_data: Path):
    contents = find_stations(real_data / "records" / "ridgecrest2019_mseed")
    assert len(contents.stations) == 11
    assert contents.rejected == ()
    for name, paths in contents.stations.items():
        stream, rejected = read_station(paths, contents.inventory, name)
        assert (len(stream), rejected) == (3, ())
        assert [trace.stats.get("sensor_azimuth") for trace in stream] == [90, 0, None]
    gain = obspy.read_inventory(str(real_data / "records" / "ridgecrest2019_mseed" / "CI.CLC.xml"))
    stream, _ = read_station(contents.stations["CI.CLC"], gain)
    peaks = [
        np.ptp(trace.data) / 2 / trace.stats.response.instrument_sensitivity.value
        for trace in stream[:2]
    ]
    # README of the data: CLC 0.51 g; half the range instead of a baseline costs a few per cent
    assert max(peaks) / 9.80665 == pytest.approx(0.51, rel=0.1)


@pytest.mark.real_data
def test_knet_counts_keep_their_gain(real_data: Path):
    contents = find_stations(real_data / "records" / "aomori2018_knet")
    assert len(contents.stations) == 9
    for paths in contents.stations.values():
        stream, rejected = read_station(paths, None)
        assert (len(stream), rejected) == (3, ())
        assert {trace.stats.get("sensor_azimuth") for trace in stream} == {0, 90, None}
        for trace in stream:
            assert trace.stats.units == "counts"
            assert trace.stats.coordinates.latitude == pytest.approx(41, abs=1)
            # the header has the peak about the mean, to 0.001 gal
            peak = np.abs(trace.data - trace.data.mean()).max()
            assert peak * trace.stats.calib == pytest.approx(
                trace.stats.header_peak * trace.stats.calib, abs=2e-5
            )


@pytest.mark.real_data
def test_a_cut_knet_file_is_a_reason(real_data: Path, tmp_path: Path):
    lines = (
        (real_data / "records" / "aomori2018_knet" / "AOM0011801241951.NS").read_text().splitlines()
    )
    (tmp_path / "AOM0011801241951.NS").write_text("\n".join(lines[:500]))
    contents = find_stations(tmp_path)
    stream, rejected = read_station(contents.stations["BO.AOM001"], None)
    assert not stream
    assert rejected[0].reasons == ("the header promises 102 s, the file holds 38.64 s",)


STATION_TEXT = """#Network|Station|Latitude|Longitude|Elevation|SiteName|StartTime|EndTime
|ANGOL|-37.79|-72.71|100.0|Angol Hospital|1970-01-01T00:00:00|
"""


@pytest.mark.real_data
@pytest.mark.parametrize("beside", [True, False])
def test_station_text_gives_the_coordinates_that_renadic_leaves_out(
    real_data: Path, tmp_path: Path, beside: bool
):
    folder = tmp_path / "records"
    folder.mkdir()
    source = real_data / "records" / "maule2010_renadic" / "angol1002271parte1.v1"
    (folder / "angol.v1").write_bytes(source.read_bytes())
    text = (folder if beside else tmp_path) / "stations.txt"
    text.write_text(STATION_TEXT)
    contents = find_stations(folder, None if beside else text)
    assert contents.rejected == ()
    stream, rejected = read_station(contents.stations[".ANGOL"], contents.inventory, ".ANGOL")
    assert rejected == ()
    assert [trace.stats.coordinates.latitude for trace in stream] == [-37.79] * 3
    assert [trace.stats.get("sensor_azimuth") for trace in stream] == [90, 0, None]
    stream, rejected = read_station(contents.stations[".ANGOL"], None, ".ANGOL")
    assert rejected == ()
    assert not any("coordinates" in trace.stats for trace in stream)  # 0, 0 in the file is no place


def test_a_vertical_channel_without_dip_points_up(folder: Path):
    described = inventory(THREE)
    for channel in described[0][0]:
        channel.dip = None
    described.write(str(folder / "station.xml"), format="STATIONXML")
    stream, reasons = read_all(folder)
    assert reasons == ()
    assert [trace.stats.get("sensor_azimuth") for trace in stream] == [30, 120, None]
    assert [trace.stats.sensor_dip for trace in stream] == [0, 0, -90]  # SEED: Z is vertical
