"""
The work of one chunk of the inventory, from raw rows to its part of the risk table; chunks do not know of each other.

A part is a Parquet file beside a small JSON file that tells what it was made from and what was left
out on the way, as the shards of stations are. Where that still holds, nothing is done again.
"""

import hashlib
import json
from collections.abc import Hashable, Iterable, Iterator, Sequence
from concurrent.futures import Executor
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import pyarrow as pa
import xarray as xr

from per_obspy.config import Building, Interpolation, Screening
from per_obspy.errors import Rejection
from per_obspy.files import file_hash, written_whole
from per_obspy.inventory.files.reading import PairChunk, checked_chunk
from per_obspy.jobs.parallel import results
from per_obspy.records.shakemap import read_shakemap
from per_obspy.screening.by_record.estimates import impact_velocity_that_counts
from per_obspy.screening.ground_motion.assignment import Stations, site_class_of
from per_obspy.screening.ground_motion.site_motion import (
    RegionalMotion,
    StationField,
    hypocentre_of,
    prepared_field,
)
from per_obspy.screening.ranking import in_order
from per_obspy.screening.rows import risk_rows
from per_obspy.spectra.storage import read_spectra
from per_obspy.tables.parts import write_part

#: Rows of a chunk: a worker needs about 10 kB for each.
CHUNK = 100_000

#: Stations that a worker keeps in memory, each of about 2 MB.
STATIONS_KEPT = 200


class StationFile(NamedTuple):
    """
    A station that can serve pairs.

    Attributes
    ----------
    name : str
        ``NETWORK.STATION``.
    longitude, latitude : float
        Degrees east and north.
    site_class : str
        Of the ground, empty if unknown.
    shard : Path
        Its Dataset.
    hash : str
        Of the shard.
    """

    name: str
    longitude: float
    latitude: float
    site_class: str
    shard: Path
    hash: str


class GroundFiles(NamedTuple):
    """
    What is known of the ground motion, for other processes to read.

    Attributes
    ----------
    stations : tuple of StationFile
        Stations that can serve pairs.
    field : StationField or None
        The motion between them; None if there are none.
    shakemap : tuple of Path
        ``grid.xml``, perhaps ``uncertainty.xml`` as well; empty if there is no map.
    key : str
        Hash of all their contents.
    """

    stations: tuple[StationFile, ...]
    field: StationField | None
    shakemap: tuple[Path, ...]
    key: str


class ChunkJob(NamedTuple):
    """
    One chunk to do.

    Attributes
    ----------
    chunk : PairChunk
        Raw rows.
    ground : GroundFiles
        The ground motion.
    building, screening : Building, Screening
        Settings.
    part : Path
        Where its rows go.
    """

    chunk: PairChunk
    ground: GroundFiles
    building: Building
    screening: Screening
    part: Path


class Part(NamedTuple):
    """
    What became of a chunk.

    Attributes
    ----------
    number : int
        Its place in the inventory.
    rows : int
        Number of rows of the inventory that it held.
    path : Path or None
        Rows of the risk table, and the keys of their order; None if no pair was left.
    note : Path
        What was left out, see :func:`rejections`.
    resumed : bool
        Whether an earlier run had done it.
    """

    number: int
    rows: int
    path: Path | None
    note: Path
    resumed: bool


def rejections(parts: Iterable[Part]) -> Iterator[Rejection]:
    """Give what was left out of some parts; they are read one by one."""
    for part in parts:
        for one in json.loads(part.note.read_text(encoding="utf-8"))["rejected"]:
            yield Rejection.stored(one)


def ground_files(
    shards: Iterable[Path], shakemap: tuple[Path, ...], settings: Interpolation
) -> tuple[GroundFiles, tuple[Rejection, ...]]:
    """Return what is known of the ground motion, and the stations that have no coordinates."""
    files, nowhere, attributes = list[StationFile](), list[Rejection](), list[dict[Hashable, Any]]()
    for shard in shards:
        station = read_spectra(shard)
        name, longitude, latitude = (
            station[key].item() for key in ("station", "longitude", "latitude")
        )
        if np.isfinite(longitude):
            files.append(
                StationFile(
                    name, longitude, latitude, site_class_of(station), shard, file_hash(shard)
                )
            )
            attributes.append(station.attrs)
        else:
            reason = "its coordinates are unknown: it serves no pair"
            nowhere.append(Rejection("station", name, "", None, (reason,)))
    source = hypocentre_of(attributes)
    field = (
        prepared_field((read_spectra(one.shard) for one in files), settings, source)
        if files
        else None
    )
    known = [*((one.name, one.hash) for one in files), *map(file_hash, shakemap), source]
    key = hashlib.sha256(repr(known).encode()).hexdigest()
    return GroundFiles(tuple(files), field, shakemap, key), tuple(nowhere)


