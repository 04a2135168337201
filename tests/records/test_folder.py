"""Folders of records with StationXML, that grow, and with several forms of a record."""

import errno
import os
import re
import socket
import time
from pathlib import Path

import numpy as np
import obspy
import pytest
from obspy import Stream, Trace, UTCDateTime
from station_files import START, read_all, record, write_records

from per_obspy.config import Processing
from per_obspy.errors import CatalogError, NothingUsable, TryLater
from per_obspy.formats.peer_at2 import write_at2
from per_obspy.processing.chain import process_station
from per_obspy.records import file_list
from per_obspy.records.earthquakes.quakeml import read_event
from per_obspy.records.file_list import changed_files, file_states, growing_files
from per_obspy.records.folder import find_stations, one_series, read_station


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_records(tmp_path)
    return tmp_path


def test_records_in_subfolders_are_found(folder: Path):
    contents = find_stations(folder)
    below = folder / "deep" / "er"
    paths = tuple(below / f"{code}.mseed" for code in ("HN1", "HN2", "HNZ"))
    assert contents.stations == {"CI.CLC": paths}
    assert contents.rejected == ()
    # Traces remember their files
    traces, reasons = read_all(folder)
    assert ([trace.stats.source for trace in traces], reasons) == ([*map(str, paths)], ())


def test_stationxml_may_lie_elsewhere(folder: Path, tmp_path_factory: pytest.TempPathFactory):
    elsewhere = tmp_path_factory.mktemp("metadata") / "station.xml"
    (folder / "station.xml").rename(elsewhere)
    for place in (elsewhere, elsewhere.parent):
        assert len(read_all(folder, place)[0]) == 3


def test_files_that_are_no_records_are_listed_and_the_rest_goes_on(folder: Path):
    (folder / "notes.txt").write_text("bring an umbrella")
    (folder / "empty.mseed").touch()
    (folder / "broken.xml").write_text("<FDSNStationXML nothing")
    contents = find_stations(folder)
    assert len(contents.stations["CI.CLC"]) == 3
    # Each with its reason
    reasons = {rejection.name: rejection.reasons[0] for rejection in contents.rejected}
    assert set(reasons) == {"notes.txt", "empty.mseed", "broken.xml"}
    assert reasons["empty.mseed"] == "the file is empty"
    assert reasons["notes.txt"].startswith("ObsPy cannot read it: its format is unknown")
    assert {rejection.kind for rejection in contents.rejected} == {"file"}


def rejections(folder: Path) -> dict[str, str]:
    """Return the first reason of everything that is rejected; the station must be whole."""
    contents = find_stations(folder)
    assert len(contents.stations["CI.CLC"]) == 3
    return {rejection.name: rejection.reasons[0] for rejection in contents.rejected}


def test_what_is_neither_file_nor_folder_is_listed(folder: Path):
    # would catch a reader that waits for ever at a pipe, and links that vanish unsaid
    os.mkfifo(folder / "pipe.mseed")
    (folder / "nowhere.mseed").symlink_to("gone")
    (folder / "loop.mseed").symlink_to("loop.mseed")
    (folder / "again").symlink_to("deep")
    (folder / "null.mseed").symlink_to(os.devnull)
    with socket.socket(socket.AF_UNIX) as server:
        # the name of a socket has at most 107 characters
        server.bind(os.path.relpath(folder / "socket"))
    reasons = rejections(folder)
    assert {reasons.pop(name) for name in ("pipe.mseed", "socket", "null.mseed")} == {
        "is no regular file"
    }
    assert reasons.pop("nowhere.mseed").startswith("is a link without a target: No such file")
    assert reasons.pop("loop.mseed").startswith("is a link without a target: Too many levels")
    assert reasons == {"again": "is a link to a folder, which is not followed: name that folder"}


