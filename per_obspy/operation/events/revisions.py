"""
Revisions of the results of an earthquake: numbered folders that never change.

``revisions/0001`` and so on hold the results of a run with ``run.json``, ``configuration.toml``,
``event.xml``, ``changes.csv`` and ``revision.json``. A revision appears whole or not at all. Files
that are the same as in the revision before are hard links to them, which need no room. ``latest``
is a link to the newest revision.
"""

import json
import os
import re
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from per_obspy.errors import CatalogError
from per_obspy.files import content_hash, file_hash, temporary_folder, writing
from per_obspy.jobs.output_folder import RECORD
from per_obspy.names import inside
from per_obspy.operation.events.revision_changes import CHANGES, write_changes
from per_obspy.pipeline.provenance import CONFIGURATION
from per_obspy.resume import Status, StatusError, read_status, write_status
from per_obspy.tables.ranked_table import table_outputs

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


def shown_content(event: Path, number: int) -> str:
    """Return the stored hash of the content of a revision, empty if missing or damaged."""
    try:
        status = read_status(revision_folder(event, number) / REVISION)
    except StatusError:
        return ""
    return str(status["key"])


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
        _sync_folders(made)
        with writing(target):
            made.rename(target)
            _sync_folders(target.parent)
    point_latest(event)
    return target


def _shared_files(
    event: Path, made: Path, outputs: Mapping[str, str], before: Path | None
) -> dict[str, str]:
    """Put the results of a run into a new revision, and return the hash of each."""
    known = _known_files(before) if before else {}
    work, hashes = event / WORK, dict(outputs)
    for name, digest in sorted(outputs.items()):
        _share(inside(work, name), inside(made, name), digest, known.get(digest))
    # Files that no run lists
    for file in (work / RECORD, work / CONFIGURATION, event / "event.xml"):
        hashes[file.name] = file_hash(file)
        _share(file, made / file.name, hashes[file.name], known.get(hashes[file.name]))
    return hashes


def _known_files(revision: Path) -> dict[str, Path]:
    """Return the files of a revision by their hash; none if it is damaged or there is none."""
    try:
        status: Status = read_status(revision / REVISION)
    except StatusError:
        return {}
    return {str(digest): revision / name for name, digest in status["outputs"].items()}


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


def _sync_folders(folder: Path) -> None:
    """Wait until the names in a folder and in those below it are on the disk."""
    if os.name != "posix":
        return
    for parent, _, _ in os.walk(folder):
        # As files.written_whole does for one file
        handle = os.open(parent, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


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
    try:
        facts: dict[str, Any] = json.loads(
            (revision_folder(event, number) / REVISION).read_text(encoding="utf-8")
        )
    except (OSError, ValueError):
        return {}
    return facts
