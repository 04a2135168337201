"""Atomic writes, removal of leftovers of killed processes, detection of file types and SHA-256."""

import errno
import hashlib
import json
import os
import platform
import re
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, BinaryIO

from per_obspy.errors import CatalogError, PerError, WriteError, WrongOutput, reason_of

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

#: Errors of a name that another kind of file has: another name mends them.
_WRONG_NAMES = {
    *(errno.ENOTDIR, errno.EISDIR, errno.EEXIST, errno.ENOTEMPTY),
    *(errno.ENAMETOOLONG, errno.ELOOP, errno.EILSEQ),
}

#: Errors of the machine when writing, and the mend; none is a mistake of program or input.
_ROOM = "try again when there is room"
_RIGHT = "try again with the right to write, or write elsewhere"
_LATER = "try again later"
UNWRITABLE = {
    errno.ENOSPC: _ROOM,
    errno.EDQUOT: _ROOM,
    errno.EFBIG: _ROOM,
    errno.EACCES: _RIGHT,
    errno.EPERM: _RIGHT,
    errno.EROFS: _RIGHT,
    errno.EIO: _LATER,
    errno.EMFILE: _LATER,
    errno.ENFILE: _LATER,
    errno.ENOMEM: _LATER,
    errno.ESTALE: _LATER,
}

#: Bytes that are written to learn whether the disk is full.
_PROBE = 1 << 20

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
    """Return why a file is not of the expected kind: its kind, or the finding of its reader."""
    kind = looks_like(path)
    known = kind and expected not in kind
    reason = f"it is {kind}" if known else str(error).partition("; ")[0].rstrip(".")
    return f"not a {expected}: {reason}"


@contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """
    Yield a temporary path that is renamed to the final one if the block succeeds, else removed.

    Parameters
    ----------
    path : Path
        Final name; its folder is made if need be.

    Yields
    ------
    Path
        The final path. It keeps the suffix, because many writers go by it.

    Raises
    ------
    WrongOutput
        If the name or its folder is that of another kind of file.
    WriteError
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
    # Libraries take relative names such as http:/x for addresses
    part = path.absolute().with_name(_part_name(path.stem, path.suffix))
    try:
        with writing(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            # HDF5 takes a name that is too long for a missing right
            with suppress(FileNotFoundError):
                part.lstat()
            yield part
            # Readers see the old file or the whole new one, never a half, also after a power cut
            _sync(part)
            part.replace(path)
            sync_folder(path.parent)
    finally:
        _remove_part(part)


def _sync(path: Path) -> None:
    """Wait until a file is on the disk."""
    handle = os.open(path, os.O_RDONLY if os.name == "posix" else os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def sync_folder(folder: Path) -> None:
    """Wait until the names in a folder are on the disk, where the system can do that."""
    if os.name == "posix":
        with suppress(OSError):
            _sync(folder)


def _remove_part(part: Path) -> None:
    """Remove a part file; where even that fails, a later run removes it."""
    with suppress(OSError):
        part.unlink(missing_ok=True)


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turn a failure to read a file or folder into ``CatalogError``, one line with the reason."""
    try:
        yield
    except PerError:
        raise
    except OSError as error:
        raise CatalogError(str(path), f"cannot be read: {reason_of(error)}") from error


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """
    Turn a failure to write into one line that names the file, the reason and the mend.

    Libraries that write have separate errors when the disk is full (HDF5 and netCDF, DuckDB,
    GDAL, libxml2): such an error counts as a failure to write if its message is that of the
    operating system, or if no file of some size can be written in the same folder.

    Parameters
    ----------
    path : Path
        The file to write.

    Raises
    ------
    WrongOutput
        If the name or its folder is that of another kind of file.
    WriteError
        If the machine cannot write.
    """
    try:
        yield
    except PerError:
        raise
    except OSError as error:
        known = _failed_write(path, error)
        if known is None:
            raise
        raise known from error
    except Exception as error:
        # Errors of libraries: by their message, or else by writing there
        folder = path if path.is_dir() else path.parent
        failure = _named_failure(error) or _probed_failure(folder)
        write_error = _failed_write(path, failure) if failure else None
        if write_error is None:
            raise
        raise write_error from error


def _failed_write(path: Path, error: OSError) -> PerError | None:
    """Return the error that a user meets instead of one of the operating system, if there is."""
    reason = os.strerror(error.errno) if error.errno else ""
    if error.errno in UNWRITABLE:
        return WriteError(str(path), f"{reason}; {UNWRITABLE[error.errno]}")
    # The folder is named where its name is the wrong one
    if error.errno in _WRONG_NAMES:
        place = f"{path.parent}: " if not path.parent.is_dir() else ""
        return WrongOutput(str(path), f"cannot be written: {place}{reason}")
    # Some libraries keep the number in the message only
    named = _named_failure(error) if error.errno is None else None
    return _failed_write(path, named) if named else None


def _named_failure(error: Exception) -> OSError | None:
    """Return the failure to write that the message of another error names."""
    message = str(error).lower()
    for number in UNWRITABLE:
        if os.strerror(number).lower() in message:
            return OSError(number, os.strerror(number))
    return None


def _probed_failure(folder: Path) -> OSError | None:
    """Return the failure to write a file of some size in a folder; None if it can be written."""
    probe = folder / _part_name("probe", "")
    try:
        probe.write_bytes(bytes(_PROBE))
    except OSError as error:
        return error
    finally:
        _remove_part(probe)
    return None


def remove_file(path: Path) -> None:
    """Remove a result that is made again, if it is there; raise ``WriteError`` if it must stay."""
    with writing(path):
        path.unlink(missing_ok=True)


@contextmanager
def temporary_folder(parent: Path) -> Iterator[Path]:
    """Yield a folder that is removed afterwards, or by a later run if this process is killed."""
    with writing(parent):
        folder = TemporaryDirectory(dir=parent.absolute(), prefix=".", suffix=_part_name("", ""))
    # A failure is looked into while the disk is still as full as it was
    with folder as name, writing(parent):
        yield Path(name)


@contextmanager
def scratch_folder() -> Iterator[Path]:
    """
    Yield a folder where the system keeps temporary files; it is removed afterwards.

    Raises
    ------
    WriteError
        If no place for temporary files can be written.
    """
    try:
        folder = TemporaryDirectory(prefix="per_obspy_")
    except FileNotFoundError as error:
        problem = "none can be written: free the disk, or name another folder in TMPDIR"
        raise WriteError("folders of temporary files", problem) from error
    with folder as name:
        yield Path(name)


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


#: Largest JSON file of a program's state that is read, bytes.
LARGEST_JSON = 1 << 24


def write_json(file: Path, content: Mapping[str, Any]) -> None:
    """Write plain values as JSON, whole or not at all."""
    with written_whole(file) as part:
        part.write_text(f"{json.dumps(content, indent=1)}\n", encoding="utf-8")


def read_json(file: Path) -> dict[str, Any]:
    """Return the content of a JSON file; empty if it is missing or damaged."""
    try:
        with file.open(encoding="utf-8") as text:
            content = json.loads(text.read(LARGEST_JSON))
    except (OSError, ValueError, RecursionError):
        return {}
    return content if isinstance(content, dict) else {}
