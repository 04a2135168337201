"""
FDSN station text: one line per channel or station, of which each is right or wrong alone.

References
----------
FDSN, "FDSN Web Service Specifications", version 1.2, 2019: columns of the text format of
fdsnws-station, divided by ``|``.
"""

import math
import re
from datetime import UTC, datetime
from typing import NamedTuple

from obspy import Inventory, UTCDateTime

from per_obspy.errors import shortened

#: Columns that every line needs, columns of codes, and largest absolute values, degrees.
_REQUIRED = ("network", "station", "latitude", "longitude")
_CODES = ("network", "station", "location", "channel")
_LARGEST = {"latitude": 90.0, "longitude": 180.0}

#: A decimal number; ``float`` also reads ``1_0`` and ``nan``.
_NUMBER = re.compile(r"[+-]?+(?:\d++\.?+\d*+|\.\d++)(?:[eE][+-]?+\d++)?+", re.ASCII)

#: start of an epoch that FDSN station text leaves open
_OPEN = UTCDateTime(1, 1, 2)


class StationLine(NamedTuple):
    """One channel or station of a list."""

    #: of the line; the header is line 1
    number: int
    #: codes; location and channel are empty in a list of stations
    network: str
    station: str
    location: str
    channel: str
    #: degrees
    latitude: float
    longitude: float
    #: of the epoch; None where it is open
    start: UTCDateTime | None
    end: UTCDateTime | None


class LineFault(NamedTuple):
    """A line that cannot be used."""

    number: int
    #: codes in it, as far as they can be read
    name: str
    #: column, value and expectation
    reason: str


def station_lines(content: bytes) -> tuple[list[StationLine], list[LineFault]]:
    r"""
    Read every line of FDSN station text alone: the usable lines, and the faults of the others.

    Only codes, place and epoch are read: a fault in another column is none here. A byte that is no
    UTF-8 is a fault only where a code, place or time has it. If the first line does not name the
    columns, ``ValueError``.

    Examples
    --------
    >>> text = b"#Network|Station|Latitude|Longitude\nXX|A|1.5|2.5\nXX|B|nan|2.5\nXX|C|1"
    >>> lines, faults = station_lines(text)
    >>> [line.station for line in lines]
    ['A']
    >>> faults[0].reason, faults[1].reason
    ("latitude: 'nan', expected a number from -90 to 90", 'has 3 columns, expected 4')
    """
    # Services write the header with blanks or without
    first, *rest = _split(content)
    columns = [name.strip().lower() for name in first.lstrip("\ufeff# ").split("|")]
    if not set(_REQUIRED) <= set(columns):
        expected = "#Network|Station|Latitude|Longitude and others"
        raise ValueError(f"the first line is {shortened(first, 80)!r}, expected {expected}")
    # Comments and empty lines are none
    lines, faults = list[StationLine](), list[LineFault]()
    for number, text in enumerate(rest, 2):
        if not text.strip() or text.startswith("#"):
            continue
        row = [cell.strip() for cell in text.split("|")]
        try:
            lines.append(_line(number, columns, row))
        except ValueError as error:
            codes = dict(zip(columns, row, strict=False))
            name = ".".join(codes[name] for name in _CODES if name in codes)
            faults.append(LineFault(number, shortened(name, 80), str(error)))
    return lines, faults


def _split(content: bytes) -> list[str]:
    """Return the lines of a text; line ends of other alphabets in a site name divide none."""
    return re.split("\r\n|\r|\n", content.decode("utf-8", "replace"))


def _line(number: int, columns: list[str], cells: list[str]) -> StationLine:
    """Return a line; raise ``ValueError`` with column and value if it is wrong."""
    if len(cells) < len(columns):
        raise ValueError(f"has {len(cells)} columns, expected {len(columns)}")
    # Columns beyond those of the header are nobody's
    row = dict(zip(columns, cells, strict=False))
    for name in ("station", "channel"):
        if row.get(name) == "":
            raise ValueError(f"{name}: empty, expected a code")
    # The location of a list is -- where it is empty
    network, station, location, channel = (row.get(name, "") for name in _CODES)
    return StationLine(
        number,
        network,
        station,
        "" if location == "--" else location,
        channel,
        _degrees(row, "latitude"),
        _degrees(row, "longitude"),
        _time(row, "starttime"),
        _time(row, "endtime"),
    )


def _degrees(row: dict[str, str], name: str) -> float:
    """Return a coordinate of a line."""
    # Also refuses what is no number
    largest = _LARGEST[name]
    value = float(row[name]) if _NUMBER.fullmatch(row[name]) else math.nan
    if not abs(value) <= largest:
        expected = f"a number from {-largest:g} to {largest:g}"
        raise ValueError(f"{name}: {shortened(row[name], 40)!r}, expected {expected}")
    return value


def _time(row: dict[str, str], name: str) -> UTCDateTime | None:
    """Return a time of a line; None where it is empty or the line has none."""
    text = row.get(name, "")
    if not text:
        return None
    try:
        moment = datetime.fromisoformat(text)
    except ValueError as error:
        expected = "a time such as 2019-07-06T03:19:53"
        raise ValueError(f"{name}: {shortened(text, 40)!r}, expected {expected}") from error
    return UTCDateTime(moment.astimezone(UTC) if moment.tzinfo else moment)


def marked_open_starts(content: bytes) -> bytes:
    r"""
    Return FDSN station text whose empty starts hold a mark, because ObsPy refuses them.

    :func:`with_open_starts` takes the mark away again.

    >>> marked_open_starts(b"#Network|Description|StartTime\nXX|net|")
    b'#Network|Description|StartTime\nXX|net|0001-01-02T00:00:00.000000Z'
    """
    header, *lines = _split(content)
    columns = [field.strip().lower() for field in header.lstrip("#").split("|")]
    rows = [line.split("|") for line in lines]
    start = columns.index("starttime") if "starttime" in columns else len(content)
    # Comments stay as they are
    for fields in rows:
        if start < len(fields) and not fields[start].strip() and not fields[0].startswith("#"):
            fields[start] = str(_OPEN)
    return "\n".join([header, *map("|".join, rows)]).encode()


def with_open_starts(inventory: Inventory) -> Inventory:
    """Return an inventory just read without the mark of :func:`marked_open_starts`."""
    for network in inventory:
        for station in network:
            for description in (station, *station.channels):
                if description.start_date == _OPEN:
                    description.start_date = None
    return inventory
