"""
Parts of a table, each made by one task and reused by later runs.

A part is a Parquet file with a status file (:mod:`per_obspy.resume`) of its name, which also holds
the rejections. A task whose status and part are whole is not done again.
"""

import hashlib
from abc import abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple, Self

import pyarrow as pa

from per_obspy.errors import Rejection
from per_obspy.files import file_hash, remove_file
from per_obspy.resume import earlier_status, read_status, write_status
from per_obspy.runs.tasks.parallel import Resumable


class Part(NamedTuple):
    """Result of a task."""

    #: Its place.
    number: int
    #: Number of rows that it took.
    rows: int
    #: Its rows; None if none was left.
    path: Path | None
    #: Status file with the rejections, see :func:`rejections`.
    status: Path
    #: Whether an earlier run had done it.
    resumed: bool = False
    #: Whether its work failed unexpectedly, so that the next run does it again.
    failed: bool = False


@dataclass(frozen=True, kw_only=True)
class PartTask(Resumable[Part]):
    """Task that makes one part."""

    #: Place of the part among all of them.
    number: int
    #: Parquet file that it makes.
    part: Path
    #: Hash of everything on which the part depends; empty until it is computed.
    key: str = ""

    @property
    @abstractmethod
    def rows(self) -> int:
        """Number of rows that it takes."""

    @abstractmethod
    def content_hash(self) -> str:
        """Return the hash of everything on which the part depends."""

    def with_key(self) -> Self:
        """Return the task with its key."""
        return replace(self, key=self.content_hash())

    def earlier(self) -> Part | None:
        """Return the part of an earlier run if its key is the same and the part is complete."""
        status = earlier_status(self._status, self.key)
        if status is None or "rejected" not in status:
            return None
        return self._finished(bool(status["outputs"]))._replace(resumed=True)

    def record(self, rejected: Sequence[Rejection]) -> Part:
        """Write the status of the part, after the part if there is one, and return the part."""
        has_part = self.part.is_file()
        outputs = {self.part.name: file_hash(self.part)} if has_part else {}
        write_status(self._status, self.key, outputs, {"rejected": list(rejected)})
        return self._finished(has_part)

    @property
    def _status(self) -> Path:
        """Status file of the part."""
        return self.part.with_suffix(".json")

    def _finished(self, has_part: bool) -> Part:
        """Return the part of this task."""
        return Part(self.number, self.rows, self.part if has_part else None, self._status)


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
