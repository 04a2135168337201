"""Coordinates of stations from plain text."""

from io import BytesIO

import obspy
import pytest

from per_obspy.errors import RecordRejected
from per_obspy.formats.text.itaca_metadata import is_itaca_metadata, read_itaca_metadata
from per_obspy.formats.text.station_table import (
    StationRow,
    is_station_table,
    located_stations,
    read_station_table,
)
from per_obspy.formats.text.station_text import (
    marked_open_starts,
    station_lines,
    with_open_starts,
)

TABLE = "Network,Station,LATITUDE,Longitude,Elevation\nxx,Some Town,-33.5,-71.25,12\n"


def test_code_and_name_and_separators():
    table = b"\xef\xbb\xbfCode; Name; Lat; Lon\n\nab1; Vi\xc3\xb1a; 1; +2.5\n"
    assert is_station_table(table)
    assert read_station_table("t", table) == (
        StationRow("", ("AB1", "VI\xd1A"), 1.0, 2.5, None, source="t"),
    )


@pytest.mark.parametrize(
    ("row", "message"),
    [
        pytest.param(
            f"x,{'A' * 200_000},1,2,3", "line 2: field larger than field limit", id="long field"
        ),
        ("x,A,1", "line 2: 3 columns, no longitude"),
        ("x,,1,2,3", "line 2, station: empty"),
        ("x,A,nan,2,3", "line 2, latitude: 'nan' is not a number from -90 to 90"),
        ("x,A,1,181,3", "line 2, longitude: '181' is not a number from -180 to 180"),
        ("x,A,1,2,high", "line 2, elevation: 'high' is not a number"),
    ],
)
def test_faults_of_a_table_name_line_and_column(row: str, message: str):
    content = TABLE.split("\n")[0] + "\n" + row
    with pytest.raises(RecordRejected, match=f"t: {message}"):
        read_station_table("t", content.encode())


def test_a_table_serves_its_networks_only():
    rows = [StationRow("XX", ("A",), 1.0, 2.0, 3.0)]
    found = located_stations(rows, ["XX.A", ".A", "YY.A", "XX.B"])
    assert [network.code for network in found] == ["XX", ""]


#: Made-up values below some of the names of a real file.
FIELDS = {
    "event.ev_sourcedb.shortname": "ITACA",
    "event.datetime": "2009-04-06 01:32:39",
    "event.latitude": "42.334",
    "event.longitude": "13.334",
    "event.focaldepth": "8.8",
    "event.pref_mag": "6.3",
    "station.sourceid": "1234",
    "station.name": '"Somewhere, high"',
    "station.code": "ABC",
    "station.latitude": "42.37",
    "station.longitude": "13.33",
    "station.altitude": "721.0",
    "station.vs30": "684.8",
    "station.ec8": "B",
}


def content(**changes: str) -> bytes:
    known = FIELDS | {name.replace("__", "."): value for name, value in changes.items()}
    return f"{','.join(known)}\n{','.join(known.values())}\n".encode()


def test_station_ground_and_event():
    assert is_itaca_metadata(content())
    row, event = read_itaca_metadata("a.zip/x.metadata", content())
    assert (row.network, row.names, row.source) == ("", ("1234", "ABC"), "x.metadata")
    assert (row.latitude, row.longitude, row.elevation) == (42.37, 13.33, 721.0)
    assert (row.vs30, row.site_class) == (684.8, "B")
    time = event.pop("time")
    assert str(time) == "2009-04-06T01:32:39.000000Z"
    # depth in m, from km
    known = {"latitude": 42.334, "longitude": 13.334, "depth": 8800.0, "magnitude": 6.3}
    assert event == pytest.approx(known)


def test_missing_facts_stay_absent():
    names = ("station__vs30", "station__altitude", "event__pref_mag", "event__datetime")
    row, event = read_itaca_metadata("x", content(**dict.fromkeys(names, "")))
    assert (row.vs30, row.elevation) == (None, None)
    assert set(event) == {"latitude", "longitude", "depth"}


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"station__latitude": "95"}, "line 2, station.latitude: '95' is not a number from -90"),
        ({"station__vs30": "nan"}, "line 2, station.vs30: 'nan'"),
        ({"station__vs30": "1e3"}, "line 2, station.vs30: '1e3'"),
        ({"event__datetime": "2009-13-45 01:32:39"}, "line 2, event.datetime"),
        ({"station__latitude": ""}, "latitude or longitude is missing"),
        ({"station__code": "", "station__sourceid": ""}, "station.code"),
        ({"station__name": '"a'}, "one of as many values"),
        ({"station__name": "a,b"}, "one of as many values"),
    ],
)
def test_wrong_values_are_refused_with_their_field(changes: dict[str, str], reason: str):
    with pytest.raises(RecordRejected, match=reason):
        read_itaca_metadata("x", content(**changes))


