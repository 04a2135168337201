"""The one place where errors of ObsPy's readers, which have no common class, become a rejection."""

import glob
import tarfile
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

from per_obspy.errors import PerError, RecordRejected
from per_obspy.records.archives import open_file

#: Reason of a rejection where no format plugin knows a file.
UNKNOWN_FORMAT = "its format is unknown"

#: How files begin that ObsPy unpacks: gzip, bzip2 and zip.
_COMPRESSED = (b"\x1f\x8b", b"BZh", b"PK\x03\x04", b"PK\x05\x06")


def foreign(reader: Callable[..., Any], path: Path, **options: Any) -> Any:
    """
    Call a reader of ObsPy on a file, or on a member of an archive.

    Parameters
    ----------
    reader : callable
        ``obspy.read``, ``obspy.read_inventory`` or ``obspy.read_events``.
    path : Path
        File, or a member of an archive as ``records.archives.members`` names it.
    **options
        For the reader.

    Raises
    ------
    RecordRejected
        Whatever the reader raises.
    """
    if path.is_file():
        return _called(reader, glob.escape(str(path)), str(path), options)
    with open_file(path) as file:
        return _called(reader, file, str(path), options)


def read_content(reader: Callable[..., Any], content: bytes, path: Path, **options: Any) -> Any:
    """
    Call a reader of ObsPy on the bytes of a file, so that the file itself is opened only once.

    Parameters
    ----------
    reader : callable
        ``obspy.read``, ``obspy.read_inventory`` or ``obspy.read_events``.
    content : bytes
        Content of the file.
    path : Path
        File, or a member of an archive as ``records.archives.members`` names it.
    **options
        For the reader.

    Raises
    ------
    RecordRejected
        Whatever the reader raises.
    """
    # ObsPy unpacks compressed files only by their path
    if path.is_file() and _is_compressed(content):
        return foreign(reader, path, **options)
    try:
        return _called(reader, BytesIO(content), str(path), options)
    except RecordRejected as rejection:
        if UNKNOWN_FORMAT in rejection.reasons[0]:
            raise
        # Some formats keep their samples in files beside, which only a path leads to
        return foreign(reader, path, **options)


def _is_compressed(content: bytes) -> bool:
    """Return whether bytes are those of an archive or of a compressed file."""
    return content.startswith(_COMPRESSED) or tarfile.is_tarfile(BytesIO(content))


def foreign_bytes(reader: Callable[..., Any], content: bytes, name: str, **options: Any) -> Any:
    """Call a reader of ObsPy on what a service answered, as ``foreign`` does on a file."""
    return _called(reader, BytesIO(content), name, options)


def _called(reader: Callable[..., Any], file: Any, name: str, options: dict[str, Any]) -> Any:
    try:
        return reader(file, **options)
    except PerError:
        raise
    except (
        Exception
    ) as error:  # ObsPy raises bare Exception, and whatever the libraries below it gave
        raise RecordRejected(name, f"ObsPy cannot read it: {_reason(error)}") from error


def _reason(error: Exception) -> str:
    """Return what ObsPy says on one line; a format that it does not know is the user's file, not an error of types."""
    reason = " ".join(str(error).split())
    return (
        UNKNOWN_FORMAT
        if reason.startswith("Unknown format")
        else f"{type(error).__name__}: {reason}"
    )
