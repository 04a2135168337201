"""
Parts of rows of buildings: a gap that never closes divides a row.

The buildings on both sides of such a gap move as if it were not there. So the motions of both
parts, each computed alone, are the motion of the row wherever their largest displacements together
stay below the gap: this motion satisfies every equation of the row, which has one solution only.
Where they may close the gap, the two parts are one, and are computed again.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.pounding.history.rows.row_tables import (
    BUILDING_FIELDS,
    BuildingRows,
    with_ends,
)

IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

#: Share of a gap that largest displacements have to leave open: more than their rounding.
LEAST_OPENING = 1e-9


def stays_open(rows: BuildingRows, displacement: FloatArray) -> BoolArray:
    """
    Return after which buildings a row is divided, by the largest displacements on both sides.

    Parameters
    ----------
    rows : BuildingRows
        Checked.
    displacement : (n_buildings,) ndarray
        Largest ``|D|`` of every building, m.

    Returns
    -------
    (n_buildings,) ndarray of bool
        Whether the gap to the next building stays open, or there is none.
    """
    reach = rows.participation_right * displacement
    other = np.append((rows.participation_left * displacement)[1:], 0.0)
    is_open = reach + other < (1.0 - LEAST_OPENING) * rows.gap
    is_open[rows.first[1:] - 1] = True
    return np.asarray(is_open)


def parts_of(rows: BuildingRows, is_end: BoolArray, chosen: BoolArray) -> BuildingRows:
    """
    Return parts of rows as rows.

    Parameters
    ----------
    rows : BuildingRows
        Checked.
    is_end : (n_buildings,) ndarray of bool
        Whether a part ends with the building; true for the last one of each row.
    chosen : (n_buildings,) ndarray of bool
        Buildings of the parts, of which all are chosen or none.
    """
    fields = {name: getattr(rows, name)[chosen] for name in BUILDING_FIELDS}
    ends = np.flatnonzero(is_end[chosen]) + 1
    # The axis of a part is that of its row
    azimuth = np.repeat(rows.azimuth, np.diff(rows.first))[chosen]
    return with_ends(BuildingRows(np.append(0, ends), **fields, azimuth=azimuth[ends - 1]))


def run_in_parts(
    rows: BuildingRows,
    maxima: FloatArray,
    run: Callable[[BuildingRows], FloatArray],
    with_pairs: bool,
) -> FloatArray:
    """
    Compute the maxima of rows by their parts, and those of pairs of neighbours alone.

    A part of two buildings is a pair alone, and is computed once for both.

    Parameters
    ----------
    rows : BuildingRows
        Checked.
    maxima : (n_buildings, n_maxima) ndarray
        Maxima of every building alone, its displacement first; then those in its row.
    run : callable
        Return the maxima of checked rows of two buildings and more.
    with_pairs : bool
        Whether pairs of longer parts are computed too.

    Returns
    -------
    (n_buildings, 2, n_maxima) ndarray
        Maxima of each building and the next one without the others of their row: without contact
        where their gap stays open, and where the pair is not computed.
    """
    is_end = stays_open(rows, maxima[:, 0])
    number = _number_in_part(is_end)
    # Parts of two among the pairs that may meet
    two = np.flatnonzero(~is_end & (number == 2))
    pairs = _pairs_alone(rows, maxima, run, np.flatnonzero(~is_end) if with_pairs else two)
    maxima[two], maxima[two + 1] = pairs[two, 0], pairs[two, 1]

    # Longer parts, then those with gaps that these motions may close
    waiting = number > 2
    while True:
        if waiting.any():
            maxima[waiting] = run(parts_of(rows, is_end, waiting))
        closes = is_end & ~stays_open(rows, maxima[:, 0])
        if not closes.any():
            return pairs
        is_end &= ~closes
        waiting = _in_parts_of(is_end, closes)


def _pairs_alone(
    rows: BuildingRows,
    maxima: FloatArray,
    run: Callable[[BuildingRows], FloatArray],
    left: IntArray,
) -> FloatArray:
    """Return the maxima of all buildings with the next ones, those of some pairs in contact."""
    last = len(maxima) - 1
    after = np.minimum(np.arange(1, len(maxima) + 1), last)
    pairs = np.stack([maxima, maxima[after]], axis=1)
    if left.size:
        pairs[left] = run(_pairs_of(rows, left)).reshape(left.size, 2, -1)
    return pairs


def _pairs_of(rows: BuildingRows, left: IntArray) -> BuildingRows:
    """Return some buildings, each with the next one, as rows of two."""
    both = np.stack([left, left + 1], axis=1).ravel()
    fields = {name: getattr(rows, name)[both] for name in BUILDING_FIELDS}
    azimuth = np.repeat(rows.azimuth, np.diff(rows.first))[left]
    return with_ends(BuildingRows(2 * np.arange(left.size + 1), **fields, azimuth=azimuth))


def _part_of(is_end: BoolArray) -> IntArray:
    """Return the number of the part of each building."""
    return np.append(0, np.cumsum(is_end[:-1]))


def _number_in_part(is_end: BoolArray) -> IntArray:
    """Return the number of buildings in the part of each building."""
    part = _part_of(is_end)
    return np.bincount(part)[part]


def _in_parts_of(is_end: BoolArray, some: BoolArray) -> BoolArray:
    """Return the buildings of all parts with some of the buildings."""
    part = _part_of(is_end)
    return np.bincount(part, weights=some)[part] > 0.0
