"""
The output folder of a run: held by one run at a time, and the JSON file that says what stands in it.

That file is written last: where it stands, the results beside it are complete.
"""

import json
import os
import platform
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

from filelock import FileLock, Timeout

from per_obspy.errors import CatalogError
from per_obspy.files import file_hash, written_whole

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
    What a run has done.

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
    """Write the record, after everything else."""
    with written_whole(file) as part:
        part.write_text(json.dumps(record, indent=1), encoding="utf-8")
    return Result(file.parent, record, did_nothing=False)


def earlier_record(file: Path, key: str) -> dict[str, Any] | None:
    """Return the record of an earlier run, if it did the same and its outputs are as it left them."""
    try:
        record: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
        intact = all(
            file_hash(file.parent / name) == known for name, known in record["outputs"].items()
        )
    except (OSError, ValueError, KeyError):
        return None
    return record if intact and record["key"] == key else None


def file_hashes(folder: Path, files: Sequence[Path]) -> dict[str, str]:
    """Return the hash of every file by its path in the folder."""
    return {str(path.relative_to(folder)): file_hash(path) for path in files}


def software_versions() -> dict[str, str]:
    """Return the version of everything that a result may depend on."""
    return {name: version(name) for name in LIBRARIES} | {"python": platform.python_version()}


def now() -> str:
    """Return the time, ISO 8601, UTC."""
    return datetime.now(UTC).isoformat(timespec="seconds")


@contextmanager
def held(folder: Path) -> Iterator[None]:
    """Hold the output folder; a second run is told who has it."""
    holder = folder / ".holder.json"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = FileLock(str(folder / ".lock"), timeout=0)
        lock.acquire()
    except Timeout as error:
        raise CatalogError(
            str(folder), f"another run holds this folder: {_holder(holder)}"
        ) from error
    except OSError as error:
        raise CatalogError(
            str(folder), f"cannot be used as output folder: {error.strerror}"
        ) from error
    try:
        said = {"process": os.getpid(), "host": platform.node(), "since": now()}
        holder.write_text(json.dumps(said), encoding="utf-8")
        yield
    finally:
        holder.unlink(missing_ok=True)
        lock.release()


def _holder(path: Path) -> str:
    try:
        said = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return "it does not say which"
    return f"process {said['process']} on {said['host']} since {said['since']}"
