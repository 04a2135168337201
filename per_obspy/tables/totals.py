"""What a region adds up to, as files: totals by area."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.config import Totals
from per_obspy.files import written_whole
from per_obspy.screening.region.outlines import box_outlines, hexagon_outlines, hexagons
from per_obspy.screening.region.totals import grid_cells, joined_totals, partial_totals
from per_obspy.tables.risk import ranked

COLUMNS = (
    "rank",
    "pair_id",
    "state",
    "risk_class",
    "probability",
    "demand_ratio",
    "longitude",
    "latitude",
)


class RegionTotals(NamedTuple):
    """
    Totals of a region.

    Attributes
    ----------
    table : DataFrame
        One row an area: see :func:`per_obspy.screening.region.totals.totals`.
    outlines : list of ndarray or None
        Corners of each area in the order of the rows, (n_corners, 2), degrees east and north; None
        if nobody gave any.
    """

    table: pd.DataFrame
    outlines: list[FloatArray] | None


def region_totals(risk: Path, settings: Totals, classes: Sequence[str]) -> RegionTotals:
    """
    Count the pairs of every area.

    Parameters
    ----------
    risk : Path
        Parquet file of the risk table, at least one row; it is read in pieces.
    settings : Totals
        Column of the pair table that names the area, or else what cells there are.
    classes : sequence of str
        Risk classes, each of which has a column even if no pair is of it.
    """
    counted = partial(_counted, risk, classes)
    if settings.area:
        return RegionTotals(
            counted(settings.area, lambda piece: _named(piece, str(settings.area))), None
        )
    if settings.h3 is not None:
        resolution = settings.h3
        table = counted(
            None, lambda piece: hexagons(piece["longitude"], piece["latitude"], resolution)
        )
        return RegionTotals(table, hexagon_outlines(table["area"]))
    boxes: dict[str, FloatArray] = {}

    def in_grid(piece: pd.DataFrame) -> NDArray[np.object_]:
        cells = grid_cells(piece["longitude"], piece["latitude"], settings.cell)
        boxes.update(zip(cells.boxes.index, box_outlines(cells.boxes), strict=True))
        return cells.cell

    table = counted(None, in_grid)
    return RegionTotals(table, [boxes[name] for name in table["area"]])


def _counted(
    risk: Path,
    classes: Sequence[str],
    column: str | None,
    area: Callable[[pd.DataFrame], NDArray[np.object_]],
) -> pd.DataFrame:
    pieces = ranked(risk, [*COLUMNS, *([column] if column else [])])
    return joined_totals([partial_totals(piece, area(piece), classes) for piece in pieces])


def _named(piece: pd.DataFrame, column: str) -> NDArray[np.object_]:
    return np.asarray(piece[column].fillna("").astype(str), dtype=object)


def write_totals(table: pd.DataFrame, path: Path) -> None:
    """Write the totals as CSV."""
    with written_whole(path) as part:
        table.to_csv(part, index=False)
