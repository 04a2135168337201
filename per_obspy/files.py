"""Atomic writes, removal of what killed processes left, file-type detection and SHA-256 hashes."""

import errno
import hashlib
import json
import os
import platform
import re
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import BinaryIO
from unicodedata import category

from per_obspy.errors import CatalogError

#: How files of other kinds begin.
SIGNATURES = {
    b"%PDF": "a PDF document",
    b"PK\x03\x04": "a ZIP archive, as Excel workbooks are",
    b"\xd0\xcf\x11\xe0": "an old Excel workbook",
    b"PAR1": "a Parquet table",
    b"SQLite format 3": "an SQLite database, as GeoPackages are",
    b"\x89HDF": "an HDF5 file, as netCDF files are",
    b"\x1f\x8b": "a file packed by gzip",
    b"\x89PNG": "a PNG picture",
    b"<": "an XML or HTML document",
}

#: Errors of the disk or of its rights, which are no mistake of the program.
UNWRITABLE = {
    errno.EACCES,
    errno.EPERM,
    errno.EROFS,
    errno.ENOSPC,
    errno.EDQUOT,
    errno.ENOTDIR,
    errno.EISDIR,
}

#: End of the name of a part file before its suffix: process and machine that write it.
_WRITER = re.compile(r"^\..*\.(?P<process>\d+)(?:@(?P<machine>[^.]*))?\.part(?:\.[^.]*)?$")

#: Name of this machine in names of part files.
_MACHINE = re.sub(r"[^A-Za-z0-9-]", "-", platform.node())


def looks_like(path: Path) -> str:
    """
    Return the kind of a file by its first bytes; empty if they are no known ones.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "table.csv"
    >>> _ = file.write_bytes(b"%PDF-1.4")
    >>> looks_like(file)
    'a PDF document'
    """
    with path.open("rb") as file:
        head = file.read(16)
    if not head:
        return "an empty file"
    return next((kind for start, kind in SIGNATURES.items() if head.startswith(start)), "")


def unreadable_reason(path: Path, expected: str, error: Exception) -> str:
    """Return why a file is not of the expected kind: its kind, or what its reader found."""
    kind = looks_like(path)
    known = kind and expected not in kind
    reason = f"it is {kind}" if known else str(error).partition("; ")[0].rstrip(".")
    return f"not a {expected}: {reason}"


@contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """
    Give a temporary path that is renamed to the final one if the block succeeds, else removed.

    Parameters
    ----------
    path : Path
        Final name; its folder is made if need be.

    Yields
    ------
    Path
        Where to write. It keeps the suffix, because many writers go by it.

    Raises
    ------
    CatalogError
        If the folder cannot be made or written to, or the disk is full.

    Examples
    --------
    >>> import tempfile
    >>> final = Path(tempfile.mkdtemp()) / "table.csv"
    >>> with written_whole(final) as part:
    ...     _ = part.write_text("gap")
    >>> final.read_text()
    'gap'
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = f"cannot be written: {path.parent}: {error.strerror}"
        raise CatalogError(str(path), reason) from error
    part = path.with_name(_part_name(path.stem, path.suffix))
    try:
        yield part
        # Readers see the old file or the whole new one, never a half
        part.replace(path)
    except OSError as error:
        if error.errno not in UNWRITABLE:
            raise
        raise CatalogError(str(path), f"cannot be written: {error.strerror}") from error
    finally:
        part.unlink(missing_ok=True)


@contextmanager
def temporary_folder(parent: Path) -> Iterator[Path]:
    """Give a folder that is removed afterwards, or by a later run if this process is killed."""
    with TemporaryDirectory(dir=parent, prefix=".", suffix=_part_name("", "")) as folder:
        yield Path(folder)


def _part_name(stem: str, suffix: str) -> str:
    """Return the name of a part file of this process; it ends with the suffix."""
    return f".{stem}.{os.getpid()}@{_MACHINE}.part{suffix}"


def is_part(path: Path) -> bool:
    """
    Return whether a path is a part file, which is being written or was left by a killed process.

    Examples
    --------
    >>> is_part(Path("chunks/.000004.4711@quake.part.json")), is_part(Path("chunks/000004.json"))
    (True, False)
    """
    return _WRITER.match(path.name) is not None


def remove_dead_parts(folder: Path) -> None:
    """Remove the part files and temporary folders below a folder whose processes have ended."""
    for parent, folders, files in os.walk(folder):
        for name in [*folders, *files]:
            writer = _WRITER.match(name)
            if writer is None or _is_running(int(writer["process"]), writer["machine"]):
                continue
            # A temporary folder is removed with everything inside
            path = Path(parent, name)
            if path.is_dir():
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink(missing_ok=True)


def _is_running(process: int, machine: str | None) -> bool:
    """Return whether a process may still write: on another machine it counts as running."""
    if machine not in (None, _MACHINE) or os.name != "posix":
        return True
    try:
        os.kill(process, 0)  # signal 0 only asks
    except ProcessLookupError:
        return False
    except (PermissionError, OverflowError):
        return True
    return True


def printable(text: str) -> str:
    """
    Return a text on one line: control characters become blanks, undecodable bytes question marks.

    Examples
    --------
    >>> printable("CI.CLC" + chr(10) + "=A1")
    'CI.CLC =A1'
    """
    known = text.encode("utf-8", "replace").decode("utf-8")
    return "".join(" " if category(letter)[0] == "C" else letter for letter in known)


def file_hash(path: Path) -> str:
    """Return the SHA-256 of a file's bytes, in hexadecimal."""
    with path.open("rb") as file:
        return opened_hash(file)


def opened_hash(file: BinaryIO) -> str:
    """Return the SHA-256 of the bytes of an open file, which are not held in memory."""
    return hashlib.file_digest(file, "sha256").hexdigest()  # type: ignore[arg-type]


def bytes_hash(content: bytes) -> str:
    """Return the SHA-256 of bytes, in hexadecimal: that of the file from which they were read."""
    return hashlib.sha256(content).hexdigest()


def content_hash(content: Mapping[str, object]) -> str:
    """Return the hash of plain values, in whichever order they were put together."""
    return bytes_hash(json.dumps(content, sort_keys=True).encode())
