"""
Independent tasks on several processes or any executor; a failure does not stop other tasks.

A resumable task leaves a status file (:mod:`per_obspy.resume`) of what it made: :func:`finish` is
the one loop over stations, chunks of pairs and chunks of rows of buildings.

The exception is a folder of results that cannot be written: the first ``WriteError`` or
``WrongOutput`` ends the work.

A fault of the data is the result of its task. A fault of the machine (:mod:`per_obspy.machine`, or
a worker that dies) is none: the task stays undone, and ``Unfinished`` is raised after all others.

A task whose worker dies takes the whole pool with it. Tasks at work then are done again, each
task in a process of its own, so that only the guilty task fails; the rest goes on in a new pool.
Few tasks are ahead of the results that were taken, so that a long row of them needs little memory.
"""

import os
import signal
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    Executor,
    Future,
    ProcessPoolExecutor,
    wait,
)
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from itertools import chain, islice
from multiprocessing import active_children, parent_process
from operator import attrgetter, methodcaller
from threading import Lock, Thread
from typing import Any, Generic, NamedTuple, Self, TypeVar

from per_obspy.errors import PerError, TryLater, Unfinished, WriteError, WrongOutput
from per_obspy.machine import machine_fault, machine_faults
from per_obspy.progress import Progress, silent
from per_obspy.runs.tasks.worker_start import are_forks, start_server, worker_context
from per_obspy.termination import held
from per_obspy.threads import usable_processors, use_one_thread

Task = TypeVar("Task")
Result = TypeVar("Result")

#: Return the result of a task; other processes must be able to import the function.
Do = Callable[[Task], Result]

#: Return the substitute for the result of a task that failed, given the reason.
Failed = Callable[[Task, str], Result]


class Work(NamedTuple, Generic[Task, Result]):
    """Function of every task, with its substitute for failures and the name of a task."""

    #: The work itself.
    do: Do[Task, Result]
    #: Substitute for the result of a task whose data are at fault.
    failed: Failed[Task, Result]
    #: Name of a task in messages.
    name: Callable[[Task], str] = str


class Resumable(ABC, Generic[Result]):
    """Task whose result an earlier run may have left; other processes must be able to load it."""

    @property
    @abstractmethod
    def name(self) -> str:
        """Name of the task in messages."""

    @abstractmethod
    def with_key(self) -> Self:
        """Return the task with the hash of everything on which its result depends."""

    @abstractmethod
    def earlier(self) -> Result | None:
        """Return the result of an earlier run; None if the task has to be done."""

    @abstractmethod
    def do(self) -> Result:
        """Do the work, write what it makes and its status, and return the result."""

    @abstractmethod
    def failed(self, reason: str) -> Result:
        """Return the substitute for the result if the data are at fault."""


@dataclass(frozen=True)
class Workers:
    """Processes in which tasks are done, and who is told of finished ones."""

    #: Number of processes; one, or a single task, needs none but this. 0: one per processor.
    processes: int = 0
    #: Where to work instead.
    executor: Executor | None = None
    #: Called with the name of a stage, and the numbers of finished and of all its tasks.
    progress: Progress = silent

    @property
    def count(self) -> int:
        """Number of processes."""
        return self.processes or usable_processors()


#: Reason of a task that takes its worker with it, also when it is alone.
DIED = "its worker process was killed, perhaps for lack of memory"

#: Signals that end a run.
_SIGNALS = {signal.SIGINT, signal.SIGTERM}

#: Pairs from which on short work after the screening is begun in other processes.
MANY = 40

#: Tasks submitted ahead, for each worker: one at work and one ready.
AHEAD = 2

#: Libraries of netCDF are not safe in threads: an executor with threads does one task at a time.
_ONE_TASK = Lock()

#: Tasks submitted ahead to an executor of unknown size.
AHEAD_ELSEWHERE = 64


def _ahead_elsewhere() -> int:
    """Return how many tasks are kept ahead of the results of an executor of unknown size."""
    return AHEAD_ELSEWHERE


class ElasticExecutor(Executor):
    """Executor whose number of workers changes while the work goes on."""

    def ahead(self) -> int:
        """Return how many tasks are kept ahead of the results just now."""
        raise NotImplementedError


def results(tasks: Iterable[Task], work: Work[Task, Result], workers: Workers) -> Iterator[Result]:
    """
    Yield the result of every task as it is finished.

    Raises
    ------
    WriteError, WrongOutput
        If a task cannot write its result; tasks that have not begun are cancelled.
    Unfinished
        After all other tasks, if the machine failed in some.
    """
    faults = list[str]()
    yield from _all_results(tasks, _Watched(work, faults), workers)
    if faults:
        raise Unfinished(*faults)


