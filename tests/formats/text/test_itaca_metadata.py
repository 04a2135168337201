"""Metadata files of ITACA 2009."""

import pytest

from per_obspy.errors import RecordRejected
from per_obspy.formats.text.itaca_metadata import is_itaca_metadata, read_itaca_metadata

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
