"""Coordinates and ground of stations from tables in CSV."""

import csv
import re
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from obspy import Inventory
from obspy.core.inventory import Comment, Network, Station

from per_obspy.errors import RecordRejected, printable

#: column of a table of stations -> names that it may have, in lower case
_COLUMNS = {
    "network": ("network", "net", "network_code"),
    "station": ("station", "code", "station_code", "sta", "name", "station_name"),
    "latitude": ("latitude", "lat", "latitude_deg"),
    "longitude": ("longitude", "lon", "long", "longitude_deg"),
    "elevation": ("elevation", "elev", "height", "elevation_m"),
    "vs30": ("vs30", "vs_30", "vs30_m/s", "vs30_mps"),
    "site_class": ("site_class", "siteclass", "ec8", "nehrp", "soil_class"),
}
_REQUIRED = ("station", "latitude", "longitude")

#: smallest and largest value: degrees, m or m/s
_RANGES = {
    "latitude": (-90.0, 90.0),
    "longitude": (-180.0, 180.0),
    "elevation": (-9000.0, 9000.0),
    "vs30": (0.0, 10_000.0),
}

#: neither nan nor inf nor long runs of digits
_DECIMAL = re.compile(r"[-+]?(\d{1,20}(\.\d{0,30})?|\.\d{1,30})")

#: Beginning of the comment of a station that names the table which describes it.
SOURCE = "coordinates from "


class StationRow(NamedTuple):
    """One row of a table of stations."""

    #: code in capitals; empty where the table has none, which fits any
    network: str
    #: code and name, as :func:`bare_name` gives them
    names: tuple[str, ...]
    #: degrees
    latitude: float
    longitude: float
    #: m
    elevation: float | None
    #: mean shear-wave velocity of the upper 30 m, m/s
    vs30: float | None = None
    #: any word; empty if unknown
    site_class: str = ""
    #: name of the table
    source: str = ""


def bare_name(name: str) -> str:
    """
    Return capitals, letters and digits only, as codes are made from names.

    >>> bare_name("Viña del Mar (Centro)") == bare_name("VIÑA DEL MAR CENTRO")
    True
    """
    return re.sub(r"[\W_]", "", name.upper())


def is_station_table(start: bytes) -> bool:
    r"""
    Check whether a file starts like a table of stations.

    >>> is_station_table(b"Station;Lat;Lon\n"), is_station_table(b"time,acceleration\n")
    (True, False)
    """
    header = start.decode("latin-1").lstrip("\ufeff\xef\xbb\xbf").split("\n")[0]
    try:
        return set(_REQUIRED) <= set(_places(_fields(header, ";" if ";" in header else ",")))
    except csv.Error:
        return False


def read_station_table(name: str, content: bytes) -> tuple[StationRow, ...]:
    """
    Read a table of stations: comma or semicolon between columns, names of columns in any case.

    The content is UTF-8 or Latin-1. `RecordRejected` names line and column of the first fault.
    """
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("latin-1")
    # Lines are counted from 1; the header decides the separator
    header, *lines = text.splitlines() or [""]
    separator = ";" if ";" in header else ","
    number, rows = 1, []
    try:
        places = _places(_fields(header, separator))
        if missing := [column for column in _REQUIRED if column not in places]:
            raise RecordRejected(name, f"line 1: no column {', '.join(missing)}")
        # Every other line is a station, a comment or empty
        for number, line in enumerate(lines, 2):
            if line.strip() and not line.startswith("#"):
                rows.append(_row(name, number, _fields(line, separator), places))
    except csv.Error as error:
        raise RecordRejected(name, f"line {number}: {error!s:.100}") from error
    return tuple(rows)


def _fields(line: str, separator: str) -> list[str]:
    """Return the fields of a line, without blanks."""
    row = next(csv.reader([line], delimiter=separator), [])
    return [field.strip() for field in row]


def _places(header: Sequence[str]) -> dict[str, list[int]]:
    """Return column -> its places in the header; of stations there may be code and name."""
    places: dict[str, list[int]] = {}
    for place, field in enumerate(header):
        for column, names in _COLUMNS.items():
            if field.lower().strip(" #\ufeff").replace(" ", "_") in names:
                places.setdefault(column, []).append(place)
    return places


def _row(name: str, line: int, fields: list[str], places: dict[str, list[int]]) -> StationRow:
    """Return a row, whose numbers must be in their range."""
    words = {}
    for column, found in places.items():
        if max(found) >= len(fields):
            raise RecordRejected(name, f"line {line}: {len(fields)} columns, no {column}")
        words[column] = fields[found[0]]
    # A station may have a code, a name or both
    names = tuple(filter(None, (bare_name(fields[place]) for place in places["station"])))
    if not names:
        raise RecordRejected(name, f"line {line}, station: empty")
    # Only the place may not be missing; tables write 0 for an unknown velocity
    numbers = {
        column: number_within(name, line, column, words[column], limits)
        for column, limits in _RANGES.items()
        if words.get(column) or column in _REQUIRED
    }
    return StationRow(
        words.get("network", "").upper(),
        names,
        numbers["latitude"],
        numbers["longitude"],
        numbers.get("elevation"),
        numbers.get("vs30") or None,
        words.get("site_class", "")[:40],
        printable(re.split(r"[/\\]", name)[-1]),
    )


def number_within(
    name: str, line: int, field: str, word: str, limits: tuple[float, float]
) -> float:
    """Return a decimal number of a field within its range."""
    smallest, largest = limits
    if not _DECIMAL.fullmatch(word) or not smallest <= float(word) <= largest:
        expected = f"a number from {smallest:g} to {largest:g}"
        raise RecordRejected(name, f"line {line}, {field}: {word[:40]!r} is not {expected}")
    return float(word)


def located_stations(rows: Iterable[StationRow], stations: Iterable[str]) -> Inventory:
    """
    Return the coordinates of stations that have records, ``"NET.STA"``, from rows of all tables.

    Code or name in a table may be in any case.
    """
    table = tuple(rows)
    networks = []
    for identifier in stations:
        network, code = identifier.split(".", 1)
        # A table without networks fits all of them, and so does a record without one
        found = [
            _station(code, row)
            for row in table
            if bare_name(code) in row.names
            and (not row.network or not network or row.network == network.upper())
        ]
        if found:
            networks.append(Network(network, stations=found))
    return Inventory(networks=networks, source="")


def _station(code: str, row: StationRow) -> Station:
    """Return the description of a station; ObsPy needs a number for an elevation."""
    # The ground, as the comments of StationXML have it
    words = [
        f"{SOURCE}{row.source or 'a table of stations'}",
        "elevation=unknown" if row.elevation is None else "",
        f"vs30={row.vs30:g}" if row.vs30 else "",
        f"site_class={row.site_class}" if row.site_class else "",
    ]
    comments = [Comment(word) for word in words if word]
    return Station(code, row.latitude, row.longitude, row.elevation or 0.0, comments=comments)
