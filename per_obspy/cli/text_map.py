"""Maps of coordinates in text: one character per cell, the same scale in both directions."""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from per_obspy.constants import METRES_PER_DEGREE

#: Cells of a map, and how much higher than wide a character is.
COLUMNS, ROWS, TALL = 64, 9, 2.0

#: Fewest columns and rows, for the labels.
FEWEST_COLUMNS, FEWEST_ROWS = 40, 3

#: Smallest width of a map, m: a single place is no scale.
SMALLEST = 100.0

#: Character of a cell by the number of its points, from that number on.
COUNTS = {1: ".", 2: "o", 10: "O", 100: "@"}

#: Meaning of these characters.
LEGEND = ". 1   o 2-9   O 10-99   @ 100 or more"

Places = tuple[Sequence[float], Sequence[float]]


def text_map(layers: Mapping[str, Places]) -> list[str]:
    """
    Return a map as lines of text.

    Parameters
    ----------
    layers : mapping
        Sign of a layer -> longitudes and latitudes, degrees. The layer of an empty sign is drawn by
        the number of its points in each cell; signs of others cover it.

    Returns
    -------
    lines : list of str
        Frame with degrees and scale; empty if fewer than two places are known.
    """
    # One place, or the same one several times, has no scale
    known = {sign: _finite(places) for sign, places in layers.items()}
    points = [point for layer in known.values() for point in layer]
    if len(set(points)) < 2:
        return []
    frame, cell = _frame_around(points)
    lines = _framed(_drawn(known, frame), frame, cell)
    return lines + ([f"{'':11}{LEGEND}"] if known.get("") else [])


class _Frame(NamedTuple):
    """Centre (degrees), degrees per column and row, and number of columns and rows of a map."""

    centre: tuple[float, float]
    step: tuple[float, float]
    size: tuple[int, int]


def _frame_around(points: Sequence[tuple[float, float]]) -> tuple[_Frame, float]:
    """Return the frame of a map around its points, and the width of a column, m."""
    east = _unwrapped([longitude for longitude, _ in points])
    north = [latitude for _, latitude in points]
    centre = (min(east) + max(east)) / 2.0, (min(north) + max(north)) / 2.0
    # The same metres per column and, but for the height of a character, per row
    degree = max(math.cos(math.radians(centre[1])), 1e-6) * METRES_PER_DEGREE
    width, height = (max(east) - min(east)) * degree, (max(north) - min(north)) * METRES_PER_DEGREE
    cell = max(width / (COLUMNS - 1), height / (TALL * (ROWS - 1)), SMALLEST / COLUMNS)
    # As many columns and rows as the points need
    columns = max(FEWEST_COLUMNS, math.ceil(width / cell) + 1)
    rows = max(FEWEST_ROWS, math.ceil(height / (TALL * cell)) + 1)
    return _Frame(centre, (cell / degree, TALL * cell / METRES_PER_DEGREE), (columns, rows)), cell


def _finite(places: Places) -> list[tuple[float, float]]:
    """Return the places with finite coordinates."""
    pairs = zip(*places, strict=True)
    return [(float(x), float(y)) for x, y in pairs if math.isfinite(x) and math.isfinite(y)]


def _unwrapped(longitudes: Sequence[float]) -> list[float]:
    """Return longitudes without a jump at the date line if their range becomes smaller."""
    turned = [longitude % 360.0 for longitude in longitudes]
    is_closer = max(turned) - min(turned) < max(longitudes) - min(longitudes)
    return turned if is_closer else list(longitudes)


def _drawn(layers: Mapping[str, Sequence[tuple[float, float]]], frame: _Frame) -> list[list[str]]:
    """Return the characters of a map, one text per row, from north to south."""
    columns, rows = frame.size
    grid = [[" "] * columns for _ in range(rows)]
    counts: dict[tuple[int, int], int] = {}
    for sign, points in layers.items():
        for longitude, latitude in points:
            # The nearer way around the Earth
            east = (longitude - frame.centre[0] + 180.0) % 360.0 - 180.0
            column = round((columns - 1) / 2.0 + east / frame.step[0])
            row = round((rows - 1) / 2.0 - (latitude - frame.centre[1]) / frame.step[1])
            # Rounding may lead over the edge
            row, column = min(max(row, 0), rows - 1), min(max(column, 0), columns - 1)
            number = counts[row, column] = counts.get((row, column), 0) + (sign == "")
            grid[row][column] = sign or _count_sign(number)
    return grid


def _count_sign(number: int) -> str:
    """Return the character for the number of points in a cell."""
    return [sign for least, sign in COUNTS.items() if number >= least][-1]


def _framed(grid: Sequence[Sequence[str]], frame: _Frame, cell: float) -> list[str]:
    """Return the lines of a map with latitudes at the left and longitudes below."""
    rows = frame.size[1]
    # Three latitudes are enough
    labelled = {0, rows // 2, rows - 1}
    lines = []
    for row, cells in enumerate(grid):
        latitude = frame.centre[1] + ((rows - 1) / 2.0 - row) * frame.step[1]
        label = f"{latitude:9.4f}" if row in labelled else " " * 9
        lines.append(f"{label} |{''.join(cells)}|")
    return [*lines, _footer(frame, cell)]


def _footer(frame: _Frame, cell: float) -> str:
    """Return the line with the longitudes of the first and last column and the size of a column."""
    columns = frame.size[0]
    half = (columns - 1) / 2.0 * frame.step[0]
    ends = (frame.centre[0] - half, frame.centre[0] + half)
    west, east = (f"{(one + 180.0) % 360.0 - 180.0:.4f}" for one in ends)
    # Kilometres where they are whole ones
    is_large = cell >= 1000.0
    size = f"{_rounded(cell / 1000.0)} km" if is_large else f"{_rounded(cell)} m"
    return f"{'':10} {west:<10}{f'1 column {size}':^{columns - 20}}{east:>10}"


def _rounded(value: float) -> str:
    """Return a positive number with two digits and without an exponent."""
    return f"{value:.1f}" if value < 10.0 else f"{float(f'{value:.2g}'):.0f}"
