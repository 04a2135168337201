"""
Metadata file of ITACA 2009 (``.metadata``): the event, the station and its ground, in CSV.

It is in the folder of the records, whose headers hold neither coordinates nor ground. One line
names the fields, one line holds their values.
"""

import csv
import re
from datetime import UTC, datetime
from typing import Any, NamedTuple

from obspy import UTCDateTime

from per_obspy.errors import RecordRejected
from per_obspy.formats.text.conversions import metres
from per_obspy.formats.text.station_table import StationRow, bare_name

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

#: Words of the time in its field.
_TIME = re.compile(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d(\.\d{1,6})?")


class ItacaMetadata(NamedTuple):
    """
    Station and earthquake of some records.

    Attributes
    ----------
    row : StationRow
        Names, place and ground of the station.
    event : dict
        ``time`` (UTC), ``latitude``, ``longitude`` (degrees), ``depth`` (m) and ``magnitude``, as
        far as they are known.
    """

    row: StationRow
    event: dict[str, Any]


def is_itaca_metadata(start: bytes) -> bool:
    """Check whether a file starts like a metadata file of ITACA 2009."""
    return start.startswith(_MARK)


def read_itaca_metadata(name: str, content: bytes) -> ItacaMetadata:
    """
    Read a metadata file.

    Parameters
    ----------
    name : str
        File, for messages.
    content : bytes
        UTF-8 or Latin-1.

    Raises
    ------
    RecordRejected
        If it does not hold one line of values, or the station has no code or place.
    """
    fields = _fields(name, content.decode("utf-8", "replace"))
    latitude, longitude = _number(name, fields, "station.latitude"), None
    if latitude is not None:
        longitude = _number(name, fields, "station.longitude")
    # Records name the station by its number, people by its code
    words = [fields.get(field, "") for field in ("station.sourceid", "station.oid", "station.code")]
    names = tuple(dict.fromkeys(bare_name(word) for word in words if bare_name(word)))
    if latitude is None or longitude is None or not names:
        raise RecordRejected(name, "line 2: station.code, latitude or longitude is missing")
    # A station without a network fits any
    row = StationRow(
        "",
        names,
        latitude,
        longitude,
        _number(name, fields, "station.altitude"),
        _number(name, fields, "station.vs30"),
        fields.get("station.ec8", "")[:40],
        re.split(r"[/\\]", name)[-1],
    )
    return ItacaMetadata(row, _event(name, fields))


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


def _number(name: str, fields: dict[str, str], field: str) -> float | None:
    """Return a number within its range, None where it is missing."""
    word = fields.get(field, "")
    if not word:
        return None
    smallest, largest = _RANGES[field]
    # Neither nan nor inf nor long runs of digits
    is_decimal = re.fullmatch(r"[-+]?\d{1,20}(\.\d{0,30})?", word)
    if is_decimal is None or not smallest <= float(word) <= largest:
        problem = f"{word[:40]!r} is not a number from {smallest:g} to {largest:g}"
        raise RecordRejected(name, f"line 2, {field}: {problem}")
    return float(word)


def _event(name: str, fields: dict[str, str]) -> dict[str, Any]:
    """Return time, hypocentre and magnitude of the event."""
    time = fields.get("event.datetime", "")
    # Facts that the file does not have stay absent
    event = {
        "time": _time(name, time) if _TIME.fullmatch(time) else None,
        "latitude": _number(name, fields, "event.latitude"),
        "longitude": _number(name, fields, "event.longitude"),
        "depth": metres(_number(name, fields, "event.focaldepth")),
        "magnitude": _number(name, fields, "event.pref_mag"),
    }
    return {word: value for word, value in event.items() if value is not None}


def _time(name: str, words: str) -> UTCDateTime:
    """Return an origin time, UTC."""
    try:
        return UTCDateTime(datetime.fromisoformat(words).replace(tzinfo=UTC))
    except ValueError as error:
        raise RecordRejected(name, f"line 2, event.datetime: {words} is no time") from error
