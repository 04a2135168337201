"""QuakeML of watched earthquakes: only facts for screening, and one line for other files."""

import obspy
import pytest
from obspy import UTCDateTime
from obspy.core.event import Catalog, Comment, Event, Magnitude, Origin

from per_obspy.errors import CatalogError
from per_obspy.records.earthquakes.quakeml_events import plain_quakeml, quakeml_rows, read_quakeml


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
    ((_, row),) = quakeml_rows(tmp_path / "a.xml")[0].items()
    assert row.magnitude is None


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