#: as the service of IRIS writes it
HEADER = (
    "#Network | Station | Location | Channel | Latitude | Longitude | Elevation | Depth | Azimuth"
    " | Dip | SensorDescription | Scale | ScaleFreq | ScaleUnits | SampleRate | StartTime | EndTime"
)


GOOD = "XX|A|--|HNZ|1.5|2.5|3|0|0|-90|Episensor|1e6|1|M/S**2|100|2001-02-03T00:00:00|"


def read(*rows: str | bytes):
    lines = [row if isinstance(row, bytes) else row.encode() for row in (HEADER, *rows)]
    return station_lines(b"\n".join(lines))


def test_an_empty_start_of_station_text_is_open():
    header = "#Network|Station|Latitude|Longitude|Elevation|SiteName|StartTime|EndTime"
    text = f"{header}\nXX|A|1|2|3|Town||\nXX|B|1|2|3|Town|2001-02-03T00:00:00|\n"
    marked = BytesIO(marked_open_starts(text.encode()))
    first, second = with_open_starts(obspy.read_inventory(marked, format="STATIONTXT"))[0]
    assert first.start_date is None
    assert second.start_date.year == 2001


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("|1.5|", "|nan|", "latitude: 'nan', expected a number from -90 to 90"),
        ("|1.5|", "|inf|", "latitude: 'inf', expected a number from -90 to 90"),
        ("|1.5|", "|1_5|", "latitude: '1_5', expected a number from -90 to 90"),
        ("|1.5|", "||", "latitude: '', expected a number from -90 to 90"),
        ("|1.5|", "|1,5|", "latitude: '1,5', expected a number from -90 to 90"),
        ("|2.5|", "|361|", "longitude: '361', expected a number from -180 to 180"),
        ("|100|2001-02-03T00:00:00|", "", "has 14 columns, expected 17"),
        ("2001-02-03T00:00:00", "x", "starttime: 'x', expected a time such as"),
        ("2001-02-03T00:00:00", "2001-02-30T00:00:00", "starttime: '2001-02-30T00:00:00'"),
        ("|HNZ|", "||", "channel: empty, expected a code"),
        ("|A|", "||", "station: empty, expected a code"),
    ],
)
def test_a_wrong_line_is_rejected_alone(old: str, new: str, reason: str):
    lines, (fault,) = read(GOOD, GOOD.replace(old, new, 1), GOOD.replace("|A|", "|B|"))
    assert [line.station for line in lines] == ["A", "B"]
    assert fault.number == 3
    assert reason in fault.reason


@pytest.mark.parametrize(
    "row",
    [
        # GeoNet wrote a pointer instead of a frequency (GeoNet/fdsn issue 122)
        GOOD.replace("1e6|1|", "1e6|%!f(*float64=0xc4226b8010)|"),
        # Latin-1 and a line end of Unicode in the description of an instrument
        GOOD.encode().replace(b"Episensor", b"Sensor \xb5g"),
        GOOD.replace("Episensor", "Old\x85New\u2028"),
        f"{GOOD}\r",
        f"{GOOD[:-1]}|2599-12-31T23:59:59.9999",
        f"{GOOD[:-1]}|2030-01-01|another column",
    ],
)
def test_a_line_whose_code_place_and_epoch_are_right_is_read(row: str | bytes):
    (line,), faults = read(row)
    assert faults == []
    assert line[:7] == (2, "XX", "A", "", "HNZ", 1.5, 2.5)
    assert line.start.year == 2001


@pytest.mark.parametrize("text", [b"<html>\n<body>busy", b"Error 404: no data", b"\xff\xfe", b"\n"])
def test_any_other_text_is_no_list(text: bytes):
    with pytest.raises(ValueError, match="the first line is"):
        station_lines(text)
