"""Tasks on processes: none is lost or stops the others, and few are ahead of the results."""

import os
import subprocess
import sys
import time
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from functools import partial
from math import isqrt
from pathlib import Path

import pytest

from per_obspy.errors import CatalogError, Unfinished, WriteError
from per_obspy.runs.tasks.parallel import AHEAD, DIED, Work, Workers, begun, results

#: Ends a process as the system does with one that takes too much memory.
DIES = "__import__('os')._exit(9)"


def failed(number, reason):
    return f"{number}: {reason}"


class InProcess(Executor):
    """Do the work at once in this process."""

    def submit(self, function, /, *arguments):
        future = Future()
        try:
            future.set_result(function(*arguments))
        except (ValueError, WriteError) as error:
            future.set_exception(error)
        return future


def _full(number):
    raise WriteError(f"{number}.nc", "No space left on device")


@pytest.mark.parametrize("executor", [None, InProcess()])
def test_a_machine_that_cannot_write_stops_all_tasks(executor):
    # would catch a full disk that is noted as a fault of every task
    with pytest.raises(WriteError, match=r"\.nc: cannot be written: No space left on device"):
        list(results(iter(range(100)), Work(_full, failed), Workers(1, executor)))


@pytest.mark.parametrize("workers", [1, 2])
def test_every_task_has_a_result_or_a_reason(workers):
    found = list(results(iter([1, -2, 9, 16]), Work(isqrt, failed), Workers(workers)))
    assert sorted(map(str, found)) == sorted(
        ["1", "-2: ValueError: isqrt() argument must be nonnegative", "3", "4"]
    )


def _refused(number):
    raise CatalogError("pairs.csv", f"row {number} is no row")


def test_wrong_input_is_no_error_of_the_program():
    assert list(results([7], Work(_refused, failed), Workers(1))) == [
        "7: pairs.csv: row 7 is no row"
    ]


def test_a_worker_that_dies_takes_only_its_task_with_it():
    # would catch tasks that waited behind the guilty one and were forgotten, or a pool that is not
    # replaced
    numbers = list(range(12))
    tasks = [DIES if number == 3 else str(number) for number in numbers]
    found = list[int]()
    with pytest.raises(Unfinished) as unfinished:
        found.extend(results(tasks, Work(eval, failed), Workers(2)))
    # a killed worker is a fault of the machine: its task has no result, all others have
    assert unfinished.value.faults == (f"{DIES}: {DIED}",)
    numbers.remove(3)
    assert sorted(found) == numbers


def test_calls_are_begun_in_other_processes_and_none_is_lost():
    # would catch a killed process that leaves the page without what all others have found
    here = f"__import__('os').getpid() == {os.getpid()}"
    with begun([partial(eval, here)] * 3, Workers(2)) as waiting:
        assert [call() for call in waiting] == [False] * 3
    calls = [partial(eval, f"{here} or {DIES}"), partial(isqrt, 16), partial(isqrt, 25)]
    with begun(calls, Workers(2)) as waiting:
        assert [call() for call in waiting] == [True, 4, 5]
    # this process does not wait for calls that no other has begun
    calls = [partial(eval, "__import__('time').sleep(0.5)")] * 3 + [partial(eval, here)] * 3
    with begun(calls, Workers(2)) as waiting:
        assert [call() for call in reversed(waiting)] == [True] * 3 + [None] * 3


SLEEPS = """
import os, sys, time
from per_obspy.runs.tasks.parallel import Work, Workers, results
notes = f"open({sys.argv[1]!r} + str(__import__('os').getpid()), 'w').close()"
task = f"{notes} or __import__('time').sleep(100)"
if __name__ == "__main__":
    list(results([task, task], Work(eval, lambda *_: None), Workers(2)))
"""


def _waited(condition):
    for _ in range(300):
        if condition():
            return True
        time.sleep(0.1)
    return False


def _is_running(process):
    try:
        return Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc")
def test_workers_end_when_the_run_is_killed(tmp_path):
    # would catch workers that wait for their next task for ever, with all their memory
    script = tmp_path / "sleeps.py"
    script.write_text(SLEEPS)
    (tmp_path / "at_work").mkdir()
    run = subprocess.Popen([sys.executable, str(script), str(tmp_path / "at_work") + os.sep])
    assert _waited(lambda: len(list((tmp_path / "at_work").iterdir())) == 2)
    workers = [int(file.name) for file in (tmp_path / "at_work").iterdir()]
    assert all(map(_is_running, workers))
    run.kill()
    run.wait()
    assert _waited(lambda: not any(map(_is_running, workers)))


def test_an_executor_that_was_given_does_the_work():
    assert sorted(results([1, 4, 9], Work(isqrt, failed), Workers(1, InProcess()))) == [1, 2, 3]


def test_few_tasks_are_ahead_of_their_results():
    asked = []

    def tasks():
        for number in range(40):
            asked.append(number)
            yield number

    found = results(tasks(), Work(isqrt, failed), Workers(2))
    for done in range(1, 20):
        next(found)
        assert len(asked) <= done + 2 * AHEAD  # would catch a pool that takes all tasks at once
    list(found)
    assert len(asked) == 40


def test_nothing_to_do_is_done():
    assert list(results([], Work(isqrt, failed), Workers(2))) == []


def _overlap(task):
    """Return how many tasks are at work at the same time as this one."""
    _AT_WORK.append(task)
    time.sleep(0.02)
    count = len(_AT_WORK)
    _AT_WORK.remove(task)
    return count


_AT_WORK: list[int] = []


def test_threads_do_one_task_at_a_time():
    # netCDF ends the process if two threads write: would catch tasks that overlap
    with ThreadPoolExecutor(4) as threads:
        found = list(results(range(8), Work(_overlap, failed), Workers(4, threads)))
    assert found == [1] * 8
