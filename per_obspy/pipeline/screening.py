"""The second stage: pairs and the shards of stations become the risk table, chunk by chunk."""

from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from itertools import chain
from pathlib import Path
from typing import NamedTuple

from per_obspy.config import Run
from per_obspy.errors import CatalogError, Rejection
from per_obspy.inventory.files.reading import PairInventory
from per_obspy.jobs.chunk import (
    CHUNK,
    ChunkJob,
    GroundFiles,
    Part,
    do_chunks,
    ground_files,
    rejections,
)
from per_obspy.pipeline.pairs import pair_files
from per_obspy.progress import Progress
from per_obspy.tables.risk import ranked, write_risk
from per_obspy.tables.writing import write_rejected
from per_obspy.threads import usable_processors

KINDS = ("file", "record", "station", "service", "pair")
STATES = ("yes", "possible", "no")


class Screened(NamedTuple):
    """
    What screening has left.

    Attributes
    ----------
    outputs : list of Path
        The files.
    counts : dict
        Pairs and their states, rejections of each kind, and chunks that an earlier run had done.
    """

    outputs: list[Path]
    counts: dict[str, int]


def screened(
    settings: Run,
    folder: Path,
    shards: Sequence[Path],
    rejected: Sequence[Rejection],
    executor: Executor | None,
    progress: Progress,
) -> Screened:
    """
    Write the risk table and what was left out, whatever the size of the inventory.

    Parameters
    ----------
    settings : Run
        What to do.
    folder : Path
        Of the results.
    shards : sequence of Path
        Stations; if there is none, only ``rejected.csv`` is written.
    rejected : sequence of Rejection
        What was left out before.
    executor : Executor, optional
        Where to work instead of processes of this machine.
    progress : callable
        Told of every chunk.

    Raises
    ------
    CatalogError
        If the inventory is wrong as a whole.
    """
    maps = _maps(settings)
    ground, nowhere = ground_files(shards, maps, settings.screening.interpolation)
    parts = _parts(settings, folder, ground, executor, progress) if shards or maps else []
    kinds = write_rejected(chain(rejected, nowhere, rejections(parts)), folder / "rejected.csv")
    outputs, states = [folder / "rejected.csv"], Counter[str]()
    if tables := [part.path for part in parts if part.path]:
        progress("ranking", 0, 1)
        facts = {"name": settings.name, "simulated": str(settings.simulation is not None).lower()}
        outputs += write_risk(tables, folder, facts, settings.csv_rows)
        for piece in ranked(folder / "risk.parquet", ["state"]):
            states.update(piece["state"])
        progress("ranking", 1, 1)
    counts = {"pairs": states.total(), **{state: states[state] for state in STATES}}
    counts |= {f"rejected_{kind}": kinds[kind] for kind in KINDS}
    return Screened(
        outputs,
        counts | {"chunks": len(parts), "chunks_resumed": sum(part.resumed for part in parts)},
    )


def _maps(settings: Run) -> tuple[Path, ...]:
    """Return the files of the ShakeMap, none if there is no map."""
    records = settings.records
    return (
        tuple(one for one in (records.shakemap, records.shakemap_uncertainty) if one)
        if records
        else ()
    )


def _parts(
    settings: Run, folder: Path, ground: GroundFiles, executor: Executor | None, progress: Progress
) -> list[Part]:
    """Return the part of every chunk, in the order of the inventory; parts of a longer one before are removed."""
    inventory = PairInventory(pair_files(settings, folder, ground.stations))
    if settings.totals.area and settings.totals.area not in inventory.names:
        raise CatalogError("totals", f"area: the pair table has no column {settings.totals.area!r}")
    progress("screening", 0, inventory.count)
    parts, rows = list[Part](), 0
    jobs, workers = (
        _jobs(settings, folder, ground, inventory),
        settings.workers or usable_processors(),
    )
    for part in do_chunks(jobs, workers, executor):
        parts.append(part)
        rows += part.rows
        progress("screening", min(rows, inventory.count), inventory.count)
    _remove_others(_chunk_folder(folder), parts)
    return sorted(parts, key=lambda part: part.number)


def _remove_others(folder: Path, parts: Sequence[Part]) -> None:
    known = {part.number for part in parts}
    for note in [one for one in folder.glob("*.json") if int(one.stem) not in known]:
        note.with_suffix(".parquet").unlink(missing_ok=True)
        note.unlink()


def _jobs(
    settings: Run, folder: Path, ground: GroundFiles, inventory: PairInventory
) -> Iterator[ChunkJob]:
    for number, chunk in enumerate(inventory.chunks(CHUNK)):
        part = _chunk_folder(folder) / f"{number:06}.parquet"
        yield ChunkJob(chunk, ground, settings.building, settings.screening, part)


def _chunk_folder(folder: Path) -> Path:
    return folder / "chunks"
