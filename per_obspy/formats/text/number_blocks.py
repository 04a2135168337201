"""Blocks of samples below a title such as ``7808 points of accel data equally spaced at .010 sec``."""

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

_POINTS = re.compile(rf"\s*(\d+)\s+(?:ACCELEROGRAM )?POINTS\b.*?\bAT\s+{DECIMAL}\s*(PTS/SEC|SEC)\b")
_WIDTHS = re.compile(r"\((\d+)F(\d+)\.\d+\)")


def is_title(line: str) -> bool:
    """Tell whether a line is the title of a block."""
    return bool(_POINTS.match(line.upper()))


def titled_block(
    text: Text, line: int, kind: str, per_line: int, width: int
) -> tuple[FloatArray, float, int]:
    """
    Return the samples, their interval in s and the line after them.

    Parameters
    ----------
    text : Text
        The file.
    line : int
        Where the title stands.
    kind : str
        A word that the title must hold, in capitals.
    per_line, width : int
        Numbers of a full line, characters of a number: where the title has no FORTRAN format.
    """
    name = f"title of {kind.lower() or 'samples'}"
    title = line_at(text, line, name).upper()
    points, widths = _POINTS.match(title), _WIDTHS.search(title)
    if points is None or kind not in title:
        refuse(text, line, name, f"expected points at an interval, got {title.strip()[:60]!r}")
    samples = count(text, line, "number of points", points[1])
    spacing = interval(text, line, "interval", points[2])
    if widths:
        per_line, width = (count(text, line, "format", part) for part in widths.groups())
    values = fixed_block(text, line + 1, samples, width, per_line)
    return (
        values,
        1 / spacing if points[3] == "PTS/SEC" else spacing,
        line + 1 + block_lines(samples, per_line),
    )