def do_chunks(jobs: Iterable[ChunkJob], workers: int, executor: Executor | None) -> Iterator[Part]:
    """Give every part as it is finished, in parallel; what an earlier run did is not done again."""
    waiting = list[Part]()

    def new() -> Iterator[ChunkJob]:
        for job in jobs:
            if earlier := _earlier(job):
                waiting.append(earlier)
            else:
                yield job

    for part in results(new(), do_chunk, _lost, workers, executor):
        yield from waiting
        waiting.clear()
        yield part
    yield from waiting


def do_chunk(job: ChunkJob) -> Part:
    """Return the finished part, its rows and the note that tells what they were made from on disk."""
    job.part.unlink(missing_ok=True)
    pairs = checked_chunk(job.chunk)
    rows, rejected = _surviving(pairs, _ground(job.ground), job)
    rejected = (
        *pairs.attrs["rejected"],
        *(one._replace(source=job.chunk.rows.source) for one in rejected),
    )
    if len(rows):
        write_part(in_order(rows, impact_velocity_that_counts(rows)), _number(job), job.part)
    return _noted(job, _key(job), job.part if len(rows) else None, rejected)


def _noted(job: ChunkJob, key: str, part: Path | None, rejected: Sequence[Rejection]) -> Part:
    """Write the note of a part."""
    content = {"key": key, "part": part and file_hash(part), "rejected": rejected}
    with written_whole(_note(job)) as note:
        note.write_text(json.dumps(content), encoding="utf-8")
    return Part(_number(job), len(job.chunk.repeated), part, _note(job), resumed=False)


def _note(job: ChunkJob) -> Path:
    return job.part.with_suffix(".json")


def _surviving(
    pairs: pd.DataFrame, ground: RegionalMotion, job: ChunkJob
) -> tuple[pd.DataFrame, tuple[Rejection, ...]]:
    """Return the rows of all pairs but those that cannot be computed, which are found by halving."""
    try:
        return risk_rows(pairs, ground, job.building, job.screening)
    except (ValueError, ArithmeticError) as error:
        if len(pairs) == 1:
            return pairs.iloc[:0], (
                Rejection("pair", pairs["pair_id"].iloc[0], "", None, (str(error),)),
            )
        middle = len(pairs) // 2
        halves = [
            _surviving(some, ground, job) for some in (pairs.iloc[:middle], pairs.iloc[middle:])
        ]
        kept = [rows for rows, _ in halves if len(rows)]
        return pd.concat(kept) if kept else pairs.iloc[:0], tuple(
            one for _, lost in halves for one in lost
        )


def _ground(files: GroundFiles) -> RegionalMotion:
    longitude, latitude = (
        np.array([(one.longitude, one.latitude) for one in files.stations]).reshape(-1, 2).T
    )
    names, ground = (
        np.array([getattr(one, name) for one in files.stations], dtype=object)
        for name in ("name", "site_class")
    )
    shards = [(one.shard, one.hash) for one in files.stations]
    stations = Stations(names, longitude, latitude, ground, lambda index: _station(*shards[index]))
    return RegionalMotion(
        stations, files.field, _shakemap(files.shakemap, files.key) if files.shakemap else None
    )


@lru_cache(1)
def _shakemap(files: tuple[Path, ...], content: str) -> xr.Dataset:
    del content
    return read_shakemap(*files)


@lru_cache(STATIONS_KEPT)
def _station(shard: Path, content: str) -> xr.Dataset:
    """Return a station's Dataset; its hash tells a changed one from what is kept."""
    del content
    return read_spectra(shard)


def _key(job: ChunkJob) -> str:
    """Return the hash of everything that the part depends on."""
    rows, digest = job.chunk.rows, hashlib.sha256()
    settings = [job.building.model_dump_json(), job.screening.model_dump_json()]
    digest.update(
        "\n".join([version("per_obspy"), rows.source, *settings, job.ground.key]).encode()
    )
    digest.update(repr(rows.broken).encode())
    content = pa.BufferOutputStream()
    with pa.ipc.new_stream(content, rows.table.schema) as stream:
        stream.write_table(rows.table.combine_chunks())
    digest.update(content.getvalue())
    digest.update(rows.lines.tobytes() + job.chunk.repeated.tobytes())
    return digest.hexdigest()


def _number(job: ChunkJob) -> int:
    return int(job.part.stem)


def _earlier(job: ChunkJob) -> Part | None:
    """Return the part as an earlier run left it, if it was made from the same and is undamaged."""
    try:
        note = json.loads(_note(job).read_text(encoding="utf-8"))
        part = file_hash(job.part) if job.part.exists() else None
        if note["key"] != _key(job) or note["part"] != part:
            return None
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return Part(
        _number(job), len(job.chunk.repeated), job.part if part else None, _note(job), resumed=True
    )


def _lost(job: ChunkJob, reason: str) -> Part:
    """Return a part of nothing but rejections; the next run does it again."""
    rows = job.chunk.rows
    names = rows.table["pair_id"].cast(pa.string()).to_pylist()
    lost = [
        Rejection("pair", name or "", rows.source, line, (reason,))
        for name, line in zip(names, rows.lines.tolist(), strict=True)
    ]
    return _noted(job, "", None, [*rows.broken, *lost])
