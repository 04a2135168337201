"""Blocks of samples below a title, as ``7808 points of accel data equally spaced at .010 sec``."""

import re

from per_obspy.checks import FloatArray
from per_obspy.formats.text.lines import (
    DECIMAL,
    Text,
    block_lines,
    count,
    fixed_block,
    interval,
    line_at,
    refuse,
)

_POINTS = re.compile(
    rf"\s*+(\d{{1,12}})\s++(?:ACCELEROGRAM )?POINTS\b.*?\bAT\s++{DECIMAL}\s*+(PTS/SEC|SEC)\b"
)
_WIDTHS = re.compile(r"\((\d{1,4})F(\d{1,4})\.\d{1,4}\)")


def is_title(line: str) -> bool:
    """Check whether a line is the title of a block."""
    return bool(_POINTS.match(line.upper()))


def titled_block(
    text: Text, line: int, kind: str, per_line: int, width: int
) -> tuple[FloatArray, float, int]:
    """
    Read a block of samples below its title.

    Parameters
    ----------
    text : Text
        The file.
    line : int
        Line of the title.
    kind : str
        A word that the title must hold, in capitals.
    per_line, width : int
        Numbers of a full line, characters of a number: where the title has no FORTRAN format.

    Returns
    -------
    samples : (n_samples,) ndarray
        In the unit of the file.
    dt : float
        Sampling interval, s.
    next_line : int
        Line after the block.
    """
    samples, dt = _announced(text, line, kind)
    # A FORTRAN format in the title takes the place of the usual one
    layout = _WIDTHS.search(text.lines[line].upper())
    if layout:
        per_line = count(text, line, "format", layout[1])
        width = count(text, line, "format", layout[2])
    values = fixed_block(text, line + 1, samples, width, per_line)
    return values, dt, line + 1 + block_lines(samples, per_line)


def _announced(text: Text, line: int, kind: str) -> tuple[int, float]:
    """Return the number of samples and the interval, s, that a title announces."""
    name = f"title of {kind.lower() or 'samples'}"
    title = line_at(text, line, name).upper()
    points = _POINTS.match(title)
    if points is None or kind not in title:
        refuse(text, line, name, f"expected points at an interval, got {title.strip()[:60]!r}")
    # Some titles give the sampling rate instead of the interval
    samples = count(text, line, "number of points", points[1])
    spacing = interval(text, line, "interval", points[2])
    return samples, 1 / spacing if points[3] == "PTS/SEC" else spacing
