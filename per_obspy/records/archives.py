"""
Archives as folders, unpacked in memory only.

Understood are zip, and tar plain or compressed by gzip, bzip2 or xz.
"""

import io
import lzma
import tarfile
import zipfile
import zlib
from pathlib import Path
from typing import BinaryIO

from per_obspy.errors import RecordRejected, reason_of

_ZIP, _TAR = (".zip",), (".tar", ".tar.gz", ".tgz", ".tar.bz2", ".tar.xz")

#: Reason of a rejection of a pipe, socket, device or folder.
IRREGULAR = "is no regular file"

#: errors of the standard library for damaged, encrypted or cut archives
_DAMAGES = (
    zipfile.BadZipFile,
    tarfile.TarError,
    zlib.error,
    lzma.LZMAError,
    EOFError,
    OSError,
    RuntimeError,
    KeyError,
)


def is_archive(path: Path) -> bool:
    """Check from its name whether a file is an archive."""
    return path.name.lower().endswith(_ZIP + _TAR)


def members(archive: Path) -> list[Path]:
    """
    List the files of an archive as paths below the path of the archive.

    Raises
    ------
    RecordRejected
        If the archive is damaged.
    """
    try:
        names = _member_names(archive)
    except _DAMAGES as error:
        raise RecordRejected(str(archive), f"the archive is damaged: {error}") from error
    return [archive / name for name in sorted(names)]


def _member_names(archive: Path) -> list[str]:
    """Return the names of the files of an archive, without those of folders."""
    if _is_zip(archive):
        with zipfile.ZipFile(archive) as opened:
            return [member.filename for member in opened.infolist() if not member.is_dir()]
    with tarfile.open(archive) as packed:
        return [member.name for member in packed if member.isfile()]


def _is_zip(archive: Path) -> bool:
    return archive.name.lower().endswith(_ZIP)


def open_file(path: Path) -> BinaryIO:
    """
    Open a file, or a member of an archive as ``members`` names it.

    Raises
    ------
    RecordRejected
        If it cannot be read.
    """
    archive = _archive_of(path)
    try:
        if archive is None:
            return _regular_file(path)
        return _member(archive, path.relative_to(archive).as_posix())
    except _DAMAGES as error:
        raise RecordRejected(str(path), f"cannot be read: {reason_of(error)}") from error


def read_file(path: Path) -> bytes:
    """
    Return the content of a file, or of a member of an archive as ``members`` names it.

    Raises
    ------
    RecordRejected
        If it cannot be read.
    """
    with open_file(path) as file:
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
    """Return the archive that holds a path, or None."""
    for parent in path.parents:
        if is_archive(parent) and parent.is_file():
            return parent
    return None


def _member(archive: Path, name: str) -> BinaryIO:
    """Unpack a file of an archive in memory."""
    if _is_zip(archive):
        with zipfile.ZipFile(archive) as opened:
            return io.BytesIO(opened.read(name))
    with tarfile.open(archive) as packed:
        content = packed.extractfile(name)
        return io.BytesIO(content.read() if content else b"")
