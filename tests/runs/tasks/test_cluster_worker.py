"""Checks of a worker before and after a task, in this process."""

import asyncio
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from threading import Lock, Timer

import pytest

from per_obspy.errors import CatalogError, MachineFault
from per_obspy.runs.tasks import cluster_worker as worker_side
from per_obspy.runs.tasks.cluster_worker import (
    LARGEST_MESSAGE,
    Shared,
    do_sent,
    own_versions,
    sent_task,
    token_file,
    wait_until_idle,
)


@pytest.fixture
def shared(tmp_path, monkeypatch):
    monkeypatch.setattr(worker_side, "_own_address", lambda: "tcp://worker")
    known = Shared(tmp_path, "4711")
    token_file(known).write_text("4711")
    return known


def test_a_task_is_done_with_its_arguments(shared):
    outcome = do_sent(sent_task(partial(divmod, 7, 2), shared, 1))
    assert (outcome.value, outcome.error, outcome.refusal) == ((3, 1), None, "")
    assert outcome.seconds >= 0


def test_a_file_that_was_changed_runs_no_code(shared):
    # would catch a pickle that somebody else put into the shared folder
    sent = sent_task(partial(len, "x" * 2 * LARGEST_MESSAGE), shared, 1)
    assert do_sent(sent).value == 2 * LARGEST_MESSAGE
    mark = shared.folder / "ran"
    own = sent_task(partial(Path.touch, mark), shared, 2)
    sent.file.write_bytes(own.content)
    outcome = do_sent(sent)
    assert isinstance(outcome.error, MachineFault)
    assert "changed after it was written" in str(outcome.error)
    assert not mark.exists()


def test_another_folder_of_the_same_name_is_not_shared(shared):
    token_file(shared).write_text("of another machine")
    outcome = do_sent(sent_task(partial(len, ""), shared, 1))
    assert outcome.refusal.endswith("it is not shared")
    assert outcome.value is None


def test_a_folder_that_goes_away_during_the_task_puts_its_result_in_doubt(shared):
    # would catch records taken for missing because the folder is
    outcome = do_sent(sent_task(partial(Path.unlink, token_file(shared)), shared, 1))
    assert outcome.refusal.startswith("does not see the shared folder")


def test_versions_differ_by_name():
    own = own_versions()
    assert own.difference(own) == ""
    other = own._replace(numpy="1.0", source="x")
    assert other.difference(own) == f"numpy 1.0 instead of {own.numpy}, source x instead of " + (
        own.source
    )


class Unsendable(Exception):
    """Another library of the process may let errors be made again without their arguments."""

    def __init__(self):
        super().__init__("no lock can be sent")
        self.lock = Lock()


def refuse(error):
    raise error


@pytest.mark.parametrize(
    ("raised", "expected"),
    [
        (CatalogError("pairs.csv", "no rows"), CatalogError),
        (Unsendable(), RuntimeError),
    ],
)
def test_an_error_reaches_the_client(shared, monkeypatch, raised, expected):
    sent = sent_task(partial(len, ""), shared, 1)
    monkeypatch.setattr(worker_side, "_received", lambda _: partial(refuse, raised))
    assert type(do_sent(sent).error) is expected


def is_idle(seconds):
    """Wait for a task in a thread: a browser of another test may leave a loop in this one."""
    with ThreadPoolExecutor(1) as thread:
        return thread.submit(lambda: asyncio.run(wait_until_idle(seconds))).result()


def test_a_worker_at_work_is_waited_for():
    with worker_side._ONE_TASK:
        assert not is_idle(0.0)
    worker_side._ONE_TASK.acquire()
    Timer(0.2, worker_side._ONE_TASK.release).start()
    assert is_idle(5.0)
