"""
Samples and header lines of volumes 1 and 2, the tradition of Caltech that many agencies follow.

Blocks of samples have a title, as ``7808 points of accel data equally spaced at .010 sec``, or are
digitised film: times and values in turn, seven characters each, five pairs per line.
"""

import re
from re import Pattern
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.formats.text.header import number_in
from per_obspy.formats.text.lines import (
    DECIMAL,
    Text,
    block_lines,
    count,
    fixed_block,
    interval,
    line_at,
    match_line,
    refuse,
)
from per_obspy.formats.text.vocabulary import Words

_TITLE = re.compile(
    rf"\s*+(\d{{1,12}})\s++(?:ACCELEROGRAM )?POINTS\b.*?\bAT\s++{DECIMAL}\s*+(PTS/SEC|SEC)\b"
)
_WIDTHS = re.compile(r"\((\d{1,4})F(\d{1,4})\.\d{1,4}\)")
_POINTS = re.compile(r"^\s*+NO\. OF POINTS\s*+=\s*+(\S+)", re.IGNORECASE)
_SENSOR = re.compile(
    rf"INSTR PERIOD\s*+[=:]\s*+{DECIMAL}\s*+S(?:EC)?,?\s*+DAMPING\s*+[=:]\s*+{DECIMAL}",
    re.IGNORECASE,
)

#: characters of a number of film, pairs on a line
_WIDTH, _PAIRS_PER_LINE = 7, 5

#: largest part of the times that may run back, and their number that always may
_BACK, _FEW_BACK = 0.02, 2

#: longest step between two times, in mean intervals; a longer one is a hole in the record
_LONGEST_STEP = 50

#: longest interval of interpolated film, s; finer ones are its halves, quarters and so on, so that
#: the components of a record share theirs
_INTERVAL = 0.02


def promised_points(text: Text, line: int, pattern: Pattern[str] = _POINTS) -> int:
    """Return the number of samples in the text of a header."""
    word = match_line(text, line, "number of points", pattern)[1]
    return count(text, line, "number of points", word)


def sensor_constants(line: str) -> dict[str, float | None]:
    """
    Return natural frequency, Hz, and damping, fraction of critical, of an instrument.

    >>> sensor_constants("INSTR PERIOD = .05 SEC, DAMPING = .6")
    {'natural_frequency': 20.0, 'damping': 0.6}
    """
    sensor = _SENSOR.search(line)
    period = number_in(sensor) or 0.0
    return {
        "natural_frequency": 1 / period if period > 0 else None,
        "damping": number_in(sensor, 2),
    }


def is_title(line: str) -> bool:
    """Check whether a line is the title of a block."""
    return bool(_TITLE.match(line.upper()))


def titled_block(
    text: Text, line: int, kind: str, per_line: int, width: int
) -> tuple[FloatArray, float, int]:
    """
    Read a block of samples below its title, which must hold a word in capitals.

    The title may have a FORTRAN format; else ``per_line`` numbers of a full line have ``width``
    characters each. Return the samples in the unit of the file, their interval, s, and the line
    after the block.
    """
    name = f"title of {kind.lower() or 'samples'}"
    title = line_at(text, line, name).upper()
    points = _TITLE.match(title)
    if points is None or kind not in title:
        refuse(text, line, name, f"expected points at an interval, got {title.strip()[:60]!r}")
    # Some titles give the sampling rate instead of the interval
    samples = count(text, line, "number of points", points[1])
    spacing = interval(text, line, "interval", points[2])
    dt = 1 / spacing if points[3] == "PTS/SEC" else spacing
    # A FORTRAN format in the title takes the place of the usual one
    if layout := _WIDTHS.search(title):
        per_line, width = (count(text, line, "format", word) for word in layout.groups())
    values = fixed_block(text, line + 1, samples, width, per_line)
    return values, dt, line + 1 + block_lines(samples, per_line)


def corrected_blocks(
    text: Text, line: int, kinds: tuple[str, str, str]
) -> tuple[FloatArray, float, int]:
    """
    Read acceleration, as :func:`titled_block`, in a volume 2.

    Velocity and displacement follow it and must be whole; ``kinds`` are the words of the titles.
    """
    values, dt, line = titled_block(text, line, kinds[0], 8, 10)
    # Each has a title of its own
    for kind in kinds[1:]:
        integral, _, line = titled_block(text, line, kind, 8, 10)
        if len(integral) != len(values):
            problem = f"{len(integral)} samples, acceleration has {len(values)}"
            refuse(text, line - 1, kind, problem)
    return values, dt, line


