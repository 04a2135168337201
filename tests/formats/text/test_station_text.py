"""FDSN station text, whose lines are right or wrong alone."""

from io import BytesIO

import obspy
import pytest

from per_obspy.formats.text.station_text import (
    marked_open_starts,
    station_lines,
    with_open_starts,
)

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
