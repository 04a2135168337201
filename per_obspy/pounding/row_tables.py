"""
Rows of buildings that touch each other at different heights, as tables for the kernels.

The clearance of an interface, ``gap + b u_right - a u_left`` with a participation for each side, is
only ever compared with zero, so that it may be measured in any unit. If the clearance of
interface k is multiplied by ``c_k`` with ``c_k a_k = s_k`` and ``c_k b_(k+1) = s_(k+1)``, and the
displacement of building k by ``s_k``, both participations are 1: the row is one of plain structures
with the masses ``m_k / s_k²``, driven by ``s_k`` times the ground acceleration. The chain of these
equations always has a solution, because a row has no loop: ``c_k = c_(k-1) b_k / a_k``. Impulses
become ``J_k / c_k``, speeds at an interface ``c_k`` times as large, energies and the coefficient of
restitution stay.

A gap that never closes divides a row into parts: the buildings on both sides move as if it were not
there. So the motions of both parts, each computed alone, are the motion of the row wherever their
largest displacements together stay below the gap: this motion satisfies every equation of the row,
which has one solution only. Where they may close the gap, the two parts are one, and are computed
again.
"""

from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from per_obspy import checks
from per_obspy.checks import FloatArray

IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


class BuildingRows(NamedTuple):
    """
    Rows of buildings, one row after the other, each from its first to its last building.

    Displacements are those of the modal coordinate ``D`` of a building, which is driven by minus
    the ground acceleration: ``D'' + 2 xi w D' + w² D = -a``.

    Attributes
    ----------
    first : (n_rows + 1,) ndarray of int
        Number of the first building of each row, then the number of buildings.
    period, damping, mass : (n_buildings,) ndarray
        Undamped period (s), fraction of critical, and modal mass (kg) of the modal coordinate; the
        mass may be infinite.
    yield_displacement, hardening : (n_buildings,) ndarray
        Modal displacement at first yield (m), infinite where a building stays elastic, and
        stiffness after yielding over that before, at least 0 and below 1.
    participation_left, participation_right : (n_buildings,) ndarray
        Displacement at the contact height of the interface to the left and right neighbour over
        ``D``, dimensionless and positive; ignored where there is no neighbour.
    gap, restitution : (n_buildings,) ndarray
        Clear distance at rest (m; 0 starts in contact) and coefficient of restitution of the
        interface to the next building of the row; ignored for the last one.
    azimuth : (n_rows,) ndarray
        Of the axis from the first to the last building, degrees clockwise from north.
    """

    first: IntArray
    period: FloatArray
    damping: FloatArray
    mass: FloatArray
    yield_displacement: FloatArray
    hardening: FloatArray
    participation_left: FloatArray
    participation_right: FloatArray
    gap: FloatArray
    restitution: FloatArray
    azimuth: FloatArray


#: Fields with one value per building.
BUILDING_FIELDS = BuildingRows._fields[1:-1]


def checked_rows(rows: BuildingRows) -> BuildingRows:
    """
    Return rows with every field checked, and the fields without meaning at rest.

    Parameters
    ----------
    rows : BuildingRows
        As from a caller.

    Returns
    -------
    BuildingRows
        Participation towards a neighbour that does not exist is 1, gap and restitution after the
        last building are 1.

    Raises
    ------
    ValueError
        If a field has the wrong shape or is out of range, a row is empty, or two walls (infinite
        masses) are pressed together.
    """
    # Shapes
    first = _checked_first(rows.first)
    count = int(first[-1])
    fields = {name: checks.numbers(name, getattr(rows, name)) for name in BUILDING_FIELDS}
    azimuth = checks.finite("azimuth", rows.azimuth)
    for name, values in {**fields, "azimuth": azimuth}.items():
        expected = first.size - 1 if name == "azimuth" else count
        if values.shape != (expected,):
            raise ValueError(f"{name} must have the shape ({expected},), got {values.shape}")

    checked = with_ends(BuildingRows(first, **fields, azimuth=azimuth))
    _check_ranges(checked)
    _refuse_pressed_walls(checked)
    return checked


