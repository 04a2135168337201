"""Archives (zip, and tar plain or compressed by gzip, bzip2, xz) as folders, unpacked in memory only."""

import io
import lzma
import tarfile
import zipfile
import zlib
from pathlib import Path
from typing import BinaryIO

from per_obspy.errors import RecordRejected, reason_of

_ZIP, _TAR = (".zip",), (".tar", ".tar.gz", ".tgz", ".tar.bz2", ".tar.xz")

#: what the standard library raises for damaged, encrypted or cut archives
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
    """Tell from its name whether a file is an archive."""
    return path.name.lower().endswith(_ZIP + _TAR)


def members(archive: Path) -> list[Path]:
    """
    Return the files of an archive as paths below the archive's own.

    Raises
    ------
    RecordRejected
        If the archive is damaged.
    """
    try:
        if archive.name.lower().endswith(_ZIP):
            with zipfile.ZipFile(archive) as opened:
                names = [member.filename for member in opened.infolist() if not member.is_dir()]
        else:
            with tarfile.open(archive) as packed:
                names = [member.name for member in packed if member.isfile()]
    except _DAMAGES as error:
        raise RecordRejected(str(archive), f"the archive is damaged: {error}") from error
    return [archive / name for name in sorted(names)]


def open_file(path: Path) -> BinaryIO:
    """
    Open a file, or a member of an archive as ``members`` names it.

    Raises
    ------
    RecordRejected
        If it cannot be read.
    """
    archive = next(
        (parent for parent in path.parents if is_archive(parent) and parent.is_file()), None
    )
    try:
        return (
            path.open("rb")
            if archive is None
            else _member(archive, path.relative_to(archive).as_posix())
        )
    except _DAMAGES as error:
        raise RecordRejected(str(path), f"cannot be read: {reason_of(error)}") from error


def _member(archive: Path, name: str) -> BinaryIO:
    if archive.name.lower().endswith(_ZIP):
        with zipfile.ZipFile(archive) as opened:
            return io.BytesIO(opened.read(name))
    with tarfile.open(archive) as packed:
        content = packed.extractfile(name)
        return io.BytesIO(content.read() if content else b"")
