"""DYNA 1.x of ESM and ITACA (``.ASC``), which AFAD imitates: one component per file."""

import re
from typing import Any

from obspy import Stream

from per_obspy.formats.text.header import Header, first_known, read_fields, scale, word_in
from per_obspy.formats.text.lines import (
    NUMBER,
    Text,
    WaveformFile,
    free_block,
    head,
    read_text,
    refuse,
)
from per_obspy.formats.text.vocabulary import Words, channel_direction, coordinates, trace
from per_obspy.units import MotionUnit, motion_unit

_NAME = re.compile(r"[A-Z][A-Z0-9_/^]*:")
_TIME = re.compile(
    r"(?P<year>\d{4})/?(?P<month>\d\d)/?(?P<day>\d\d)[ _\n]?"
    rf"(?P<hour>\d\d):?(?P<minute>\d\d):?(?P<second>{NUMBER})$"
)
_MODEL = re.compile(r"sensor = (.*?)\s*+(?:\[.*?\])?\s*+(?:\||$)")

#: words for an unknown ground, in lower case
_UNKNOWN = ("", "none", "unknown", "null", "nan", "-")


def is_dyna(file: WaveformFile) -> bool:
    """Check whether a file starts like DYNA."""
    start = head(file, 300)
    return start.startswith(b"EVENT_NAME:") and b"\nEVENT_DATE_YYYYMMDD:" in start


def read_dyna(file: WaveformFile, **_unused: Any) -> Stream:
    """Read a DYNA record: one component, m/s2 (or m/s, m)."""
    return read_component(read_text(file), 0)


def read_component(text: Text, first: int) -> Stream:
    """Read one component whose header begins on the line ``first``."""
    stop = first
    while stop < len(text.lines) and _NAME.match(text.lines[stop]):
        stop += 1
    if stop == len(text.lines):
        refuse(text, stop - 1, "samples", "the file ends after its header")
    header = read_fields(text, stop)
    samples = header.samples("NDATA")
    dt = header.interval("SAMPLING_INTERVAL_S")
    unit = _unit(header)
    values = unit.factor * free_block(text, stop, samples)
    # Words of the header; velocity and displacement have no peak
    words = _station(header) | {"units": unit.name, "quantity": unit.quantity}
    words |= {"event": _event(header), **_processing(header)}
    # The format has no azimuths, only the channel
    words |= channel_direction(words["channel"] or "")
    words["starttime"] = header.time(_TIME, "DATE_TIME_FIRST_SAMPLE_YYYYMMDD_HHMMSS")
    peak = scale(header.number("PGA_CM/S^2"), 0.01)
    words["header_peak"] = peak if unit.name == "m/s2" else None
    return Stream([trace(values, dt, words, text.name)])


def _unit(header: Header) -> MotionUnit:
    """Return the unit of the samples, which must fit the quantity."""
    name, kind = header.required("UNITS"), header.required("DATA_TYPE")
    unit = motion_unit(name)
    if unit is None:
        header.refuse("UNITS", f"{name!r} is none of cm/s^2, m/s^2, g, cm/s, cm")
    # A spectrum, for example, is in a unit of a quantity without being its time series
    if kind.lower() != unit.quantity:
        header.refuse("DATA_TYPE", f"{kind!r} is not a time series in {name}")
    return unit


def _station(header: Header) -> Words:
    """Return codes, name, place, instrument and ground of the station."""
    location = header.word("LOCATION") or ""
    sensor = _MODEL.match(header.word("INSTRUMENT") or "")
    place = header.numbers(
        latitude="STATION_LATITUDE_DEGREE",
        longitude="STATION_LONGITUDE_DEGREE",
        elevation="STATION_ELEVATION_M",
    )
    # The header has no serial number
    constants = header.numbers(
        natural_frequency="INSTRUMENTAL_FREQUENCY_HZ", damping="INSTRUMENTAL_DAMPING"
    )
    return {
        **header.words(network="NETWORK", channel="STREAM", station_name="STATION_NAME"),
        "station": header.required("STATION_CODE"),
        "location": location if len(location) == 2 else None,
        "coordinates": coordinates(**place),
        "instrument": {"model": word_in(sensor), **constants},
        **_ground(header),
    }


def _ground(header: Header) -> dict[str, str | float | None]:
    """Return site class and Vs30, m/s; words as ``unknown`` and ``None`` are no ground."""
    site_class, velocity = (
        word if word and word.lower() not in _UNKNOWN else None
        for word in (header.word("SITE_CLASSIFICATION_EC8"), header.word("VS30_M/S"))
    )
    vs30 = header.number("VS30_M/S") if velocity else None
    # A velocity of 0 is how tables write an unknown one
    return {"site_class": site_class, "vs30": vs30 if vs30 is not None and vs30 > 0 else None}


def _processing(header: Header) -> Words:
    """Return the corners of the filter, Hz; a record without any was not processed."""
    corners = {}
    for corner, name in (("highpass", "LOW_CUT"), ("lowpass", "HIGH_CUT")):
        # AFAD has them under a name with a prefix
        names = (f"{name}_FREQUENCY_HZ", f"AAD_{name}_FREQUENCY_HZ")
        corners[corner] = first_known(map(header.number, names))
    filtered = first_known(corners.values()) is not None
    return {"corners": corners, "processing_level": "processed" if filtered else "raw"}


def _event(header: Header) -> Words:
    """Return name, time, hypocentre and magnitude (moment, or else local) of the event."""
    return {
        "name": header.word("EVENT_NAME"),
        "time": header.time(_TIME, "EVENT_DATE_YYYYMMDD", "EVENT_TIME_HHMMSS"),
        **header.numbers(latitude="EVENT_LATITUDE_DEGREE", longitude="EVENT_LONGITUDE_DEGREE"),
        "depth": scale(header.number("EVENT_DEPTH_KM"), 1000),
        "magnitude": first_known(map(header.number, ("MAGNITUDE_W", "MAGNITUDE_L"))),
    }