def _checked_first(first: ArrayLike) -> IntArray:
    """Return the number of the first building of each row, in ascending order from 0."""
    # Whole numbers, each row with a building
    numbers = np.asarray(first)
    if numbers.ndim != 1 or numbers.size < 2 or numbers.dtype.kind not in "iu":
        raise ValueError(
            f"first must be whole numbers (n_rows + 1,), got {numbers.dtype} {numbers.shape}"
        )
    starts = numbers.astype(np.int64)
    if starts[0] != 0 or (np.diff(starts) < 1).any():
        raise ValueError("first must begin at 0 and grow by one or more per row")
    return starts


def with_ends(rows: BuildingRows) -> BuildingRows:
    """Return rows with 1 in place of every term of a neighbour that a row does not have."""
    begins, ends = rows.first[:-1], rows.first[1:] - 1
    # Buildings of these terms
    index = dict.fromkeys(("participation_right", "gap", "restitution"), ends)
    index["participation_left"] = begins
    columns = {name: getattr(rows, name).copy() for name in index}
    for name, column in columns.items():
        column[index[name]] = 1.0
    return rows._replace(**columns)


def _check_ranges(rows: BuildingRows) -> None:
    """Refuse values of buildings and interfaces that are out of range."""
    for name in ("period", "participation_left", "participation_right"):
        checks.positive(name, getattr(rows, name))
    for name in ("mass", "yield_displacement"):
        checks.positive_or_infinite(name, getattr(rows, name))
    for name in ("damping", "hardening"):
        checks.fraction_of_critical(name, getattr(rows, name))
    checks.not_negative("gap", rows.gap)
    checks.between("restitution", rows.restitution, 0.0, 1.0)


def _refuse_pressed_walls(rows: BuildingRows) -> None:
    """Refuse two walls of a row with an interface or without a gap between them."""
    # Neighbouring walls of one row
    walls = np.flatnonzero(np.isinf(rows.mass))
    row = np.searchsorted(rows.first, walls, side="right") - 1
    for (left, row_left), (right, row_right) in pairwise(zip(walls, row, strict=True)):
        if row_left == row_right and (right == left + 1 or not rows.gap[left:right].any()):
            raise ValueError(
                f"mass of the buildings at index {left} and {right} is infinite, "
                "with no room to move between them"
            )


class RowScales(NamedTuple):
    """Displacement of building k, and clearance after it, in the units of the table, (n,)."""

    displacement: FloatArray
    clearance: FloatArray


def row_scales(rows: BuildingRows) -> RowScales:
    """
    Return the scales ``s`` and ``c`` at which both participations of every interface are 1.

    Parameters
    ----------
    rows : BuildingRows
        Checked.

    Returns
    -------
    RowScales
        Dimensionless. The scale of the clearance is 1 for the first interface of a row; where both
        participations of every building are equal, it is exactly 1 for all.
    """
    starts, sizes = rows.first[:-1], np.diff(rows.first)
    ratio = rows.participation_left / rows.participation_right
    clearance = np.ones(ratio.size)
    # One interface after the other along all rows, so that a row does not depend on the others
    for position in range(1, int(sizes.max())):
        building = starts[sizes > position] + position
        clearance[building] = clearance[building - 1] * ratio[building]

    # A last building has an interface on its left only
    displacement = clearance * rows.participation_right
    last = (rows.first[1:] - 1)[sizes > 1]
    displacement[last] = clearance[last - 1] * rows.participation_left[last]
    return RowScales(displacement, clearance)


def building_table(rows: BuildingRows, scales: RowScales) -> FloatArray:
    """
    Return the kernels' table of structures of all buildings.

    Parameters
    ----------
    rows : BuildingRows
        Checked.
    scales : RowScales
        Of these rows.

    Returns
    -------
    (n_buildings, 6) ndarray
        As from `structure_table`; displacements are ``s`` times those of the modal coordinate.
    """
    table = np.empty((rows.period.size, 6))
    frequency = 2.0 * np.pi / rows.period
    table[:, 0] = rows.damping * frequency
    table[:, 1] = frequency**2
    table[:, 2] = rows.hardening
    # In the unit of the table: yield displacement, drive and mass
    table[:, 3] = scales.displacement * rows.yield_displacement
    table[:, 4] = scales.displacement
    table[:, 5] = rows.mass / scales.displacement**2
    return table


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
