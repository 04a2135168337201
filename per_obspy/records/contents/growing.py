"""
Record files that are still being written, in a folder that grows.

A file waits if it was changed a short time ago or while the folder was read. It is no rejection:
the next run of the folder takes it.
"""

import time
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

#: s, after which a file whose time lies ahead of the clock is looked at again.
LOOK_AGAIN = 0.5


class FileState(NamedTuple):
    """Size of a file, bytes, and time of its latest change, ns since 1970."""

    size: int
    changed: int


def file_states(files: Iterable[Path]) -> dict[Path, FileState]:
    """Return the state of every file that is there."""
    found = {}
    for path in files:
        try:
            facts = path.stat()
        except OSError:
            continue
        found[path] = FileState(facts.st_size, facts.st_mtime_ns)
    return found


def growing_files(states: Mapping[Path, FileState], settle: float) -> set[Path]:
    """
    Return the files that may still be written to.

    Parameters
    ----------
    states : mapping of Path to FileState
        From :func:`file_states`, taken before.
    settle : float
        Age, s, from which a file counts as finished if it does not change; 0: every file does.

    Examples
    --------
    >>> import os, tempfile
    >>> record = Path(tempfile.mkdtemp()) / "S1.mseed"
    >>> _ = record.write_bytes(b"half of it")
    >>> [path.name for path in growing_files(file_states([record]), settle=60.0)]
    ['S1.mseed']
    >>> os.utime(record, (1e9, 1e9))
    >>> growing_files(file_states([record]), settle=60.0)
    set()
    """
    if settle <= 0:
        return set()
    now = time.time()
    ages = {path: now - state.changed * 1e-9 for path, state in states.items()}
    young = {path for path, age in ages.items() if 0 <= age < settle}
    # Clocks of file servers differ: only a change of the file itself decides then
    if any(age < 0 for age in ages.values()):
        time.sleep(min(settle, LOOK_AGAIN))
    return young | changed_files({path: states[path] for path in states.keys() - young})


def changed_files(states: Mapping[Path, FileState]) -> set[Path]:
    """Return the files that have changed or vanished since their state was taken."""
    later = file_states(states)
    return {path for path, state in states.items() if later.get(path) != state}
