"""The tables of a run as files: risk, its columns, and what was left out."""

import json
from collections.abc import Iterable, Mapping
from importlib.metadata import version
from pathlib import Path

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from per_obspy.errors import Rejection
from per_obspy.files import written_whole
from per_obspy.screening.columns import column_table


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
    rows = [one._replace(reasons="; ".join(one.reasons)) for one in rejected]  # type: ignore[arg-type]
    table = pd.DataFrame(rows, columns=Rejection._fields).astype({"row": "Int64"})
    with written_whole(path) as part:
        table.to_csv(part, index=False)
