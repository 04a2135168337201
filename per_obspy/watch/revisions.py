"""Revisions of the results of an earthquake, and ``changes.csv``: what each has changed."""

import csv
import os
import re
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from per_obspy.errors import CatalogError
from per_obspy.files import (
    content_hash,
    file_hash,
    read_json,
    sync_folder,
    temporary_folder,
    writing,
    written_whole,
)
from per_obspy.inventory.files.text_cells import cell
from per_obspy.names import inside
from per_obspy.results.parts import batches, bounded_database, parquet_rows
from per_obspy.results.ranked_table import table_files, table_outputs
from per_obspy.resume import write_status
from per_obspy.runs.output_folder import RECORD
from per_obspy.runs.provenance import CONFIGURATION

#: Name of the table in a revision.
CHANGES = "changes.csv"

#: Its columns: event, station, pair or building; its name; what changed; values.
COLUMNS = ("kind", "name", "quantity", "before", "after")

#: Facts of the earthquake whose changes are listed.
EVENT_FACTS = ("time", "latitude", "longitude", "depth", "magnitude", "magnitude_type")

#: kind -> table, column of names, columns whose changes are listed
TABLES = {
    "pair": ("risk", "pair_id", ("state", "risk_class")),
    "building": ("buildings", "building_id", ("risk_class",)),
}

#: Rows that are written at once.
ROWS = 50_000

Row = tuple[object, ...]


def write_changes(before: Path | None, after: Path, facts: Mapping[str, Any]) -> None:
    """
    Write the changes of a revision into its folder.

    Parameters
    ----------
    before : Path or None
        Folder of the revision before; None if this is the first: its stations came, and its
        earthquake has no values before.
    after : Path
        Folder of the revision.
    facts : mapping
        ``"event"``: facts of the earthquake now; ``"event_before"``: in the revision before.
    """
    target = after / CHANGES
    with written_whole(target) as part, part.open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(COLUMNS)
        for row in _all_changes(before, after, facts):
            rows.writerow(map(cell, row))


def _all_changes(before: Path | None, after: Path, facts: Mapping[str, Any]) -> Iterator[Row]:
    """Yield the changes of the earthquake, of stations, of pairs and of buildings."""
    yield from event_changes(facts.get("event_before") or {}, facts.get("event") or {})
    yield from _station_changes(before, after)
    # All pairs of a first result are new
    if before is None:
        return
    for kind, (name, identifier, quantities) in TABLES.items():
        tables = (table_files(before, name), table_files(after, name))
        if all(tables):
            yield from _table_changes(kind, tables, identifier, quantities)


def event_changes(before: Mapping[str, Any], after: Mapping[str, Any]) -> Iterator[Row]:
    """
    Yield the facts of an earthquake that have changed.

    Examples
    --------
    >>> list(event_changes({"magnitude": 6.8}, {"magnitude": 7.1}))
    [('event', '', 'magnitude', 6.8, 7.1)]
    """
    for name in EVENT_FACTS:
        old, new = before.get(name), after.get(name)
        if old != new:
            yield ("event", str(after.get("event_id", "")), name, old, new)


def _station_changes(before: Path | None, after: Path) -> Iterator[Row]:
    """Yield the stations that are new, missing or of a changed state, by name."""
    old = _station_states(before / "stations.csv") if before is not None else {}
    new = _station_states(after / "stations.csv")
    for name in sorted(old.keys() | new.keys()):
        states = (old.get(name, "absent"), new.get(name, "absent"))
        if states[0] != states[1]:
            yield ("station", name, "state", *states)


def _station_states(table: Path) -> dict[str, str]:
    """Return the state of every station of a table, empty without a table."""
    if not table.is_file():
        return {}
    with table.open(encoding="utf-8", newline="") as file:
        return {row["station"]: row["state"] for row in csv.DictReader(file)}


def _table_changes(
    kind: str, tables: tuple[list[Path], list[Path]], identifier: str, quantities: tuple[str, ...]
) -> Iterator[Row]:
    """Yield the changes between two tables, by name, in bounded memory."""
    # Named so that the database finds them
    columns = [identifier, *quantities]
    old, new = (parquet_rows(table, columns) for table in tables)
    with bounded_database(tables[1][0].parent) as database:
        database.register("old", old)
        database.register("new", new)
        # Rows whose value differs, or which only one table has
        for quantity in quantities:
            query = (
                f"SELECT {identifier} AS name, old.{quantity} AS before, new.{quantity} AS after "
                f"FROM old FULL OUTER JOIN new USING ({identifier}) "
                f"WHERE old.{quantity} IS DISTINCT FROM new.{quantity} ORDER BY name"
            )
            for batch in batches(database, query, ROWS):
                for row in batch.to_pylist():
                    values = [row["before"], row["after"]]
                    values = ["absent" if value is None else value for value in values]
                    yield (kind, row["name"], quantity, *values)


#: Folder of the revisions, link to the newest, and description of each.
REVISIONS, LATEST, REVISION = "revisions", "latest", "revision.json"

#: Folder in which the runs of an earthquake work.
WORK = "work"

#: Results by which a revision differs from the one before, besides the risk table.
COMPARED = ("stations.csv", "rows.parquet", "buildings.parquet", "totals.csv")

#: Name of the folder of a revision.
_NAME = re.compile(r"[0-9]{4,9}")


