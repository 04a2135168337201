"""Coordinates of a station from tables, headers and StationXML, and their contradictions."""

from pathlib import Path

import pytest
from format_samples import SAMPLES
from obspy import Trace
from obspy.core import AttribDict
from obspy.core.inventory import Channel, Inventory, Network, Station
from station_files import read_all, write_inventory, write_records

from per_obspy.records.folder import find_stations, read_station
from per_obspy.records.metadata import (
    HEADER,
    STATIONXML,
    set_coordinates,
)

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
