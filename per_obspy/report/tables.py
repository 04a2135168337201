"""The tables of a run as files: risk, its columns, and what was left out."""

import json
from collections.abc import Iterable, Mapping
from importlib.metadata import version
from pathlib import Path

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from per_obspy.errors import CatalogError, Rejection
from per_obspy.files import written_whole
from per_obspy.screening.columns import column_table
from per_obspy.screening.evaluation import evaluation
from per_obspy.screening.totals import grid_cells, totals


def write_risk(table: pd.DataFrame, folder: Path, facts: Mapping[str, str]) -> None:
    """
    Write ``risk.csv``, ``risk.parquet`` and ``risk.columns.csv``.

    Parameters
    ----------
    table : DataFrame
        From :func:`per_obspy.risk_table`.
    folder : Path
        Where to.
    facts : mapping of str to str
        What the Parquet file says of the whole table, for example whether the motion is simulated.
    """
    plain = table.copy()
    plain.attrs = {}
    with written_whole(folder / "risk.csv") as part:
        plain.to_csv(part, index=False)
    arrow = pa.Table.from_pandas(plain, preserve_index=False)
    said = {"per_obspy": json.dumps({"version": version("per_obspy"), **facts})}
    with written_whole(folder / "risk.parquet") as part:
        pq.write_table(arrow.replace_schema_metadata({**(arrow.schema.metadata or {}), **said}), part)
    with written_whole(folder / "risk.columns.csv") as part:
        column_table(plain.columns).to_csv(part, index=False)


def write_rejected(rejected: Iterable[Rejection], path: Path) -> None:
    """Write what was left out, one row a thing, its reasons separated by semicolons."""
    rows = [(*one[:-1], "; ".join(one.reasons)) for one in rejected]
    table = pd.DataFrame(rows, columns=Rejection._fields).astype({"row": "Int64"})
    with written_whole(path) as part:
        table.to_csv(part, index=False)


def write_totals(table: pd.DataFrame, cell: float, area: str | None, folder: Path) -> list[Path]:
    """
    Write totals by area and, where pounding was observed, how the prediction did.

    Parameters
    ----------
    table : DataFrame
        From :func:`per_obspy.risk_table`, at least one row.
    cell : float
        Size of the cells of a grid, m.
    area : str, optional
        Column of the pair table that names the area, instead of cells.
    folder : Path
        Where ``totals.csv`` and ``evaluation.json`` go.

    Returns
    -------
    list of Path
        The files.

    Raises
    ------
    CatalogError
        If the pair table has no such column.
    """
    if area is not None and area not in table:
        raise CatalogError("totals", f"area: the pair table has no column {area!r}")
    by = table[area] if area else grid_cells(table["longitude"], table["latitude"], cell).cell
    with written_whole(folder / "totals.csv") as part:
        totals(table, by).to_csv(part, index=False)
    if "observed" not in table or not table["observed"].notna().any():
        return [folder / "totals.csv"]
    seen = evaluation(table)._asdict()
    seen["reliability"] = seen["reliability"].to_dict("records")
    with written_whole(folder / "evaluation.json") as part:
        part.write_text(json.dumps(seen, indent=1, default=float), encoding="utf-8")
    return [folder / "totals.csv", folder / "evaluation.json"]
