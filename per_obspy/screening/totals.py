"""Totals of a risk table by administrative area or by cell of a grid."""

from collections.abc import Iterable, Sequence
from itertools import chain
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from pandas.api.types import union_categoricals

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.constants import EARTH_RADIUS
from per_obspy.inventory.schema import Column
from per_obspy.screening.assignment import on_sphere
from per_obspy.screening.ranking import EVERY_STATE
from per_obspy.screening.values import TextArray, values


def hexagons(longitude: ArrayLike, latitude: ArrayLike, resolution: int) -> TextArray:
    """
    Find the H3 cell of each place.

    Parameters
    ----------
    longitude, latitude : (n_places,) array_like
        Degrees east and north.
    resolution : int
        From 0 to 15; a cell of resolution 8 has about 0.7 km², each further step a seventh of that.

    Returns
    -------
    cell : (n_places,) ndarray of str
        Index of the cell, hexadecimal.

    References
    ----------
    https://h3geo.org. Needs the extra ``gis``.

    Examples
    --------
    >>> hexagons([-122.388903], [37.769377], 9).tolist()
    ['89283082e73ffff']
    """
    from h3 import latlng_to_cell

    east = np.atleast_1d(checks.between("longitude", longitude, -180.0, 180.0)).tolist()
    north = np.atleast_1d(checks.between("latitude", latitude, -90.0, 90.0)).tolist()
    cells = [latlng_to_cell(y, x, resolution) for x, y in zip(east, north, strict=True)]
    return np.array(cells, dtype=object)


def hexagon_outlines(cells: Iterable[str]) -> list[FloatArray]:
    """
    Return the corners of H3 cells, each (n_corners, 2), degrees east and north.

    Longitudes of a cell across the date line go on beyond 180.
    """
    from h3 import cell_to_boundary

    outlines = [np.array(cell_to_boundary(cell))[:, ::-1] for cell in cells]
    for corners in outlines:
        if np.ptp(corners[:, 0]) > 180.0:
            corners[:, 0] %= 360.0
    return outlines


def hexagon_middles(cells: Iterable[str]) -> FloatArray:
    """Return the middles of H3 cells, (n_cells, 2), degrees east and north."""
    from h3 import cell_to_latlng

    return np.array([cell_to_latlng(cell)[::-1] for cell in cells]).reshape(-1, 2)


def box_outlines(boxes: pd.DataFrame) -> FloatArray:
    """Return the corners of boxes ``west, south, east, north``, (n_boxes, 4, 2), degrees."""
    west, south, east, north = boxes[["west", "south", "east", "north"]].to_numpy(np.float64).T
    corners = np.stack([(west, south), (east, south), (east, north), (west, north)], axis=0)
    return corners.transpose(2, 0, 1)


#: Numbers of cells per row: more than any row has, so that row and column make one number.
ROW_FACTOR = 1 << 32

#: Column of the number of pairs whose probability is 1, which are half of a usual table.
CERTAIN = "certain"

#: Columns of the worst pair -> their names in the totals.
WORST = {
    "pair_id": "worst_pair",
    "state": "worst_state",
    "expected_impact_velocity": "worst_expected_impact_velocity",
}

#: Unit and meaning of the columns of a table of totals; each risk class adds a column
#: ``class_...``.
TOTALS: dict[str, Column] = {
    column.name: column
    for column in (
        Column(
            "area",
            "str",
            "",
            "place of the pairs, else the nearest town and the way from it to the middle of a cell",
        ),
        Column("pairs", "int64", "1", "pairs in the area"),
        *(Column(state, "int64", "1", f"pairs of the state {state}") for state in EVERY_STATE),
        Column(
            "expected_pounding",
            "float64",
            "1",
            "expected number of pounding pairs: sum of the probabilities, without unknown gaps",
        ),
        Column(
            "expected_pounding_std_independent",
            "float64",
            "1",
            "standard deviation of expected_pounding if pairs were independent",
        ),
        Column(
            "expected_pounding_std_common",
            "float64",
            "1",
            "standard deviation of expected_pounding if one cause decided all pairs",
        ),
        Column("worst_pair", "str", "", "pair_id of the area's worst pair"),
        Column("worst_state", "str", "", "state of worst_pair"),
        Column(
            "worst_expected_impact_velocity",
            "float64",
            "m/s",
            "expected impact velocity of worst_pair",
        ),
        Column(
            "longitude",
            "float64",
            "degrees",
            "longitude of the middle of the pairs of the area, east",
        ),
        Column(
            "latitude",
            "float64",
            "degrees",
            "latitude of the middle of the pairs of the area, north",
        ),
    )
}

