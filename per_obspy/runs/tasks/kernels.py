"""Compilation of all kernels in processes, so that no later command waits for them."""

from per_obspy.errors import Unfinished, WriteError
from per_obspy.kernels._jit import can_be_stored
from per_obspy.progress import Progress
from per_obspy.runs.tasks.parallel import Work, Workers, results
from per_obspy.screening.warmup import PARTS, compile_part

#: Stage of the progress.
COMPILING = "compiling kernels (once, one to two minutes)"

#: Processes: more would compile the kernels of histories twice, and end no earlier.
PROCESSES = 2


def compile_kernels(progress: Progress) -> None:
    """
    Compile all kernels that a command may need; compiled ones are only loaded.

    Raises
    ------
    WriteError
        If there is no folder in which they can be stored: every start would compile them again.
    Unfinished
        If a part cannot be compiled.
    """
    if not can_be_stored():
        reason = "set NUMBA_CACHE_DIR to a folder that can be written"
        raise WriteError("compiled kernels", reason)
    progress(COMPILING, 0, len(PARTS))
    workers = Workers(min(PROCESSES, Workers().count))
    parts = results(list(PARTS), Work(compile_part, _failed), workers)
    for done, _ in enumerate(parts, start=1):
        progress(COMPILING, done, len(PARTS))


def _failed(name: str, reason: str) -> str:
    """Raise an error with the reason why a part cannot be compiled."""
    raise Unfinished(f"kernels of {name} cannot be compiled: {reason}")