def revision_folder(event: Path, number: int) -> Path:
    """
    Return the folder of a revision.

    Examples
    --------
    >>> revision_folder(Path("us7000abcd"), 7).as_posix()
    'us7000abcd/revisions/0007'
    """
    return event / REVISIONS / f"{number:04d}"


def newest_revision(event: Path) -> int:
    """Return the number of the newest revision in the folder of an earthquake, 0 if none."""
    names = [path.name for path in event.glob(f"{REVISIONS}/*") if _NAME.fullmatch(path.name)]
    return max(map(int, names), default=0)


def content_of(record: Mapping[str, Any], event_hash: str) -> str:
    """
    Return a hash of the content of a revision: tables, counts and the earthquake.

    Parameters
    ----------
    record : mapping
        Content of ``run.json``.
    event_hash : str
        Of the QuakeML that was screened.
    """
    tables = {name: record["outputs"].get(name, "") for name in COMPARED}
    tables |= table_outputs(record["outputs"])
    return content_hash({"tables": tables, "event": event_hash})


def publish(event: Path, number: int, record: Mapping[str, Any], facts: Mapping[str, Any]) -> Path:
    """
    Make a revision of the results of a run, and point ``latest`` to it.

    Parameters
    ----------
    event : Path
        Folder of the earthquake, with the results in ``work``.
    number : int
        Of the new revision, larger than that of any other.
    record : mapping
        Content of ``run.json``.
    facts : mapping
        Further content of ``revision.json``: earthquake, delay, time.

    Returns
    -------
    folder : Path
        Of the revision.

    Raises
    ------
    WriteError
        If the machine cannot write: there is no revision then.
    CatalogError
        If a result has changed since its run, or a revision of the number is there.
    """
    target, newest = revision_folder(event, number), newest_revision(event)
    before = revision_folder(event, newest) if newest else None
    if target.exists():
        raise CatalogError(str(target), "this revision is there already")
    with writing(target):
        target.parent.mkdir(parents=True, exist_ok=True)
    # Made next to its place: a killed watcher leaves no folder that bears a number
    with temporary_folder(target.parent) as room:
        made = room / target.name
        # The description comes last, as it holds the hash of everything else
        outputs = _shared_files(event, made, record["outputs"], before)
        write_changes(before, made, facts)
        outputs[CHANGES] = file_hash(made / CHANGES)
        write_status(made / REVISION, content_of(record, outputs["event.xml"]), outputs, facts, 1)
        for parent, _, _ in os.walk(made):
            sync_folder(Path(parent))
        with writing(target):
            made.rename(target)
        sync_folder(target.parent)
    point_latest(event)
    return target


def _shared_files(
    event: Path, made: Path, outputs: Mapping[str, str], before: Path | None
) -> dict[str, str]:
    """Put the results of a run into a new revision, and return the hash of each."""
    work, hashes = event / WORK, dict(outputs)
    # Files of the revision before by their hash; none if it is damaged
    earlier = read_json(before / REVISION).get("outputs") if before else None
    known = dict[str, Path]()
    if before and isinstance(earlier, dict):
        known = {str(digest): before / name for name, digest in earlier.items()}
    for name, digest in sorted(outputs.items()):
        _share(inside(work, name), inside(made, name), digest, known.get(digest))
    # Files that no run lists
    for file in (work / RECORD, work / CONFIGURATION, event / "event.xml"):
        hashes[file.name] = file_hash(file)
        _share(file, made / file.name, hashes[file.name], known.get(hashes[file.name]))
    return hashes


def _share(source: Path, target: Path, digest: str, earlier: Path | None) -> None:
    """Copy a file, or link it to the same file of the revision before."""
    with writing(target):
        target.parent.mkdir(parents=True, exist_ok=True)
        if earlier is not None and _linked(earlier, target, digest):
            return
        shutil.copyfile(source, target)
        with target.open("rb+") as file:
            os.fsync(file.fileno())
    # A run of this folder by hand may have come in between
    if file_hash(target) != digest:
        raise CatalogError(str(source), "has changed since its run: it is run again")


def _linked(earlier: Path, target: Path, digest: str) -> bool:
    """Link a file to an unchanged earlier one; return whether that was possible."""
    try:
        if file_hash(earlier) != digest:
            return False
        target.hardlink_to(earlier)
    except OSError:  # a file system without links, or one file with too many
        return False
    return True


def point_latest(event: Path) -> None:
    """
    Let ``latest`` in the folder of an earthquake lead to its newest revision.

    The link is replaced at once: readers find the revision before or the new one.
    """
    number = newest_revision(event)
    if not number:
        return
    # Seen from its own folder, so that the results can be moved
    link, goal = event / LATEST, f"{REVISIONS}/{number:04d}"
    with writing(link):
        if link.is_symlink() and str(link.readlink()) == goal:
            return
        if link.is_dir() and not link.is_symlink():
            problem = "is a folder, not a link, as copies without links leave it: remove it"
            raise CatalogError(str(link), problem)
        with temporary_folder(event) as room:
            (room / LATEST).symlink_to(goal, target_is_directory=True)
            (room / LATEST).replace(link)


def revision_facts(event: Path, number: int) -> dict[str, Any]:
    """Return the content of ``revision.json``, empty if there is none."""
    return read_json(revision_folder(event, number) / REVISION)
