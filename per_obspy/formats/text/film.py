"""Digitised film: times and values in turn, seven characters each, five pairs a line."""

import numpy as np

from per_obspy.checks import FloatArray
from per_obspy.formats.text.lines import Text, block_lines, fixed_block, interval, refuse

_WIDTH, _PAIRS_PER_LINE = 7, 5

#: how far the digitiser's time may wander from even spacing, as a fraction of the duration
_DRIFT = 0.001


def pair_lines(samples: int) -> int:
    """Return how many lines the pairs take."""
    return block_lines(samples, _PAIRS_PER_LINE)


def read_pairs(text: Text, line: int, samples: int) -> tuple[FloatArray, float]:
    """
    Return the values and their mean interval, s.

    The times are rounded to 1 ms and corrected for the speed of the film, and a sample or two may
    be missing where two pictures join; so single intervals vary. Times that stand still, go back or
    drift away are refused.
    """
    pairs = fixed_block(text, line, 2 * samples, _WIDTH, 2 * _PAIRS_PER_LINE).reshape(-1, 2)
    times = pairs[:, 0]
    dt = float(times[-1] - times[0]) / max(samples - 1, 1)
    dt = interval(text, line, "mean interval", dt)
    steps = np.diff(times)
    drift = np.abs(times - times[0] - dt * np.arange(samples))[1:]
    wrong = (steps <= 0) | (drift > _DRIFT * dt * samples + dt)
    if wrong.any():
        index = int(np.argmax(wrong)) + 1
        place = line + index // _PAIRS_PER_LINE
        refuse(
            text,
            place,
            f"time {index + 1}",
            f"{times[index]:g} s breaks the mean interval of {dt:g} s",
        )
    return pairs[:, 1], dt
