"""
Status files, by which work is resumed: a small JSON file per finished piece of work.

A status holds the key of the work (a hash of everything on which its result depends), the hash of
every file that it made (``outputs``, by the path seen from the status file) and further facts. It
is written after all of them and appears whole or not at all. Work is done if its status can be
read, has the same key, and every output still has its hash; anything else (no status, a damaged
one, one of another program, an output that is missing, cut or changed) means that it is done again.
"""

import hashlib
import json
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

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


class Comparison(NamedTuple):
    """
    Outcome of a comparison of files with their hashes.

    Attributes
    ----------
    changed : tuple of Path
        Files that are missing or have another content.
    compared : int
        Number of files that were compared, or are missing.
    files : int
        Number of all files.
    """

    changed: tuple[Path, ...]
    compared: int
    files: int


def compare_outputs(statuses: Mapping[Path, Status], seconds: float) -> Comparison:
    """
    Compare the outputs of some status files with their hashes, the smallest first.

    Parameters
    ----------
    statuses : mapping of Path to dict
        Status file -> its content.
    seconds : float
        Longest time, s: what is left then, of outputs of any size, is not compared.
    """
    until, changed, compared = time.monotonic() + seconds, list[Path](), 0
    sizes = _sizes(statuses)
    for file, (size, digest) in sorted(sizes.items(), key=lambda item: item[1][0]):
        found = _hash_until(file, until) if size >= 0 else ""
        # The time is over
        if found is None:
            break
        compared += 1
        if found != digest or size < 0:
            changed.append(file)
    return Comparison(tuple(changed), compared, len(sizes))


def _sizes(statuses: Mapping[Path, Status]) -> dict[Path, tuple[int, str]]:
    """Return size, bytes, and hash of every output; -1 for one that is missing or no file."""
    sizes = dict[Path, tuple[int, str]]()
    for path, status in statuses.items():
        for name, digest in status["outputs"].items():
            file = path.parent / str(name)
            # A folder or pipe in the place of a file is none, and never read
            try:
                is_whole = _is_near(path, file) and file.is_file()
                sizes[file] = (file.stat().st_size if is_whole else -1, str(digest))
            except OSError:
                sizes[file] = (-1, "")
    return sizes


def _hash_until(path: Path, until: float) -> str | None:
    """Return the hash of a file, empty if it cannot be read, None if the time is over before."""
    digest = hashlib.sha256()
    try:
        with path.open("rb") as file:
            while time.monotonic() < until:
                piece = file.read(1 << 20)
                digest.update(piece)
                if not piece:
                    return digest.hexdigest()
    except OSError:
        return ""
    return None


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