@pytest.mark.parametrize("number", [errno.EACCES, errno.EIO])
def test_unreadable_folders_and_files_do_not_stop_the_others(
    folder: Path, number: int, monkeypatch
):
    # rights are no obstacle to the superuser, so the system's answers are made here
    (folder / "closed").mkdir()
    record("HN3").write(str(folder / "closed.mseed"), format="MSEED")
    scandir, opened = os.scandir, Path.open

    def scanned(path):
        if Path(path).name == "closed":
            raise OSError(number, os.strerror(number), os.fspath(path))
        return scandir(path)

    def open_or_refuse(self, *arguments, **options):
        if self.name == "closed.mseed":
            raise OSError(number, os.strerror(number), os.fspath(self))
        return opened(self, *arguments, **options)

    monkeypatch.setattr(os, "scandir", scanned)
    monkeypatch.setattr(Path, "open", open_or_refuse)
    assert rejections(folder) == {
        "closed": f"the folder cannot be listed: {os.strerror(number)}",
        "closed.mseed": f"cannot be read: {os.strerror(number)}",
    }


def test_a_disk_that_fails_in_the_middle_of_a_file_rejects_the_file(folder: Path, monkeypatch):
    opened = Path.open

    class Failing:
        def __enter__(self):
            return self

        def __exit__(self, *_error: object):
            return False

        def read(self, *_size: int):
            raise OSError(errno.EIO, os.strerror(errno.EIO))

    record("HN3").write(str(folder / "bad.mseed"), format="MSEED")
    monkeypatch.setattr(
        Path,
        "open",
        lambda self, *rest, **options: (
            Failing() if self.name == "bad.mseed" else opened(self, *rest, **options)
        ),
    )
    assert rejections(folder) == {"bad.mseed": "cannot be read: Input/output error"}


def test_a_pipe_is_no_folder_of_records_and_no_metadata(folder: Path):
    os.mkfifo(folder / "pipe")
    with pytest.raises(CatalogError, match="pipe: is neither a folder nor a regular file"):
        find_stations(folder / "pipe")
    with pytest.raises(CatalogError, match="pipe: is no StationXML: is no regular file"):
        find_stations(folder, folder / "pipe")
    with pytest.raises(CatalogError, match="pipe: is no regular file"):
        read_event(folder / "pipe")


def test_one_file_of_several_stations_serves_each(folder: Path):
    both = Stream([record("HN1"), record("HN1", station="CCC")])
    both.write(str(folder / "both.mseed"), format="MSEED")
    contents = find_stations(folder)
    # The file of both is read for either
    paths = contents.stations["CI.CCC"]
    assert paths == (folder / "both.mseed",)
    stream, rejected = read_station(paths, contents.inventory, "CI.CLC")
    assert ([trace.id for trace in stream], rejected) == (["CI.CLC..HN1"], ())


def test_missing_and_empty_folders_are_refused(tmp_path: Path):
    with pytest.raises(CatalogError, match=r"nowhere: no such folder"):
        find_stations(tmp_path / "nowhere")
    with pytest.raises(CatalogError, match="the folder is empty"):
        find_stations(tmp_path)


def test_folders_without_records_are_refused(tmp_path: Path):
    (tmp_path / "a.txt").write_text("words")
    (tmp_path / "b.txt").write_text("more words")
    problem = r"none of its 2 files is a record; a\.txt: ObsPy cannot read it"
    with pytest.raises(NothingUsable, match=problem):
        find_stations(tmp_path)
    # a file that was named is wrong input
    with pytest.raises(CatalogError, match=r"none of its 1 files is a record; a\.txt") as raised:
        find_stations(tmp_path / "a.txt")
    assert not isinstance(raised.value, NothingUsable)


def test_a_named_stationxml_must_be_readable(folder: Path):
    (folder / "notes.txt").write_text("bring an umbrella")
    with pytest.raises(CatalogError, match=r"notes\.txt: is no StationXML"):
        find_stations(folder, folder / "notes.txt")
    with pytest.raises(CatalogError, match="holds no StationXML"):
        find_stations(folder, folder / "deep")


