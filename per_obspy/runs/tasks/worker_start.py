"""
Start of worker processes: fresh interpreters, or forks of a server.

A fork of a process with threads of Python can hang. The server has none: it loads the libraries of
the jobs once, while the run that it serves loads its own, and each worker begins with a copy.
Threads of allocators and of linear algebra end and begin with a fork by themselves. Only the
command line on Linux forks: a program has one server, which may be that of its user, and system
libraries of macOS do not survive a fork.
"""

import gc
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from per_obspy.garbage import keep_all, no_search

if TYPE_CHECKING:
    from multiprocessing.context import BaseContext

#: Modules that load everything that a job needs.
LOADED = ("per_obspy.runs.tasks.worker_libraries",)

#: Whether workers of this process are forks of its server.
_forks = {"workers": False}


@contextmanager
def forked_workers() -> Iterator[None]:
    """Fork the workers of a program from a server while the block runs, where that is safe."""
    earlier = _forks["workers"]
    _forks["workers"] = sys.platform == "linux"
    try:
        yield
    finally:
        _forks["workers"] = earlier


@contextmanager
def loading() -> Iterator[None]:
    """Load libraries in a block; those of a program are left out of later searches for garbage."""
    with no_search():
        yield
    # Once: what a watcher has from one run to the next is found by later searches
    if are_forks() and not gc.get_freeze_count():
        keep_all()


def are_forks() -> bool:
    """Return whether workers are forks of a server, which begin in a tenth of a second."""
    return _forks["workers"]


def worker_context() -> "BaseContext":
    """Return the context in which worker processes are started."""
    from multiprocessing import forkserver, get_context

    if not are_forks():
        return get_context("spawn")
    forkserver.set_forkserver_preload(list(LOADED))
    return get_context("forkserver")


def start_server() -> None:
    """Start the server, if workers are its forks, which loads its libraries in the background."""
    from multiprocessing import forkserver

    if are_forks():
        worker_context()
        forkserver.ensure_running()
