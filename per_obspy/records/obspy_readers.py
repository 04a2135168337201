"""The one place where errors of ObsPy's readers, which have no common class, become a rejection."""

import glob
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

from per_obspy.errors import PerError, RecordRejected
from per_obspy.records.archives import open_file


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
        "its format is unknown"
        if reason.startswith("Unknown format")
        else f"{type(error).__name__}: {reason}"
    )
