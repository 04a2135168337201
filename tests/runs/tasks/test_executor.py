"""
Tasks on two worker processes of a Dask cluster: none is lost whatever happens to a worker.

Tests per_obspy.runs.tasks.executor.
"""

import os
import signal
import time

import pytest

from per_obspy.config.engine import Engine
from per_obspy.errors import ServiceError, TryLater, Unfinished
from per_obspy.runs.tasks import cluster_worker as worker_side
from per_obspy.runs.tasks.executor import DaskExecutor, present_workers
from per_obspy.runs.tasks.parallel import AHEAD, Work, Workers, results

distributed = pytest.importorskip("distributed", reason="an extra: per_obspy[dask]")


def failed(task, reason):
    return f"{task}: {reason}"


@pytest.fixture(scope="module")
def cluster():
    import dask

    # A task that kills its worker is tried on no second one by the scheduler
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 0}),
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=":0", silence_logs=50
        ) as cluster,
    ):
        yield cluster


@pytest.fixture
def executor(cluster):
    with DaskExecutor(cluster.scheduler_address) as executor:
        yield executor


@pytest.fixture
def client(cluster):
    with distributed.Client(cluster, set_as_default=False) as client:
        client.wait_for_workers(2)
        yield client


def done(executor, folder, tasks, engine=None):
    """Return the results of expressions."""
    with executor.sharing(folder, engine or Engine(retries=1, wait=30)):
        return list(results(tasks, Work(eval, failed), Workers(1, executor)))


def reasons(executor):
    return [event["reason"] for event in executor.facts()["events"]]


def test_every_task_has_a_result_or_a_reason(executor, tmp_path):
    found = done(executor, tmp_path, ["1 + 1", "[] + 1", "len('x' * 9)"])
    assert sorted(map(str, found)) == [
        "2",
        "9",
        '[] + 1: TypeError: can only concatenate list (not "int") to list',
    ]
    facts = executor.facts()
    assert sum(worker["tasks"] for worker in facts["workers"]) == 3
    assert facts["events"] == []
    assert list(tmp_path.iterdir()) == []  # would catch files of tasks that stay


def test_no_worker_is_missed_while_the_client_refreshes_its_own_list(client, monkeypatch):
    def then_refreshed(do, *arguments, **named):
        found = sync(do, *arguments, **named)
        # as in the background every two seconds, without any worker (distributed 2026.8)
        sync(client._update_scheduler_info)
        return found

    sync = client.sync
    monkeypatch.setattr(client, "sync", then_refreshed)
    # would catch workers at work that are reported as killed
    assert [threads for _, threads in present_workers(client).values()] == [1, 1]


def test_few_tasks_are_ahead_of_their_results(executor, tmp_path):
    asked = []

    def tasks():
        for number in range(60):
            asked.append(number)
            yield str(number)

    with executor.sharing(tmp_path, Engine()):
        found = results(tasks(), Work(eval, failed), Workers(1, executor))
        for got in range(1, 30):
            next(found)
            # would catch all of 100 000 tasks waiting in the memory of client and scheduler
            assert len(asked) <= got + 2 * AHEAD * 2
        assert sorted([got, *found])[-1] == 59
    assert executor._pending == {}


def test_a_large_task_travels_by_the_shared_folder(executor, tmp_path):
    text = "x" * (2 * worker_side.LARGEST_MESSAGE)
    assert done(executor, tmp_path, [f"len({text!r})"]) == [len(text)]


def test_a_worker_that_is_killed_loses_no_task(executor, client, tmp_path):
    victim, process = next(iter(client.run(os.getpid).items()))
    tasks = ["__import__('time').sleep(0.2)"] * 12
    with executor.sharing(tmp_path, Engine(retries=3, wait=30)):
        found = results(
            [f"({task}, {n})[1]" for n, task in enumerate(tasks)],
            Work(eval, failed),
            Workers(1, executor),
        )
        first = next(found)
        os.kill(process, signal.SIGKILL)
        assert sorted([first, *found]) == list(range(12))
        end = time.monotonic() + 10
        while not executor.facts()["events"] and time.monotonic() < end:
            time.sleep(0.1)
    lost = executor.facts()["events"][0]
    assert lost["worker"] == victim
    assert "is gone: killed, preempted or cut off" in lost["reason"]


