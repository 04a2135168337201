"""
Number of usable processors, and threads over blocks of work.

Kernels release the interpreter, so that threads share a record without copying it. Worker processes
use one thread each: together they already occupy all processors.
"""

import math
import os
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TypeVar

Block = TypeVar("Block")
Result = TypeVar("Result")

#: Folder of the control groups, with the CPU limit of a container.
CGROUP = Path("/sys/fs/cgroup")

#: Largest number of threads of this process.
_limit = {"threads": math.inf}


def usable_processors() -> int:
    """
    Return the number of processors that this process may use.

    Returns
    -------
    int
        Processors of the affinity mask, or fewer where the CPU limit of a container is lower
        (rounded up); at least 1.
    """
    processors = min(_processors_of_affinity(), _limit_of_version_2(), _limit_of_version_1())
    return max(1, int(processors))


def _processors_of_affinity() -> int:
    """Return the number of processors on which the system schedules this process."""
    if sys.version_info >= (3, 13):
        return os.process_cpu_count() or 1
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _limit_of_version_2() -> float:
    """Return the limit of ``cpu.max`` in processors: quota and period in µs, or ``max``."""
    words = _words(CGROUP / "cpu.max")
    return _processors(*words) if len(words) == 2 else math.inf


def _limit_of_version_1() -> float:
    """Return the limit of ``cpu.cfs_quota_us`` (-1: none) over ``cpu.cfs_period_us``."""
    quota = _words(CGROUP / "cpu" / "cpu.cfs_quota_us")
    period = _words(CGROUP / "cpu" / "cpu.cfs_period_us")
    return _processors(quota[0], period[0]) if len(quota) == len(period) == 1 else math.inf


def _words(path: Path) -> list[str]:
    """Return the words of a small file, none if it cannot be read."""
    try:
        return path.read_text("ascii").split()
    except (OSError, UnicodeDecodeError):
        return []


def _processors(quota: str, period: str) -> float:
    """Return CPU time per period in processors, infinite where the texts are no limit."""
    if not (quota.isdecimal() and period.isdecimal()):
        return math.inf
    microseconds, interval = int(quota), int(period)
    return math.ceil(microseconds / interval) if microseconds and interval else math.inf


def use_one_thread() -> None:
    """Limit this process to one thread, as one of several worker processes."""
    _limit["threads"] = 1


def map_in_threads(work: Callable[[Block], Result], blocks: Sequence[Block]) -> list[Result]:
    """
    Map a function over blocks of work, in as many threads as there are usable processors.

    Parameters
    ----------
    work : callable
        Computes the result of one block; releases the interpreter while it computes.
    blocks : sequence
        Independent blocks of work.

    Returns
    -------
    list
        Results in the order of the blocks, identical for any number of threads.
    """
    threads = min(len(blocks), usable_processors(), _limit["threads"])
    if threads <= 1:
        return [work(block) for block in blocks]
    with ThreadPoolExecutor(int(threads)) as pool:
        return list(pool.map(work, blocks))
