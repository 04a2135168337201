"""Work on one chunk of the inventory, from raw rows to its part of the risk table."""

from collections.abc import Iterable, Iterator
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

import pandas as pd
import pyarrow as pa

from per_obspy.config import Building, Screening
from per_obspy.errors import Rejection
from per_obspy.files import remove_file
from per_obspy.inventory.files.reading import PairChunk, checked_chunk
from per_obspy.results.parts import write_part
from per_obspy.runs.tasks.ground_files import GroundFiles, read_ground
from per_obspy.runs.tasks.parallel import Work, Workers
from per_obspy.runs.tasks.parts import Part, do_parts, record_part, rows_hash
from per_obspy.screening.ranking import in_order
from per_obspy.screening.risk import risk_rows
from per_obspy.screening.site_motion import RegionalMotion

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
        Hash of everything on which the part depends; computed by :func:`do_chunks`.
    """

    number: int
    chunk: PairChunk
    ground: GroundFiles
    building: Building
    screening: Screening
    part: Path
    key: str = ""

    @property
    def rows(self) -> int:
        """Number of rows of the inventory."""
        return len(self.chunk.repeated)


def do_chunks(jobs: Iterable[ChunkJob], workers: Workers) -> Iterator[Part]:
    """Yield the part of every chunk as it is finished, as `parts.do_parts` does."""
    keyed = (job._replace(key=_key(job)) for job in jobs)
    yield from do_parts(keyed, Work(do_chunk, _failed, _name), workers)


def do_chunk(job: ChunkJob) -> Part:
    """Write the rows of a chunk and their status, and return the finished part."""
    remove_file(job.part)
    pairs = checked_chunk(job.chunk)
    rows, uncomputed = _computed_rows(pairs, read_ground(job.ground), job)
    # Rows that cannot be computed belong to the file of the chunk
    rejected = [row._replace(source=job.chunk.rows.source) for row in uncomputed]
    if len(rows):
        write_part(in_order(rows), job.number, job.part)
    return record_part(job, [*pairs.attrs["rejected"], *rejected])


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
    rows = job.chunk.rows
    # Program, settings and ground motion
    settings = [job.building.model_dump_json(), job.screening.model_dump_json()]
    texts = [version("per_obspy"), rows.source, *settings, job.ground.key, repr(rows.broken)]
    # Raw rows, their places in the file, what came before, and what is odd
    places = rows.lines.tobytes() + job.chunk.repeated.tobytes()
    return rows_hash(texts, rows.table, places, "\n".join(job.chunk.odd).encode())


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
    remove_file(job.part)
    return record_part(job, [*rows.broken, *rejected], key="")._replace(failed=True)
