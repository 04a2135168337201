"""The earthquake by the headers of records: one vote per station."""

from pathlib import Path

import pytest
from format_samples import SAMPLES
from obspy import UTCDateTime

from per_obspy.config import Records
from per_obspy.records.earthquakes.earthquake import (
    Earthquake,
    agreed_event,
    header_event,
    same_earthquake,
)
from per_obspy.records.earthquakes.groups import event_groups, group_event
from per_obspy.records.folder import find_stations
from per_obspy.records.sources import find_path_sources, find_sources

TIME = "2023-02-06T01:17:32.000000Z"
MAIN = Earthquake("", TIME, 37.288, 37.043, 8600.0, 7.7)
OTHER = Earthquake("", "2023-02-06T10:24:47.000000Z", 38.089, 37.239, 7000.0, 7.6)


def votes(*events: Earthquake | None) -> list[tuple[str, Earthquake | None]]:
    return [(f"TK.{number}", event) for number, event in enumerate(events)]


def test_most_stations_decide_and_the_others_are_named():
    found = agreed_event(votes(MAIN, OTHER, MAIN, None))
    assert (found.event, found.stations, found.others) == (MAIN, 2, {"TK.1": OTHER})
    assert found.facts["contradicting"] == {"TK.1": "2023-02-06T10:24:47 38.089, 37.239 M 7.6"}


def test_half_of_the_stations_are_no_majority():
    found = agreed_event(votes(MAIN, OTHER))
    assert (found.event, found.stations) == (None, 0)
    assert set(found.others) == {"TK.0", "TK.1"}
    assert agreed_event(votes(None, None)) is None


def test_a_station_has_one_vote_whatever_its_records():
    many = [("TK.1", OTHER)] * 9 + votes(MAIN)[:1] + [("TK.2", MAIN)]
    assert agreed_event(many).event == MAIN


def test_facts_of_agreeing_headers_are_joined_and_the_most_frequent_taken():
    rounded = MAIN._replace(time="2023-02-06T01:17:00.000000Z", magnitude=7.6)
    short = Earthquake(time=TIME)
    found = agreed_event(votes(short, rounded, MAIN, MAIN))
    assert (found.event, found.stations) == (MAIN, 4)
    # a place with a depth goes before one without
    flat = MAIN._replace(depth=None, latitude=37.3)
    assert agreed_event(votes(flat, flat, MAIN)).event == MAIN


@pytest.mark.parametrize(
    ("change", "same"),
    [
        # formats round times to the minute, agencies differ by tens of km and half a magnitude
        ({"time": "2023-02-06T01:17:00Z"}, True),
        ({"time": "2023-02-06T01:19:00Z"}, False),
        ({"latitude": 37.7}, True),
        ({"latitude": 37.9}, False),
        ({"magnitude": 7.0}, True),
        ({"magnitude": 6.0}, False),
        ({"time": "", "latitude": None, "longitude": None, "magnitude": None}, True),
    ],
)
def test_descriptions_of_one_earthquake(change, same):
    assert same_earthquake(MAIN, MAIN._replace(**change)) == same


@pytest.mark.parametrize(
    "words",
    [
        None,
        {},
        {"latitude": 0.0, "longitude": 0.0, "depth": 5.0},
        {"latitude": 95.0, "longitude": 10.0},
        {"latitude": float("nan"), "longitude": 10.0},
        {"magnitude": 0.0},
        {"time": "yesterday", "magnitude": float("inf")},
    ],
)
def test_headers_without_facts_have_no_vote(words):
    assert header_event(words) is None


def test_the_words_are_those_of_stats():
    words = {"time": UTCDateTime(TIME), "latitude": 37.288, "longitude": 37.043}
    words |= {"depth": 8600.0, "magnitude": 7.7}
    assert header_event(words) == MAIN
    assert MAIN.words == words


