"""
Risk table as a dataset of one file per cell, made of the parts of all chunks.

The client sorts the columns of the order only. Workers arrange every part by cell, and merge every
cell by rank; both are resumed by status files (:mod:`per_obspy.resume`). The folder ``risk/``
appears when all cells are finished, by a change of its name.
"""

import shutil
from collections import Counter
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple, NoReturn

import pyarrow as pa

from per_obspy.files import content_hash, file_hash, remove_file, temporary_folder, writing
from per_obspy.results.parts import joined_schema
from per_obspy.results.ranked_cells import (
    CellCounts,
    CellRows,
    ranks_file,
    write_arranged,
    write_cell,
    write_ranks,
)
from per_obspy.results.ranked_table import ranked_table, table_files
from per_obspy.results.risk import RiskFiles, ranked_schema, write_worst_rows
from per_obspy.results.table_files import write_csv
from per_obspy.resume import earlier_status, read_status, write_status
from per_obspy.runs.tasks.parallel import Work, Workers, new_and_resumed
from per_obspy.runs.tasks.parts import Part
from per_obspy.screening.columns import column_table, csv_columns

#: Folder in the results in which the dataset is made, and the name of the dataset.
WORK, DATASET = "cells", "risk"

#: Form of the arranged files: those of another one are made again.
FORM = "compressed batches, ranks in a file of their own"


class ArrangeJob(NamedTuple):
    """
    One part to arrange by cell.

    Attributes
    ----------
    part, ranks : Path
        The part and the ranks of its rows.
    schema : Schema
        Of all parts.
    size : float
        Width and height of a cell, degrees.
    file : Path
        The arranged file; its status file has the same name.
    key : str
        Hash of everything on which the file depends.
    """

    part: Path
    ranks: Path
    schema: pa.Schema
    size: float
    file: Path
    key: str


class CellJob(NamedTuple):
    """
    One cell to write.

    Attributes
    ----------
    rows : tuple of CellRows
        Its rows in all arranged parts.
    schema : Schema
        Of the file.
    file : Path
        The file; its status file has the same name.
    key : str
        Hash of everything on which the file depends.
    """

    rows: tuple[CellRows, ...]
    schema: pa.Schema
    file: Path
    key: str


def write_cells(
    parts: Sequence[Part], folder: Path, facts: Mapping[str, str], size: float, workers: Workers
) -> RiskFiles:
    """
    Write ``risk/`` with one Parquet file per cell.

    Parameters
    ----------
    parts : sequence of Part
        Parts with rows, at least one.
    folder : Path
        Of the results.
    facts : mapping of str to str
        Facts of the whole table that every file states.
    size : float
        Width and height of a cell, degrees.
    workers : Workers
        Where to work.

    Raises
    ------
    WriteError
        If a file cannot be written.
    Unfinished
        If the machine failed in some; the next run does these.
    """
    # A folder of its own, which a killed run leaves to the next
    work, paths = folder / WORK, [part.path for part in parts if part.path]
    schema = joined_schema(paths)
    known = {"facts": dict(facts), "size": size, "parts": _hashes(parts), "form": FORM}
    key = content_hash(known)
    cells = _arranged(paths, work, schema, (key, size), workers)
    whole = ranked_schema(schema, facts)
    made = _made(work / DATASET)
    jobs = [
        CellJob(tuple(rows), whole, made / f"{cell}.parquet", f"{key} {cell}")
        for cell, rows in sorted(cells.items())
    ]
    # All cells, then the folder under its name
    counts = _written(jobs, workers)
    _publish(work, {job.file for job in jobs}, folder / DATASET)
    return RiskFiles(table_files(folder), *counts)


def _written(jobs: Sequence[CellJob], workers: Workers) -> CellCounts:
    """Write all cells and return their numbers together."""
    total = CellCounts(Counter(), Counter())
    found = new_and_resumed(jobs, _earlier_cell, _WRITTEN, workers)
    for done, counts in enumerate(found, start=1):
        total.states.update(counts.states)
        total.stations.update(counts.stations)
        workers.progress("cells", done, len(jobs))
    return total


