"""ITACA 2009 corrected acceleration (``.cor.acc``), one component per file."""

import re
from typing import Any

from obspy import Stream, UTCDateTime

from per_obspy.checks import FloatArray
from per_obspy.formats.text.conversions import utc_from_words
from per_obspy.formats.text.fields import (
    Fields,
    count_field,
    interval_field,
    number_field,
    read_fields,
    required_field,
    text_field,
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
    quoted,
    read_text,
    refuse,
)
from per_obspy.formats.text.vocabulary import corners, orientation, trace

_HEADER_LINES = 10
_WIDTH, _PER_LINE = 14, 5
_TIME = re.compile(rf"(\d{{4}})-(\d{{1,2}})-(\d{{1,2}}) (\d{{1,2}}):(\d{{1,2}}):{DECIMAL}")
_STATION = re.compile(r"(\S+) / (.*)")
_CORNERS = re.compile(rf"{DECIMAL}\s*+-\s*+{DECIMAL}")


def is_itaca(file: WaveformFile) -> bool:
    """Check whether a file starts like a corrected record of ITACA 2009."""
    start = head(file, 120)
    return start.startswith(b"Event Date & Time ") and b"Station Code / Name" in start


def read_itaca(file: WaveformFile, **_unused: Any) -> Stream:
    """Read a corrected record of ITACA 2009: acceleration of one component, m/s2."""
    text = read_text(file)
    fields = read_fields(text, _HEADER_LINES - 1)
    unit = line_at(text, _HEADER_LINES - 1, "unit")
    if "m/s/s" not in unit:
        problem = f"{quoted(text, _HEADER_LINES - 1)} does not name m/s/s"
        refuse(text, _HEADER_LINES - 1, "unit", problem)
    values = _samples(text, count_field(text, fields, "Number of Data"))
    # Words of the header
    words = _processing(text, fields) | {"event": {"time": _event_time(text, fields)}}
    words |= _station(text, fields)
    words |= orientation(required_field(text, fields, "Orientation").value)
    dt = interval_field(text, fields, "Time Increment (s)")
    return Stream([trace(values, dt, words, text.name)])


def _samples(text: Text, samples: int) -> FloatArray:
    """Return the samples, which end the file."""
    values = fixed_block(text, _HEADER_LINES, samples, _WIDTH, _PER_LINE)
    no_more(text, _HEADER_LINES + block_lines(samples, _PER_LINE), samples)
    return values


def _processing(text: Text, fields: Fields) -> dict[str, Any]:
    """Return quantity, filter and peak."""
    band = _CORNERS.match(text_field(fields, "Filter Cut-off Frequency (Hz)") or "")
    return {
        "units": "m/s2",
        "quantity": "acceleration",
        "processing_level": "processed",
        "corners": corners(band),
        "header_peak": number_field(text, fields, "PGA (m/s/s)"),
    }


def _station(text: Text, fields: Fields) -> dict[str, Any]:
    """Return codes and name; the civil protection (DPC) runs the network with FDSN code IT."""
    station = _STATION.match(required_field(text, fields, "Station Code / Name").value)
    network = text_field(fields, "Network") or ""
    return {
        "network": "IT" if network.startswith("DPC") else None,
        "station": station[1] if station else None,
        "station_name": station[2] if station else None,
    }


def _event_time(text: Text, fields: Fields) -> UTCDateTime | None:
    """Return the origin time, UTC."""
    name = "Event Date & Time"
    line, value = required_field(text, fields, name)
    time = _TIME.match(value)
    return utc_from_words(text, line, name, time.groups()) if time else None
