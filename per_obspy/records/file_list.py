"""
Files on which records depend: those below a folder, still growing or not, and those of a run.

Found with few libraries. A file waits if it was changed a short time ago or while its folder was
read. It is no rejection: the next run of the folder takes it.
"""

import os
import stat
import time
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from per_obspy import config
from per_obspy.errors import CatalogError, Rejection, reason_of
from per_obspy.files import is_part
from per_obspy.records.archive import IRREGULAR

if TYPE_CHECKING:
    from per_obspy.records.fdsn.cache import Fetched

#: s, after which a file whose time lies ahead of the clock is looked at again.
LOOK_AGAIN = 0.5

#: Beginnings and ends of names of documents, and of files that systems leave.
_TITLES = ("readme", "read_me", "licence", "license", "disclaimer", "copying", "citation")
_SUFFIXES = (
    *(".pdf", ".htm", ".html", ".md", ".rtf", ".doc", ".docx", ".ps", ".eps", ".svg"),
    *(".png", ".gif", ".jpg", ".jpeg", ".kml", ".kmz", ".md5", ".sha256"),
)
_HIDDEN = (".ds_store", "thumbs.db", "desktop.ini")


class FileState(NamedTuple):
    """State of a file by which a change of it shows."""

    size: int  # bytes
    changed: int  # time of its latest change, ns since 1970


def files_below(folder: Path) -> tuple[list[Path], list[Rejection]]:
    """
    Return the files below a folder, sorted, and whatever else is there that cannot be read.

    Folders that cannot be listed, links without a target or to a folder, pipes, sockets and
    devices are rejections; the rest goes on. Part files of this package are passed over.

    Raises
    ------
    CatalogError
        If it is no folder.
    """
    if not folder.is_dir():
        raise CatalogError(str(folder), "is neither a folder nor a regular file")
    unlisted: list[OSError] = []
    paths, problems = [], {}
    # Links to folders are among the folders, and are not entered
    for parent, folders, names in os.walk(folder, onerror=unlisted.append):
        for path in (Path(parent, name) for name in (*folders, *names)):
            if problem := _problem(path):
                problems[path] = problem
            elif not path.is_dir() and not is_part(path):
                paths.append(path)
    # An error may come in the middle of a folder
    for error in unlisted:
        path = Path(error.filename or folder)
        problems[path] = f"the folder cannot be listed: {reason_of(error)}"
    rows = [file_row(path, problem) for path, problem in problems.items()]
    return sorted(paths), sorted(rows)


def file_row(path: Path, *reasons: str) -> Rejection:
    """Return the row of a file or folder that cannot be read."""
    return Rejection("file", path.name, str(path), None, reasons)


def _problem(path: Path) -> str:
    """Return why an entry of a folder is neither a file nor a folder; empty if it is one."""
    try:
        kind = path.stat().st_mode
    except OSError as error:
        problem = "is a link without a target" if path.is_symlink() else "cannot be read"
        return f"{problem}: {reason_of(error)}"
    # Folders behind links could hold each other
    if stat.S_ISDIR(kind):
        is_link = path.is_symlink()
        return "is a link to a folder, which is not followed: name that folder" if is_link else ""
    return "" if stat.S_ISREG(kind) else IRREGULAR


def is_document(path: Path) -> bool:
    """
    Check from its name whether a file is for people: documents that agencies pack with records.

    >>> is_document(Path("a.zip/README.TXT")), is_document(Path("plot.pdf"))
    (True, True)
    >>> is_document(Path("readme/CE1.V2"))
    False
    """
    name = path.name.lower()
    # macOS packs an additional file, which begins with ._, with each file
    return name in _HIDDEN or name.startswith(("._", *_TITLES)) or name.endswith(_SUFFIXES)


def file_states(files: Iterable[Path]) -> dict[Path, FileState]:
    """Return the state of every file that is there."""
    states = {}
    for path in files:
        try:
            facts = path.stat()
        except OSError:
            continue
        states[path] = FileState(facts.st_size, facts.st_mtime_ns)
    return states


def growing_files(states: Mapping[Path, FileState], settle: float) -> set[Path]:
    """
    Return the files that may still be written to.

    Parameters
    ----------
    states : mapping of Path to FileState
        From :func:`file_states`, taken before.
    settle : float
        Age, s, from which a file counts as finished if it does not change; 0: every file does.

    Examples
    --------
    >>> import os, tempfile
    >>> record = Path(tempfile.mkdtemp()) / "S1.mseed"
    >>> _ = record.write_bytes(b"half of it")
    >>> [path.name for path in growing_files(file_states([record]), settle=60.0)]
    ['S1.mseed']
    >>> os.utime(record, (1e9, 1e9))
    >>> growing_files(file_states([record]), settle=60.0)
    set()
    """
    if settle <= 0:
        return set()
    now = time.time()
    ages = {path: now - state.changed * 1e-9 for path, state in states.items()}
    young = {path for path, age in ages.items() if 0 <= age < settle}
    # Clocks of file servers differ: only a change of the file itself decides then
    if any(age < 0 for age in ages.values()):
        time.sleep(min(settle, LOOK_AGAIN))
    return young | changed_files({path: states[path] for path in states.keys() - young})


def changed_files(states: Mapping[Path, FileState]) -> set[Path]:
    """Return the files that have changed or vanished since their state was taken."""
    later = file_states(states)
    return {path for path, state in states.items() if later.get(path) != state}


def input_files(records: config.Records | None, fetched: "Fetched | None") -> list[Path]:
    """Return every file on which a run may depend; of an SDS archive those of the window."""
    if records is None:
        return []
    # Files, and folders with everything below them
    places = [records.folder, records.stationxml, records.event]
    places += [table.file for table in records.columns]
    if fetched:
        places += [fetched.folder, fetched.event.path if fetched.event else None]
    places += [records.asdf.file] if records.asdf else []
    places += [records.shakemap, records.shakemap_uncertainty, records.stationlist]
    files = []
    for place in filter(None, places):
        files += files_below(place)[0] if place.is_dir() else [place]
    files += _day_files(records, records.sds) if records.sds else []
    return [path for path in files if path.is_file()]


def _day_files(records: config.Records, sds: config.Sds) -> list[Path]:
    """Return the day files of an SDS archive in its window."""
    from per_obspy.records.earthquakes.quakeml import read_event
    from per_obspy.records.fdsn.request import window
    from per_obspy.records.sds import find_sds_stations

    event = read_event(records.event) if records.event else None
    archive = find_sds_stations(sds.folder, *window(sds, event), records.stationxml)
    return [path for paths in archive.stations.values() for path in paths]
