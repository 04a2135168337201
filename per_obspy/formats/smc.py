"""USGS SMC: one component of acceleration (cm/s2), velocity (cm/s) or displacement (cm)."""

import re
from datetime import UTC, datetime, timedelta
from typing import Any

from obspy import Stream, UTCDateTime

from per_obspy.checks import FloatArray
from per_obspy.formats.text.conversions import first_known, metres
from per_obspy.formats.text.film import Film, even_film
from per_obspy.formats.text.lines import (
    Text,
    WaveformFile,
    block_lines,
    count,
    fixed_block,
    head_lines,
    interval,
    line_at,
    no_more,
    quoted,
    read_text,
    refuse,
)
from per_obspy.formats.text.vocabulary import coordinates, horizontal, trace

_TEXT_LINES, _INTEGER_LINES, _NUMBER_LINES = 11, 6, 16
_INTEGERS, _REALS = 48, 50
_NO_INTEGER, _NO_REAL = -32768, 1e38
_TITLE = re.compile(
    r"[1-4] (UNCORRECTED ACCELEROGRAM|CORRECTED ACCELEROGRAM|VELOCITY|DISPLACEMENT)\s*+"
)
_QUANTITIES = {"VELOCITY": ("velocity", "m/s"), "DISPLACEMENT": ("displacement", "m")}
_STATION = re.compile(r"station = (.*?)\s*+component=")
_MODEL = re.compile(r"inst type=(.*?)\s++data source = (.*)")
_CENTIMETRE = 0.01  # m


def is_smc(file: WaveformFile) -> bool:
    """Check whether a file starts like SMC."""
    lines = head_lines(file, 200)
    return len(lines) > 2 and bool(_TITLE.fullmatch(lines[0])) and lines[1].startswith("*")


def read_smc(file: WaveformFile, **_unused: Any) -> Stream:
    """Read SMC: one component, m/s2, m/s or m."""
    text = read_text(file)
    title = _TITLE.fullmatch(text.lines[0])
    if title is None:
        refuse(text, 0, "title", f"{quoted(text, 0)} is not that of a time series")
    # Integers and reals of the header
    line_at(text, _TEXT_LINES, "integers")
    integers = fixed_block(text, _TEXT_LINES, _INTEGERS, 10, 8)
    reals = fixed_block(text, _TEXT_LINES + _INTEGER_LINES, _REALS, 15, 5)
    values, dt, film = _samples(text, integers, reals, title[1])
    # Words of the header
    words = _quantity(title[1]) | {"starttime": _start(text, integers)}
    words |= _station(text, integers, reals) | _numbers(reals) | _direction(integers)
    return Stream([trace(values, dt, words | film, text.name)])


def _samples(
    text: Text, integers: FloatArray, reals: FloatArray, title: str
) -> tuple[FloatArray, float, dict[str, Any]]:
    """Return the samples in SI, their interval, s, and the words of digitised film."""
    comments = 0 if integers[15] == _NO_INTEGER else int(integers[15])
    first = _TEXT_LINES + _NUMBER_LINES + max(comments, 0)
    samples = count(text, _TEXT_LINES + 2, "number of samples", f"{integers[16]:.17g}")
    # Film has no rate: its samples are pairs of time and value
    if title.startswith("UNCORRECTED") and _real(reals, 1) is None:
        film = _film(text, first, samples)
        return _CENTIMETRE * film.values, film.dt, film.words
    rate = interval(text, _TEXT_LINES + _INTEGER_LINES, "sampling rate", float(reals[1]))
    # The samples end the file
    values = _CENTIMETRE * fixed_block(text, first, samples, 10, 8)
    no_more(text, first + block_lines(samples, 8), samples)
    return values, 1 / rate, {}