@pytest.mark.real_data
def test_ridgecrest(real_data: Path):
    contents = find_stations(real_data / "records" / "ridgecrest2019_mseed")
    assert len(contents.stations) == 11
    assert contents.rejected == ()
    # East, north and up of each
    for name, paths in contents.stations.items():
        stream, rejected = read_station(paths, contents.inventory, name)
        assert (len(stream), rejected) == (3, ())
        assert [trace.stats.get("sensor_azimuth") for trace in stream] == [90, 0, None]


@pytest.mark.real_data
def test_the_peak_of_ridgecrest_is_that_of_the_readme(real_data: Path):
    folder = real_data / "records" / "ridgecrest2019_mseed"
    metadata = obspy.read_inventory(str(folder / "CI.CLC.xml"))
    stream, _ = read_station(find_stations(folder).stations["CI.CLC"], metadata)
    peaks = []
    for trace in stream[:2]:
        gain = trace.stats.response.instrument_sensitivity.value
        peaks.append(np.ptp(trace.data) / 2 / gain)
    # README of the data: CLC 0.51 g; half the range instead of a baseline costs a few per cent
    assert max(peaks) / 9.80665 == pytest.approx(0.51, rel=0.1)


@pytest.mark.real_data
def test_a_cut_knet_file_is_a_reason(real_data: Path, tmp_path: Path):
    name = "AOM0011801241951.NS"
    lines = (real_data / "records" / "aomori2018_knet" / name).read_text().splitlines()
    (tmp_path / name).write_text("\n".join(lines[:500]))
    contents = find_stations(tmp_path)
    stream, rejected = read_station(contents.stations["BO.AOM001"], None)
    assert not stream
    assert rejected[0].reasons == ("the header promises 102 s, the file holds 38.64 s",)


#: quantity and unit of the header -> ending of a PEER file
PEER_FILES = {
    "ACCELERATION": ("G", "AT2"),
    "VELOCITY": ("CM/S", "VT2"),
    "DISPLACEMENT": ("CM", "DT2"),
}


def write_peer(folder: Path, quantities: tuple[str, ...]) -> None:
    """Write three components of one station, each as files of the quantities."""
    for component in ("000", "090", "UP"):
        for quantity in quantities:
            unit, ending = PEER_FILES[quantity]
            head = f"PEER\nKobe, 1/16/1995, Some Town, {component}\n{quantity} TIME SERIES IN"
            text = f"{head} UNITS OF {unit}\nNPTS= 3, DT= .01 SEC\n1 2 3\n"
            (folder / f"KOBE{component}.{ending}").write_text(text)


def test_velocity_and_displacement_beside_acceleration_are_listed_and_not_read(tmp_path: Path):
    write_peer(tmp_path, tuple(PEER_FILES))
    (paths,) = find_stations(tmp_path).stations.values()
    stream, rejected = read_station(paths, None)
    assert {trace.stats.units for trace in stream} == {"m/s2"}
    assert len(stream) == 3
    # Every other file is a row with its reason
    reasons = {Path(row.source).name: row.reasons for row in rejected}
    for component in ("000", "090", "UP"):
        for quantity, ending in (("velocity", "VT2"), ("displacement", "DT2")):
            reason = f"{quantity} series, acceleration is read instead"
            assert reasons.pop(f"KOBE{component}.{ending}") == (reason,)
    assert reasons == {}


def test_velocity_without_acceleration_is_read_as_such(tmp_path: Path):
    write_peer(tmp_path, ("VELOCITY",))
    (paths,) = find_stations(tmp_path).stations.values()
    stream, rejected = read_station(paths, None)
    assert ({trace.stats.units for trace in stream}, rejected) == ({"m/s"}, ())


STATION_TABLE = "Network,Station,LATITUDE,Longitude,Elevation\nxx,Some Town,-33.5,-71.25,12\n"


def test_a_table_beside_the_records_gives_their_coordinates(tmp_path: Path):
    write_peer(tmp_path, ("ACCELERATION",))
    (tmp_path / "stations.csv").write_text(STATION_TABLE)
    # The name is that in the header, in another case
    contents = find_stations(tmp_path)
    assert contents.rejected == ()
    (paths,) = contents.stations.values()
    stream, rejected = read_station(paths, contents.inventory)
    assert rejected == ()
    for trace in stream:
        place = trace.stats.coordinates
        assert (place.latitude, place.longitude, place.elevation) == (-33.5, -71.25, 12.0)


