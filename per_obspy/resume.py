"""
Status files, by which work is resumed: a small JSON file per finished piece of work.

A status holds the key of the work (a hash of everything on which its result depends), the hash of
every file that it made (``outputs``, by the path seen from the status file) and further facts. It
is written after all of them and appears whole or not at all. Work is done if its status can be
read, has the same key, and every output still has its hash; anything else (no status, a damaged
one, one of another program, an output that is missing, cut or changed) means that it is done again.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from per_obspy.files import file_hash, written_whole

#: Content of a status file: ``key``, ``outputs``, and facts of any other name.
Status = dict[str, Any]


class StatusError(ValueError):
    """A status file is missing, damaged, or of another kind."""


def write_status(
    path: Path,
    key: str,
    outputs: Mapping[str, str],
    facts: Mapping[str, object],
    indent: int | None = None,
) -> Status:
    """
    Write a status file, after everything that it describes, and return its content.

    Parameters
    ----------
    path : Path
        JSON file, in the folder of the outputs or above.
    key : str
        Hash of everything on which the work depends; empty if it shall be done again.
    outputs : mapping of str to str
        Path of every output, seen from the folder of the status file, and its hash.
    facts : mapping
        Plain values by other names than ``key`` and ``outputs``.
    indent : int, optional
        Spaces per level, for files that people read.
    """
    status = {**facts, "outputs": dict(outputs), "key": key}
    with written_whole(path) as part:
        part.write_text(json.dumps(status, indent=indent), encoding="utf-8")
    return status


def read_status(path: Path) -> Status:
    """
    Read a status file; whether its outputs are as they were left is not looked at.

    Raises
    ------
    StatusError
        If it is missing, damaged, or no status file.
    """
    try:
        status: Status = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise StatusError(str(error)) from error
    is_status = isinstance(status, dict) and isinstance(status.get("outputs"), dict)
    if not is_status or not isinstance(status.get("key"), str):
        raise StatusError("it has no key and outputs")
    return status


def changed_outputs(path: Path, status: Status) -> list[Path]:
    """Return the outputs of a status file that are missing or no longer have their hash."""
    changed = []
    for name, known in status["outputs"].items():
        file = path.parent / name
        if not _is_near(path, file) or hash_if_readable(file) != known:
            changed.append(file)
    return changed


def _is_near(path: Path, file: Path) -> bool:
    """Return whether an output is in the folder of its status file, or in a folder next to it."""
    try:
        return file.resolve().is_relative_to(path.parent.resolve().parent)
    except (OSError, ValueError):  # a name that no file can have
        return False


def hash_if_readable(path: Path) -> str:
    """Return the hash of a file, or an empty text if it is missing or cannot be read."""
    try:
        return file_hash(path)
    except OSError:
        return ""


def earlier_status(path: Path, key: str) -> Status | None:
    """
    Return the status that an earlier run left, if the same work is done and its outputs are whole.

    Parameters
    ----------
    path : Path
        The status file.
    key : str
        Of the work that is to be done now.

    Returns
    -------
    dict or None
        None if the work has to be done.
    """
    try:
        status = read_status(path)
    except StatusError:
        return None
    if not key or status["key"] != key or changed_outputs(path, status):
        return None
    return status
