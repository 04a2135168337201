"""
End of the program by SIGTERM or SIGINT, within ten seconds and with a folder that can be resumed.

A signal raises an exception in the main thread: the current task is abandoned, and so are the
processes that work on it. What they had finished stays, as every file is written whole. Compiled
code does not notice exceptions; a thread therefore ends the program when the time is over.
"""

import multiprocessing
import os
import select
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

#: Exit codes after the interrupt key and after SIGTERM, as of programs that these signals end.
INTERRUPTED, TERMINATED = 130, 143

#: s, from a signal to the end of the program at the latest.
LIMIT = 5.0

_ENDING = (signal.SIGINT, signal.SIGTERM)
_request = threading.Event()
_interrupts = list[Callable[[], None]]()


class _Hold:
    """Whether signals wait, the one that does, and the last whose exception was raised."""

    depth = 0
    waiting: int | None = None
    raised: int | None = None


_hold = _Hold()


class Terminated(SystemExit):
    """The program was asked to end by SIGTERM; raised in the main thread."""

    def __init__(self) -> None:
        super().__init__(TERMINATED)


def requested() -> bool:
    """Return whether SIGTERM has asked the program to end."""
    return _request.is_set()


def pause(seconds: float) -> bool:
    """Wait, and return whether SIGTERM has asked the program to end; an end does not wait."""
    return _request.wait(seconds)


@contextmanager
def ending_in_time() -> Iterator[None]:
    """
    End the program by SIGTERM and SIGINT within :data:`LIMIT` seconds, whatever the block does.

    SIGTERM raises :class:`Terminated`, and SIGINT ``KeyboardInterrupt``. Outside the main thread
    and on systems without these signals the block runs as it is.
    """
    if os.name != "posix" or threading.current_thread() is not threading.main_thread():
        yield
        return
    _request.clear()
    _hold.depth, _hold.waiting, _hold.raised = 0, None, None
    # The number of every signal is written at once, also while compiled code works
    read, write = os.pipe()
    os.set_blocking(write, False)
    earlier_fd = signal.set_wakeup_fd(write, warn_on_full_buffer=False)
    earlier = [signal.signal(number, _end) for number in _ENDING]
    threading.Thread(target=_watch, args=(read,), daemon=True, name="termination").start()
    try:
        yield
    finally:
        for number, handler in zip(_ENDING, earlier, strict=True):
            signal.signal(number, handler)
        signal.set_wakeup_fd(earlier_fd)
        os.close(write)


@contextmanager
def held() -> Iterator[None]:
    """
    Let the exceptions of both signals wait until the block has ended.

    Masks of signals are those of one thread, and any other thread takes the signal then.
    """
    _hold.depth += 1
    try:
        yield
    finally:
        _hold.depth -= 1
    number = _hold.waiting
    if number is not None and not _hold.depth:
        _hold.waiting = None
        _end(number)


@contextmanager
def interrupted_by_signals(interrupt: Callable[[], None]) -> Iterator[None]:
    """
    Call a function as soon as a signal ends the program, while the block lasts.

    Parameters
    ----------
    interrupt : callable
        Ends what other threads do for compiled code of the main thread, which looks for signals
        but waits for these threads before it returns.
    """
    _interrupts.append(interrupt)
    try:
        yield
    finally:
        _interrupts.remove(interrupt)


def raise_swallowed_end(error: BaseException) -> None:
    """
    Raise the exception of a signal again, if a library has made another error of it.

    Parameters
    ----------
    error : BaseException
        What the library has raised: databases look for signals while they work, and report their
        exceptions as errors of the query.
    """
    if _hold.raised is None or not isinstance(error, Exception):
        return
    raise (KeyboardInterrupt if _hold.raised == signal.SIGINT else Terminated) from error


def _end(number: int, *_: object) -> None:
    """Raise the exception of a signal; a second SIGTERM does not disturb the clearing up."""
    if _hold.depth:
        _hold.waiting = number
        return
    is_key = number == signal.SIGINT
    if not is_key and _request.is_set():
        return
    _hold.raised = number
    # Here, as the exception of a handler is noticed by what has not ended yet
    for interrupt in _interrupts:
        interrupt()
    if is_key:
        raise KeyboardInterrupt
    _request.set()
    raise Terminated


def _watch(read: int) -> None:
    """Read the numbers of signals, and end the program when the time after one is over."""
    end, code = None, 0
    while True:
        left = None if end is None else max(end - time.monotonic(), 0.0)
        ready, _, _ = select.select([read], [], [], left)
        if not ready:
            end_now(code)
        found = os.read(read, 1)
        # The block has ended
        if not found:
            os.close(read)
            return
        if end is None and found[0] in _ENDING:
            end, code = time.monotonic() + LIMIT, 128 + found[0]


def end_now(code: int) -> None:
    """End the program and the processes that it has started, without waiting for any thread."""
    for child in multiprocessing.active_children():
        child.kill()
    os._exit(code)


def has_working_threads() -> bool:
    """Return whether a thread still works for which the interpreter would wait at its end."""
    main = threading.main_thread()
    return any(not thread.daemon for thread in threading.enumerate() if thread is not main)
