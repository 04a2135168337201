"""QuakeML: earthquakes of files, of the watcher, and the one earthquake of a run."""

import pickle
import subprocess
import sys
import zipfile
from pathlib import Path

import obspy
import pytest
from obspy import UTCDateTime
from obspy.core.event import Catalog, Comment, Event, Magnitude, Origin

from per_obspy.errors import CatalogError
from per_obspy.files import file_hash
from per_obspy.processing.earthquake import source_of
from per_obspy.records.earthquakes.quakeml import (
    earthquake_of,
    plain_quakeml,
    portable,
    read_event,
    read_event_file,
    read_quakeml,
)


def event(magnitude: float | None = 6.1, **facts: float) -> Event:
    place = {"time": UTCDateTime(2026, 11, 23), "latitude": 14.6, "longitude": -90.5}
    sizes = [] if magnitude is None else [Magnitude(mag=magnitude, magnitude_type="Mw")]
    return Event(origins=[Origin(**{**place, **facts})], magnitudes=sizes)


def test_bytes_depend_on_time_place_and_magnitude_alone():
    first = event()
    first.comments.append(Comment(text="reviewed"))
    assert plain_quakeml(first, "x1") == plain_quakeml(event(), "x1")
    assert plain_quakeml(event(), "x1") != plain_quakeml(event(6.2), "x1")
    assert plain_quakeml(event(), "x1") != plain_quakeml(event(latitude=14.7), "x1")


def test_preferred_origin_and_magnitude_are_kept(tmp_path):
    found = event()
    better = Origin(time=UTCDateTime(2026, 11, 23), latitude=15.0, longitude=-91.0)
    found.origins.append(better)
    found.preferred_origin_id = better.resource_id
    (tmp_path / "a.xml").write_bytes(plain_quakeml(found, "x1"))
    (plain,) = obspy.read_events(tmp_path / "a.xml")
    assert plain.origins[0].latitude == 15.0
    assert len(plain.origins) == 1


def test_unknown_magnitude(tmp_path):
    (tmp_path / "a.xml").write_bytes(plain_quakeml(event(None), "../x"))
    ((_, event_),) = read_quakeml(tmp_path / "a.xml")[0].items()
    assert earthquake_of(event_).magnitude is None


@pytest.mark.parametrize(
    "content", [b"", b"<html></html>", b"\x00" * 100, b'<?xml version="1.0"?><q:quakeml']
)
def test_files_that_are_no_quakeml_are_one_line(tmp_path, content):
    (tmp_path / "a.xml").write_bytes(content)
    with pytest.raises(CatalogError, match="is no QuakeML") as error:
        read_quakeml(tmp_path / "a.xml")
    assert "\n" not in str(error.value)


def test_earthquake_without_a_place_is_one_line(tmp_path):
    Catalog([Event()]).write(tmp_path / "a.xml", format="QUAKEML")
    events, (problem,) = read_quakeml(tmp_path / "a.xml")
    assert events == {}
    assert "has no origin" in problem


def test_folder_in_place_of_a_file_is_one_line(tmp_path):
    with pytest.raises(CatalogError, match="cannot be read"):
        read_quakeml(tmp_path)


START = UTCDateTime(2019, 7, 6, 3, 19, 53)


@pytest.fixture
def event_file(tmp_path: Path) -> Path:
    """An event with two origins and two magnitudes, of which the second ones are preferred."""
    origins = [Origin(time=START + i, latitude=35.0, longitude=-117.0 - i) for i in range(2)]
    magnitudes = [Magnitude(mag=6.9 + i / 10) for i in range(2)]
    event = Event(origins=origins, magnitudes=magnitudes)
    # Origins and magnitudes are referred to by their identifiers
    event.preferred_origin_id = origins[1].resource_id
    event.preferred_magnitude_id = magnitudes[1].resource_id
    Catalog([event]).write(str(tmp_path / "event.xml"), format="QUAKEML")
    return tmp_path / "event.xml"


def test_an_event_in_an_archive(event_file: Path, tmp_path: Path):
    with zipfile.ZipFile(tmp_path / "events.zip", "w") as archive:
        archive.write(event_file, "event.xml")
    file = read_event_file(tmp_path / "events.zip" / "event.xml")
    assert file.hash == file_hash(event_file)
    assert file.event.origins[0].time == START


LOADS = """
import pickle, sys
event = pickle.load(sys.stdin.buffer).event
origin = event.preferred_origin() or event.origins[0]
magnitude = event.preferred_magnitude() or event.magnitudes[0]
print(origin.time - {start!r}, origin.longitude, magnitude.mag)
"""


def test_preferred_origin_and_magnitude_survive_the_way_to_another_process(event_file: Path):
    # would catch stations that are processed with the first of several origins
    content = pickle.dumps(portable(read_event_file(event_file)))
    code = f"from obspy import UTCDateTime\n{LOADS.format(start=START)}"
    process = subprocess.run(
        [sys.executable, "-c", code], input=content, capture_output=True, check=True
    )
    assert process.stdout.decode().split() == ["1.0", "-118.0", "7.0"]


