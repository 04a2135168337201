"""
Work on one chunk of the inventory, from raw rows to its part of the risk table.

Chunks are independent of each other. A part is a Parquet file with a status file
(:mod:`per_obspy.resume`) of its name, which also holds the rejections. A chunk whose status and
part are whole is not done again.
"""

import hashlib
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Executor
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

import pandas as pd
import pyarrow as pa

from per_obspy.config import Building, Screening
from per_obspy.errors import Rejection
from per_obspy.files import file_hash, remove_file
from per_obspy.inventory.files.reading import PairChunk, checked_chunk
from per_obspy.jobs.ground_files import GroundFiles, read_ground
from per_obspy.jobs.parallel import Work, new_and_resumed
from per_obspy.resume import earlier_status, read_status, write_status
from per_obspy.screening.ranking import in_order
from per_obspy.screening.risk import risk_rows
from per_obspy.screening.site_motion import RegionalMotion
from per_obspy.tables.parts import write_part

#: Rows of a chunk at most: a worker needs about 10 kB for each.
CHUNK = 100_000


class ChunkJob(NamedTuple):
    """
    One chunk to do.

    Attributes
    ----------
    number : int
        Place of the chunk in the inventory.
    chunk : PairChunk
        Raw rows.
    ground : GroundFiles
        The ground motion.
    building, screening : Building, Screening
        Settings.
    part : Path
        Where its rows go.
    key : str
        Hash of everything on which the part depends; :func:`do_chunks` computes it.
    """

    number: int
    chunk: PairChunk
    ground: GroundFiles
    building: Building
    screening: Screening
    part: Path
    key: str = ""


class Part(NamedTuple):
    """
    Result of a chunk.

    Attributes
    ----------
    number : int
        Its place in the inventory.
    rows : int
        Number of rows of the inventory that it held.
    path : Path or None
        Rows of the risk table, and the keys of their order; None if no pair was left.
    status : Path
        Status file with the rejections, see :func:`rejections`.
    resumed : bool
        Whether an earlier run had done it.
    failed : bool
        Whether its work failed unexpectedly, so that the next run does it again.
    """

    number: int
    rows: int
    path: Path | None
    status: Path
    resumed: bool
    failed: bool = False


def rejections(parts: Iterable[Part]) -> Iterator[Rejection]:
    """Yield the rejections of parts, reading one part at a time."""
    for part in parts:
        yield from map(Rejection.stored, read_status(part.status)["rejected"])


def do_chunks(jobs: Iterable[ChunkJob], workers: int, executor: Executor | None) -> Iterator[Part]:
    """
    Yield every part as it is finished, in parallel; finished parts of an earlier run are reused.

    Parameters
    ----------
    jobs : iterable of ChunkJob
        Chunks, which are taken while the work goes on.
    workers : int
        Number of processes.
    executor : Executor or None
        Where to work instead.

    Raises
    ------
    WriteError
        If a part cannot be written.
    Unfinished
        After all other chunks, if the machine failed at some.
    """
    keyed = (job._replace(key=_key(job)) for job in jobs)
    work = Work(do_chunk, _failed, _name)
    yield from new_and_resumed(keyed, _earlier, work, workers, executor)


def do_chunk(job: ChunkJob) -> Part:
    """Write the rows of a chunk and their status, and return the finished part."""
    remove_file(job.part)
    pairs = checked_chunk(job.chunk)
    rows, uncomputed = _computed_rows(pairs, read_ground(job.ground), job)
    # Rows that cannot be computed belong to the file of the chunk
    rejected = [row._replace(source=job.chunk.rows.source) for row in uncomputed]
    if len(rows):
        ordered = in_order(rows)
        write_part(ordered, job.number, job.part)
    has_part = len(rows) > 0
    return _recorded(job, job.key, has_part, [*pairs.attrs["rejected"], *rejected])


def _recorded(job: ChunkJob, key: str, has_part: bool, rejected: Sequence[Rejection]) -> Part:
    """Write the status of a part, after the part, and return the part."""
    outputs = {job.part.name: file_hash(job.part)} if has_part else {}
    write_status(_status_file(job), key, outputs, {"rejected": rejected})
    return _part(job, has_part, resumed=False)


def _part(job: ChunkJob, has_part: bool, resumed: bool) -> Part:
    """Return the part of a chunk."""
    path = job.part if has_part else None
    return Part(job.number, len(job.chunk.repeated), path, _status_file(job), resumed)


def _status_file(job: ChunkJob) -> Path:
    """Return the status file of a chunk."""
    return job.part.with_suffix(".json")


def _computed_rows(
    pairs: pd.DataFrame, ground: RegionalMotion, job: ChunkJob
) -> tuple[pd.DataFrame, tuple[Rejection, ...]]:
    """Compute the rows of all pairs but those that fail, which are found by halving."""
    try:
        return risk_rows(pairs, ground, job.building, job.screening)
    except (ValueError, ArithmeticError) as error:
        if len(pairs) == 1:
            name = pairs["pair_id"].iloc[0]
            return pairs.iloc[:0], (Rejection("pair", name, "", None, (str(error),)),)

    # A pair among several fails: each half is computed alone
    middle = len(pairs) // 2
    first, rejected_first = _computed_rows(pairs.iloc[:middle], ground, job)
    second, rejected_second = _computed_rows(pairs.iloc[middle:], ground, job)
    tables = [rows for rows in (first, second) if len(rows)]
    joined = pd.concat(tables) if tables else pairs.iloc[:0]
    return joined, (*rejected_first, *rejected_second)


def _key(job: ChunkJob) -> str:
    """Return the hash of all inputs of the part."""
    rows, digest = job.chunk.rows, hashlib.sha256()
    # Program, settings and ground motion
    settings = [job.building.model_dump_json(), job.screening.model_dump_json()]
    parts = [version("per_obspy"), rows.source, *settings, job.ground.key]
    digest.update("\n".join(parts).encode())
    # Raw rows: broken lines, cells, places in their file, what came before, and what is odd
    digest.update(repr(rows.broken).encode())
    content = pa.BufferOutputStream()
    with pa.ipc.new_stream(content, rows.table.schema) as stream:
        stream.write_table(rows.table.combine_chunks())
    digest.update(content.getvalue())
    digest.update(rows.lines.tobytes() + job.chunk.repeated.tobytes())
    digest.update("\n".join(job.chunk.odd).encode())
    return digest.hexdigest()


def _earlier(job: ChunkJob) -> Part | None:
    """Return the part of an earlier run if its key is the same and the part is complete."""
    status = earlier_status(_status_file(job), job.key)
    if status is None or "rejected" not in status:
        return None
    return _part(job, bool(status["outputs"]), resumed=True)


def _name(job: ChunkJob) -> str:
    """Return the name of a chunk in messages: its file and the lines of its pairs."""
    rows = job.chunk.rows
    lines = f", lines {rows.lines.min()} to {rows.lines.max()}" if rows.lines.size else ""
    return f"pairs of {rows.source}{lines}"


def _failed(job: ChunkJob, reason: str) -> Part:
    """Return a part of rejections only after a failure; the next run repeats it."""
    # One rejection per pair, with its line
    rows = job.chunk.rows
    # Every row has the reason
    names = rows.table["pair_id"].cast(pa.string()).to_pylist()
    rejected = [
        Rejection("pair", name or "", rows.source, line, (reason,))
        for name, line in zip(names, rows.lines.tolist(), strict=True)
    ]
    return _recorded(job, "", False, [*rows.broken, *rejected])._replace(failed=True)