def test_a_table_may_be_named_and_lie_elsewhere(tmp_path: Path):
    folder = tmp_path / "records"
    folder.mkdir()
    write_peer(folder, ("ACCELERATION",))
    table = tmp_path / "places.csv"
    table.write_text("name;lat;lon\nSOME TOWN;1.5;2.5\n")
    contents = find_stations(folder, table)
    (paths,) = contents.stations.values()
    for trace in read_station(paths, contents.inventory)[0]:
        # an elevation that the table lacks stays unknown
        assert trace.stats.coordinates == {"latitude": 1.5, "longitude": 2.5}
    table.write_text("name;lat;lon\nSOME TOWN;91;2.5\n")
    with pytest.raises(CatalogError, match="line 2, latitude: '91' is not a number from -90 to 90"):
        find_stations(folder, table)


def test_station_text_without_starts_serves_the_records_beside_it(tmp_path: Path):
    write_peer(tmp_path, ("ACCELERATION",))
    header = "#Network|Station|Latitude|Longitude|Elevation|SiteName|StartTime|EndTime"
    (tmp_path / "stations.txt").write_text(f"{header}\n|SOMETOWN|1|2|3|Town||\n")
    contents = find_stations(tmp_path)
    (paths,) = contents.stations.values()
    stream, _ = read_station(paths, contents.inventory)
    assert {trace.stats.coordinates.latitude for trace in stream} == {1.0}


@pytest.mark.parametrize("row", ["XX|A|north|2|3|Town||", "XX|A|95|2|3|Town||", "|||||||\n\n"])
def test_station_text_that_obspy_refuses_is_a_rejected_file(folder: Path, row):
    header = "#Network|Station|Latitude|Longitude|Elevation|SiteName|StartTime|EndTime"
    (folder / "stations.txt").write_text(f"{header}\n{row}\n")
    (rejection,) = find_stations(folder).rejected
    assert rejection.name == "stations.txt"
    assert rejection.reasons[0].startswith("is no FDSN station text: ")


def test_a_wrong_line_of_station_text_costs_no_other_line(folder: Path):
    header = "#Network|Station|Latitude|Longitude|Elevation|SiteName|StartTime|EndTime"
    rows = ["XX|A|nan|2|3|Town||", "XX|B|1|2|3|Town||", "XX|C|1|2|high|Town||"]
    (folder / "stations.txt").write_text("\n".join([header, *rows]))
    contents = find_stations(folder)
    assert "B" in [station.code for network in contents.inventory for station in network]
    (rejection,) = contents.rejected
    assert rejection.reasons[0] == "line 2: latitude: 'nan', expected a number from -90 to 90"
    # an elevation is read by ObsPy alone
    assert rejection.reasons[1].startswith("line 4: ObsPy cannot read it: ")


#: Names of three files, their last titles, and the channels of two horizontals and a vertical.
DIRECTIONS = [
    (("1", "2", "3"), ("HNE", "HNN", "HNZ"), ("HNE", "HNN", "HNZ")),
    (("1", "2", "3"), ("HN1", "HN2", "HNZ"), ("HN1", "HN2", "HNZ")),
    (("1", "2", "3"), ("L", "T", "V"), ("HNL", "HNT", "HNZ")),
    (("1", "2", "3"), ("TRAN", "LONG", "UP"), ("HNT", "HNL", "HNZ")),
    (("X-L", "X-T", "X-UP"), ("", "", ""), ("HNL", "HNT", "HNZ")),
    (("XHNE", "XHNN", "XHNZ"), ("", "", ""), ("HNE", "HNN", "HNZ")),
]


