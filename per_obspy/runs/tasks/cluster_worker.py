"""
Work of a cluster's worker: one task at a time, with the checks that its result can be trusted.

A worker refuses a task if it runs another version of the program or of a library on which results
depend, or if it does not see the shared folder. The client then gives the task to another worker.
"""

import asyncio
import hashlib
import pickle
import platform
import time
from collections.abc import Callable
from functools import cache
from importlib.metadata import version
from pathlib import Path
from threading import Lock
from typing import Any, NamedTuple

from per_obspy.errors import MachineFault
from per_obspy.files import bytes_hash, written_whole
from per_obspy.reader_process import sendable
from per_obspy.threads import use_one_thread

#: Tasks of at most this many bytes travel through the scheduler, larger ones by the shared folder.
LARGEST_MESSAGE = 50_000

#: Libraries of netCDF are not safe in threads: a worker with several does one task after the other.
_ONE_TASK = Lock()

#: Files of the program on which results depend.
_SOURCES = {".py", ".csv"}


class Versions(NamedTuple):
    """Versions on which results depend."""

    per_obspy: str
    python: str
    numpy: str
    numba: str
    #: Beginning of the hash of the program's files, which differ between two checkouts of the same
    #: version.
    source: str

    def difference(self, expected: "Versions") -> str:
        """Return the versions that are not as expected, as text; empty if all are."""
        pairs = zip(self._fields, self, expected, strict=True)
        return ", ".join(f"{name} {own} instead of {one}" for name, own, one in pairs if own != one)


class Shared(NamedTuple):
    """Folder that client and workers share while a run is under way."""

    #: Of the run; it also holds the tasks that are too large for a message.
    folder: Path
    #: Content of a file in it, which no other folder of that name has.
    token: str


class SentTask(NamedTuple):
    """A task on its way to a worker."""

    #: The pickled task; empty if it is in a file of the shared folder, with its SHA-256.
    content: bytes
    file: Path | None
    hash: str
    shared: Shared
    #: Those of the client.
    versions: Versions


class Outcome(NamedTuple):
    """Outcome of a task on a worker."""

    value: Any
    error: Exception | None
    #: Why the worker is unfit for any task of this run; empty if it is fit.
    refusal: str
    #: Address of the worker, name of its machine, and processor time, s.
    worker: str
    host: str
    seconds: float


@cache
def own_versions() -> Versions:
    """Return the versions of this process."""
    root, digest = Path(__file__).parents[2], hashlib.sha256()
    for path in sorted(root.rglob("*")):
        if path.suffix in _SOURCES:
            digest.update(path.relative_to(root).as_posix().encode() + path.read_bytes())
    # Results depend on these libraries beyond the last digit
    libraries = [version(name) for name in ("per_obspy", "numpy", "numba")]
    package, numpy, numba = libraries
    return Versions(package, platform.python_version(), numpy, numba, digest.hexdigest()[:12])


def identity() -> tuple[str, Versions]:
    """Return the name of this machine and the versions of this process."""
    return platform.node(), own_versions()


def token_file(shared: Shared) -> Path:
    """Return the file by which a worker knows the shared folder."""
    return shared.folder / "token"


def sent_task(work: Callable[[], Any], shared: Shared, number: int) -> SentTask:
    """
    Return a task as it is sent; a large one is written into the shared folder.

    Parameters
    ----------
    work : callable
        The work with its arguments, as of ``functools.partial``.
    shared : Shared
        The shared folder.
    number : int
        Of the task, for the name of its file.

    Raises
    ------
    WriteError
        If it cannot be written.
    """
    content = pickle.dumps(work, protocol=pickle.HIGHEST_PROTOCOL)
    if len(content) <= LARGEST_MESSAGE:
        return SentTask(content, None, "", shared, own_versions())
    path = shared.folder / f"{number}.task"
    with written_whole(path) as part:
        part.write_bytes(content)
    return SentTask(b"", path, bytes_hash(content), shared, own_versions())


def do_sent(task: SentTask) -> Outcome:
    """Do a task on a worker; its errors are part of the outcome, so that the client judges them."""
    start = time.thread_time()
    with _ONE_TASK:
        use_one_thread()
        value, error, refusal = None, None, _refusal(task)
        if not refusal:
            try:
                value = _received(task)()
            except Exception as raised:  # noqa: BLE001 - the client judges every error
                error = sendable(raised)
            # Whatever was found is in doubt if the folder went away meanwhile
            refusal = _lost_folder(task.shared)
    if refusal:
        value, error = None, None
    seconds = time.thread_time() - start
    return Outcome(value, error, refusal, _own_address(), platform.node(), seconds)


def _own_address() -> str:
    """Return the address of the worker on which this function is called."""
    from distributed import get_worker

    return str(get_worker().address)


async def wait_until_idle(seconds: float) -> bool:
    """Wait for the task that is at work in this process; return whether it has ended."""
    end = time.monotonic() + seconds
    while _ONE_TASK.locked() and time.monotonic() < end:
        await asyncio.sleep(0.1)
    return not _ONE_TASK.locked()


def _refusal(task: SentTask) -> str:
    """Return the reason for which this worker cannot do tasks of the run; empty if it can."""
    difference = own_versions().difference(task.versions)
    return f"runs {difference}" if difference else _lost_folder(task.shared)


def _lost_folder(shared: Shared) -> str:
    """Return a message if the shared folder is not visible to this worker, else an empty one."""
    path = token_file(shared)
    try:
        known = path.read_text(encoding="utf-8")
    except OSError as error:
        return f"does not see the shared folder {shared.folder.parent}: {error.strerror}"
    if known != shared.token:
        return f"has another folder at {shared.folder.parent}: it is not shared"
    return ""


def _received(task: SentTask) -> Any:
    """Return the work with its arguments; a file is taken only as the client wrote it."""
    content = task.content
    if task.file is not None:
        content = task.file.read_bytes()
        if bytes_hash(content) != task.hash:
            raise MachineFault(f"{task.file}: changed after it was written")
    return pickle.loads(content)  # noqa: S301 - from the client itself, by message or by hash
