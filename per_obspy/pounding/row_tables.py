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
again. For the same reason neighbours of one equation of motion and equal contact heights, which no
other building hits, are parts of one building each, whatever their gap: they move in step.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.kernels.pounding_lanes.run_block import UNREACHABLE
from per_obspy.pounding.kernel_tables import kernel_table, refuse_pressed_walls
from per_obspy.pounding.structure import PAIR_CHECKS

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


#: Check of each of these fields.
ROW_CHECKS = {
    **PAIR_CHECKS,
    "participation_left": checks.positive,
    "participation_right": checks.positive,
}


def checked_rows(rows: BuildingRows) -> BuildingRows:
    """
    Return rows with every field checked, and 1 in fields without meaning.

    Refused with ``ValueError`` is a field of the wrong shape or out of range, an empty row, and two
    walls (infinite masses) that are pressed together.
    """
    # Shapes
    first = _checked_first(rows.first)
    fields = {name: checks.numbers(name, getattr(rows, name)) for name in BUILDING_FIELDS}
    fields["azimuth"] = checks.finite("azimuth", rows.azimuth)
    for name, values in fields.items():
        expected = first.size - 1 if name == "azimuth" else int(first[-1])
        if values.shape != (expected,):
            raise ValueError(f"{name} must have the shape ({expected},), got {values.shape}")

    # Ranges where a field has a meaning
    checked = with_ends(BuildingRows(first, **fields))
    for name in BUILDING_FIELDS:
        ROW_CHECKS[name](name, getattr(checked, name))
    row = np.repeat(np.arange(first.size - 1), np.diff(first))
    refuse_pressed_walls(checked.mass, checked.gap, row, "the buildings at index")
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
    columns = {}
    for name in ("participation_left", "participation_right", "gap", "restitution"):
        columns[name] = getattr(rows, name).copy()
        is_left = name == "participation_left"
        columns[name][rows.first[:-1] if is_left else rows.first[1:] - 1] = 1.0
    return rows._replace(**columns)


def some_buildings(rows: BuildingRows, buildings: IntArray, first: IntArray) -> BuildingRows:
    """Return some buildings as rows that begin at ``first`` among them, on the axes they have."""
    fields = {name: getattr(rows, name)[buildings] for name in BUILDING_FIELDS}
    row = np.searchsorted(rows.first, buildings[first[:-1]], side="right") - 1
    return with_ends(BuildingRows(first, **fields, azimuth=rows.azimuth[row]))


def two_by_two(rows: BuildingRows, some: IntArray) -> tuple[IntArray, BuildingRows]:
    """Return some buildings of each row two by two, the last perhaps twice, and as pairs apart."""
    row = np.searchsorted(rows.first, some, side="right") - 1
    left = np.flatnonzero((np.arange(some.size) - np.searchsorted(row, row)) % 2 == 0)
    right = left + np.append(row[1:] == row[:-1], False)[left]
    both = some[np.stack([left, right], axis=1).ravel()]
    pairs = some_buildings(rows, both, 2 * np.arange(left.size + 1))
    # A gap that never closes, and no walls
    gap, mass = np.full(both.size, UNREACHABLE), np.ones(both.size)
    return both, pairs._replace(gap=gap, mass=mass)


class RowScales(NamedTuple):
    """Displacement of building k, and clearance after it, in the units of the table, (n,)."""

    displacement: FloatArray
    clearance: FloatArray


