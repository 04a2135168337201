"""Work on one chunk of the inventory, from raw rows to its part of the risk table."""

from dataclasses import dataclass, replace
from importlib.metadata import version

import pandas as pd
import pyarrow as pa

from per_obspy.config import Building, Screening
from per_obspy.errors import Rejection
from per_obspy.files import remove_file
from per_obspy.inventory.files.reading import PairChunk, checked_chunk
from per_obspy.results.parts import write_part
from per_obspy.runs.tasks.earlier_result import EarlierResult, earlier_rows
from per_obspy.runs.tasks.ground_files import GroundFiles, read_ground
from per_obspy.runs.tasks.parts import Part, PartTask, rows_hash
from per_obspy.screening.earlier_damage import pairs_after
from per_obspy.screening.ranking import in_order
from per_obspy.screening.risk import risk_rows
from per_obspy.screening.site_motion import RegionalMotion

#: Rows of a chunk at most: a worker needs about 10 kB for each.
CHUNK = 100_000


@dataclass(frozen=True, kw_only=True)
class ChunkTask(PartTask):
    """One chunk of the inventory."""

    #: Raw rows.
    chunk: PairChunk
    #: The ground motion.
    ground: GroundFiles
    #: Settings.
    building: Building
    screening: Screening
    #: Results of an earlier earthquake, from which the pairs start.
    after: EarlierResult | None = None

    @property
    def rows(self) -> int:
        """Number of rows of the inventory."""
        return len(self.chunk.repeated)

    @property
    def name(self) -> str:
        """File and lines of the pairs."""
        rows = self.chunk.rows
        lines = f", lines {rows.lines.min()} to {rows.lines.max()}" if rows.lines.size else ""
        return f"pairs of {rows.source}{lines}"

    def content_hash(self) -> str:
        """Return the hash of all inputs of the part."""
        rows = self.chunk.rows
        # Program, settings and ground motion
        settings = [self.building.model_dump_json(), self.screening.model_dump_json()]
        texts = [version("per_obspy"), rows.source, *settings, self.ground.key, repr(rows.broken)]
        texts += [self.after.key] if self.after else []
        # Raw rows, their places in the file, what came before, and what is odd
        places = rows.lines.tobytes() + self.chunk.repeated.tobytes()
        return rows_hash(texts, rows.table, places, "\n".join(self.chunk.odd).encode())

    def do(self) -> Part:
        """Write the rows of the chunk and their status, and return the finished part."""
        remove_file(self.part)
        pairs = checked_chunk(self.chunk)
        rejected_rows = pairs.attrs["rejected"]
        if self.after:
            left = earlier_rows(self.after, pairs["pair_id"])
            pairs = pairs_after(pairs, left, self.building.code_level)
        rows, uncomputed = _computed_rows(pairs, read_ground(self.ground), self)
        # Rows that cannot be computed belong to the file of the chunk
        rejected = [row._replace(source=self.chunk.rows.source) for row in uncomputed]
        if len(rows):
            write_part(in_order(rows), self.number, self.part)
        return self.record([*rejected_rows, *rejected])

    def failed(self, reason: str) -> Part:
        """Return a part of one rejection per pair after a failure; the next run repeats it."""
        # Every row with its line
        rows = self.chunk.rows
        names = rows.table["pair_id"].cast(pa.string()).to_pylist()
        rejected = [
            Rejection("pair", name or "", rows.source, line, (reason,))
            for name, line in zip(names, rows.lines.tolist(), strict=True)
        ]
        remove_file(self.part)
        return replace(self, key="").record([*rows.broken, *rejected])._replace(failed=True)


def _computed_rows(
    pairs: pd.DataFrame, ground: RegionalMotion, task: ChunkTask
) -> tuple[pd.DataFrame, tuple[Rejection, ...]]:
    """Compute the rows of all pairs but those that fail, which are found by halving."""
    try:
        return risk_rows(pairs, ground, task.building, task.screening)
    except (ValueError, ArithmeticError) as error:
        if len(pairs) == 1:
            name = pairs["pair_id"].iloc[0]
            return pairs.iloc[:0], (Rejection("pair", name, "", None, (str(error),)),)

    # A pair among several fails: each half is computed alone
    middle = len(pairs) // 2
    first, rejected_first = _computed_rows(pairs.iloc[:middle], ground, task)
    second, rejected_second = _computed_rows(pairs.iloc[middle:], ground, task)
    tables = [rows for rows in (first, second) if len(rows)]
    joined = pd.concat(tables) if tables else pairs.iloc[:0]
    return joined, (*rejected_first, *rejected_second)
