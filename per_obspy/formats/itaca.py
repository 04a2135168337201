"""ITACA 2009 corrected acceleration (``.cor.acc``), one component a file."""

import re
from typing import Any

from obspy import Stream, UTCDateTime

from per_obspy.formats.text.fields import (
    Fields,
    count_field,
    field,
    interval_field,
    number_field,
    read_fields,
    word_field,
)
from per_obspy.formats.text.lines import (
    DECIMAL,
    Text,
    WaveformFile,
    block_lines,
    fixed_block,
    head,
    line_at,
    no_more,
    read_text,
    refuse,
)
from per_obspy.formats.text.vocabulary import orientation, trace, utc

_HEADER_LINES = 10
_WIDTH, _PER_LINE = 14, 5
_TIME = re.compile(rf"(\d{{4}})-(\d{{1,2}})-(\d{{1,2}}) (\d{{1,2}}):(\d{{1,2}}):{DECIMAL}")
_STATION = re.compile(r"(\S+) / (.*)")
_CORNERS = re.compile(rf"{DECIMAL}\s*-\s*{DECIMAL}")


def is_itaca(file: WaveformFile) -> bool:
    """Tell whether a file starts like a corrected record of ITACA 2009."""
    start = head(file, 120)
    return start.startswith(b"Event Date & Time ") and b"Station Code / Name" in start


def read_itaca(file: WaveformFile, **_unused: Any) -> Stream:
    """Read a corrected record of ITACA 2009: acceleration of one component, m/s2."""
    text = read_text(file)
    fields = read_fields(text, _HEADER_LINES - 1)
    if "m/s/s" not in line_at(text, _HEADER_LINES - 1, "unit"):
        refuse(
            text,
            _HEADER_LINES - 1,
            "unit",
            f"{text.lines[_HEADER_LINES - 1].strip()!r} does not say m/s/s",
        )
    samples = count_field(text, fields, "Number of Data")
    values = fixed_block(text, _HEADER_LINES, samples, _WIDTH, _PER_LINE)
    no_more(text, _HEADER_LINES + block_lines(samples, _PER_LINE), samples)
    corners = _CORNERS.match(word_field(fields, "Filter Cut-off Frequency (Hz)") or "")
    words = {
        "units": "m/s2",
        "quantity": "acceleration",
        "processing_level": "processed",
        "corners": {"highpass": float(corners[1]), "lowpass": float(corners[2])} if corners else {},
        "header_peak": number_field(text, fields, "PGA (m/s/s)"),
        "event": {"time": _event_time(text, fields)},
    }
    words |= _station(text, fields) | orientation(field(text, fields, "Orientation").value)
    return Stream([trace(values, interval_field(text, fields, "Time Increment (s)"), words)])


def _station(text: Text, fields: Fields) -> dict[str, Any]:
    """Code and name; the Italian civil protection (DPC) runs the network with FDSN code IT."""
    station = _STATION.match(field(text, fields, "Station Code / Name").value)
    network = word_field(fields, "Network") or ""
    return {
        "network": "IT" if network.startswith("DPC") else None,
        "station": station[1] if station else None,
        "station_name": station[2] if station else None,
    }


def _event_time(text: Text, fields: Fields) -> UTCDateTime | None:
    found = field(text, fields, "Event Date & Time")
    time = _TIME.match(found.value)
    if time is None:
        return None
    year, month, day, hour, minute = (int(part) for part in time.groups()[:5])
    return utc(
        text, found.line, "Event Date & Time", (year, month, day), (hour, minute, float(time[6]))
    )
