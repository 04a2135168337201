"""
Metadata file of ITACA 2009 (``.metadata``): the event, the station and its ground, in CSV.

It is in the folder of the records, whose headers hold neither coordinates nor ground. One line
names the fields, one line holds their values.
"""

import csv
import re
from datetime import UTC, datetime
from typing import NamedTuple

from obspy import UTCDateTime

from per_obspy.errors import RecordRejected
from per_obspy.formats.text.station_table import StationRow, bare_name, number_within
from per_obspy.formats.text.vocabulary import Words

_MARK = b"event.ev_sourcedb.shortname,"

#: field -> smallest and largest value that is believed
_RANGES = {
    "station.latitude": (-90.0, 90.0),
    "station.longitude": (-180.0, 180.0),
    "station.altitude": (-500.0, 9000.0),
    "station.vs30": (30.0, 10_000.0),
    "event.latitude": (-90.0, 90.0),
    "event.longitude": (-180.0, 180.0),
    "event.focaldepth": (0.0, 800.0),
    "event.pref_mag": (0.0, 10.0),
}

#: field -> word of the event; its depth is in km
_EVENT = {
    "event.latitude": "latitude",
    "event.longitude": "longitude",
    "event.focaldepth": "depth",
    "event.pref_mag": "magnitude",
}

#: Words of the time in its field.
_TIME = re.compile(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d(\.\d{1,6})?")


class ItacaMetadata(NamedTuple):
    """Station and earthquake of some records."""

    #: names, place and ground of the station
    row: StationRow
    #: time (UTC), latitude, longitude (degrees), depth (m) and magnitude, as far as known
    event: Words


def is_itaca_metadata(start: bytes) -> bool:
    """Check whether a file starts like a metadata file of ITACA 2009."""
    return start.startswith(_MARK)


def read_itaca_metadata(name: str, content: bytes) -> ItacaMetadata:
    """
    Read a metadata file in UTF-8 or Latin-1; the name is for messages.

    It is refused if it does not hold one line of values, or the station has no code or place.
    """
    fields = _fields(name, content.decode("utf-8", "replace"))
    numbers = {
        field: number_within(name, 2, field, fields[field], limits)
        for field, limits in _RANGES.items()
        if fields.get(field)
    }
    # Records name the station by its number, people by its code
    words = [fields.get(f"station.{field}", "") for field in ("sourceid", "oid", "code")]
    names = tuple(dict.fromkeys(filter(None, map(bare_name, words))))
    if not names or not {"station.latitude", "station.longitude"} <= numbers.keys():
        raise RecordRejected(name, "line 2: station.code, latitude or longitude is missing")
    # A station without a network fits any
    row = StationRow(
        "",
        names,
        numbers["station.latitude"],
        numbers["station.longitude"],
        numbers.get("station.altitude"),
        numbers.get("station.vs30"),
        fields.get("station.ec8", "")[:40],
        re.split(r"[/\\]", name)[-1],
    )
    return ItacaMetadata(row, _event(name, fields.get("event.datetime", ""), numbers))


def _fields(name: str, text: str) -> dict[str, str]:
    """Return field -> value, without blanks."""
    try:
        rows = [row for row in csv.reader(text.splitlines()) if row]
    except csv.Error as error:
        raise RecordRejected(name, f"is no CSV: {error!s:.100}") from error
    # Each name has one value
    if len(rows) != 2 or len(rows[0]) != len(rows[1]):
        raise RecordRejected(name, "must hold one line of names and one of as many values")
    return {field.strip(): value.strip() for field, value in zip(*rows, strict=True)}


def _event(name: str, time: str, numbers: dict[str, float]) -> Words:
    """Return time, hypocentre and magnitude of the event, as far as they are known."""
    event: Words = {word: numbers[field] for field, word in _EVENT.items() if field in numbers}
    if "depth" in event:
        event["depth"] *= 1000.0
    # A time that is written in another way is unknown
    if not _TIME.fullmatch(time):
        return event
    try:
        moment = datetime.fromisoformat(time).replace(tzinfo=UTC)
    except ValueError as error:
        raise RecordRejected(name, f"line 2, event.datetime: {time} is no time") from error
    return {"time": UTCDateTime(moment), **event}