def test_an_event_without_magnitude_stays_without(tmp_path: Path):
    Catalog([Event(origins=[Origin(time=START, latitude=0, longitude=0)])]).write(
        str(tmp_path / "event.xml"), format="QUAKEML"
    )
    assert portable(read_event_file(tmp_path / "event.xml")).event.magnitudes == []


WRONG = {
    "two events": (
        [Origin(time=START, latitude=1.0, longitude=2.0)],
        2,
        "must hold one event, holds 2",
    ),
    "no origin": ([], 1, "has no origin"),
    "no time": ([Origin(latitude=1.0, longitude=2.0)], 1, "has an origin without time"),
}


@pytest.mark.parametrize("fault", WRONG)
def test_a_file_needs_one_event_with_origin_and_time(tmp_path: Path, fault: str):
    origins, count, reason = WRONG[fault]
    events = [Event(origins=origins) for _ in range(count)]
    Catalog(events).write(str(tmp_path / "event.xml"), format="QUAKEML")
    with pytest.raises(CatalogError, match=rf"event\.xml: .*{reason}"):
        read_event_file(tmp_path / "event.xml")


QUAKEML = """<?xml version="1.0"?>
<q:quakeml xmlns="http://quakeml.org/xmlns/bed/1.2" xmlns:q="http://quakeml.org/xmlns/quakeml/1.2">
<eventParameters publicID="smi:a/b"><event publicID="smi:a/one"><origin publicID="smi:a/o">
<time><value>2023-02-06T01:17:34</value></time><latitude><value>37.2</value></latitude>
<longitude><value>37.0</value></longitude><depth><value>10000</value></depth></origin>
<magnitude publicID="smi:a/m"><mag><value>7.8</value></mag></magnitude>
</event></eventParameters></q:quakeml>"""

VALUES = {"time": "2023-02-06T01:17:34", "latitude": "37.2", "longitude": "37.0"}


@pytest.mark.filterwarnings("ignore:Could not convert")
@pytest.mark.parametrize("field", VALUES)
@pytest.mark.parametrize("value", [None, "", "x", "1e9", "nan"])
def test_an_earthquake_without_time_or_place_is_one_line(tmp_path: Path, field: str, value):
    tag = f"<{field}><value>{VALUES[field]}</value></{field}>"
    new = "" if value is None else f"<{field}><value>{value}</value></{field}>"
    (tmp_path / "event.xml").write_text(QUAKEML.replace(tag, new))
    with pytest.raises(CatalogError, match=rf"event\.xml: .*{field}") as error:
        read_event_file(tmp_path / "event.xml")
    assert "\n" not in str(error.value)


@pytest.mark.filterwarnings("ignore:Could not convert")
@pytest.mark.parametrize(
    ("old", "new", "depth", "magnitude"),
    [
        ("<depth><value>10000</value></depth>", "", 10_000.0, 7.8),
        ("<value>10000<", "<value><", 10_000.0, 7.8),
        ("<mag><value>7.8</value></mag>", "", 10_000.0, None),
        ("<value>7.8<", "<value>x<", 10_000.0, None),
        ("<magnitude", '<magnitude publicID="smi:a/n"><mag/></magnitude><magnitude', 10_000.0, 7.8),
    ],
)
def test_depth_and_magnitude_may_be_unknown(tmp_path: Path, old, new, depth, magnitude):
    (tmp_path / "event.xml").write_text(QUAKEML.replace(old, new))
    source = source_of(portable(read_event_file(tmp_path / "event.xml")).event)
    # 10 km stand for an unknown depth
    assert (source.depth, source.magnitude) == (depth, magnitude)


@pytest.mark.parametrize(("old", "new"), [("10000", "1e9"), ("7.8<", "78<"), ("10000", "-1e6")])
def test_a_depth_or_magnitude_that_cannot_be_true_is_one_line(tmp_path: Path, old, new):
    (tmp_path / "event.xml").write_text(QUAKEML.replace(old, new))
    with pytest.raises(CatalogError, match=r"the event smi:a/one: (depth|magnitude) .*: expected"):
        read_event(tmp_path / "event.xml")


def test_degrees_east_up_to_360_are_read(tmp_path: Path):
    (tmp_path / "event.xml").write_text(QUAKEML.replace(">37.0<", ">183.5<"))
    assert read_event(tmp_path / "event.xml").origins[0].longitude == -176.5


@pytest.mark.parametrize("content", [b"", b"<html>", b"\x89HDF\r\n\x1a\n"])
def test_other_files_are_refused(tmp_path: Path, content: bytes):
    (tmp_path / "event.xml").write_bytes(content)
    with pytest.raises(CatalogError, match=r"event\.xml"):
        read_event(tmp_path / "event.xml")


def test_the_hash_is_that_of_the_file(event_file: Path):
    file = read_event_file(event_file)
    assert (file.path, file.hash) == (event_file, file_hash(event_file))
    assert file.event == read_event(event_file)


def test_a_missing_file_is_named(tmp_path: Path):
    with pytest.raises(CatalogError, match=r"missing\.xml: cannot be read: No such file"):
        read_event(tmp_path / "missing.xml")