def afad(folder: Path, station: str, change: tuple[str, str] = ("", "")) -> None:
    """Write a record of AFAD of a station, with a line of its header changed."""
    known = {"STATION_CODE": station, "EVENT_DATE_YYYYMMDD": "20230206"}
    known |= {"EVENT_TIME_HHMMSS": "011732"} | {change[0]: change[1]}
    lines = SAMPLES["afad"].text.splitlines(keepends=True)
    for number, line in enumerate(lines):
        name = line.split(":")[0]
        if name in known:
            lines[number] = f"{name}: {known[name]}\n"
    (folder / f"{station}.asc").write_bytes("".join(lines).encode("latin-1"))


def test_a_folder_is_of_the_earthquake_of_most_headers(tmp_path: Path, caplog):
    for station in ("1001", "1002"):
        afad(tmp_path, station)
    afad(tmp_path, "1003", ("EVENT_LATITUDE_DEGREE", "10.0"))
    right = header_event(_event(tmp_path, "1001"))
    for found in (
        find_sources(Records(folder=tmp_path), None),
        find_path_sources([tmp_path]),
    ):
        for name in ("1001", "1003"):
            (source,) = (s for key, s in found.stations.items() if key.endswith(name))
            (trace,), rejected = source.reader(source.files, source.inventory)
            assert rejected == ()
            assert header_event(trace.stats.event) == right
    assert "1 headers describe another earthquake than the 2 of most" in caplog.text
    (facts,) = find_sources(Records(folder=tmp_path), None).earthquakes
    assert facts["headers"]["stations"] == 2
    assert list(facts["headers"]["contradicting"]) == [
        key for key in found.stations if key.endswith("1003")
    ]


def _event(folder: Path, station: str):
    found = find_stations(folder / f"{station}.asc")
    return found.records[0].event.words


def test_an_origin_at_another_time_is_no_earthquake_of_the_records(tmp_path: Path):
    afad(tmp_path, "1001", ("EVENT_DATE_YYYYMMDD", "1999/08/17"))
    (group,) = event_groups(find_stations(tmp_path).records)
    found = group_event(group)
    assert found.event is None
    assert len(found.others) == 1


#: Folder of real records -> one record of the earthquake, and what catalogues say of it: the USGS
#: (us1000778i, us1000hyfh, nc72282711), JMA (24 January 2018, off Aomori) and AFAD (Pazarcik)
KNOWN = {
    ("kaikoura2016_geonet", "HSES"): Earthquake(
        "", "2016-11-13T11:02:56.340Z", -42.7373, 173.054, 15110.0, 7.8
    ),
    ("cosmos", "BMR"): Earthquake("", "2018-11-30T17:29:29.330Z", 61.3464, -149.9552, 46700.0, 7.1),
    ("cosmos", "C031"): Earthquake(
        "", "2014-08-24T10:20:44.070Z", 38.2152, -122.3123, 11120.0, 6.0
    ),
    ("aomori2018_knet", "AOM001"): Earthquake(
        "", "2018-01-24T10:51:19Z", 41.01, 142.45, 34000.0, 6.3
    ),
    ("afad2023", "3125"): Earthquake("", "2023-02-06T01:17:34Z", 37.226, 37.014, 10000.0, 7.8),
    ("itaca2009", "2987"): Earthquake("", "2009-04-06T01:32:40Z", 42.342, 13.380, 8300.0, 6.3),
}


@pytest.mark.real_data
@pytest.mark.parametrize(("folder", "station"), KNOWN)
def test_headers_of_real_records_describe_the_earthquake_of_catalogues(
    real_data: Path, folder: str, station: str
):
    found = find_stations(real_data / "records" / folder)
    events = {record.event for record in found.records if record.station.endswith(station)}
    (event,) = events
    assert same_earthquake(event, KNOWN[folder, station])
    # time, place, depth and magnitude are all there
    assert event.known == 5
    assert abs(event.depth - KNOWN[folder, station].depth) < 10_000.0
