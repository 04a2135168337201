"""ITACA 2009 corrected acceleration (``.cor.acc``), one component per file."""

import re
from typing import Any

from obspy import Stream

from per_obspy.formats.text.header import CLOCK, corners, read_fields, word_in
from per_obspy.formats.text.lines import (
    DECIMAL,
    WaveformFile,
    block_lines,
    fixed_block,
    head,
    match_line,
    no_more,
    read_text,
)
from per_obspy.formats.text.vocabulary import orientation, trace

_HEADER_LINES = 10
_WIDTH, _PER_LINE = 14, 5
_TIME = re.compile(rf"(?P<year>\d{{4}})-(?P<month>\d{{1,2}})-(?P<day>\d{{1,2}}) {CLOCK}")
_STATION = re.compile(r"(\S+) / (.*)")
_CORNERS = re.compile(rf"{DECIMAL}\s*+-\s*+{DECIMAL}")
_UNIT = re.compile("m/s/s")


def is_itaca(file: WaveformFile) -> bool:
    """Check whether a file starts like a corrected record of ITACA 2009."""
    start = head(file, 120)
    return start.startswith(b"Event Date & Time ") and b"Station Code / Name" in start


def read_itaca(file: WaveformFile, **_unused: Any) -> Stream:
    """Read a corrected record of ITACA 2009: acceleration of one component, m/s2."""
    text = read_text(file)
    header = read_fields(text, _HEADER_LINES - 1)
    match_line(text, _HEADER_LINES - 1, "unit", _UNIT, "{} does not name m/s/s")
    samples = header.samples("Number of Data")
    values = fixed_block(text, _HEADER_LINES, samples, _WIDTH, _PER_LINE)
    no_more(text, _HEADER_LINES + block_lines(samples, _PER_LINE), samples)
    # The civil protection (DPC) runs the network with FDSN code IT
    header.required("Event Date & Time")
    station = _STATION.match(header.required("Station Code / Name"))
    # Words without a value are dropped from the trace
    is_dpc = (header.word("Network") or "").startswith("DPC")
    words = {
        "processing_level": "processed",
        "corners": corners(_CORNERS.match(header.word("Filter Cut-off Frequency (Hz)") or "")),
        "header_peak": header.number("PGA (m/s/s)"),
        "event": {"time": header.time(_TIME, "Event Date & Time")},
        "network": "IT" if is_dpc else None,
        "station": word_in(station),
        "station_name": word_in(station, 2),
        **orientation(header.required("Orientation")),
    }
    return Stream([trace(values, header.interval("Time Increment (s)"), words, text.name)])
