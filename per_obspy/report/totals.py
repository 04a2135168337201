"""What a region adds up to, as files: totals by area and, where pounding was observed, how the prediction did."""

import json
from pathlib import Path

import pandas as pd
import pyarrow.parquet as pq

from per_obspy.config import Totals
from per_obspy.files import written_whole
from per_obspy.report.ranked import ranked
from per_obspy.screening.evaluation import evaluation
from per_obspy.screening.totals import grid_cells, joined_totals, partial_totals

COLUMNS = ("rank", "pair_id", "state", "risk_class", "probability", "demand_ratio", "longitude", "latitude")


def write_totals(risk: Path, settings: Totals, folder: Path) -> list[Path]:
    """
    Write ``totals.csv`` and, where pounding was observed, ``evaluation.json``; return their paths.

    Parameters
    ----------
    risk : Path
        Parquet file of the risk table, at least one row.
    settings : Totals
        Column of the pair table that names the area, or else the size of the cells of a grid.
    folder : Path
        Where to.
    """
    columns = [*COLUMNS, *([settings.area] if settings.area else [])]
    parts = [partial_totals(piece, _areas(piece, settings)) for piece in ranked(risk, columns)]
    with written_whole(folder / "totals.csv") as part:
        joined_totals(parts).to_csv(part, index=False)
    if "observed" not in pq.read_schema(risk).names:
        return [folder / "totals.csv"]
    return [folder / "totals.csv", *_write_evaluation(risk, folder / "evaluation.json")]


def _areas(table: pd.DataFrame, settings: Totals) -> pd.Series:
    if settings.area:
        return table[settings.area].fillna("").astype(str)
    return pd.Series(grid_cells(table["longitude"], table["latitude"], settings.cell).cell)


def _write_evaluation(risk: Path, path: Path) -> list[Path]:
    """Compare the pairs that somebody looked at, if there are any."""
    pieces = ranked(risk, ["observed", "state", "probability"])
    seen = pd.concat([piece[piece["observed"].notna()] for piece in pieces], ignore_index=True)
    if seen.empty:
        return []
    found = evaluation(seen)._asdict()
    found["reliability"] = found["reliability"].to_dict("records")
    with written_whole(path) as part:
        part.write_text(json.dumps(found, indent=1, default=float), encoding="utf-8")
    return [path]