def _all_results(
    tasks: Iterable[Task],
    watched: "_Watched[Task, Result]",
    workers: Workers,
) -> Iterator[Result]:
    """Yield the results of all tasks in which the machine does not fail."""
    executor, count = workers.executor, workers.count
    if executor is not None:
        ahead = executor.ahead if isinstance(executor, ElasticExecutor) else _ahead_elsewhere
        for task in (yield from _on(executor, tasks, watched, ahead)):
            watched.note(task, watched.broken or DIED)
        return
    # One task alone needs no other process
    remaining = iter(tasks)
    first = list(islice(remaining, 2))
    if min(count, len(first)) <= 1:
        for task in chain(first, remaining):
            yield from watched.result(task, partial(watched.work.do, task))
        return
    remaining = chain(first, remaining)
    for head in remaining:  # a pool, and another one after each worker that died
        with _Pool(count) as pool:
            waiting = chain([head], remaining)
            unfinished = yield from _on(pool, waiting, watched, lambda: AHEAD * count)
        for task in unfinished:
            yield from _alone(task, watched)


def near(workers: Workers, pairs: int) -> Workers:
    """Return who does short work on so many pairs: this process where others begin too late."""
    shared = pairs >= MANY and workers.executor is None and are_forks()
    return workers if shared else Workers(1)


@contextmanager
def begun(calls: Sequence[partial[Result]], workers: Workers) -> Iterator[list[partial[Result]]]:
    """
    Begin some calls in other processes; the block receives calls that wait for the results.

    This process is one of the workers: it does a call that is asked for before it has begun, and
    one whose process died. Whoever asks for the last calls first waits least.
    """
    if workers.count < 2:
        yield [*calls]
        return
    with _Pool(workers.count - 1) as pool:
        yield [partial(_awaited, _submitted(pool, call), call) for call in calls]


def _submitted(pool: Executor, call: partial[Result]) -> Future[Result] | None:
    """Return the future of a call; None if the pool is broken."""
    try:
        return pool.submit(_done, _call, call)
    except BrokenExecutor:
        return None


def _awaited(future: Future[Result] | None, call: partial[Result]) -> Result:
    """Return the result of a call that was begun, or else do it."""
    try:
        return call() if future is None or future.cancel() else future.result()
    except BrokenExecutor:
        return call()


def _call(call: partial[Result]) -> Result:
    """Call; other processes load this by its name."""
    return call()


def prepare_workers(workers: int) -> None:
    """Let the libraries of the workers be loaded in the background, if more than one will work."""
    if workers > 1:
        with _signals_held():
            start_server()


def finish(tasks: Iterable[Resumable[Result]], workers: Workers) -> Iterator[Result]:
    """
    Yield the result of every resumable task; results of an earlier run are reused.

    Raises
    ------
    WriteError, WrongOutput, Unfinished
        As :func:`results` does.
    """
    resumed, faults = list[Result](), list[str]()
    watched = _Watched(_RESUMABLE, faults)

    def missing() -> Iterator[Resumable[Result]]:
        """Yield the tasks without an earlier result, and collect the earlier results."""
        for task in tasks:
            # A key that cannot be computed costs its own task only
            for found in watched.result(task, partial(_begun, task)):
                if isinstance(found, Resumable):
                    yield found
                else:
                    resumed.append(found)

    # Resumed results are passed on as soon as the next one is finished, or none can be written
    try:
        for result in _all_results(missing(), watched, workers):
            yield from resumed
            resumed.clear()
            yield result
    except (WriteError, WrongOutput):
        yield from resumed
        raise
    yield from resumed
    if faults:
        raise Unfinished(*faults)


def _begun(task: Resumable[Result]) -> Resumable[Result] | Result:
    """Return the result that an earlier run left of a task, or else the task with its key."""
    keyed = task.with_key()
    earlier = keyed.earlier()
    return keyed if earlier is None else earlier


#: Work of resumable tasks; only its first function travels to other processes.
_RESUMABLE: Work[Any, Any] = Work(
    methodcaller("do"), lambda task, reason: task.failed(reason), attrgetter("name")
)


