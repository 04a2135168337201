"""
Parts of a table, each made by one task and reused by later runs.

A part is a Parquet file with a status file (:mod:`per_obspy.resume`) of its name, which also holds
the rejections. A task whose status and part are whole is not done again.
"""

import hashlib
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple, Protocol, TypeVar

import pyarrow as pa

from per_obspy.errors import Rejection
from per_obspy.files import file_hash, remove_file
from per_obspy.resume import earlier_status, read_status, write_status
from per_obspy.runs.tasks.parallel import Work, Workers, new_and_resumed


class PartJob(Protocol):
    """Task that makes one part."""

    @property
    def number(self) -> int:
        """Place of the part among all of them."""

    @property
    def rows(self) -> int:
        """Number of rows that it takes."""

    @property
    def part(self) -> Path:
        """Parquet file that it makes."""

    @property
    def key(self) -> str:
        """Hash of everything on which the part depends."""


Job = TypeVar("Job", bound=PartJob)


class Part(NamedTuple):
    """
    Result of a task.

    Attributes
    ----------
    number : int
        Its place.
    rows : int
        Number of rows that it took.
    path : Path or None
        Its rows; None if none was left.
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
    resumed: bool = False
    failed: bool = False


def do_parts(jobs: Iterable[Job], work: Work[Job, Part], workers: Workers) -> Iterator[Part]:
    """
    Yield every part as it is finished, in parallel; finished parts of an earlier run are reused.

    Parameters
    ----------
    jobs : iterable of PartJob
        Tasks with their keys, which are taken while the work goes on.
    work : Work
        What a task does.
    workers : Workers
        Where to work.

    Raises
    ------
    WriteError
        If a part cannot be written.
    Unfinished
        After all other tasks, if the machine failed at some.
    """
    yield from new_and_resumed(jobs, _earlier_part, work, workers)


def record_part(job: PartJob, rejected: Sequence[Rejection], key: str | None = None) -> Part:
    """Write the status of a part, after the part if there is one, and return the part."""
    has_part = job.part.is_file()
    outputs = {job.part.name: file_hash(job.part)} if has_part else {}
    key = job.key if key is None else key
    write_status(_status_file(job), key, outputs, {"rejected": list(rejected)})
    return _part(job, has_part)


def _earlier_part(job: PartJob) -> Part | None:
    """Return the part of an earlier run if its key is the same and the part is complete."""
    status = earlier_status(_status_file(job), job.key)
    if status is None or "rejected" not in status:
        return None
    return _part(job, bool(status["outputs"]))._replace(resumed=True)


def _part(job: PartJob, has_part: bool) -> Part:
    """Return the part of a task."""
    return Part(job.number, job.rows, job.part if has_part else None, _status_file(job))


def _status_file(job: PartJob) -> Path:
    """Return the status file of a part."""
    return job.part.with_suffix(".json")


def rejections(parts: Iterable[Part]) -> Iterator[Rejection]:
    """Yield the rejections of parts, reading one part at a time."""
    for part in parts:
        yield from map(Rejection.stored, read_status(part.status)["rejected"])


def remove_other_parts(folder: Path, parts: Iterable[Part]) -> None:
    """Remove parts of an earlier table, and partly written ones."""
    known = {path for part in parts for path in (part.path, part.status)}
    for path in folder.iterdir() if folder.is_dir() else ():
        if path not in known and path.is_file():
            remove_file(path)


def rows_hash(texts: Iterable[str], table: pa.Table, *others: bytes) -> str:
    """Return the hash of texts, of the rows of a table, and of other bytes."""
    digest = hashlib.sha256("\n".join(texts).encode())
    content = pa.BufferOutputStream()
    with pa.ipc.new_stream(content, table.schema) as stream:
        stream.write_table(table.combine_chunks())
    digest.update(content.getvalue())
    for other in others:
        digest.update(other)
    return digest.hexdigest()
