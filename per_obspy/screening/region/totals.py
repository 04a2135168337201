"""Totals of a risk table by administrative area or by cell of a grid."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from pandas.api.types import union_categoricals

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.constants import EARTH_RADIUS
from per_obspy.inventory.schema import Column

STATES = ("yes", "possible", "no")

#: More than the cells around the earth: a row and a column make one number.
MANY = 1 << 32

#: Unit and meaning of the columns of a table of totals; every risk class has a column ``class_...``
#: besides.
TOTALS: dict[str, Column] = {
    column.name: column
    for column in (
        Column(
            "area",
            "str",
            "",
            "name of the area or of the cell; empty where the pair table does not tell",
        ),
        Column("pairs", "int64", "1", "pairs in the area"),
        Column("yes", "int64", "1", "pairs whose gap is below their demand"),
        Column("possible", "int64", "1", "pairs that may pound"),
        Column("no", "int64", "1", "the other pairs"),
        Column(
            "expected_pounding",
            "float64",
            "1",
            "expected number of pounding pairs: sum of their probabilities",
        ),
        Column(
            "expected_pounding_std_independent",
            "float64",
            "1",
            "its standard deviation if pairs were independent",
        ),
        Column(
            "expected_pounding_std_common",
            "float64",
            "1",
            "its standard deviation if one cause decided all pairs",
        ),
        Column("worst_pair", "str", "", "pair_id of the area's worst pair"),
        Column("worst_state", "str", "", "its state"),
        Column(
            "worst_demand_ratio", "float64", "1", "its gap / demand; empty where its demand is 0"
        ),
        Column("longitude", "float64", "degrees", "of the middle of the area's pairs, east"),
        Column("latitude", "float64", "degrees", "of the middle of the area's pairs, north"),
    )
}


class ExpectedCount(NamedTuple):
    """
    Expected number of events and what its standard deviation may be.

    Attributes
    ----------
    mean : float
        Sum of the probabilities.
    std_independent, std_common : float
        If nothing links the events, and if one cause decides all of them (each happens when the
        same uniform random number stays below its probability). Pairs that share an earthquake lie
        in between.
    """

    mean: float
    std_independent: float
    std_common: float


class GridCells(NamedTuple):
    """
    Cells of a grid.

    Attributes
    ----------
    cell : (n_places,) ndarray of str
        The cell of each place.
    boxes : DataFrame
        ``west, south, east, north`` in degrees, indexed by the cell.
    """

    cell: NDArray[np.object_]
    boxes: pd.DataFrame


def expected_count(probability: ArrayLike) -> ExpectedCount:
    """
    Return the expected number of events of given probabilities, with both limits of its standard deviation.

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
    # all pairs of events: the smaller of two probabilities is the later one, twice for each earlier
    # one, once itself
    both = float(falling @ (2.0 * np.arange(falling.size) + 1.0))
    independent = float(np.sqrt((falling * (1.0 - falling)).sum()))
    return ExpectedCount(mean, independent, float(np.sqrt(max(both - mean**2, 0.0))))


def totals(table: pd.DataFrame, area: ArrayLike) -> pd.DataFrame:
    """
    Count the pairs of every area.

    Parameters
    ----------
    table : DataFrame
        Risk table; with a column ``probability`` (of pounding) expected numbers are given, of the
        pairs that have one.
    area : (n_pairs,) array_like of str
        Area or cell of each pair.

    Returns
    -------
    DataFrame
        One row an area, in the order of their names: the columns of ``TOTALS`` and ``class_...``
        for every risk class.
    """
    return joined_totals([partial_totals(table, area, table["risk_class"].unique())])


class PartialTotals(NamedTuple):
    """
    What a piece of a risk table adds to the totals.

    Attributes
    ----------
    sums : DataFrame
        What is summed up, by area.
    worst : DataFrame
        The worst pair of each area with its ``rank``.
    chance : DataFrame or None
        Area and probability of each pair; 12 bytes a pair.
    """

    sums: pd.DataFrame
    worst: pd.DataFrame
    chance: pd.DataFrame | None