#: Columns of the buildings, where the pairs name them.
BUILDING_TOTALS: dict[str, Column] = {
    column.name: column
    for column in (
        Column("buildings", "int64", "1", "buildings whose worst pair is in the area"),
        Column("buildings_hit", "int64", "1", "of these, hit in the exact history of a row"),
        Column(
            "expected_buildings_common",
            "float64",
            "1",
            "expected number of buildings that are hit, if one cause decides all pairs of each",
        ),
        Column(
            "expected_buildings_independent",
            "float64",
            "1",
            "expected number of buildings that are hit, if pairs were independent; the truth lies "
            "between both numbers",
        ),
        Column("worst_building", "str", "", "building_id of the area's worst building"),
    )
}


class ExpectedCount(NamedTuple):
    """
    Expected number of events and the limits of its standard deviation.

    Attributes
    ----------
    mean : float
        Sum of the probabilities.
    std_independent, std_common : float
        Standard deviation if the events are independent, and if one cause decides all of them (each
        happens when the same uniform random number stays below its probability). Pairs that share
        an earthquake lie in between.
    """

    mean: float
    std_independent: float
    std_common: float


#: Columns of an expected count.
EXPECTED = tuple(f"expected_pounding{end}" for end in ("", "_std_independent", "_std_common"))


class GridCells(NamedTuple):
    """Cells of a grid, with the places in them."""

    cell: TextArray  # of each place
    boxes: pd.DataFrame  # ``west, south, east, north`` in degrees, indexed by the cell


class PartialTotals(NamedTuple):
    """Contribution of a piece of a risk table to the totals."""

    # Numbers of pairs, and sums of their positions on the unit sphere, by area
    sums: pd.DataFrame
    # The worst pair of each area with its ``rank``
    worst: pd.DataFrame
    # Area and probability of each pair whose probability is neither 0 nor 1, at most 12 bytes per
    # pair; pairs of probability 1 are counted in the sums
    probabilities: tuple[pd.DataFrame, ...]


def expected_count(probability: ArrayLike) -> ExpectedCount:
    """
    Compute the expected number of events and both limits of its standard deviation.

    Parameters
    ----------
    probability : (n_events,) array_like
        From 0 to 1.

    Raises
    ------
    ValueError
        If a probability is outside [0, 1].

    Examples
    --------
    >>> expected_count([0.5, 0.5, 0.5, 0.5])
    ExpectedCount(mean=2.0, std_independent=1.0, std_common=2.0)
    """
    falling = -np.sort(-np.atleast_1d(checks.between("probability", probability, 0.0, 1.0)))
    mean = float(falling.sum())
    # Second moment under one cause: two events both happen with the smaller probability, which is
    # the later of two falling ones; it counts twice for each earlier one and once with itself
    second = float(falling @ (2.0 * np.arange(falling.size) + 1.0))
    independent = float(np.sqrt((falling * (1.0 - falling)).sum()))
    return ExpectedCount(mean, independent, float(np.sqrt(max(second - mean**2, 0.0))))


def partial_totals(table: pd.DataFrame, area: ArrayLike, classes: Iterable[str]) -> PartialTotals:
    """
    Count the pairs of every area in a piece of a risk table, to be joined by :func:`joined_totals`.

    ``area`` is the area or cell of each pair, ``classes`` the names of the risk classes; with a
    column ``probability`` there are expected numbers, of the pairs that have one.
    """
    rows = table.assign(area=np.asarray(area, dtype=object))
    # Truth values and ones, which are summed up to numbers of pairs
    added: dict[str, object] = {"pairs": 1}
    added |= {state: rows["state"] == state for state in EVERY_STATE}
    added |= {f"class_{name}": rows["risk_class"] == name for name in classes}
    # Positions on the unit sphere, of which the mean direction is the middle of the area
    added |= dict(
        zip("xyz", on_sphere(values(rows, "longitude"), values(rows, "latitude")).T, strict=True)
    )
    if "probability" in rows:
        added[CERTAIN] = rows["probability"] == 1.0
    sums = pd.DataFrame(added, index=rows.index).groupby(rows["area"]).sum()
    worst = rows.sort_values("rank").drop_duplicates("area")[["area", "rank", *WORST]]
    return PartialTotals(sums, worst, _uncertain(rows))


def _uncertain(rows: pd.DataFrame) -> tuple[pd.DataFrame, ...]:
    """Return area and probability of the pairs whose probability is neither 0 nor 1."""
    if "probability" not in rows:
        return ()
    between = rows["probability"].between(0.0, 1.0, inclusive="neither")
    # A copy: a view would keep all columns of the piece in memory
    return (rows.loc[between, ["area", "probability"]].astype({"area": "category"}).copy(),)


def joined_parts(parts: Iterable[PartialTotals]) -> PartialTotals:
    """Return the contributions of some pieces, at least one, as that of one piece."""
    sums, worst, probabilities = zip(*parts, strict=True)
    counted = pd.concat(sums).fillna(0.0).groupby(level=0, sort=True).sum()
    first = pd.concat(worst).sort_values("rank").drop_duplicates("area")
    return PartialTotals(counted, first, tuple(chain.from_iterable(probabilities)))


