"""Work on one piece of connected pairs without histories: its rows and its buildings, in order."""

from pathlib import Path
from typing import NamedTuple, NoReturn

import pyarrow as pa

from per_obspy.buildings.search import WITHOUT_HISTORIES, PieceRows, find_in_piece
from per_obspy.buildings.tables import write_parts_of_piece
from per_obspy.config import Run
from per_obspy.runs.tasks.parallel import Work


class PieceTask(NamedTuple):
    """One piece of connected pairs."""

    #: Number of the piece.
    number: int
    #: The pairs, as a stream: a slice of a table would travel with all of it.
    pairs: pa.Buffer
    #: Settings of the run.
    settings: Run
    #: Folder of the parts.
    room: Path

    @property
    def files(self) -> tuple[Path, Path]:
        """Parts of the rows and of the buildings."""
        names = (f"{kind}-{self.number:06}.parquet" for kind in ("rows", "buildings"))
        rows, buildings = (self.room / name for name in names)
        return rows, buildings


def piece_task(number: int, pairs: pa.Table, settings: Run, room: Path) -> PieceTask:
    """Return the task of a piece of connected pairs."""
    content = pa.BufferOutputStream()
    with pa.ipc.new_stream(content, pairs.schema) as stream:
        stream.write_table(pairs)
    return PieceTask(number, content.getvalue(), settings, room)


def _do(task: PieceTask) -> tuple[PieceTask, PieceRows]:
    """Write both parts; return the task without its pairs, and what else is found."""
    with pa.ipc.open_stream(task.pairs) as stream:
        pairs = stream.read_all()
    contacts, found = find_in_piece(pairs, task.settings.rows, WITHOUT_HISTORIES)
    write_parts_of_piece(contacts, task.settings, task.number, *task.files)
    return task._replace(pairs=pa.py_buffer(b"")), found


def _failed(task: PieceTask, reason: str) -> NoReturn:
    """End the run: no row of the table is wrong, but the program is."""
    raise RuntimeError(f"rows of buildings, piece {task.number}: {reason}")


#: Work on all pieces.
PIECES = Work(_do, _failed, lambda task: f"rows of buildings, piece {task.number}")