def _film(text: Text, first: int, samples: int) -> Film:
    """Return a digitised trace, whose header counts the pairs or the numbers in them."""
    # The length of the file decides which of both it counts; most files of the USGS have a line
    # more, whose times come after a pause
    lines, of_numbers, of_pairs = (
        len(text.lines) - first,
        block_lines(samples, 8),
        block_lines(2 * samples, 8),
    )
    if samples % 2 == 0 and lines in (of_numbers, of_numbers + 1) and lines < of_pairs:
        samples //= 2
    pairs = fixed_block(text, first, 2 * samples, 10, 8).reshape(-1, 2)
    end = first + block_lines(2 * samples, 8)
    has_line_more = len(text.lines) == end + 1
    if not has_line_more:
        no_more(text, end, samples)
    film = even_film(text, first, pairs, 4)
    if has_line_more:
        film.words["notes"].append("a line after the last pair is left out")
    return film


def _quantity(title: str) -> dict[str, Any]:
    """Return quantity, unit and processing level."""
    quantity, unit = _QUANTITIES.get(title, ("acceleration", "m/s2"))
    level = "raw" if title.startswith("UNCORRECTED") else "processed"
    return {"quantity": quantity, "units": unit, "processing_level": level}


def _real(reals: FloatArray, index: int) -> float | None:
    """Return a real number of the header, or None where it is unknown."""
    return float(reals[index]) if abs(reals[index]) < _NO_REAL else None


def _start(text: Text, integers: FloatArray) -> UTCDateTime | None:
    """Return the time of the first sample, whose date is year and day of the year."""
    year, day, hour, minute, second, millisecond = (int(value) for value in integers[1:7])
    if _NO_INTEGER in (year, day, hour, minute):
        return None
    # Seconds and their fraction may be missing
    second = 0 if second == _NO_INTEGER else second
    millisecond = 0 if millisecond == _NO_INTEGER else millisecond
    try:
        new_year = datetime(year, 1, 1, tzinfo=UTC)
        since = timedelta(
            days=day - 1, hours=hour, minutes=minute, seconds=second, milliseconds=millisecond
        )
        return UTCDateTime(new_year + since)
    except (ValueError, OverflowError) as error:
        refuse(text, _TEXT_LINES, "time", f"{year} day {day} is no date ({error})")


def _station(text: Text, integers: FloatArray, reals: FloatArray) -> dict[str, Any]:
    """Return codes, name, coordinates and instrument of the station."""
    name = _STATION.match(text.lines[5])
    model = _MODEL.match(text.lines[7])
    number = int(integers[29])
    # Where the station has no number, its code is in the text
    return {
        "network": "NP" if model and model[2].strip() == "USGS" else None,
        "station": text.lines[2].strip() if number == _NO_INTEGER else str(number),
        "station_name": name[1] if name else None,
        "coordinates": coordinates(_real(reals, 10), _real(reals, 11), _real(reals, 12)),
        "instrument": {
            "model": model[1] if model else None,
            "natural_frequency": _real(reals, 21),
            "damping": _real(reals, 22),
        },
    }


def _numbers(reals: FloatArray) -> dict[str, Any]:
    """Return filter, peak and event from the real numbers of the header."""
    extremes = (_real(reals, 29), _real(reals, 31))
    peaks = [abs(extreme) * _CENTIMETRE for extreme in extremes if extreme is not None]
    # Magnitude: moment, or else local, or else surface wave
    event = {
        "latitude": _real(reals, 2),
        "longitude": _real(reals, 3),
        "depth": metres(_real(reals, 4)),
        "magnitude": first_known(_real(reals, index) for index in (5, 7, 6)),
    }
    return {
        "corners": {"highpass": _real(reals, 32), "lowpass": _real(reals, 34)},
        "header_peak": max(peaks, default=None),
        "event": event,
    }


def _direction(integers: FloatArray) -> dict[str, float]:
    """
    Return the orientation.

    In the first number 0 is up, 180 is down, and 90 leaves the azimuth to the second.
    """
    vertical, azimuth = int(integers[12]), int(integers[13])
    if vertical in (0, 180):
        return {"sensor_dip": -90.0 if vertical == 0 else 90.0}
    return horizontal(float(azimuth)) if azimuth != _NO_INTEGER else {}
