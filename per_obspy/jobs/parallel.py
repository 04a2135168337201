"""
Independent tasks on several processes, or on any executor; none of them can stop the others.

The exception is a machine that cannot write: the first ``WriteError`` ends the work.

A task whose worker dies takes the whole pool with it. What was under way then is done again, each
task in a process of its own, so that only the guilty task fails; the rest goes on in a new pool.
Few tasks are ahead of the results that were taken, so that a long row of them needs little memory.
"""

import os
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from itertools import chain, islice
from multiprocessing import get_context, parent_process
from threading import Thread
from typing import TypeVar

from per_obspy.errors import PerError, WriteError
from per_obspy.threads import use_one_thread

Task = TypeVar("Task")
Result = TypeVar("Result")

#: Return the result of a task; other processes must be able to import the function.
Do = Callable[[Task], Result]

#: Return the substitute for the result of a task that failed, given the reason.
Failed = Callable[[Task, str], Result]

#: Tasks submitted ahead, for each worker: one at work and one ready.
AHEAD = 2

#: Tasks submitted ahead to an executor of unknown size.
AHEAD_ELSEWHERE = 64


def results(
    tasks: Iterable[Task],
    do: Do[Task, Result],
    failed: Failed[Task, Result],
    workers: int,
    executor: Executor | None,
) -> Iterator[Result]:
    """
    Yield the result of every task as it is finished.

    Parameters
    ----------
    tasks : iterable
        Tasks, which are taken while the work goes on.
    do, failed : callable
        Work of a task, and the substitute for its result if it fails.
    workers : int
        Number of processes; one, or a single task, needs none but this.
    executor : Executor, optional
        Where to work instead.

    Raises
    ------
    WriteError
        If a task cannot write its result; tasks that have not begun are cancelled.
    """
    if executor is not None:
        unfinished = yield from _on(executor, tasks, do, failed, AHEAD_ELSEWHERE)
        yield from (failed(task, "its worker process died") for task in unfinished)
        return
    remaining = iter(tasks)
    first = list(islice(remaining, 2))
    if min(workers, len(first)) <= 1:
        yield from (_caught(task, partial(do, task), failed) for task in chain(first, remaining))
        return
    remaining = chain(first, remaining)
    for head in remaining:  # a pool, and another one after each worker that died
        with _pool(workers) as pool:
            unfinished = yield from _on(pool, chain([head], remaining), do, failed, AHEAD * workers)
        for task in unfinished:
            yield _alone(task, do, failed)


def _on(
    executor: Executor,
    tasks: Iterable[Task],
    do: Do[Task, Result],
    failed: Failed[Task, Result],
    ahead: int,
) -> Generator[Result, None, list[Task]]:
    """Yield results until all tasks are done or the executor is broken; return its tasks then."""
    remaining, unfinished = iter(tasks), list[Task]()
    pending: dict[Future[Result], Task] = {}
    unwritten: WriteError | None = None
    while True:
        # Keep the executor busy, but only a few tasks ahead of the results
        room = 0 if unfinished else ahead - len(pending)
        for task in islice(remaining, room):
            try:
                pending[executor.submit(do, task)] = task
            except BrokenProcessPool:
                unfinished.append(task)
                break
        if not pending:
            return unfinished
        # A broken executor fails all its tasks: they are done again elsewhere
        for future in wait(pending, return_when=FIRST_COMPLETED).done:
            task = pending.pop(future)
            try:
                yield _caught(task, future.result, failed)
            except BrokenProcessPool:
                unfinished.append(task)
            except WriteError as error:
                unwritten = error
        # Other tasks cannot write either; what was finished has been passed on
        if unwritten:
            for future in pending:
                future.cancel()
            raise unwritten


def _alone(task: Task, do: Do[Task, Result], failed: Failed[Task, Result]) -> Result:
    """Return the result of a task that has a process of its own."""
    try:
        with _pool(1) as pool:
            return _caught(task, pool.submit(do, task).result, failed)
    except BrokenProcessPool:
        return failed(task, "its worker process died")


def _pool(workers: int) -> ProcessPoolExecutor:
    """Return fresh processes: a fork of a process that has threads can hang."""
    return ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=_begin_worker)


def _begin_worker() -> None:
    """Prepare a worker process: one thread, and an end with the process that started it."""
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


def _caught(task: Task, work: Callable[[], Result], failed: Failed[Task, Result]) -> Result:
    """
    Return the result; whatever is raised becomes a reason, so that no task stops the others.

    Only where the machine cannot write, the other tasks fail too, and all of them stop.
    """
    try:
        return work()
    except (BrokenProcessPool, WriteError):
        raise
    except PerError as error:
        return failed(task, str(error))
    except Exception as error:  # noqa: BLE001 - where a worker returns, every task needs a result
        return failed(task, f"{type(error).__name__}: {error}")
