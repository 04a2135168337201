"""Rows of buildings as a table, one row per interface, joined from the parts of the jobs."""

import json
from collections.abc import Iterator, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from per_obspy.files import written_whole
from per_obspy.screening.building_rows.row_columns import FLAGS, ROWS
from per_obspy.tables.parts import text_columns
from per_obspy.tables.table_files import regrouped, schema_of, table_of, write_meanings

#: Rows of a row group.
TOGETHER = 10_000


def write_rows_part(interfaces: Mapping[str, Any], path: Path) -> None:
    """Write some interfaces with the columns ``ROWS``."""
    table = table_of(interfaces, ROWS)
    with written_whole(path) as part:
        pq.write_table(
            table, part, row_group_size=TOGETHER, use_dictionary=text_columns(table.schema)
        )


def _tables(parts: Sequence[Path]) -> Iterator[pa.Table]:
    """Yield the rows of each part."""
    for part in parts:
        with pq.ParquetFile(part.absolute()) as file:
            yield file.read(use_threads=False)


def write_rows(parts: Sequence[Path], folder: Path, facts: Mapping[str, str]) -> list[Path]:
    """
    Write ``rows.parquet`` and ``rows.columns.csv``.

    Parameters
    ----------
    parts : sequence of Path
        From :func:`write_rows_part`, in their order.
    folder : Path
        Folder of the files.
    facts : mapping of str to str
        Facts of the whole table that the Parquet file states.
    """
    # The same facts as in the risk table
    files = [folder / "rows.parquet", folder / "rows.columns.csv"]
    statement = {"per_obspy": json.dumps({"version": version("per_obspy"), **facts})}
    schema = schema_of(ROWS, statement)
    dictionaries = text_columns(schema)
    with (
        written_whole(files[0]) as whole,
        pq.ParquetWriter(whole, schema, use_dictionary=dictionaries) as writer,
    ):
        for rows in regrouped(_tables(parts), schema, TOGETHER):
            writer.write_table(rows)
    write_meanings(ROWS, FLAGS, files[1])
    return files
