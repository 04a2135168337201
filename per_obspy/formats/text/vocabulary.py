"""
The words that every format plugin puts into ``trace.stats``, and the few conversions that they need.

==============================
================================================================================ word
meaning ==============================
================================================================================ network, station,
location     codes of the header; location tells instruments of one station apart channel
SEED code from sampling rate and orientation, instrument code N (accelerometer) starttime, delta
UTC; s. Unknown: 1970-01-01, ObsPy's default; a date without a time gives midnight units
``"m/s2"``, ``"m/s"``, ``"m"``, or ``"counts"`` with the gain in ``calib`` (m/s2 a count) quantity
``"acceleration"``, ``"velocity"`` or ``"displacement"`` processing_level               ``"raw"`` or
``"processed"`` coordinates                    latitude, longitude (degrees), elevation (m)
sensor_location                where in the structure or the ground, as the header has it
sensor_azimuth, sensor_dip     degrees clockwise from north (horizontals only); degrees down from
horizontal (0; up
                               is -90)
corners                        highpass, lowpass: corners of the filter that was applied, Hz
instrument                     model, serial, natural_frequency (Hz), damping (fraction of
critical),
                               sensitivity (V/(m/s2))
event                          name, time (UTC), latitude, longitude (degrees), depth (m), magnitude
station_name                   as the header has it site_class, vs30               of the ground as
the metadata have it: any word; m/s header_peak                    largest absolute value according
to the header, in ``units`` ==============================
================================================================================

What a file does not say is absent: never a guess, never zero. Coordinates 0, 0 are what files write
for unknown.
"""

import math
import re
from collections.abc import Mapping
from datetime import UTC, datetime, timedelta
from typing import Any

from obspy import Trace, UTCDateTime
from obspy.core import AttribDict

from per_obspy.checks import FloatArray
from per_obspy.formats.text.lines import Text, refuse

#: words for a vertical sensor -> its dip, degrees down from horizontal
VERTICAL_DIPS = {
    **dict.fromkeys(
        ("UP", "UPDO", "U", "Z", "V", "VER", "VERT", "VERTICAL", "UD", "U-D", "VRT", "VRTC"), -90.0
    ),
    **dict.fromkeys(("DOWN", "DWN", "DN", "-UP", "D"), 90.0),
}

#: words for the points of the compass -> degrees clockwise from north
COMPASS_AZIMUTHS = {
    **dict.fromkeys(("N", "NS", "N-S", "SN", "NORTH"), 0.0),
    **dict.fromkeys(("E", "EW", "E-W", "WE", "EAST"), 90.0),
    **dict.fromkeys(("S", "SOUTH"), 180.0),
    **dict.fromkeys(("W", "WEST"), 270.0),
}

_CODES = ("network", "station", "location", "channel")
_QUADRANT = re.compile(r"([NS])\s*(\d{1,2}(?:\.\d*)?)\s*([EW])")
_QUADRANT_AZIMUTHS = {
    "NE": (0.0, 1.0),
    "NW": (360.0, -1.0),
    "SE": (180.0, -1.0),
    "SW": (180.0, 1.0),
}


def orientation(words: str) -> dict[str, float]:
    """
    Return ``sensor_azimuth`` or ``sensor_dip`` from words such as ``N21E``, ``NS``, ``UP``, else nothing.

    >>> orientation("S 16 E"), orientation("Up"), orientation("270 DEG")
    ({'sensor_azimuth': 164.0, 'sensor_dip': 0.0}, {'sensor_dip': -90.0}, {'sensor_azimuth': 270.0,
    'sensor_dip': 0.0})
    """
    word = words.strip().upper().removesuffix("DEG").rstrip(" .")
    if word in VERTICAL_DIPS:
        return {"sensor_dip": VERTICAL_DIPS[word]}
    if word in COMPASS_AZIMUTHS:
        return horizontal(COMPASS_AZIMUTHS[word])
    if quadrant := _QUADRANT.fullmatch(word):
        start, sign = _QUADRANT_AZIMUTHS[quadrant[1] + quadrant[3]]
        return horizontal(start + sign * float(quadrant[2]))
    if re.fullmatch(r"\d{1,3}(\.\d*)?", word) and float(word) <= 360:
        return horizontal(float(word))
    return {}