def write_components(folder: Path, names: tuple[str, ...], titles: tuple[str, ...]) -> None:
    """Write files of AT2 with peaks of 3, 2 and 1 m/s2, whose titles end with a direction."""
    for seed, (name, title) in enumerate(zip(names, titles, strict=True)):
        samples = np.random.default_rng(seed).normal(size=3000)
        trace = Trace(samples * (3 - seed) / np.abs(samples).max(), {"delta": 0.01})
        trace.stats.update({"units": "m/s2", "channel": title, "station": "PLACE"})
        write_at2(Stream([trace]), folder / f"{name}.AT2")


@pytest.mark.parametrize(("names", "titles", "channels"), DIRECTIONS)
def test_every_component_of_a_set_of_files_has_its_identity(
    tmp_path: Path, names: tuple[str, ...], titles: tuple[str, ...], channels: tuple[str, ...]
):
    # mutation: all share one code, and the vertical, or the last file, becomes the horizontal
    write_components(tmp_path, names, titles)
    contents = find_stations(tmp_path)
    [(station, paths)] = contents.stations.items()
    best, rejected = process_station(read_station(paths, None, station)[0], Processing())
    assert rejected == ()
    # seven digits of the file
    peaks = {trace.stats.channel: np.abs(trace.data).max() for trace in best}
    assert peaks == pytest.approx(dict(zip(channels, (3, 2, 1), strict=True)), rel=1e-6)


@pytest.mark.parametrize("titles", [("FOO", "BAR", "BAZ"), ("1", "2", "3"), ("L", "L", "L")])
def test_components_that_cannot_be_told_apart_are_refused(tmp_path: Path, titles: tuple[str, ...]):
    write_components(tmp_path, ("a1", "a2", "a3"), titles)
    contents = find_stations(tmp_path)
    [(station, paths)] = contents.stations.items()
    best, rejected = process_station(read_station(paths, None, station)[0], Processing())
    assert not best
    reasons = " ".join(row.reasons[0] for row in rejected)
    assert re.search("cannot be told apart|it may be that|contradict each other", reasons)


@pytest.mark.real_data
@pytest.mark.parametrize(
    ("name", "peaks"),
    [
        # mended or refused by name, as the README of each expects; m/s2 to four digits
        ("three-contradicting-pieces", {"HNN": 5.166, "HNZ": 3.639}),
        ("at2-unknown-direction", {"BNE": 8.661, "BNN": 3.627, "BNZ": 2.260}),
        ("at2-longitudinal-transverse", {"HNL": 8.181, "HNT": 6.175, "HNZ": 3.324}),
        ("mseed-rate-rounding", {"HNE": 3.205, "HNN": 5.166, "HNZ": 3.639}),
        ("stationxml-no-overall-sensitivity", {"HNE": 3.205, "HNN": 5.166, "HNZ": 3.639}),
    ],
)
def test_inputs_that_gave_wrong_numbers_in_the_field(
    real_data: Path, name: str, peaks: dict[str, float]
):
    contents = find_stations(real_data / "field" / name)
    [(station, paths)] = contents.stations.items()
    stream, _ = read_station(paths, contents.inventory, station)
    best, rejected = process_station(stream, Processing())
    found = {trace.stats.channel: float(np.abs(trace.data).max()) for trace in best}
    assert found == pytest.approx(peaks, rel=2e-4)
    assert len(rejected) == 3 - len(peaks)


def form(
    source: str, units: str = "m/s2", kind: str = "COSMOS", seconds: int = 60, **stats: object
) -> Trace:
    header = {"network": "CE", "station": "1", "channel": "HNN", "delta": 0.01, "starttime": START}
    header |= {"units": units, "_format": kind, "source": source, "processing_level": "raw"}
    return Trace(np.ones(100 * seconds), header | stats)


def kept(*traces: Trace) -> list[str]:
    stream, rejected = one_series(Stream(list(traces)))
    assert len(stream) + len(rejected) == len(traces)
    return [trace.stats.source for trace in stream]


def test_acceleration_goes_before_counts():
    counts, physical = form("a.V0", "counts"), form("a.V1")
    assert kept(counts, physical) == kept(physical, counts) == ["a.V1"]
    _, (row,) = one_series(Stream([counts, physical]))
    assert (row.kind, row.name, row.source) == ("record", "CE.1..HNN", "a.V0")
    assert row.reasons == ("the same record as a.V1 (COSMOS in m/s2), which is read instead",)


