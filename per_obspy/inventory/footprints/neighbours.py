"""
Neighbouring footprints: gap, overlap, facing walls, azimuth and place in the row. Coordinates are metres.

Two walls face each other if they are antiparallel within 30 degrees, overlap along their length and
stand no further apart than the gap and ``FACING_DEPTH``. The axis of the pair is the mean normal of
its facing walls, weighted by length; without facing walls (two corners meet) it is the shortest
connection.
"""

from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.inventory.footprints.layers import Geometries

IntArray = NDArray[np.int64]

#: Gaps below this are coordinates' round-off: the buildings touch, m.
TOUCHING = 1e-3

#: Walls that stand back by this much from the nearest ones still count as facing, m.
FACING_DEPTH = 0.25

#: Largest angle between facing walls, degrees; and between the axis and a neighbour that continues
#: the row.
FACING_ANGLE, ROW_ANGLE = 30.0, 45.0

#: Pairs treated at a time, to bound memory.
CHUNK = 20_000


class Neighbours(NamedTuple):
    """
    Pairs of footprints, ``first < second``, one element a pair.

    Attributes
    ----------
    first, second : (n_pairs,) ndarray of int
        Positions of the two footprints.
    gap : (n_pairs,) ndarray
        Shortest distance, m; 0 if they touch.
    overlap : (n_pairs,) ndarray
        Area that both cover, m2.
    facing_length : (n_pairs,) ndarray
        Length over which walls face each other, m.
    azimuth : (n_pairs,) ndarray
        From first to second, degrees clockwise from the projection's north.
    inside : (n_pairs,) ndarray of bool
        Whether both have a further neighbour on the other side.
    """

    first: IntArray
    second: IntArray
    gap: FloatArray
    overlap: FloatArray
    facing_length: FloatArray
    azimuth: FloatArray
    inside: NDArray[np.bool_]


class _Walls(NamedTuple):
    """Walls of all buildings, those of building ``i`` at ``offset[i]:offset[i + 1]``; the outside is on their right."""

    offset: IntArray
    start: FloatArray
    end: FloatArray


def neighbours(polygons: Geometries, distance: float) -> Neighbours:
    """
    Find the pairs of footprints within a distance.

    Parameters
    ----------
    polygons : (n_buildings,) ndarray of shapely polygons or multipolygons
        In metres, valid.
    distance : float
        Largest gap, m.
    """
    one, other = shapely.STRtree(polygons).query(polygons, predicate="dwithin", distance=distance)
    order = np.lexsort((other, one))
    first, second = one[order], other[order]
    first, second = first[first < second], second[first < second]
    gap = shapely.distance(polygons[first], polygons[second])
    gap = np.where(gap < TOUCHING, 0.0, gap)
    facing, axis = _facing(polygons, first, second, gap)
    axis = np.where(
        facing[:, None] > 0.0, axis, _connection(polygons[first], polygons[second], gap)
    )
    azimuth = np.rad2deg(np.arctan2(axis[:, 0], axis[:, 1])) % 360.0
    overlap, met = np.zeros(gap.size), gap == 0.0
    overlap[met] = shapely.area(shapely.intersection(polygons[first[met]], polygons[second[met]]))
    return Neighbours(first, second, gap, overlap, facing, azimuth, _inside(first, second, azimuth))


def _connection(first: Geometries, second: Geometries, gap: FloatArray) -> FloatArray:
    """Return the shortest connection of each pair; of touching ones, the line between the centres."""
    line = shapely.get_coordinates(shapely.shortest_line(first, second)).reshape(-1, 2, 2)
    centre = shapely.get_coordinates(shapely.centroid(second)) - shapely.get_coordinates(
        shapely.centroid(first)
    )
    connection: FloatArray = np.where(gap[:, None] > 0.0, line[:, 1] - line[:, 0], centre)
    return connection


def _walls(polygons: Geometries) -> _Walls:
    parts, building = shapely.get_parts(
        shapely.orient_polygons(polygons, exterior_cw=False), return_index=True
    )
    rings, part = shapely.get_rings(parts, return_index=True)
    points, ring = shapely.get_coordinates(rings, return_index=True)
    wall = (ring[1:] == ring[:-1]) & (points[1:] != points[:-1]).any(axis=1)
    owner = building[part[ring[:-1][wall]]]
    offset = np.searchsorted(owner, np.arange(len(polygons) + 1))
    return _Walls(offset, points[:-1][wall], points[1:][wall])