def horizontal(azimuth: float) -> dict[str, float]:
    """Return the words of a horizontal sensor, degrees clockwise from north."""
    return {"sensor_azimuth": azimuth % 360, "sensor_dip": 0.0}


def channel_code(sampling_rate: float, orientation: Mapping[str, float]) -> str:
    """
    Return the SEED code of an accelerometer's channel.

    North and east within 5 degrees are N and E; otherwise 1 is the horizontal nearer to the
    north-south line. An unknown orientation gives only band and instrument.

    >>> channel_code(200, horizontal(0)), channel_code(50, horizontal(118)), channel_code(100, {"sensor_dip": -90})
    ('HNN', 'BN2', 'HNZ')
    """
    bands = ((1000.0, "F"), (250.0, "C"), (80.0, "H"), (10.0, "B"), (0.0, "M"))
    band = next(code for rate, code in bands if round(sampling_rate, 3) >= rate)
    if abs(orientation.get("sensor_dip", 0.0)) == 90:
        return f"{band}NZ"
    if "sensor_azimuth" not in orientation:
        return f"{band}N"
    azimuth = orientation["sensor_azimuth"]
    for letter, axis in (("N", 0.0), ("E", 90.0)):
        if abs((azimuth - axis + 180) % 360 - 180) <= 5:
            return f"{band}N{letter}"
    return f"{band}N{1 if abs(math.cos(math.radians(azimuth))) > math.sqrt(0.5) - 1e-9 else 2}"


def full_year(year: str) -> int:
    """
    Return a year of which two digits may be given: strong-motion records begin in 1933.

    >>> full_year("52"), full_year("06"), full_year("1985")
    (1952, 2006, 1985)
    """
    if len(year.strip()) > 2:
        return int(year)
    return int(year) + (2000 if int(year) < 33 else 1900)


def hemisphere(degrees: str, letter: str) -> float:
    """
    Return signed degrees.

    >>> hemisphere("117.365", "W")
    -117.365
    """
    return -float(degrees) if letter.upper() in ("S", "W") else float(degrees)


def trace(samples: FloatArray, dt: float, words: Mapping[str, Any]) -> Trace:
    """
    Return a trace with the words of the vocabulary; words that are None are left out, and so are empty groups.

    The channel code is made from rate and orientation where the header has none. Codes keep
    letters, digits, ``_`` and ``-`` only, so that they can name a file.
    """
    known = {name: _group(value) for name, value in words.items()}
    known = {
        name: value for name, value in known.items() if value is not None and value != AttribDict()
    }
    known.setdefault("channel", channel_code(1 / dt, known))
    known |= {name: re.sub(r"[^A-Za-z0-9_-]", "", known[name]) for name in _CODES if name in known}
    return Trace(data=samples, header={"delta": dt, **known})


def _group(value: Any) -> Any:
    if not isinstance(value, Mapping):
        return value
    return AttribDict({name: part for name, part in value.items() if part is not None})


def coordinates(
    latitude: float | None, longitude: float | None, elevation: float | None = None
) -> dict[str, float | None]:
    """Return the group of coordinates, degrees and m; empty where they are unknown, 0, 0 or impossible."""
    if latitude is None or longitude is None or (latitude == 0 and longitude == 0):
        return {}
    if abs(latitude) > 90 or abs(longitude) > 180:
        return {}
    return {"latitude": latitude, "longitude": longitude, "elevation": elevation}


def utc(
    text: Text,
    line: int,
    field: str,
    date: tuple[int, ...],
    clock: tuple[float, ...] = (),
    hours_ahead: float = 0.0,
) -> UTCDateTime:
    """Return a time in UTC from year, month, day and hour, minute, second of a clock that many hours ahead of UTC."""
    hour, minute, second = (*clock, 0.0, 0.0, 0.0)[:3]
    if not 1900 <= date[0] < 2100:
        refuse(text, line, field, f"{date[0]} is not a year of a record")
    try:
        year, month, day = date
        moment = datetime(year, month, day, tzinfo=UTC) + timedelta(
            hours=hour - hours_ahead, minutes=minute, seconds=second
        )
    except (ValueError, OverflowError, TypeError) as error:
        refuse(text, line, field, f"{date} {clock} is not a time ({error})")
    return UTCDateTime(moment)