class Film(NamedTuple):
    """A digitised trace on even steps."""

    #: in the unit of the file
    values: FloatArray
    #: interval, s
    dt: float
    #: ``digitised`` and ``notes``
    words: Words
    #: line after the film
    next_line: int


def read_film(
    text: Text, line: int, samples: int, width: int = _WIDTH, per_line: int = _PAIRS_PER_LINE
) -> Film:
    """
    Read a digitised trace as :func:`even_film` gives it, from the line of the first time on.

    It has so many pairs of time and value, of ``width`` characters a number.
    """
    pairs = fixed_block(text, line, 2 * samples, width, 2 * per_line).reshape(-1, 2)
    return even_film(text, line, pairs, per_line)


def even_film(text: Text, line: int, pairs: FloatArray, per_line: int) -> Film:
    """
    Return digitised times, s, and values, (n_samples, 2), on even steps.

    The times are rounded and corrected for the speed of the film, a sample or two may be missing
    where two pictures join, and some operators digitised turning points only. Where every time is
    within half a mean interval of its even place, the values are kept and have the mean interval.
    Otherwise they are interpolated linearly onto steps of 0.02, 0.01, 0.005 ... s, the first that
    is not longer than the mean interval. A time that does not grow is left out and noted; a hole
    in the record or many such times are refused, by their line.
    """
    places = _rising_times(text, line, pairs[:, 0], per_line)
    times, values = pairs[places].T
    mean = _mean_interval(text, line, places, pairs[:, 0], per_line)
    # The largest distance from the even time axis of that interval
    deviation = float(np.abs(times - times[0] - mean * np.arange(len(times))).max())
    # Film is marked as such, with everything that was done to it
    notes = [f"digitised film, times up to {deviation:.3g} s off a mean interval of {mean:.6g} s"]
    if len(times) < len(pairs):
        notes.append(f"{len(pairs) - len(times)} times of the film run back and are left out")
    if deviation > mean / 2:
        values, mean = _interpolate(times, values, mean)
        notes.append(f"interpolated linearly onto steps of {mean:g} s")
    next_line = line + block_lines(len(pairs), per_line)
    return Film(values, mean, {"digitised": True, "notes": notes}, next_line)


def _interpolate(times: FloatArray, values: FloatArray, mean: float) -> tuple[FloatArray, float]:
    """Return values on even steps and their interval, s, which is not above the mean one."""
    # A mean interval that is longer by rounding only does not halve the steps
    halvings = int(np.ceil(np.log2(_INTERVAL / mean) - 1e-3))
    dt = _INTERVAL / 2 ** max(halvings, 0)
    even = times[0] + dt * np.arange(int((times[-1] - times[0]) / dt + 1e-6) + 1)
    return np.interp(even, times, values), dt


def _rising_times(text: Text, line: int, times: FloatArray, per_line: int) -> NDArray[np.intp]:
    """Return the places of the times that exceed all before them; few may not."""
    latest = np.maximum.accumulate(times)
    runs_back = np.append(False, times[1:] <= latest[:-1])
    back = np.flatnonzero(runs_back)
    # Many of them mean that the columns are no times
    if len(back) > max(_FEW_BACK, _BACK * len(times)):
        index = int(back[0])
        problem = f"{times[index]:g} s follows {latest[index - 1]:g} s, as {len(back)} times do"
        refuse(text, line + index // per_line, f"time {index + 1}", problem)
    return np.flatnonzero(~runs_back)


def _mean_interval(
    text: Text, line: int, places: NDArray[np.intp], times: FloatArray, per_line: int
) -> float:
    """Return the mean interval, s; refuse a step so long that a part of the record is missing."""
    steps = np.diff(times[places])
    first, last = times[places[[0, -1]]]
    mean = interval(text, line, "mean interval", float(last - first) / max(len(steps), 1))
    # Places count the times that were left out
    long = np.flatnonzero(steps > _LONGEST_STEP * mean)
    if len(long):
        before, place = places[long[0] : long[0] + 2].tolist()
        problem = f"{times[place]:g} s follows {times[before]:g} s, the mean interval is {mean:g} s"
        refuse(text, line + place // per_line, f"time {place + 1}", problem)
    return mean