class _Watched(Generic[Task, Result]):
    """Work whose errors become results, if they are faults of the data, or else faults."""

    def __init__(self, work: Work[Task, Result], faults: list[str]) -> None:
        self.work = work
        self.broken = ""
        self._faults = faults

    def note(self, task: Task, reason: str) -> None:
        """Note a task in which the machine failed."""
        self._faults.append(f"{self.work.name(task)}: {reason}")

    def result(self, task: Task, get: Callable[[], Result]) -> Iterator[Result]:
        """
        Yield the result of a task, or its substitute; no result if the machine failed.

        Only where the machine cannot write, the other tasks fail too, and all of them stop.
        """
        found: Result | None
        try:
            found = get()
        except BrokenExecutor as error:
            self.broken = str(error)
            raise
        except (WriteError, WrongOutput):
            raise
        except TryLater as error:
            self.note(task, str(error))
            return
        except PerError as error:
            found = self._substitute(task, error, str(error))
        except Exception as error:  # noqa: BLE001 - any error is a result
            found = self._substitute(task, error, f"{type(error).__name__}: {error}")
        if found is not None:
            yield found

    def _substitute(self, task: Task, error: Exception, reason: str) -> Result | None:
        """Return the result of a task that failed; None if that was a fault of the machine."""
        fault = machine_fault(error)
        if fault is None:
            return self.work.failed(task, reason)
        self.note(task, str(fault))
        return None


def _on(
    executor: Executor,
    tasks: Iterable[Task],
    watched: _Watched[Task, Result],
    ahead: Callable[[], int],
) -> Generator[Result, None, list[Task]]:
    """Yield results until all tasks are done or the executor is broken; return its tasks then."""
    remaining, unfinished = iter(tasks), list[Task]()
    pending: dict[Future[Result], Task] = {}
    unwritten: WriteError | WrongOutput | None = None
    while True:
        # Keep the executor busy, but only a few tasks ahead of the results
        room = 0 if unfinished else ahead() - len(pending)
        for task in islice(remaining, max(room, 0)):
            try:
                pending[executor.submit(_done, watched.work.do, task)] = task
            except BrokenExecutor as error:
                watched.broken = str(error)
                unfinished.append(task)
                break
        if not pending:
            return unfinished
        # A broken executor fails all its tasks: they are done again elsewhere
        for future in wait(pending, return_when=FIRST_COMPLETED).done:
            task = pending.pop(future)
            try:
                yield from watched.result(task, future.result)
            except BrokenExecutor:
                unfinished.append(task)
            except (WriteError, WrongOutput) as error:
                unwritten = error
        # Other tasks cannot write either; finished results have been passed on
        if unwritten:
            for future in pending:
                future.cancel()
            raise unwritten


def _done(do: Do[Task, Result], task: Task) -> Result:
    """Do a task; raise errors caused by the machine as machine faults: processes drop causes."""
    with _ONE_TASK, machine_faults():
        return do(task)


def _alone(task: Task, watched: _Watched[Task, Result]) -> Iterator[Result]:
    """Yield the result of one task, done in a separate process."""
    try:
        with _Pool(1) as pool:
            future = pool.submit(_done, watched.work.do, task)
            yield from watched.result(task, future.result)
    except BrokenExecutor:
        watched.note(task, DIED)


class _Pool(ProcessPoolExecutor):
    """Process pool that ends with an interrupt."""

    def __init__(self, workers: int) -> None:
        self._others = set(active_children())
        super().__init__(workers, mp_context=worker_context(), initializer=_begin_worker)

    def submit(self, do: Callable[..., Any], /, *arguments: Any, **named: Any) -> Future[Any]:
        """Submit a task, with signals held back while a process starts."""
        with _signals_held():
            return super().submit(do, *arguments, **named)

    def __exit__(self, kind: type[BaseException] | None, *others: Any) -> bool | None:
        """Wait for the workers; end them first if the work was interrupted."""
        if kind is not None and not issubclass(kind, Exception):
            # Files are written whole, so that a worker can end anywhere
            for worker in set(active_children()) - self._others:
                worker.kill()
        return super().__exit__(kind, *others)


@contextmanager
def _signals_held() -> Iterator[None]:
    """
    Hold back the interrupt key and SIGTERM, also in a process that is started meanwhile.

    The key of a terminal reaches workers as well as the run, and a process that is not yet known
    to the run could not be ended with it.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    with held():
        before = signal.pthread_sigmask(signal.SIG_BLOCK, _SIGNALS)
        try:
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin_worker() -> None:
    """Prepare a worker process: one thread, and an end with the process that started it."""
    # The run ends its workers itself; until here both signals were held back
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGTERM})
    use_one_thread()
    _end_with_parent()


def _end_with_parent() -> None:
    """End this process when the one that started it has ended, even if that was killed."""
    parent = parent_process()
    assert parent is not None  # a pool starts this process

    def watch() -> None:
        parent.join()
        os._exit(1)

    Thread(target=watch, daemon=True).start()
