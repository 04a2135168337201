"""Totals of a region by area, from a risk table that is read in pieces."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import pandas as pd

from per_obspy.checks import FloatArray
from per_obspy.config import Totals
from per_obspy.screening.region.outlines import box_outlines, hexagon_outlines, hexagons
from per_obspy.screening.region.totals import (
    PartialTotals,
    grid_cells,
    joined_totals,
    partial_totals,
)
from per_obspy.tables.rounding import rounded_table
from per_obspy.tables.table_files import write_csv

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


class RegionTotals(NamedTuple):
    """
    Totals of a region.

    Attributes
    ----------
    table : DataFrame
        One row per area: see :func:`per_obspy.screening.region.totals.totals`.
    outlines : list of ndarray or None
        Corners of each area in the order of the rows, (n_corners, 2), degrees east and north; None
        for named areas, whose outline is unknown.
    """

    table: pd.DataFrame
    outlines: list[FloatArray] | None


class PieceTotals(NamedTuple):
    """
    Totals of a piece of the risk table.

    Attributes
    ----------
    totals : PartialTotals
        By area.
    boxes : mapping of str to ndarray
        Corners of the grid's cells; empty for other areas.
    """

    totals: PartialTotals
    boxes: Mapping[str, FloatArray] = MappingProxyType({})


def totals_columns(settings: Totals) -> list[str]:
    """Return the columns of the risk table that totals of these areas need."""
    return [*COLUMNS, *([settings.area] if settings.area else [])]


def piece_totals(piece: pd.DataFrame, settings: Totals, classes: Sequence[str]) -> PieceTotals:
    """
    Count the pairs of every area in a piece of the risk table.

    Parameters
    ----------
    piece : DataFrame
        With the columns of :func:`totals_columns`.
    settings : Totals
        Column of the pair table that names the area, or else the kind of cells.
    classes : sequence of str
        Risk classes, each of which has a column even if no pair is of it.
    """
    longitude, latitude = piece["longitude"], piece["latitude"]
    if settings.area:
        area = np.asarray(piece[settings.area].fillna("").astype(str), dtype=object)
        return PieceTotals(partial_totals(piece, area, classes))
    if settings.h3 is not None:
        area = hexagons(longitude, latitude, settings.h3)
        return PieceTotals(partial_totals(piece, area, classes))
    # Cells of a grid, whose outlines are known
    cells = grid_cells(longitude, latitude, settings.cell)
    boxes = dict(zip(cells.boxes.index, box_outlines(cells.boxes), strict=True))
    return PieceTotals(partial_totals(piece, cells.cell, classes), boxes)


def region_totals(pieces: Iterable[PieceTotals], settings: Totals) -> RegionTotals:
    """
    Join the totals of the pieces of a risk table.

    Parameters
    ----------
    pieces : iterable of PieceTotals
        From :func:`piece_totals`, at least one.
    settings : Totals
        The same as of the pieces.
    """
    counted = list(pieces)
    table = joined_totals([piece.totals for piece in counted])
    if settings.area:
        return RegionTotals(table, None)
    if settings.h3 is not None:
        return RegionTotals(table, hexagon_outlines(table["area"]))
    # Outlines of all cells that a piece has
    boxes: dict[str, FloatArray] = {}
    for piece in counted:
        boxes |= piece.boxes
    return RegionTotals(table, [boxes[name] for name in table["area"]])


def write_totals(table: pd.DataFrame, path: Path) -> None:
    """Write the totals as CSV, numbers rounded."""
    write_csv(rounded_table(table), path)