def partial_totals(table: pd.DataFrame, area: ArrayLike, classes: Iterable[str]) -> PartialTotals:
    """Count a piece of a risk table, as :func:`totals` does; :func:`joined_totals` joins what pieces add."""
    rows = table.assign(area=np.asarray(area, dtype=object))
    east, north = np.radians(rows["longitude"]), np.radians(rows["latitude"])
    added = {
        "pairs": 1,
        **{state: rows["state"] == state for state in STATES},
        **{f"class_{name}": rows["risk_class"] == name for name in classes},
        "x": np.cos(north) * np.cos(east),
        "y": np.cos(north) * np.sin(east),
        "z": np.sin(north),
    }
    sums = pd.DataFrame(added).groupby(rows["area"]).sum()
    worst = rows.sort_values("rank").drop_duplicates("area")[
        ["area", "rank", "pair_id", "state", "demand_ratio"]
    ]
    if "probability" not in rows:
        return PartialTotals(sums, worst, None)
    return PartialTotals(
        sums, worst, rows[["area", "probability"]].dropna().astype({"area": "category"})
    )


def joined_totals(parts: Iterable[PartialTotals]) -> pd.DataFrame:
    """Return the totals of a table from those of its pieces."""
    sums, worst, chances = zip(*parts, strict=True)
    counted = pd.concat(sums).fillna(0.0).groupby(level=0, sort=True).sum()
    x, y, z = (counted.pop(name) for name in "xyz")
    counted = counted.astype(np.int64)
    known = [one for one in chances if one is not None]
    if known:
        counted = counted.join(_expected(known)).fillna(dict.fromkeys(EXPECTED, 0.0))
    first = (
        pd.concat(worst)
        .sort_values("rank")
        .drop_duplicates("area")
        .set_index("area")
        .drop(columns="rank")
    )
    counted = counted.join(
        first.set_axis(["worst_pair", "worst_state", "worst_demand_ratio"], axis=1)
    )
    latitude = np.degrees(np.arctan2(z, np.hypot(x, y)))  # across the date line too
    table: pd.DataFrame = counted.assign(longitude=np.degrees(np.arctan2(y, x)), latitude=latitude)
    return table.rename_axis("area").reset_index()


EXPECTED = tuple(f"expected_pounding{end}" for end in ("", "_std_independent", "_std_common"))


def _expected(chances: Sequence[pd.DataFrame]) -> pd.DataFrame:
    """Return the expected number of pounding pairs of every area that has a probability."""
    areas = union_categoricals([one["area"] for one in chances])
    table = pd.DataFrame(
        {"area": areas, "probability": np.concatenate([one["probability"] for one in chances])}
    )
    groups = table.groupby("area", observed=True)["probability"]
    return pd.DataFrame(
        {area: expected_count(some) for area, some in groups}, index=list(EXPECTED)
    ).T


def grid_cells(longitude: ArrayLike, latitude: ArrayLike, size: float) -> GridCells:
    """
    Return the cell of each place in a grid of about equal areas over the whole earth.

    Parameters
    ----------
    longitude, latitude : (n_places,) array_like
        Degrees east and north.
    size : float
        Extent of a cell, m. Rows are exactly that high; cells are as wide as a whole number around
        the row allows.

    Raises
    ------
    ValueError
        If a coordinate is out of range or the size is not above 1 m.

    Examples
    --------
    >>> grid_cells([0.001, 0.002, -0.001], [0.001, 0.001, 0.001], 500.0).cell
    array(['r0 c0', 'r0 c0', 'r0 c80059'], dtype=object)
    """
    east = np.atleast_1d(checks.between("longitude", longitude, -180.0, 180.0))
    north = np.atleast_1d(checks.between("latitude", latitude, -90.0, 90.0))
    high = np.degrees(checks.number("size", size, _above_one_metre) / EARTH_RADIUS)
    row = np.floor(north / high).astype(np.int64)
    around = _cells_around(row, high)
    column = np.minimum(np.floor((east % 360.0) / 360.0 * around).astype(np.int64), around - 1)
    _, first, which = np.unique(row * MANY + column, return_index=True, return_inverse=True)
    row, column, wide = row[first], column[first], 360.0 / around[first]
    names = np.array(
        [f"r{one} c{other}" for one, other in zip(row.tolist(), column.tolist(), strict=True)],
        dtype=object,
    )
    west = (column * wide + 180.0) % 360.0 - 180.0
    south = row * high
    boxes = {"west": west, "south": south, "east": west + wide, "north": south + high}
    return GridCells(names[which], pd.DataFrame(boxes, index=names))


def _cells_around(row: NDArray[np.int64], high: float) -> NDArray[np.int64]:
    """Return how many cells there are around the earth in a row."""
    middle = np.radians(np.minimum(np.abs(row + 0.5) * high, 90.0))
    around: NDArray[np.int64] = np.maximum(
        np.rint(360.0 * np.cos(middle) / high).astype(np.int64), 1
    )
    return around


def _above_one_metre(name: str, values: ArrayLike) -> FloatArray:
    return checks.between(name, values, 1.0, 1e7)
