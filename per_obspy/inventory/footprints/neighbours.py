"""
Neighbouring footprints: gap, overlap, facing walls, azimuth and place in the row.

Coordinates are metres. Two walls face each other if they are antiparallel within 30 degrees,
overlap along their length and are no more distant than the gap and ``FACING_DEPTH``. The axis of
the pair is the mean normal of its facing walls, weighted by length; without facing walls (two
corners meet) it is the shortest connection.
"""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
import pandas as pd
import shapely
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.inventory.footprints.raw_layer import Geometries

IntArray = NDArray[np.int64]

#: Gaps below this are coordinates' round-off: the buildings touch, m.
TOUCHING = 1e-3

#: Walls set back by this much from the nearest ones still count as facing, m.
FACING_DEPTH = 0.25

#: Largest angle between facing walls, degrees.
FACING_ANGLE = 30.0

_ANTIPARALLEL = -np.cos(np.deg2rad(FACING_ANGLE))

#: Largest angle between the axis and the direction of a neighbour that continues the row, degrees.
ROW_ANGLE = 45.0

#: Pairs per block, to bound memory.
CHUNK = 20_000


class Outlines(NamedTuple):
    """
    Footprints in metres that are polygons only when they are needed.

    Attributes
    ----------
    bounds : (n_buildings, 4) ndarray
        West, south, east, north, m.
    polygons : callable
        Polygons or multipolygons of an array of positions.
    meridian : float
        Longitude along which the north of the projection is true, degrees.
    """

    bounds: FloatArray
    polygons: Callable[[IntArray], Geometries]
    meridian: float = 0.0


class _Walls(NamedTuple):
    """
    Walls of all buildings, from start to end with the outside on the right.

    Those of building ``i`` are ``offset[i]:offset[i + 1]``.
    """

    offset: IntArray
    start: FloatArray
    end: FloatArray


def neighbours(outlines: Outlines, distance: float) -> pd.DataFrame:
    """
    Find the pairs of footprints within a distance, block by block.

    Parameters
    ----------
    outlines : Outlines
        Footprints in metres, valid.
    distance : float
        Largest gap, m.

    Returns
    -------
    pairs : DataFrame
        ``first`` below ``second``, positions of the footprints; ``gap`` (m; 0 if they touch),
        ``overlap`` (covered by both, m2), ``facing_length`` (of walls that face each other, m),
        ``azimuth`` (from first to second, degrees clockwise from the projection's north),
        ``inside_1``, ``inside_2`` (whether each has a further neighbour on its other side).
    """
    positions, columns = list[IntArray](), list[FloatArray]()
    for first, second in _near_boxes(outlines, distance):
        near, measures = _measure(outlines, first, second, distance)
        positions.append(np.stack([first[near], second[near]]))
        columns.append(measures)
    # All pairs, which show where rows go on
    first, second = np.concatenate(positions, axis=1)
    names = ("gap", "overlap", "facing_length", "azimuth")
    measured = dict(zip(names, np.concatenate(columns, axis=1), strict=True))
    inside = _inside_row(first, second, measured["azimuth"])
    # No copy: neighbours are many
    pairs = {"first": first, "second": second, **measured}
    return pd.DataFrame(pairs | {"inside_1": inside[0], "inside_2": inside[1]}, copy=False)


def _near_boxes(outlines: Outlines, distance: float) -> Iterator[tuple[IntArray, IntArray]]:
    """Yield blocks of footprints whose bounding boxes are near, every pair once and in order."""
    # A tree over the diagonals has the boxes of the outlines, in a fifth of their memory
    corners = outlines.bounds.reshape(-1, 2, 2)
    tree = shapely.STRtree(shapely.linestrings(corners))
    low, high = outlines.bounds[:, :2] - distance, outlines.bounds[:, 2:] + distance
    for start in range(0, len(corners), CHUNK):
        rows = slice(start, start + CHUNK)
        reach = shapely.box(*low[rows].T, *high[rows].T)
        query, found = tree.query(reach)
        is_once = query + start < found
        first, second = query[is_once] + start, found[is_once]
        order = np.lexsort((second, first))
        # Large buildings have many neighbours
        for part in range(0, max(order.size, 1), CHUNK):
            chosen = order[part : part + CHUNK]
            yield first[chosen], second[chosen]


def _measure(
    outlines: Outlines, first: IntArray, second: IntArray, distance: float
) -> tuple[NDArray[np.bool_], FloatArray]:
    """Return which pairs are near, and their gap, overlap, facing length and azimuth, (4, n)."""
    # Polygons of the block, each once
    numbers, place = np.unique(np.concatenate([first, second]), return_inverse=True)
    polygons = outlines.polygons(numbers)
    one, other = place[: first.size], place[first.size :]
    gap = shapely.distance(polygons[one], polygons[other])
    near = gap <= distance
    one, other, gap = one[near], other[near], np.where(gap < TOUCHING, 0.0, gap)[near]
    facing, azimuth = _axis(polygons, one, other, gap)
    # Area covered by both
    overlap, touch = np.zeros(gap.size), gap == 0.0
    shared = shapely.intersection(polygons[one[touch]], polygons[other[touch]])
    overlap[touch] = shapely.area(shared)
    return near, np.stack([gap, overlap, facing, azimuth])