def joined_totals(parts: Iterable[PartialTotals]) -> pd.DataFrame:
    """
    Join the contributions of pieces, at least one, to the totals of the whole table.

    Returns
    -------
    DataFrame
        One row per area, in the order of their names: the columns of ``TOTALS`` and ``class_...``
        for every risk class.
    """
    counted, worst, probabilities = joined_parts(parts)
    x, y, z = (counted.pop(name) for name in "xyz")
    counted = counted.astype(np.int64)
    # Areas without any probability expect no pounding pair
    if probabilities:
        expected = _expected(probabilities, counted.pop(CERTAIN))
        counted = counted.join(expected).fillna(dict.fromkeys(EXPECTED, 0.0))
    counted = counted.join(worst.set_index("area")[[*WORST]].rename(columns=WORST))
    # The middle is the mean direction, which holds across the date line too
    latitude = np.degrees(np.arctan2(z, np.hypot(x, y)))
    table: pd.DataFrame = counted.assign(longitude=np.degrees(np.arctan2(y, x)), latitude=latitude)
    return table.rename_axis("area").reset_index()


def _expected(pieces: Sequence[pd.DataFrame], certain: "pd.Series[int]") -> pd.DataFrame:
    """Return the expected number of pounding pairs of every area that may have one."""
    # Pieces have different categories of areas
    area = union_categoricals([piece["area"] for piece in pieces])
    probability = np.concatenate([piece["probability"] for piece in pieces])
    # Pairs of an area one after the other; of each area only its own are copied
    order = np.argsort(area.codes, kind="stable")
    ends = np.cumsum(np.bincount(area.codes, minlength=area.categories.size))
    counts = {}
    for name, code in zip(certain.index, area.categories.get_indexer(certain.index), strict=True):
        some = order[ends[code - 1] if code > 0 else 0 : ends[code]] if code >= 0 else order[:0]
        chances = np.concatenate([np.ones(certain[name]), probability[some]])
        if chances.size:
            counts[name] = expected_count(chances)
    return pd.DataFrame(counts, index=list(EXPECTED)).T


def grid_cells(longitude: ArrayLike, latitude: ArrayLike, size: float) -> GridCells:
    """
    Find the cell of each place in a grid of about equal areas over the whole earth.

    Parameters
    ----------
    longitude, latitude : (n_places,) array_like
        Degrees east and north.
    size : float
        Extent of a cell, m, from 1 m to 10 000 km. Rows are exactly that high; cells are as wide as
        a whole number of them around the row allows.

    Raises
    ------
    ValueError
        If a coordinate or the size is out of range.

    Examples
    --------
    >>> grid_cells([0.001, 0.002, -0.001], [0.001, 0.001, 0.001], 500.0).cell
    array(['r0 c0', 'r0 c0', 'r0 c80059'], dtype=object)
    """
    east = np.atleast_1d(checks.between("longitude", longitude, -180.0, 180.0))
    north = np.atleast_1d(checks.between("latitude", latitude, -90.0, 90.0))
    metres = checks.number("size", size, lambda name, value: checks.between(name, value, 1.0, 1e7))
    high = np.degrees(metres / EARTH_RADIUS)
    # Rows of equal height, each cut into a whole number of cells
    row = np.floor(north / high).astype(np.int64)
    middle = np.radians(np.minimum(np.abs(row + 0.5) * high, 90.0))
    around = np.maximum(np.rint(360.0 * np.cos(middle) / high).astype(np.int64), 1)
    column = np.floor((east % 360.0) / 360.0 * around).astype(np.int64)
    # round-off may reach the next column
    return _named_cells(row, np.minimum(column, around - 1), 360.0 / around, high)


def _named_cells(
    row: NDArray[np.int64], column: NDArray[np.int64], wide: FloatArray, high: float
) -> GridCells:
    """Return the cells of places, with names and limits; a cell is so wide and high, degrees."""
    # The cells that hold a place, each once
    number = row * ROW_FACTOR + column
    _, first, cell = np.unique(number, return_index=True, return_inverse=True)
    row, column, wide = row[first], column[first], wide[first]
    names = [f"r{i} c{k}" for i, k in zip(row.tolist(), column.tolist(), strict=True)]
    # West from -180 up to 180; east may lie beyond 180
    west, south = (column * wide + 180.0) % 360.0 - 180.0, row * high
    limits = {"west": west, "south": south, "east": west + wide, "north": south + high}
    boxes = pd.DataFrame(limits, index=np.array(names, dtype=object))
    return GridCells(boxes.index.to_numpy(object)[cell], boxes)
