"""The parts of made-up files: a motion, blocks of numbers as FORTRAN writes them, expectations."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Samples = NDArray[np.float64]

_HALF = np.array([0.5, -1.25, 2.0, -3.75, 4.0, 0.0, 1.5, -0.25, 0.75, -2.5, 3.25, -1.0, 0.125])

#: In the unit of the file, so that a reader's factor shows.
MOTION = np.concatenate((_HALF, _HALF[:10] / 2))

GRAVITY = 9.80665  # m/s2, by definition


class Sample(NamedTuple):
    """
    A file and its content.

    Attributes
    ----------
    name : str
        Of the format.
    text : str
        Of the file.
    ids : tuple of str
        ``NET.STA.LOC.CHA`` of the traces.
    values : tuple of ndarray
        Samples of the traces, ``units``.
    dt : float
        Sampling interval, s.
    azimuths, dips : tuple of (float or None)
        Of the sensors, degrees.
    level, units : str
        Words of the vocabulary.
    start : str or None
        Time of the first sample, UTC.
    coordinates : (float, float) or None
        Latitude and longitude, degrees.
    """

    name: str
    text: str
    ids: tuple[str, ...]
    values: tuple[Samples, ...]
    dt: float
    azimuths: tuple[float | None, ...]
    dips: tuple[float | None, ...]
    level: str
    units: str = "m/s2"
    start: str | None = None
    coordinates: tuple[float, float] | None = None


def block(values: Samples | Sequence[float], layout: str, per_line: int) -> str:
    """Write numbers as FORTRAN does."""
    fields = [layout % value for value in values]
    rows = ["".join(fields[first : first + per_line]) for first in range(0, len(fields), per_line)]
    return "\n".join(rows)


def columns(values: Samples, layout: str) -> list[str]:
    """Write one line per row of a table, all columns in one layout."""
    return [block(row, layout, len(row)) for row in values]


def film(values: Samples, dt: float, indent: str = "") -> str:
    """Write digitised film: times and values in turn."""
    times = np.arange(len(values)) * dt
    lines = block(np.column_stack((times, values)).ravel(), "%7.3f", 10).split("\n")
    return "\n".join(indent + line for line in lines)


def integers_and_reals(count: int, reals: dict[int, float] | None = None) -> list[str]:
    """Write 100 integers that are 0, and real numbers that are 0 but for those given by index."""
    values = [0.0] * count
    for index, value in (reals or {}).items():
        values[index] = value
    return [block([0] * 100, "%5d", 16), block(values, "%10.4f", 8)]


def three_columns(motion: Samples) -> Samples:
    """Return the samples of three components, one column each."""
    return np.column_stack((motion, -motion, motion / 2))