def row_scales(rows: BuildingRows) -> RowScales:
    """
    Return the scales ``s`` and ``c`` at which both participations of every interface are 1.

    The scale of the clearance is 1 for the first interface of a row; where both participations of
    every building are equal, it is exactly 1 for all.
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
    """Return `kernel_table` of all buildings; displacements are ``s`` times the modal ones."""
    limit, mass = scales.displacement * rows.yield_displacement, rows.mass / scales.displacement**2
    spring = rows.damping, 2.0 * np.pi / rows.period, rows.hardening, limit
    return kernel_table(*spring, scales.displacement, mass)


#: Share of a gap that largest displacements have to leave open: more than their rounding.
LEAST_OPENING = 1e-9


def stays_open(rows: BuildingRows, displacement: FloatArray) -> BoolArray:
    """
    Return after which buildings a row is divided, by the largest displacements ``|D|``, m.

    The gap to the next building stays open there, or there is none.
    """
    reach = rows.participation_right * displacement
    other = np.append((rows.participation_left * displacement)[1:], 0.0)
    is_open = reach + other < (1.0 - LEAST_OPENING) * rows.gap
    is_open[rows.first[1:] - 1] = True
    return np.asarray(is_open)


def moves_in_step(rows: BuildingRows) -> BoolArray:
    """Return after which buildings the next one has the same motion at contact, if none hits it."""
    is_same = np.append(rows.participation_right[:-1] == rows.participation_left[1:], False)
    for name in ("period", "damping", "yield_displacement", "hardening"):
        column = getattr(rows, name)
        is_same[:-1] &= column[:-1] == column[1:]
    return is_same


def _ends(rows: BuildingRows, displacement: FloatArray, before: BoolArray) -> BoolArray:
    """Return after which buildings, of those before, a gap stays open or all move in step."""
    is_open, in_step = before & stays_open(rows, displacement), before & moves_in_step(rows)
    is_pushed = _counted(is_open, ~(is_open | in_step)) > 0.0
    return is_open | (in_step & ~is_pushed)


def parts_of(rows: BuildingRows, is_end: BoolArray, chosen: BoolArray) -> BuildingRows:
    """Return parts of rows, each to a building that ``is_end``, of which all or none is chosen."""
    ends = np.flatnonzero(is_end[chosen]) + 1
    return some_buildings(rows, np.flatnonzero(chosen), np.append(0, ends))


def run_in_parts(
    rows: BuildingRows,
    maxima: FloatArray,
    run: Callable[[BuildingRows], FloatArray],
    wanted: BoolArray,
) -> FloatArray:
    """
    Compute the maxima of rows by their parts, and those of pairs of neighbours alone.

    ``maxima`` (n_buildings, n_maxima) are those of every building alone, its displacement first;
    then those in its row. ``run`` returns the maxima of checked rows of two buildings and more. A
    part of two buildings is a pair alone, and is computed once for both; pairs of longer parts only
    where the pair of a building and the next one is ``wanted``. Return the maxima of each building
    and the next one without the others of their row, (n_buildings, 2, n_maxima): without contact
    where their gap stays open or they move in step, NaN where the pair is not computed.
    """
    in_step = moves_in_step(rows)
    is_end = _ends(rows, maxima[:, 0], np.ones_like(in_step))
    number = _counted(is_end, np.ones_like(is_end))

    # Parts of two among the pairs that may meet
    may_meet = ~is_end & ~in_step
    two = np.flatnonzero(may_meet & (number == 2))
    left = np.flatnonzero(may_meet & (wanted | (number == 2)))
    after = np.minimum(np.arange(1, len(maxima) + 1), len(maxima) - 1)
    pairs = np.stack([maxima, maxima[after]], axis=1)
    pairs[may_meet] = np.nan
    # Both of each pair, which has no other neighbours
    if left.size:
        pairs[left] = run(_pairs_of(rows, left)).reshape(left.size, 2, -1)
    maxima[two], maxima[two + 1] = pairs[two, 0], pairs[two, 1]
    _run_longer(rows, maxima, run, is_end, number > 2)
    return pairs


def _pairs_of(rows: BuildingRows, left: IntArray) -> BuildingRows:
    """Return some buildings, each with the next one, as rows without other neighbours."""
    both = np.stack([left, left + 1], axis=1).ravel()
    return some_buildings(rows, both, 2 * np.arange(left.size + 1))


def _run_longer(
    rows: BuildingRows,
    maxima: FloatArray,
    run: Callable[[BuildingRows], FloatArray],
    is_end: BoolArray,
    waiting: BoolArray,
) -> None:
    """Fill in the maxima of the parts that wait, and of those with gaps that motions may close."""
    while True:
        if waiting.any():
            maxima[waiting] = run(parts_of(rows, is_end, waiting))
        before, is_end = is_end, _ends(rows, maxima[:, 0], is_end)
        closes = before & ~is_end
        if not closes.any():
            return
        waiting = _counted(is_end, closes) > 0.0


def _counted(is_end: BoolArray, some: BoolArray) -> FloatArray:
    """Return how many of some buildings are in the part of each building."""
    part = np.append(0, np.cumsum(is_end[:-1]))
    counted: FloatArray = np.bincount(part, weights=some)[part]
    return counted
