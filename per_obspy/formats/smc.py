"""USGS SMC: one component of acceleration (cm/s2), velocity (cm/s) or displacement (cm)."""

import re
from datetime import UTC, datetime, timedelta
from typing import Any

from obspy import Stream, UTCDateTime

from per_obspy.checks import FloatArray
from per_obspy.formats.text.header import first_known, scale, word_in
from per_obspy.formats.text.lines import (
    Text,
    WaveformFile,
    block_lines,
    count,
    fixed_block,
    head_lines,
    interval,
    line_at,
    match_line,
    no_more,
    read_text,
    refuse,
)
from per_obspy.formats.text.vocabulary import Words, coordinates, horizontal, trace
from per_obspy.formats.text.volumes import Film, read_film

_TEXT_LINES, _INTEGER_LINES, _HEADER_LINES = 11, 6, 27
_INTEGERS, _REALS = 48, 50
_WIDTH, _PER_LINE = 10, 8  # of integers and samples
_NO_INTEGER, _NO_REAL = -32768, 1e38
_RAW = "UNCORRECTED ACCELEROGRAM"
_KINDS = {
    _RAW: {"processing_level": "raw"},
    "CORRECTED ACCELEROGRAM": {"processing_level": "processed"},
    "VELOCITY": {"processing_level": "processed", "quantity": "velocity", "units": "m/s"},
    "DISPLACEMENT": {"processing_level": "processed", "quantity": "displacement", "units": "m"},
}
_TITLE = re.compile(rf"^[1-4] ({'|'.join(_KINDS)})\s*+$")
_STATION = re.compile(r"station = (.*?)\s*+component=")
_MODEL = re.compile(r"inst type=(.*?)\s++data source = (.*)")
_CENTIMETRE = 0.01  # m


def is_smc(file: WaveformFile) -> bool:
    """Check whether a file starts like SMC."""
    lines = head_lines(file, 200)
    return len(lines) > 2 and bool(_TITLE.match(lines[0])) and lines[1].startswith("*")


def read_smc(file: WaveformFile, **_unused: Any) -> Stream:
    """Read SMC: one component, m/s2, m/s or m."""
    text = read_text(file)
    title = match_line(text, 0, "title", _TITLE, "{} is not that of a time series")[1]
    line_at(text, _TEXT_LINES, "integers")
    # Integers and reals of the header, where they are known
    whole = fixed_block(text, _TEXT_LINES, _INTEGERS, _WIDTH, _PER_LINE)
    real = fixed_block(text, _TEXT_LINES + _INTEGER_LINES, _REALS, 15, 5)
    integers = [None if number == _NO_INTEGER else int(number) for number in whole]
    reals = [float(number) if abs(number) < _NO_REAL else None for number in real]
    samples = count(text, _TEXT_LINES + 2, "number of samples", f"{whole[16]:.17g}")
    # Samples follow the comments
    first = _HEADER_LINES + max(integers[15] or 0, 0)
    values, dt, film = _samples(text, first, samples, title, float(real[1]))
    words = _station(text, integers, reals) | _motion(text, integers, reals) | film
    return Stream([trace(_CENTIMETRE * values, dt, words | _KINDS[title], text.name)])


def _samples(
    text: Text, first: int, samples: int, title: str, rate: float
) -> tuple[FloatArray, float, Words]:
    """Return the samples, their interval, s, and the words of film: uncorrected without a rate."""
    if title == _RAW and not abs(rate) < _NO_REAL:
        return _film(text, first, samples)[:3]
    rate = interval(text, _TEXT_LINES + _INTEGER_LINES, "sampling rate", rate)
    values = fixed_block(text, first, samples, _WIDTH, _PER_LINE)
    # The samples end the file
    no_more(text, first + block_lines(samples, _PER_LINE), samples)
    return values, 1 / rate, {}


def _film(text: Text, first: int, samples: int) -> Film:
    """Return a digitised trace, whose header counts the pairs or the numbers in them."""
    # The length of the file decides which of both it counts; most files of the USGS have a line
    # more, whose times come after a pause
    lines = len(text.lines) - first
    of_numbers, of_pairs = (block_lines(size, _PER_LINE) for size in (samples, 2 * samples))
    if samples % 2 == 0 and lines in (of_numbers, of_numbers + 1) and lines < of_pairs:
        samples //= 2
    film = read_film(text, first, samples, _WIDTH, _PER_LINE // 2)
    if len(text.lines) == film.next_line + 1:
        film.words["notes"].append("a line after the last pair is left out")
    else:
        no_more(text, film.next_line, samples)
    return film


def _station(text: Text, integers: list[int | None], reals: list[float | None]) -> Words:
    """Return codes, name, place and instrument of the station."""
    model = _MODEL.match(text.lines[7])
    # Where the station has no number, its code is in the text
    number = integers[29]
    return {
        "network": "NP" if (word_in(model, 2) or "").strip() == "USGS" else None,
        "station": text.lines[2].strip() if number is None else str(number),
        "station_name": word_in(_STATION.match(text.lines[5])),
        "coordinates": coordinates(*reals[10:13]),
        "instrument": {
            "model": word_in(model),
            "natural_frequency": reals[21],
            "damping": reals[22],
        },
    }


def _motion(text: Text, integers: list[int | None], reals: list[float | None]) -> Words:
    """Return time, filter, peak, event and direction of a record."""
    peaks = [abs(extreme) for extreme in (reals[29], reals[31]) if extreme is not None]
    # Numbers that are unknown are dropped from the trace
    return {
        "starttime": _start(text, integers),
        "corners": {"highpass": reals[32], "lowpass": reals[34]},
        "header_peak": scale(max(peaks, default=None), _CENTIMETRE),
        # Magnitude: moment, or else local, or else surface wave
        "event": {
            "latitude": reals[2],
            "longitude": reals[3],
            "depth": scale(reals[4], 1000),
            "magnitude": first_known((reals[5], reals[7], reals[6])),
        },
        **_direction(integers),
    }


def _start(text: Text, integers: list[int | None]) -> UTCDateTime | None:
    """Return the time of the first sample, whose date is year and day of the year."""
    year, day, hour, minute, second, millisecond = integers[1:7]
    if year is None or day is None or hour is None or minute is None:
        return None
    # Seconds and their fraction may be missing
    try:
        return UTCDateTime(
            datetime(year, 1, 1, tzinfo=UTC)
            + timedelta(day - 1, second or 0, 0, millisecond or 0, minute, hour)
        )
    except (ValueError, OverflowError) as error:
        refuse(text, _TEXT_LINES, "time", f"{year} day {day} is no date ({error})")


def _direction(integers: list[int | None]) -> dict[str, float]:
    """
    Return the orientation.

    In the first number 0 is up, 180 is down, and 90 leaves the azimuth to the second.
    """
    vertical, azimuth = integers[12:14]
    if vertical in (0, 180):
        return {"sensor_dip": -90.0 if vertical == 0 else 90.0}
    return {} if azimuth is None else horizontal(float(azimuth))