def _axis(
    polygons: Geometries, first: IntArray, second: IntArray, gap: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the length of facing walls of each pair, m, and its azimuth, degrees."""
    facing, normals = _facing(polygons, first, second, gap)
    one, other = polygons[first], polygons[second]
    line = shapely.get_coordinates(shapely.shortest_line(one, other)).reshape(-1, 2, 2)
    # A shortest line of length 0 has no direction: that between the centres of touching ones
    centre_1, centre_2 = (shapely.get_coordinates(shapely.centroid(each)) for each in (one, other))
    shortest = np.where(gap > 0.0, (line[:, 1] - line[:, 0]).T, (centre_2 - centre_1).T)
    axis = np.where(facing > 0.0, normals, shortest)
    return facing, np.rad2deg(np.arctan2(*axis)) % 360.0


def _walls(polygons: Geometries) -> _Walls:
    """Return the walls of all rings, courtyards too."""
    # Rings with the building on their left, and the building of each ring
    anticlockwise = shapely.orient_polygons(polygons, exterior_cw=False)
    parts, building = shapely.get_parts(anticlockwise, return_index=True)
    rings, part = shapely.get_rings(parts, return_index=True)
    points, ring = shapely.get_coordinates(rings, return_index=True)
    # Two successive points of one ring that differ make a wall
    is_wall = (ring[1:] == ring[:-1]) & (points[1:] != points[:-1]).any(axis=1)
    owner = building[part[ring[:-1][is_wall]]]
    offset = np.searchsorted(owner, np.arange(len(polygons) + 1))
    return _Walls(offset, points[:-1][is_wall], points[1:][is_wall])


def _facing(
    polygons: Geometries, first: IntArray, second: IntArray, gap: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the length of facing walls of each pair, m, and sums of normal by length, (2, n)."""
    walls, bounds = _walls(polygons), shapely.bounds(polygons)
    # Combinations of walls that come near the other building
    reach = gap + FACING_DEPTH
    pair_1, near_1 = _near(walls, first, bounds[second], reach)
    pair_2, near_2 = _near(walls, second, bounds[first], reach)
    counts = np.bincount(pair_2, minlength=reach.size)
    starts = np.cumsum(counts) - counts
    row_1, row_2 = _expanded(starts[pair_1], counts[pair_1])
    pair, wall_1, wall_2 = pair_1[row_1], near_1[row_1], near_2[row_2]
    # Sums over the combinations of each pair
    shared, normal = _facing_walls(walls, wall_1, wall_2, reach[pair])
    sums = [np.bincount(pair, shared * each, minlength=reach.size) for each in normal.T]
    length = np.bincount(pair, shared, minlength=reach.size)
    return np.asarray(length, dtype=np.float64), np.stack(sums)


def _expanded(starts: IntArray, counts: IntArray) -> tuple[IntArray, IntArray]:
    """Return range and value of each element of the ranges ``start:start + count``."""
    owner = np.repeat(np.arange(counts.size), counts)
    within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    return owner, starts[owner] + within


def _near(
    walls: _Walls, building: IntArray, box: FloatArray, reach: FloatArray
) -> tuple[IntArray, IntArray]:
    """Return pair and wall of the walls that come near the bounding box of the other building."""
    first = walls.offset[building]
    pair, wall = _expanded(first, walls.offset[building + 1] - first)
    # Bounding box of each wall against that of the building, widened by the reach
    start, end = walls.start[wall], walls.end[wall]
    is_low = np.minimum(start, end) <= box[pair, 2:] + reach[pair, None]
    is_high = np.maximum(start, end) >= box[pair, :2] - reach[pair, None]
    is_near = (is_low & is_high).all(axis=1)
    return pair[is_near], wall[is_near]


def _facing_walls(
    walls: _Walls, wall_1: IntArray, wall_2: IntArray, reach: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return shared lengths of facing walls, m, 0 for others, and normals out of first walls."""
    along, normal, length = _directions(walls, wall_1)
    # Second wall seen from the start of the first
    begin, end = (ends[wall_2] - walls.start[wall_1] for ends in walls[1:])
    along_begin, along_end, wall = _dot(begin, along), _dot(end, along), end - begin
    # Length that both share, where the second wall runs against the first
    low = np.minimum(along_begin, along_end).clip(min=0.0)
    high = np.maximum(along_begin, along_end).clip(max=length)
    advance = along_end - along_begin
    is_facing = advance < _ANTIPARALLEL * np.hypot(*wall.T)
    # Distance of the second wall at the middle of the shared length
    to_middle = (low + high) / 2.0 - along_begin
    share = np.divide(to_middle, advance, out=np.zeros_like(advance), where=is_facing)
    distance = _dot(begin + share[:, None] * wall, normal)
    is_facing &= (high > low) & (distance >= -FACING_DEPTH) & (distance <= reach)
    return np.where(is_facing, high - low, 0.0), normal


def _directions(walls: _Walls, wall: IntArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return unit vectors along walls and out of their buildings, and lengths, m."""
    span = walls.end[wall] - walls.start[wall]
    length = np.hypot(*span.T)
    along = span / length[:, None]
    return along, np.column_stack([along[:, 1], -along[:, 0]]), length


def _dot(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the scalar product of each row."""
    return np.asarray(np.sum(first * second, axis=1))


def _inside_row(
    first: IntArray, second: IntArray, azimuth: FloatArray
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return where either building of a pair has a further neighbour on the opposite side."""
    # Each pair seen from both buildings, grouped by building
    building = np.concatenate([first, second])
    direction = np.concatenate([azimuth, azimuth + 180.0])
    order = np.argsort(building, kind="stable")
    counts = np.bincount(building)
    starts = np.cumsum(counts) - counts
    # Each neighbour against every neighbour of the same building
    seen, other = _expanded(starts[building], counts[building])
    turn = (direction[order][other] - direction[seen]) % 360.0
    is_opposite = np.abs(turn - 180.0) < ROW_ANGLE
    continues = np.bincount(seen, is_opposite, minlength=building.size) > 0
    return continues[: first.size], continues[first.size :]
