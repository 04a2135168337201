"""
Archives as folders, whose members are read without unpacking them into any folder.

Understood are zip, and tar plain or compressed by gzip, bzip2 or xz, also inside each other. An
archive is walked once and stays open; of a compressed tar, and of an archive inside another, a copy
is in a temporary file without a name. How much an archive may unpack to is limited by
``[records.archives]`` of the configuration.
"""

from functools import lru_cache
from pathlib import Path
from typing import BinaryIO

from per_obspy.config import Archives
from per_obspy.errors import PerError, RecordRejected, Rejection, reason_of
from per_obspy.records.archives.walked import DAMAGES, Allowance, WalkedArchive, is_archive

#: Reason of a rejection of a pipe, socket, device or folder.
IRREGULAR = "is no regular file"

#: Limits where no configuration gives others.
LIMITS = Archives()

#: Open archives that a process keeps.
_KEPT = 8


def archive_files(archive: Path, limits: Archives = LIMITS) -> tuple[list[Path], list[Rejection]]:
    """
    List the files of an archive as paths below the path of the archive.

    Parameters
    ----------
    archive : Path
        Zip or tar.
    limits : Archives
        Limits of unpacking.

    Returns
    -------
    files : list of Path
        Sorted; those of archives inside are below the paths of these.
    rejected : list of Rejection
        Members that are not read, each with its reason.

    Raises
    ------
    RecordRejected
        If the archive is damaged or unpacks to more than the limits.
    """
    opened = _opened_archive(archive, limits)
    return [archive / name for name in sorted(opened.members)], opened.rejected


def open_file(path: Path, limits: Archives = LIMITS) -> BinaryIO:
    """
    Open a file, or a member of an archive as ``archive_files`` names it.

    Raises
    ------
    RecordRejected
        If it cannot be read.
    """
    archive = _archive_of(path)
    try:
        if archive is None:
            return _regular_file(path)
        return _opened_archive(archive, limits).read(path.relative_to(archive).as_posix())
    except PerError:
        raise
    except DAMAGES as error:
        raise RecordRejected(str(path), f"cannot be read: {reason_of(error)}") from error


def read_file(path: Path, limits: Archives = LIMITS) -> bytes:
    """
    Return the content of a file, or of a member of an archive as ``archive_files`` names it.

    Raises
    ------
    RecordRejected
        If it cannot be read.
    """
    with open_file(path, limits) as file:
        try:
            return file.read()
        except OSError as error:
            raise RecordRejected(str(path), f"cannot be read: {reason_of(error)}") from error


def _regular_file(path: Path) -> BinaryIO:
    """Open a file; a pipe, a socket or a device could keep its reader waiting for ever."""
    if path.exists() and not path.is_file():
        raise RecordRejected(str(path), IRREGULAR)
    return path.open("rb")


def _archive_of(path: Path) -> Path | None:
    """Return the archive on the disk that holds a path, or None."""
    for parent in path.parents:
        if is_archive(parent) and parent.is_file():
            return parent
    return None


def _opened_archive(archive: Path, limits: Archives) -> WalkedArchive:
    """Return an archive, which is walked once as long as its file does not change."""
    try:
        facts = archive.stat()
        return _walked(archive, (facts.st_size, facts.st_mtime_ns), limits)
    except PerError:
        raise
    except DAMAGES as error:
        reason = f"the archive is damaged: {reason_of(error)}"
        raise RecordRejected(str(archive), reason) from error


@lru_cache(_KEPT)
def _walked(archive: Path, version: tuple[int, int], limits: Archives) -> WalkedArchive:
    """Open an archive and walk it; a changed one has another size or time."""
    size, _ = version
    file = archive.open("rb")
    return WalkedArchive(str(archive), file, Allowance(str(archive), size, limits))
