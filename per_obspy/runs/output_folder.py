"""
Output folder of a run: locked by one run at a time, and described by one JSON file.

That file is a status file (:mod:`per_obspy.resume`) and written last: where it is, the other
results are complete.
"""

import json
import os
import platform
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

from filelock import FileLock, Timeout

from per_obspy.errors import CatalogError, FolderInUse
from per_obspy.files import file_hash, remove_dead_parts, writing
from per_obspy.resume import write_status

#: Written first as unfinished, and last as it ends.
RECORD = "run.json"

#: Histories and sensitivity of the worst pairs of a run.
WORST_PAIRS = "worst_pairs.json"

#: State of a run that is under way, was killed, or met a fault of the machine; and its stages.
UNFINISHED, STATIONS, SCREENING = "unfinished", "stations", "screening"

#: Libraries whose versions a result may depend on.
LIBRARIES = (
    "per_obspy",
    "numpy",
    "scipy",
    "numba",
    "obspy",
    "pandas",
    "xarray",
    "netCDF4",
    "pyarrow",
    "duckdb",
)


class Result(NamedTuple):
    """
    Result of a run.

    Attributes
    ----------
    folder : Path
        Where everything is.
    record : dict
        The content of its JSON file, ``run.json`` or ``ensemble.json``.
    did_nothing : bool
        Whether the same had been done before.
    """

    folder: Path
    record: dict[str, Any]
    did_nothing: bool


def recorded(file: Path, record: dict[str, Any]) -> Result:
    """Write ``run.json`` or ``ensemble.json`` with key and outputs, after all other files."""
    facts = {name: value for name, value in record.items() if name not in ("key", "outputs")}
    written = write_status(file, record["key"], record["outputs"], facts, indent=1)
    return Result(file.parent, written, did_nothing=False)


def file_hashes(folder: Path, files: Sequence[Path]) -> dict[str, str]:
    """Return the hash of every file by its path in the folder."""
    return {str(path.relative_to(folder)): file_hash(path) for path in files}


def software_versions() -> dict[str, str]:
    """Return the versions of the libraries on which results depend."""
    return {name: version(name) for name in LIBRARIES} | {"python": platform.python_version()}


def now() -> str:
    """Return the current time, ISO 8601, UTC."""
    return datetime.now(UTC).isoformat(timespec="seconds")


@contextmanager
def locked_folder(folder: Path) -> Iterator[None]:
    """Lock an output folder and remove stale part files; an error names the lock's holder."""
    holder = folder / ".holder.json"
    lock = _acquired_lock(folder, holder)
    try:
        owner = {"process": os.getpid(), "host": platform.node(), "since": now()}
        # What killed processes left is removed first: it may fill the disk
        remove_dead_parts(folder)
        with writing(holder):
            holder.write_text(json.dumps(owner), encoding="utf-8")
        yield
    finally:
        with suppress(OSError):
            holder.unlink(missing_ok=True)
        lock.release()


def _acquired_lock(folder: Path, holder: Path) -> FileLock:
    """Make the output folder if need be and acquire its lock at once."""
    # The lock ends with its process, so that a killed run does not hold it
    lock = FileLock(str(folder / ".lock"), timeout=0)
    try:
        with writing(folder):
            folder.mkdir(parents=True, exist_ok=True)
            lock.acquire()
    except CatalogError as error:
        reason = error.problem.removeprefix("cannot be written: ")
        raise CatalogError(str(folder), f"cannot be used as output folder: {reason}") from error
    except Timeout as error:
        raise FolderInUse(str(folder), _holder(holder)) from error
    return lock


def _holder(path: Path) -> str:
    """Return process, host and start of the run that holds an output folder."""
    try:
        owner = json.loads(path.read_text(encoding="utf-8"))
        return f"process {owner['process']} on {owner['host']} since {owner['since']}"
    except (OSError, ValueError, KeyError, TypeError):
        return "its process is unknown"
