"""Work on one chunk of rows of buildings: whole rows of one station, and their exact histories."""

from collections.abc import Iterable, Iterator, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa

from per_obspy.buildings.histories import no_outcomes, row_outcomes
from per_obspy.buildings.tables import write_rows_part
from per_obspy.errors import Rejection
from per_obspy.files import remove_file
from per_obspy.runs.tasks.ground_files import StationFile, read_station_once
from per_obspy.runs.tasks.parallel import Work, Workers
from per_obspy.runs.tasks.parts import Part, do_parts, record_part, rows_hash
from per_obspy.screening.values import Columns, chosen, components
from per_obspy.spectra.station import lacks_azimuths


class RowsJob(NamedTuple):
    """
    One chunk to do.

    Attributes
    ----------
    number : int
        Place of the chunk.
    contacts : Table
        Contacts of whole rows, one after the other, with the columns of their interfaces that are
        known, and those of ``histories.NEEDED``.
    station : StationFile or None
        Whose record they are followed under; None: no history is computed.
    part : Path
        Where the interfaces go.
    key : str
        Hash of everything on which the part depends; :func:`do_row_chunks` computes it.
    """

    number: int
    contacts: pa.Table
    station: StationFile | None
    part: Path
    key: str = ""

    @property
    def rows(self) -> int:
        """Number of contacts."""
        return int(self.contacts.num_rows)


def do_row_chunks(jobs: Iterable[RowsJob], workers: Workers) -> Iterator[Part]:
    """Yield the part of every chunk as it is finished, as `parts.do_parts` does."""
    keyed = (job._replace(key=_key(job)) for job in jobs)
    yield from do_parts(keyed, Work(do_rows, _failed, _name), workers)


def do_rows(job: RowsJob) -> Part:
    """Follow the rows of a chunk, write its part and status, and return the finished part."""
    remove_file(job.part)
    contacts = _columns(job.contacts)
    if job.station is None:
        return _record(job, contacts, no_outcomes(job.contacts.num_rows), ())
    dataset = read_station_once(job.station.shard, job.station.hash)
    if lacks_azimuths(dataset):
        reason = f"the azimuths of the horizontals of {dataset['station'].item()} are unknown"
        return _reject_all(job, reason)
    # Along a single horizontal whatever the axis: it counts as north
    one_horizontal = dataset.sizes["horizontal"] == 1
    if one_horizontal:
        contacts["flags"] = _flagged(contacts["flags"], "one_horizontal")
    axis = np.zeros(job.contacts.num_rows) if one_horizontal else contacts["azimuth"]
    outcomes, rejected = _known_outcomes(components(dataset), contacts | {"axis": axis})
    return _record(job, contacts, outcomes, rejected)


def _columns(table: pa.Table) -> Columns:
    """Return a table as arrays."""
    frame = table.to_pandas()
    return {str(name): frame[name].to_numpy() for name in frame}


def _known_outcomes(
    motion: tuple[np.ndarray, np.ndarray, float], contacts: Columns
) -> tuple[Columns, tuple[Rejection, ...]]:
    """Compute the outcomes of all rows but those of unknown gap, which are rows of two."""
    known = np.flatnonzero(np.isfinite(contacts["gap"]))
    outcomes = no_outcomes(contacts["gap"].size)
    if not known.size:
        return outcomes, ()
    computed, rejected = _outcomes(motion, chosen(contacts, known))
    for name, column in computed.items():
        outcomes[name][known] = column
    return outcomes, rejected


def _outcomes(
    motion: tuple[np.ndarray, np.ndarray, float], contacts: Columns
) -> tuple[Columns, tuple[Rejection, ...]]:
    """Compute the outcomes of all rows but those that fail, which are found by halving."""
    count = contacts["interface"].size
    first = np.append(np.flatnonzero(contacts["interface"] == 1), count)
    try:
        return row_outcomes(motion, contacts, first, contacts["axis"][first[:-1]]), ()
    except (ValueError, ArithmeticError, RuntimeError) as error:
        if first.size == 2:
            rejection = Rejection("row", contacts["row_id"][0], "", None, (str(error),))
            return no_outcomes(count), (rejection,)

    # A row among several fails: each half is computed alone
    middle = first[first.size // 2]
    (one, rejected), (other, more) = (
        _outcomes(motion, chosen(contacts, rows))
        for rows in (np.arange(middle), np.arange(middle, count))
    )
    # Both halves in their order
    return {name: np.append(one[name], other[name]) for name in one}, (*rejected, *more)


def _flagged(flags: np.ndarray, name: str) -> np.ndarray:
    """Add a flag to texts of flags."""
    return np.array([f"{text} {name}".strip() for text in flags.tolist()], dtype=object)


def _record(
    job: RowsJob, contacts: Columns, outcomes: Columns, rejected: Sequence[Rejection]
) -> Part:
    """Write a part, its status after it, and return the part."""
    names, flags = contacts["row_id"], contacts["flags"]
    # What holds for one contact of a row holds for all of it
    raised = {
        "values_reconciled": np.isin(names, names[outcomes["reconciled"]]),
        "no_history": np.isin(names, [rejection.name for rejection in rejected]),
    }
    for name, rows in raised.items():
        flags = np.where(rows, _flagged(flags, name), flags)
    write_rows_part({**contacts, **outcomes, "flags": flags}, job.part)
    return record_part(job, rejected)


def _key(job: RowsJob) -> str:
    """Return the hash of all inputs of the part."""
    station = job.station.hash if job.station else ""
    return rows_hash([version("per_obspy"), station], job.contacts)


def _name(job: RowsJob) -> str:
    """Return the name of a chunk in messages."""
    rows = job.contacts["row_id"]
    return f"rows of buildings from {rows[0]} to {rows[-1]}"


def _failed(job: RowsJob, reason: str) -> Part:
    """Return a part without histories after a failure; the next run repeats it."""
    return _reject_all(job._replace(key=""), reason)._replace(failed=True)


def _reject_all(job: RowsJob, reason: str) -> Part:
    """Write a part of which no row has a history, for the same reason."""
    names = dict.fromkeys(job.contacts["row_id"].to_pylist())
    rejected = [Rejection("row", str(name), "", None, (reason,)) for name in names]
    return _record(job, _columns(job.contacts), no_outcomes(job.contacts.num_rows), rejected)
