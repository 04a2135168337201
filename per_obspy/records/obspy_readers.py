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


def read_with_obspy(reader: Callable[..., Any], path: Path, **options: Any) -> Any:
    """
    Call a reader of ObsPy on a file, or on a member of an archive.

    Parameters
    ----------
    reader : callable
        ``obspy.read``, ``obspy.read_inventory`` or ``obspy.read_events``.
    path : Path
        File, or a member of an archive as ``records.archives.archive_files`` names it.
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
        File, or a member of an archive as ``records.archives.archive_files`` names it.
    **options
        For the reader.

    Raises
    ------
    RecordRejected
        Whatever the reader raises.
    """
    # ObsPy unpacks compressed files only by their path
    if path.is_file() and _is_compressed(content):
        return read_with_obspy(reader, path, **options)
    try:
        return _called(reader, BytesIO(content), str(path), options)
    except RecordRejected as rejection:
        if UNKNOWN_FORMAT in rejection.reasons[0]:
            raise
        # Some formats keep their samples in files beside, which only a path leads to
        return read_with_obspy(reader, path, **options)


def _is_compressed(content: bytes) -> bool:
    """Return whether bytes are those of an archive or of a compressed file."""
    return content.startswith(_COMPRESSED) or tarfile.is_tarfile(BytesIO(content))


def read_bytes_with_obspy(
    reader: Callable[..., Any], content: bytes, name: str, **options: Any
) -> Any:
    """
    Call a reader of ObsPy on bytes.

    Parameters
    ----------
    reader, **options
        As for :func:`read_with_obspy`.
    content : bytes
        Answer of a service, or a part of a file.
    name : str
        Of its source, for messages.

    Raises
    ------
    RecordRejected
        Whatever the reader raises.
    """
    return _called(reader, BytesIO(content), name, options)


def _called(reader: Callable[..., Any], file: Any, name: str, options: dict[str, Any]) -> Any:
    """Call a reader; its errors, of ObsPy's bare Exception or of any library below, reject."""
    try:
        return reader(file, **options)
    except PerError:
        raise
    except Exception as error:
        raise RecordRejected(name, f"ObsPy cannot read it: {_reason(error)}") from error


def _reason(error: Exception) -> str:
    """
    Return the message of an error on one line.

    A format that ObsPy does not know is a fault of the file, not an error of types.
    """
    reason = " ".join(str(error).split())
    if reason.startswith("Unknown format"):
        return UNKNOWN_FORMAT
    return f"{type(error).__name__}: {reason}"