def write_texts(table: Sequence[Path], folder: Path, csv_rows: int) -> list[Path]:
    """Write ``risk.csv`` with the worst rows of a dataset, and ``risk.columns.csv``."""
    text, columns = folder / "risk.csv", folder / "risk.columns.csv"
    with ranked_table(table) as ranked:
        names = ranked.schema.names
        write_worst_rows(ranked, csv_rows, text, csv_columns(names))
        write_csv(column_table(names), columns)
    return [text, columns]


def _hashes(parts: Sequence[Part]) -> list[str]:
    """Return the program's version and the hash of every part, as the status files have them."""
    found = [read_status(part.status)["outputs"] for part in parts]
    return [version("per_obspy"), *(digest for one in found for digest in one.values())]


def _arranged(
    parts: Sequence[Path],
    work: Path,
    schema: pa.Schema,
    cells: tuple[str, float],
    workers: Workers,
) -> dict[str, list[CellRows]]:
    """Arrange all parts, and return the rows of each cell in the order of the parts."""
    key, size = cells
    found = list[dict[str, CellRows]]()
    # Ranks come from the order of the whole, everything else from the part alone
    with temporary_folder(_made(work)) as room:
        jobs = [
            ArrangeJob(part, ranks, schema, size, work / "arranged" / f"{part.stem}.arrow", key)
            for part, ranks in zip(parts, write_ranks(parts, room), strict=True)
        ]
        for rows in new_and_resumed(jobs, _earlier_part, _ARRANGED, workers):
            found.append(rows)
            workers.progress("ranking", len(found), len(jobs))
    joined = dict[str, list[CellRows]]()
    for rows in found:
        for cell, some in rows.items():
            joined.setdefault(cell, []).append(some)
    return joined


def _made(folder: Path) -> Path:
    """Return a folder, which is made if need be."""
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    return folder


def _publish(work: Path, files: set[Path], target: Path) -> None:
    """Let the finished dataset appear under its name, and remove what it was made of."""
    for path in work.joinpath(DATASET).iterdir():
        if path not in files:
            remove_file(path)
    with writing(target):
        work.joinpath(DATASET).rename(target)
    shutil.rmtree(work, ignore_errors=True)


def _arrange(job: ArrangeJob) -> dict[str, CellRows]:
    """Arrange one part and write its status."""
    found = write_arranged(job.part, job.ranks, job.schema, job.size, job.file)
    # Place of the rows of each cell; the file is that of the job
    rows = {cell: some[1:] for cell, some in found.items()}
    outputs = {file.name: file_hash(file) for file in (job.file, ranks_file(job.file))}
    write_status(job.file.with_suffix(".json"), job.key, outputs, {"rows": rows})
    return found


def _earlier_part(job: ArrangeJob) -> dict[str, CellRows] | None:
    """Return the rows of a part that an earlier run has arranged, None if it has not."""
    status = earlier_status(job.file.with_suffix(".json"), job.key)
    if status is None:
        return None
    return {cell: CellRows(job.file, *rows) for cell, rows in status["rows"].items()}


def _write(job: CellJob) -> CellCounts:
    """Write one cell and its status."""
    counts = write_cell(job.rows, job.schema, job.file, job.file.parent.parent)
    outputs = {f"{DATASET}/{job.file.name}": file_hash(job.file)}
    write_status(_status_file(job), job.key, outputs, counts._asdict())
    return counts


def _earlier_cell(job: CellJob) -> CellCounts | None:
    """Return the numbers of a cell that an earlier run has written, None if it has not."""
    status = earlier_status(_status_file(job), job.key)
    if status is None:
        return None
    return CellCounts(Counter(status["states"]), Counter(status["stations"]))


def _status_file(job: CellJob) -> Path:
    """Return the status file of a cell, which is not in the folder of the dataset."""
    return job.file.parent.with_name(f"{job.file.stem}.json")


def _failed(job: ArrangeJob | CellJob, reason: str) -> NoReturn:
    """Raise the failure of a job: a table without some of its rows is no table."""
    raise RuntimeError(f"{job.file}: {reason}")


_ARRANGED = Work(_arrange, _failed, lambda job: str(job.file))
_WRITTEN = Work(_write, _failed, lambda job: str(job.file))