def _facing(
    polygons: Geometries, first: IntArray, second: IntArray, gap: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the length over which walls face each other, and the sum of their normals times that length."""
    walls, bounds = _walls(polygons), shapely.bounds(polygons)
    length, axis = np.zeros(first.size), np.zeros((first.size, 2))
    for start in range(0, first.size, CHUNK):
        rows = slice(start, start + CHUNK)
        reach = gap[rows] + FACING_DEPTH
        one = _near(walls, first[rows], bounds[second[rows]], reach)
        two = _near(walls, second[rows], bounds[first[rows]], reach)
        pair, wall_1, wall_2 = _combined(one, two, reach.size)
        shared, normal = _facing_walls(walls, wall_1, wall_2, reach[pair])
        length[rows] = np.bincount(pair, shared, minlength=reach.size)
        for i in (0, 1):
            axis[rows, i] = np.bincount(pair, shared * normal[:, i], minlength=reach.size)
    return length, axis


def _expanded(starts: IntArray, counts: IntArray) -> tuple[IntArray, IntArray]:
    """Return, for ranges ``start:start + count``, which range each element is of, and the element."""
    owner = np.repeat(np.arange(counts.size), counts)
    within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    return owner, starts[owner] + within


def _near(
    walls: _Walls, building: IntArray, box: FloatArray, reach: FloatArray
) -> tuple[IntArray, IntArray]:
    """Return pair and wall for the walls of each pair's building that come near the other's bounding box."""
    pair, wall = _expanded(
        walls.offset[building], walls.offset[building + 1] - walls.offset[building]
    )
    low = np.minimum(walls.start[wall], walls.end[wall]) <= box[pair, 2:] + reach[pair, None]
    high = np.maximum(walls.start[wall], walls.end[wall]) >= box[pair, :2] - reach[pair, None]
    near = (low & high).all(axis=1)
    return pair[near], wall[near]


def _combined(
    one: tuple[IntArray, IntArray], two: tuple[IntArray, IntArray], n_pairs: int
) -> tuple[IntArray, IntArray, IntArray]:
    """Return every combination of a wall of the first and a wall of the second building of the same pair."""
    counts = np.bincount(two[0], minlength=n_pairs)
    starts = np.cumsum(counts) - counts
    row, other = _expanded(starts[one[0]], counts[one[0]])
    return one[0][row], one[1][row], two[1][other]


def _facing_walls(
    walls: _Walls, one: IntArray, two: IntArray, reach: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the shared length of walls that face each other (0 for others) and the normal out of the first."""
    span = walls.end[one] - walls.start[one]
    length = np.hypot(*span.T)
    along = span / length[:, None]
    normal = np.column_stack([along[:, 1], -along[:, 0]])
    begin, end = walls.start[two] - walls.start[one], walls.end[two] - walls.start[one]
    along_begin, along_end = np.sum(begin * along, axis=1), np.sum(end * along, axis=1)
    low = np.maximum(0.0, np.minimum(along_begin, along_end))
    high = np.minimum(length, np.maximum(along_begin, along_end))
    other = np.hypot(*(end - begin).T)
    antiparallel = (along_end - along_begin) < -np.cos(np.deg2rad(FACING_ANGLE)) * other
    share = np.divide(
        (low + high) / 2.0 - along_begin,
        along_end - along_begin,
        out=np.zeros_like(low),
        where=antiparallel,
    )
    apart = np.sum((begin + share[:, None] * (end - begin)) * normal, axis=1)
    facing = antiparallel & (high > low) & (apart >= -FACING_DEPTH) & (apart <= reach)
    return np.where(facing, high - low, 0.0), normal


def _inside(first: IntArray, second: IntArray, azimuth: FloatArray) -> NDArray[np.bool_]:
    """Return where both buildings of a pair have a further neighbour opposite to the other one."""
    building = np.concatenate([first, second])
    direction = np.concatenate([azimuth, azimuth + 180.0])
    order = np.argsort(building, kind="stable")
    counts = np.bincount(building)
    starts = np.cumsum(counts) - counts
    seen, other = _expanded(starts[building], counts[building])
    opposite = np.abs((direction[order][other] - direction[seen]) % 360.0 - 180.0) < ROW_ANGLE
    continued = np.bincount(seen, opposite, minlength=building.size) > 0
    return continued[: first.size] & continued[first.size :]
