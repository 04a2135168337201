"""Digitised film: times and values in turn, seven characters each, five pairs per line."""

import numpy as np

from per_obspy.checks import FloatArray
from per_obspy.formats.text.lines import Text, block_lines, fixed_block, interval, refuse

_WIDTH, _PAIRS_PER_LINE = 7, 5

#: largest deviation of the digitiser's time from even spacing, as a fraction of the duration
_DRIFT = 0.001


def film_lines(samples: int) -> int:
    """Return the number of lines of a digitised trace."""
    return block_lines(samples, _PAIRS_PER_LINE)


def read_film(text: Text, line: int, samples: int) -> tuple[FloatArray, float]:
    """
    Read the values of a digitised trace and their mean interval.

    The times are rounded to 1 ms and corrected for the speed of the film, and a sample or two may
    be missing where two pictures join; so single intervals vary. Times that repeat, go back or
    drift away are refused.

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
    values : (samples,) ndarray
        In the unit of the file.
    dt : float
        Mean interval, s.
    """
    pairs = fixed_block(text, line, 2 * samples, _WIDTH, 2 * _PAIRS_PER_LINE).reshape(-1, 2)
    # The mean interval replaces the single ones
    times = pairs[:, 0]
    mean = float(times[-1] - times[0]) / max(samples - 1, 1)
    dt = interval(text, line, "mean interval", mean)
    _refuse_uneven(text, line, times, dt)
    return pairs[:, 1], dt


def _refuse_uneven(text: Text, line: int, times: FloatArray, dt: float) -> None:
    """Refuse the first time that does not grow or deviates too far from even spacing."""
    samples = len(times)
    steps = np.diff(times)
    # Deviation from the even time axis of the mean interval
    drift = np.abs(times - times[0] - dt * np.arange(samples))[1:]
    wrong = (steps <= 0) | (drift > _DRIFT * dt * samples + dt)
    if wrong.any():
        index = int(np.argmax(wrong)) + 1
        problem = f"{times[index]:g} s breaks the mean interval of {dt:g} s"
        refuse(text, line + index // _PAIRS_PER_LINE, f"time {index + 1}", problem)
