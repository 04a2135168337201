"""Digitised film: times and values in turn, seven characters each, five pairs per line."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.formats.text.lines import Text, block_lines, fixed_block, interval, refuse

_WIDTH, _PAIRS_PER_LINE = 7, 5

#: largest part of the times that may run back, and their number that always may
_BACK, _FEW_BACK = 0.02, 2

#: longest step between two times, in mean intervals; a longer one is a hole in the record
_LONGEST_STEP = 50

#: longest interval of interpolated film, s; finer ones are its halves, quarters and so on, so that
#: the components of a record share theirs
_INTERVAL = 0.02


class Film(NamedTuple):
    """
    A digitised trace on even steps.

    Attributes
    ----------
    values : (n_samples,) ndarray
        In the unit of the file.
    dt : float
        Interval, s.
    words : dict
        ``digitised`` and ``notes`` in the vocabulary of ``formats/text/vocabulary.py``.
    """

    values: FloatArray
    dt: float
    words: dict[str, Any]


def film_lines(samples: int) -> int:
    """Return the number of lines of a digitised trace."""
    return block_lines(samples, _PAIRS_PER_LINE)


def read_film(text: Text, line: int, samples: int) -> Film:
    """
    Read a digitised trace.

    Parameters
    ----------
    text : Text
        The file.
    line : int
        Line of the first time.
    samples : int
        Pairs of time and value, dimensionless.

    Returns
    -------
    film : Film
        As :func:`even_film` gives it.
    """
    pairs = fixed_block(text, line, 2 * samples, _WIDTH, 2 * _PAIRS_PER_LINE).reshape(-1, 2)
    return even_film(text, line, pairs, _PAIRS_PER_LINE)


def even_film(text: Text, line: int, pairs: FloatArray, per_line: int) -> Film:
    """
    Return digitised times and values on even steps.

    The times are rounded and corrected for the speed of the film, a sample or two may be missing
    where two pictures join, and some operators digitised turning points only. Where every time is
    within half a mean interval of its even place, the values are kept and have the mean interval.
    Otherwise they are interpolated linearly onto steps of 0.02, 0.01, 0.005 ... s, the first that
    is not longer than the mean interval. A time that does not grow is left out and noted; a hole
    in the record or many such times are refused.

    Parameters
    ----------
    text, line
        File and line of the first time, for messages.
    pairs : (n_samples, 2) ndarray
        Times, s, and values.
    per_line : int
        Pairs on a line, dimensionless.
    """
    places = _growing(text, line, pairs[:, 0], per_line)
    times, values = pairs[places].T
    # The mean interval, and the deviation from the even time axis that it gives
    mean = interval(text, line, "mean interval", _mean_step(times))
    _refuse_holes(text, line, places, times, per_line)
    deviation = float(np.abs(times - times[0] - mean * np.arange(len(times))).max())
    # Film is marked as such, with everything that was done to it
    notes = [f"digitised film, times up to {deviation:.3g} s off a mean interval of {mean:.6g} s"]
    if len(times) < len(pairs):
        notes.append(f"{len(pairs) - len(times)} times of the film run back and are left out")
    dt, samples = mean, np.ascontiguousarray(values)
    if deviation > mean / 2:
        samples, dt = _interpolated(times, values, mean)
        notes.append(f"interpolated linearly onto steps of {dt:g} s")
    return Film(samples, dt, {"digitised": True, "notes": notes})


def _mean_step(times: FloatArray) -> float:
    """Return the mean step of times, s; zero of a single one."""
    return float(times[-1] - times[0]) / max(len(times) - 1, 1)


def _interpolated(times: FloatArray, values: FloatArray, mean: float) -> tuple[FloatArray, float]:
    """Return values on even steps and their interval, s, which is not above the mean one."""
    # A mean interval that is longer by rounding only does not halve the steps
    halvings = int(np.ceil(np.log2(_INTERVAL / mean) - 1e-3))
    dt = _INTERVAL / 2 ** max(halvings, 0)
    even = times[0] + dt * np.arange(int((times[-1] - times[0]) / dt + 1e-6) + 1)
    return np.interp(even, times, values), dt


def _growing(text: Text, line: int, times: FloatArray, per_line: int) -> NDArray[np.intp]:
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


def _refuse_holes(
    text: Text, line: int, places: NDArray[np.intp], times: FloatArray, per_line: int
) -> None:
    """Refuse the first step that is so long that a part of the record is missing."""
    steps, mean = np.diff(times), _mean_step(times)
    # Places count the times that were left out
    if steps.max() > _LONGEST_STEP * mean:
        index = int(np.argmax(steps > _LONGEST_STEP * mean)) + 1
        problem = f"{times[index]:g} s follows {times[index - 1]:g} s, the mean interval is"
        place = int(places[index])
        refuse(text, line + place // per_line, f"time {place + 1}", f"{problem} {mean:g} s")
