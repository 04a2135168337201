"""Tasks on processes: nothing is lost, none stops the others, and few are ahead of the results."""

from concurrent.futures import Executor, Future
from math import isqrt

import pytest

from per_obspy.errors import CatalogError
from per_obspy.parallel import AHEAD, results

#: Ends a process as the system does with one that takes too much memory.
DIES = "__import__('os')._exit(9)"


def lost(number, reason):
    return f"{number}: {reason}"


class Here(Executor):
    """Do the work at once, in this process."""

    def submit(self, function, /, *arguments):
        future = Future()
        try:
            future.set_result(function(*arguments))
        except ValueError as error:
            future.set_exception(error)
        return future


@pytest.mark.parametrize("workers", [1, 2])
def test_every_task_has_a_result_or_a_reason(workers):
    found = list(results(iter([1, -2, 9, 16]), isqrt, lost, workers, None))
    assert sorted(map(str, found)) == sorted(["1", "-2: ValueError: isqrt() argument must be nonnegative", "3", "4"])


def _refused(number):
    raise CatalogError("pairs.csv", f"row {number} is no row")


def test_what_the_user_got_wrong_is_no_error_of_the_program():
    assert list(results([7], _refused, lost, 1, None)) == ["7: pairs.csv: row 7 is no row"]


def test_a_worker_that_dies_takes_only_its_task_with_it():
    # would catch tasks that waited behind the guilty one and were forgotten, or a pool that is not replaced
    tasks = [DIES if number == 3 else str(number) for number in range(12)]
    found = list(results(tasks, eval, lost, 2, None))
    assert f"{DIES}: its worker process died" in found
    assert sorted(one for one in found if isinstance(one, int)) == [number for number in range(12) if number != 3]


def test_an_executor_that_was_given_does_the_work():
    assert sorted(results([1, 4, 9], isqrt, lost, 1, Here())) == [1, 2, 3]


def test_few_tasks_are_ahead_of_their_results():
    asked = []

    def tasks():
        for number in range(40):
            asked.append(number)
            yield number

    found = results(tasks(), isqrt, lost, 2, None)
    for done in range(1, 20):
        next(found)
        assert len(asked) <= done + 2 * AHEAD  # would catch a pool that takes all tasks at once
    list(found)
    assert len(asked) == 40


def test_nothing_to_do_is_done():
    assert list(results([], isqrt, lost, 2, None)) == []