def test_a_task_that_kills_every_worker_stays_undone(executor, tmp_path):
    dies = "__import__('os')._exit(9)"
    with pytest.raises(Unfinished, match="its worker was killed each time, the last one at tcp://"):
        done(executor, tmp_path, [dies, "1 + 1"], Engine(retries=0, wait=30))


def changed(client, text, **where):
    """Change the module of the worker side on workers: they cannot import this one."""
    text = f"import per_obspy.runs.tasks.cluster_worker as side; {text}"
    client.run(exec, text, {}, **where)


def with_versions(versions):
    return f"side.own_versions = lambda: side.Versions(*{tuple(versions)})"


def test_a_worker_of_another_version_gets_no_task(executor, client, tmp_path):
    own = worker_side.own_versions()
    wrong, right = sorted(client.run(os.getpid))
    try:
        changed(client, with_versions(own._replace(numba="0.1")), workers=[wrong])
        assert sorted(done(executor, tmp_path, ["1", "2", "3", "4"])) == [1, 2, 3, 4]
    finally:
        changed(client, with_versions(own))
    counts = {worker["address"]: worker["tasks"] for worker in executor.facts()["workers"]}
    assert counts == {wrong: 0, right: 4}
    assert reasons(executor) == [f"runs numba 0.1 instead of {own.numba}; it gets no task"]


def test_without_any_fit_worker_the_reason_names_them(executor, client, tmp_path):
    own = worker_side.own_versions()
    try:
        changed(client, with_versions(own._replace(per_obspy="0.0.9")))
        with pytest.raises(
            TryLater, match=r"no usable worker within 1 s: .* runs per_obspy 0\.0\.9"
        ):
            done(executor, tmp_path, ["1"], Engine(wait=1))
    finally:
        changed(client, with_versions(own))


def with_token(name):
    return f"side.token_file = lambda shared: shared.folder / {name!r}"


def test_a_worker_that_loses_the_shared_folder_gets_no_further_task(executor, client, tmp_path):
    lost, right = sorted(client.run(os.getpid))
    try:
        changed(client, with_token("elsewhere"), workers=[lost])
        tasks = [f"(__import__('time').sleep(0.1), {n})[1]" for n in range(8)]
        assert sorted(done(executor, tmp_path, tasks)) == list(range(8))
    finally:
        changed(client, with_token("token"))
    assert reasons(executor) == [
        f"does not see the shared folder {tmp_path}: No such file or directory; it gets no task"
    ]
    # would catch a worker that takes task after task because it fails at once
    assert executor.facts()["workers"][[lost, right].index(lost)]["tasks"] <= AHEAD * 2


def test_no_scheduler_is_no_wrong_input(tmp_path):
    with (
        DaskExecutor("missing.json") as executor,
        pytest.raises(ServiceError, match="no scheduler"),
    ):
        done(executor, tmp_path, ["1"])


def test_a_scheduler_that_ends_leaves_tasks_for_the_next_run(cluster, tmp_path):
    # the last test of the module: the cluster is no more afterwards
    tasks = ["1", *["__import__('time').sleep(1)"] * 9]
    with (
        DaskExecutor(cluster.scheduler_address) as executor,
        executor.sharing(tmp_path, Engine(wait=1)),
    ):
        found = results(tasks, Work(eval, failed), Workers(1, executor))
        next(found)
        cluster.close()
        with pytest.raises(Unfinished, match=r"is gone|no usable worker"):
            list(found)
