"""A simulated city of footprints with party walls, narrow gaps, courtyards and faults."""

from typing import NamedTuple

import numpy as np
import pyproj
import shapely
from numpy.typing import NDArray

#: Metres about a place where nobody lives.
LOCAL = "+proj=tmerc +lon_0=-67.95 +lat_0=-20.35 +datum=WGS84"

#: Houses of a block: two rows back to back; blocks of a row of blocks; width of a street, m.
ROW, ACROSS, STREET = 20, 25, 12.0

#: Shares of houses: walls shared with the next one, courtyards, sheds in them, wings; and of
#: features by mistake: walls that cross the next house by a metre, outlines that cross themselves,
#: outlines twice, no outline.
TOUCHING, COURTYARD, SHED, WING = 0.55, 0.08, 0.3, 0.15
CROSSING, INVALID, TWICE, MISSING = 0.01, 0.003, 0.002, 0.001


class City(NamedTuple):
    """
    Footprints in the order of a file.

    Attributes
    ----------
    outlines : (n,) ndarray of shapely geometries
        Longitude and latitude, degrees; None where there is none.
    storeys : (n,) ndarray
        Number of storeys.
    """

    outlines: NDArray[np.object_]
    storeys: NDArray[np.float64]


def city(houses: int, seed: int = 1) -> City:
    """Return about ``count`` houses in whole blocks, with courtyard sheds and digitising errors."""
    random = np.random.default_rng(seed)
    blocks = [_block(random, *divmod(number, ACROSS)) for number in range(-(-houses // (2 * ROW)))]
    outlines = _with_mistakes(random, np.concatenate(blocks))
    to_degrees = pyproj.Transformer.from_crs(LOCAL, "OGC:CRS84", always_xy=True)
    degrees = shapely.transform(outlines, lambda xy: np.column_stack(to_degrees.transform(*xy.T)))
    return City(degrees, random.integers(1, 9, len(degrees)).astype(float))


def _block(random: np.random.Generator, north: int, east: int) -> NDArray[np.object_]:
    """Return the houses of a block, turned by up to 20 degrees about its corner."""
    yard = random.uniform(0.5, 15.0)
    rows = [_row(random, sign * yard / 2.0, sign) for sign in (-1, 1)]
    turned = shapely.affinity.rotate(
        shapely.GeometryCollection(list(np.concatenate(rows))), random.uniform(-20, 20), (0, 0)
    )
    place = [east * (ROW * 13.0 + STREET + 40.0), north * (80.0 + STREET + ROW * 10.0)]
    return shapely.transform(shapely.get_parts(turned), lambda xy: xy + place)


def _row(random: np.random.Generator, back: float, sign: int) -> NDArray[np.object_]:
    """Return the houses of a row whose yards end at a line, with the sheds in their courtyards."""
    width, depth = random.lognormal(np.log(9.0), 0.25, ROW), random.uniform(10.0, 18.0, ROW)
    gap = np.where(random.random(ROW) < TOUCHING, 0.0, random.lognormal(np.log(0.1), 1.2, ROW))
    gap = np.where(random.random(ROW) < CROSSING, -1.0, gap)
    west = np.concatenate([[0.0], np.cumsum(width + gap)[:-1]])
    houses = []
    for x, wide, deep in zip(west, width, depth, strict=True):
        low, high = sorted([back, back + sign * deep])
        houses += _house(random, shapely.box(x, low, x + wide, high))
    return np.array(houses, dtype=object)


def _house(random: np.random.Generator, plot: shapely.Polygon) -> list[shapely.Polygon]:
    """Return a house that fills its plot, or has a courtyard, perhaps with a shed, or a wing."""
    x, y, far_x, far_y = plot.bounds
    kind = random.random()
    if kind < COURTYARD:
        yard = shapely.box(x + 2.5, y + 3.0, far_x - 2.5, far_y - 3.0)
        shed = shapely.box(x + 2.5 + random.uniform(0.0, 0.5), y + 4.0, x + 4.5, y + 6.0)
        sheds = [shed] if random.random() < SHED and shapely.contains(yard, shed) else []
        return [plot - yard, *sheds] if far_x - x > 6.0 else [plot]
    return (
        [plot - shapely.box(x, y, x + (far_x - x) / 2.0, y + 4.0)]
        if kind < COURTYARD + WING
        else [plot]
    )


def _with_mistakes(random: np.random.Generator, houses: NDArray[np.object_]) -> NDArray[np.object_]:
    """Return the houses with self-crossing, missing and, at the end, repeated outlines."""
    kind, outlines = random.random(len(houses)), houses.copy()
    for i in np.flatnonzero(kind < INVALID):
        corners = shapely.get_coordinates(shapely.box(*outlines[i].bounds))
        outlines[i] = shapely.Polygon(corners[[0, 2, 1, 3]])
    outlines[(kind >= INVALID) & (kind < INVALID + MISSING)] = None
    return np.concatenate([outlines, houses[kind > 1.0 - TWICE]])