def test_the_longer_form_goes_first():
    assert kept(form("a.smc", kind="SMC", seconds=40), form("a.V0", "counts")) == ["a.V0"]


def test_of_equal_forms_the_choice_does_not_depend_on_the_order():
    one, two = form("b.raw", kind="CSMIP_V1"), form("a.smc", kind="SMC")
    assert kept(one, two) == kept(two, one) == ["b.raw"]


@pytest.mark.parametrize(
    "stats",
    [
        {"starttime": START + 3600},
        {"channel": "HNE"},
        {"location": "01"},
        {"station": "2"},
        {"processing_level": "processed"},
    ],
)
def test_another_time_channel_or_state_is_another_record(stats: dict[str, object]):
    assert kept(form("a.V1"), form("b.smc", kind="SMC", **stats)) == ["a.V1", "b.smc"]


def test_pieces_of_one_form_all_stay():
    later = form("b.V1", starttime=START + 50)
    assert kept(form("a.V1"), later, form("a.V0", "counts")) == ["a.V1", "b.V1"]


OLD = time.time() - 3600


def write_record(folder, station, changed=OLD):
    """Write a record as MiniSEED with a time of its latest change."""
    header = {"network": "XX", "station": station, "channel": "HNZ", "sampling_rate": 100.0}
    trace = Trace(np.arange(2000, dtype=np.int32), {**header, "starttime": UTCDateTime(2024, 1, 1)})
    path = folder / f"{station}.mseed"
    Stream([trace]).write(str(path), format="MSEED")
    os.utime(path, (changed, changed))
    return path


def test_a_young_file_waits_and_is_taken_later(tmp_path):
    write_record(tmp_path, "A")
    half = write_record(tmp_path, "B", changed=time.time())
    half.write_bytes(half.read_bytes()[:300])  # would be a rejected file
    found = find_stations(tmp_path, settle=60.0)
    assert (list(found.stations), found.waiting, found.rejected) == (["XX.A"], (half,), ())
    # without the setting every file is read
    assert find_stations(tmp_path).waiting == ()
    write_record(tmp_path, "B")
    assert list(find_stations(tmp_path, settle=60.0).stations) == ["XX.A", "XX.B"]


def test_a_folder_of_young_files_is_read_later(tmp_path):
    write_record(tmp_path, "A", changed=time.time())
    with pytest.raises(TryLater, match="its 1 files are still being written, try again in 60 s"):
        find_stations(tmp_path, settle=60.0)


def test_a_file_that_changes_meanwhile_waits(tmp_path, monkeypatch):
    # a clock of the file server that is ahead, and a writer that goes on
    path = write_record(tmp_path, "A", changed=time.time() + 3600)
    states = file_states([path])
    monkeypatch.setattr(file_list.time, "sleep", lambda _: path.write_bytes(b"more"))
    assert growing_files(states, 60.0) == {path}
    # the same clock, but a writer that has finished
    path = write_record(tmp_path, "B", changed=time.time() + 3600)
    monkeypatch.setattr(file_list.time, "sleep", lambda _: None)
    assert growing_files(file_states([path]), 60.0) == set()


def test_a_file_that_changes_while_it_is_read_waits(tmp_path, monkeypatch):
    write_record(tmp_path, "A")
    path = write_record(tmp_path, "B")
    from per_obspy.records import folder

    read = folder.read_file

    def reading(file, limits):
        content = read(file, limits)
        if file == path:
            file.write_bytes(content + content)
        return content

    monkeypatch.setattr(folder, "read_file", reading)
    found = find_stations(tmp_path, settle=60.0)
    assert (list(found.stations), found.waiting) == (["XX.A"], (path,))


def test_a_file_that_vanishes_has_changed(tmp_path):
    path = write_record(tmp_path, "A")
    states = file_states([path, tmp_path / "absent"])
    assert list(states) == [path]
    path.unlink()
    assert changed_files(states) == {path}
