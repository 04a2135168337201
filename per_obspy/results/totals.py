"""Totals of a region by area, from a risk table that is read in pieces."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
from numpy.typing import ArrayLike, NDArray

from per_obspy.checks import FloatArray
from per_obspy.config import Totals
from per_obspy.inventory.places import near_towns
from per_obspy.results.table_files import rounded_table, write_csv
from per_obspy.screening.totals import (
    GridCells,
    PartialTotals,
    box_outlines,
    grid_cells,
    hexagon_middles,
    hexagon_outlines,
    hexagons,
    joined_parts,
    joined_totals,
    partial_totals,
)

#: Pieces that are joined together.
TOGETHER = 16

#: Columns of the risk table that totals need.
COLUMNS = (
    "rank",
    "pair_id",
    "state",
    "risk_class",
    "probability",
    "expected_impact_velocity",
    "longitude",
    "latitude",
)


#: Column that names the area of a pair where the settings name none.
PLACE = "place"


class RegionTotals(NamedTuple):
    """Totals of a region."""

    #: One row per area: see :func:`per_obspy.screening.totals.totals`.
    table: pd.DataFrame
    #: Corners of each area in the order of the rows, (n_corners, 2), degrees east and north; None
    #: if an area has a name, whose outline is unknown.
    outlines: list[FloatArray] | None


class PieceTotals(NamedTuple):
    """Totals of a piece of the risk table."""

    #: By area.
    totals: PartialTotals
    #: Corners of the grid's cells; empty for other areas.
    boxes: Mapping[str, FloatArray] = MappingProxyType({})


class CountedTotals:
    """Totals of pieces of a risk table that are counted one after the other."""

    def __init__(self) -> None:
        self._waiting = list[PieceTotals]()

    def append(self, piece: PieceTotals) -> None:
        """Count a piece; several that wait become one, so that memory is that of the areas."""
        self._waiting.append(piece)
        if len(self._waiting) >= TOGETHER:
            self._waiting = [_joined(self._waiting)]

    def __iter__(self) -> Iterator[PieceTotals]:
        """Yield the totals of all pieces."""
        yield from self._waiting


def _joined(pieces: Sequence[PieceTotals]) -> PieceTotals:
    """Return the totals of several pieces as those of one."""
    boxes: dict[str, FloatArray] = {}
    for piece in pieces:
        boxes |= piece.boxes
    return PieceTotals(joined_parts(piece.totals for piece in pieces), boxes)


def totals_columns(settings: Totals) -> list[str]:
    """Return the columns of the risk table that totals of these areas need."""
    return [*COLUMNS, settings.area or PLACE]


def piece_totals(piece: pd.DataFrame, settings: Totals, classes: Sequence[str]) -> PieceTotals:
    """
    Count the pairs of every area in a piece of the risk table.

    Parameters
    ----------
    piece : DataFrame
        With the columns of :func:`totals_columns` that the table has.
    settings : Totals
        Column of the pair table that names the area, or else the kind of cells.
    classes : sequence of str
        Risk classes, each of which has a column even if no pair is of it.
    """
    if settings.area or settings.h3 is not None:
        area = areas_of(piece, settings, settings.area or "")
        return PieceTotals(partial_totals(piece, area, classes))
    # Cells of a grid, whose outlines are known, where the place of a pair has no name
    cells = named_cells(piece["longitude"], piece["latitude"], settings.cell)
    boxes = dict(zip(cells.boxes.index, box_outlines(cells.boxes), strict=True))
    return PieceTotals(partial_totals(piece, _with_cells(piece, cells), classes), boxes)


def named_cells(longitude: ArrayLike, latitude: ArrayLike, size: float) -> GridCells:
    """Return the cells of places as :func:`grid_cells` does, named by the nearest town."""
    cells = grid_cells(longitude, latitude, size)
    boxes = cells.boxes
    # Longitudes of a cell may go on beyond 180 degrees
    east = (boxes[["west", "east"]].mean(axis=1) + 180.0) % 360.0 - 180.0
    north = boxes[["south", "north"]].mean(axis=1).clip(-90.0, 90.0)
    names = near_towns(east, north, size)
    number = boxes.index.get_indexer(pd.Index(cells.cell))
    return GridCells(names[number], boxes.set_axis(names))


def _with_cells(piece: pd.DataFrame, cells: GridCells) -> NDArray[np.object_]:
    """Return the place of each row, or else the name of its cell."""
    if PLACE not in piece:
        return cells.cell
    place = piece[PLACE].fillna("").to_numpy(dtype=object)
    return np.where(place == "", cells.cell, place)


def areas_of(piece: pd.DataFrame, settings: Totals, column: str) -> NDArray[np.object_]:
    """
    Return the area or cell of each row of a table.

    Parameters
    ----------
    piece : DataFrame
        With ``longitude, latitude``, degrees, the column of areas if the settings name it, and
        ``place`` if it is known.
    settings : Totals
        Kind of areas.
    column : str
        Column that contains the area, for named areas.
    """
    if settings.area:
        return np.asarray(piece[column].fillna("").astype(str), dtype=object)
    longitude, latitude = piece["longitude"], piece["latitude"]
    if settings.h3 is not None:
        return np.asarray(hexagons(longitude, latitude, settings.h3), dtype=object)
    return _with_cells(piece, named_cells(longitude, latitude, settings.cell))


def named_areas(table: pd.DataFrame, settings: Totals) -> pd.DataFrame:
    """
    Return a table with its ``area`` as people read it: H3 cells by the way from the nearest town.

    Examples
    --------
    >>> named_areas(pd.DataFrame({"area": ["882dadcb69fffff"]}), Totals(h3=8))["area"].tolist()
    ['Kahramanmaraş (0.3 km S, 1.1 km E)']
    """
    if settings.h3 is None or table.empty:
        return table
    from h3 import average_hexagon_edge_length

    # Each cell once
    codes, cells = pd.factorize(table["area"])
    east, north = hexagon_middles(cells).T
    names = near_towns(east, north, average_hexagon_edge_length(settings.h3, "m"))
    return table.assign(area=names[codes])


def with_buildings(table: pd.DataFrame, buildings: Path) -> pd.DataFrame:
    """
    Return totals with the buildings of each area, if there is a table of buildings.

    Parameters
    ----------
    table : DataFrame
        Totals by ``area``.
    buildings : Path
        ``buildings.parquet``, worst first; it need not exist.

    Returns
    -------
    DataFrame
        With the columns ``BUILDING_TOTALS``. A building counts in the area of its worst pair, so
        that no other areas are needed.
    """
    if not buildings.exists():
        return table
    names = ["area", "building_id", "impacts", "probability_common", "probability_independent"]
    found = pq.read_table(buildings.absolute(), columns=names, use_threads=False).to_pandas()
    # The worst building comes first
    groups = found.assign(hit=found["impacts"].fillna(0) > 0).groupby("area", sort=True)
    counted = pd.DataFrame(
        {
            "buildings": groups.size(),
            "buildings_hit": groups["hit"].sum(),
            "expected_buildings_common": groups["probability_common"].sum(),
            "expected_buildings_independent": groups["probability_independent"].sum(),
            "worst_building": groups["building_id"].first(),
        }
    ).reindex(table["area"])
    # An area whose pairs are all repeated elsewhere has no building
    numbers = counted.columns.drop("worst_building")
    counted[numbers] = counted[numbers].fillna(0)
    counted = counted.astype({"buildings": np.int64, "buildings_hit": np.int64})
    return table.join(counted, on="area")


def region_totals(pieces: Iterable[PieceTotals], settings: Totals) -> RegionTotals:
    """Join the totals of the pieces of a risk table."""
    counted = _joined(list(pieces))
    table = joined_totals([counted.totals])
    if settings.area:
        return RegionTotals(table, None)
    if settings.h3 is not None:
        return RegionTotals(table, hexagon_outlines(table["area"]))
    # One area with a name of its own leaves no outline to all
    is_grid = counted.boxes.keys() >= set(table["area"])
    outlines = [counted.boxes[name] for name in table["area"]] if is_grid else None
    return RegionTotals(table, outlines)


def write_totals(table: pd.DataFrame, path: Path) -> None:
    """Write the totals as CSV, numbers rounded."""
    write_csv(rounded_table(table, own=table.columns), path)
