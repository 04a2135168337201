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
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from per_obspy import checks
from per_obspy.checks import FloatArray

IntArray = NDArray[np.int64]


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
