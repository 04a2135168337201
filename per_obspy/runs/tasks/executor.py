"""
Executor of a run: the processes of this machine, one that was given, or a Dask cluster.

A task on a cluster is tried again, on another worker if there is one, after a fault of the worker
or of its machine. Only tasks that fail each time stay undone. The client keeps few tasks ahead of
the results (:mod:`per_obspy.runs.tasks.parallel`), and large ones travel by the shared folder, so
that the memory of client and scheduler does not grow with the number of tasks.
"""

import json
import logging
import secrets
import time
from collections.abc import Callable, Collection, Iterator, Mapping
from concurrent.futures import BrokenExecutor, Executor, Future, InvalidStateError
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext, suppress
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from functools import partial
from importlib import import_module
from itertools import count
from operator import itemgetter
from pathlib import Path
from threading import Event, Thread, Timer
from typing import Any
from urllib.parse import urlsplit

from per_obspy.config import Run
from per_obspy.config.engine import Engine, checked_address, local_workers
from per_obspy.errors import (
    CatalogError,
    MachineFault,
    ServiceError,
    TryLater,
    printable,
    reason_of,
    require_extra,
)
from per_obspy.files import remove_file, temporary_folder, writing
from per_obspy.runs.tasks.cluster_worker import (
    Outcome,
    SentTask,
    Shared,
    do_sent,
    identity,
    own_versions,
    sent_task,
    token_file,
    wait_until_idle,
)
from per_obspy.runs.tasks.parallel import AHEAD, ElasticExecutor, Workers
from per_obspy.threads import usable_processors

LOG = logging.getLogger("per_obspy.cluster")

#: Seconds within which a scheduler has to answer.
ANSWER = 30

#: Bytes of a scheduler file that are read: it holds a few addresses, and every worker of later.
LARGEST_FILE = 10_000_000

#: Events that are kept; of a cluster that loses workers all day the first ones explain the rest.
EVENTS_KEPT = 1000

#: Seconds between two looks at the workers, and before a task is tried again (times the attempt).
LOOK, PAUSE = 1.0, 0.5

#: Unfit workers that one task may meet.
MOST_REFUSALS = 100

#: Tasks ahead while no worker has come yet.
FEWEST_AHEAD = 4

#: Seconds that tasks of a run that ends early, or of an earlier run, may take to end.
PATIENCE = 10.0


@contextmanager
def connected_client(address: str) -> Iterator[Any]:
    """
    Yield a client of a cluster, which is started first if it is one of this machine.

    Raises
    ------
    MissingExtra
        If Dask is not installed.
    ServiceError
        If no scheduler answers at the checked address.
    """
    require_extra("dask", "distributed")
    library = import_module("distributed")  # its classes have no complete types
    with ExitStack() as stack:
        place: Any = address
        if (workers := local_workers(address)) is not None:
            # One process per worker, closed to other machines; faults are logged by the client
            place = library.LocalCluster(
                n_workers=workers or usable_processors(),
                threads_per_worker=1,
                processes=True,
                host="127.0.0.1",
                dashboard_address="127.0.0.1:0",
                silence_logs=logging.CRITICAL,
            )
            stack.enter_context(place)
        elif address.endswith(".json") and "://" not in address:
            place = _address_in(Path(address))
        try:
            client = library.Client(place, timeout=ANSWER, set_as_default=False)
        except (OSError, ValueError) as error:
            reason = printable(str(error)) or type(error).__name__
            raise ServiceError(f"{address}: no scheduler answers: {reason}") from error
        yield stack.enter_context(client)


def _address_in(file: Path) -> str:
    """Return the address in a scheduler file; for one that is missing Dask would wait for ever."""
    try:
        with file.open("rb") as opened:
            known = json.loads(opened.read(LARGEST_FILE))
    except (OSError, ValueError) as error:
        reason = f"no scheduler file that can be read: {reason_of(error)}"
        raise ServiceError(f"{file}: {reason}; has the scheduler started?") from error
    # It also names the workers, which the scheduler knows better
    address = known.get("address") if isinstance(known, dict) else None
    if not isinstance(address, str) or "://" not in address:
        raise CatalogError(str(file), "no scheduler file: it has no address of a scheduler")
    return address


def present_workers(client: Any) -> Mapping[str, tuple[str, int]]:
    """Return the workers of a cluster: address -> machine by address, threads."""
    # ``scheduler_info`` has no workers while the client refreshes it in the background
    known = client.nthreads()
    return {
        str(address): (urlsplit(address).hostname or "unknown", int(threads))
        for address, threads in known.items()
    }


def unfit_workers(client: Any, new: Collection[str]) -> Iterator[tuple[str, str, str]]:
    """Yield address, machine and fault of new workers; the fault is empty if a worker is fit."""
    if not new:
        return
    # Without the package a worker cannot even be asked by it
    packages = client.get_versions(packages=["per_obspy"])["workers"]
    known = {one for one in new & packages.keys() if packages[one]["packages"].get("per_obspy")}
    yield from ((one, "", "has no per_obspy") for one in new & packages.keys() - known)
    answers = client.run(identity, workers=list(known), on_error="return") if known else {}
    for address, answer in answers.items():
        if isinstance(answer, BaseException):
            yield address, "", f"cannot be asked: {answer}"
            continue
        # Tasks are refused by a worker of another version too, if it came since the last look
        host, versions = answer
        difference = versions.difference(own_versions())
        yield address, host, f"runs {difference}" if difference else ""


@dataclass
class ClusterWorker:
    """What is known of one worker."""

    #: Name of its machine.
    host: str = "unknown"
    #: Number of its threads; 0 if it is not there.
    threads: int = 0
    #: Why it is unfit for this run; empty if it is fit.
    fault: str = ""
    #: Its finished tasks, and their processor time, s.
    tasks: int = 0
    seconds: float = 0.0


class ClusterWorkers:
    """
    Workers by address, with their events; every fault is logged when it happens.

    Threads of the executor and of Dask share it, so that loops go over copies.
    """

    def __init__(self) -> None:
        self._workers: dict[str, ClusterWorker] = {}
        self._events: list[dict[str, str]] = []
        self._left_out = 0

    def update(self, present: Mapping[str, tuple[str, int]]) -> set[str]:
        """Update the present workers, note those that disappeared, and return new addresses."""
        before = {address for address, one in self._copy() if one.threads}
        for address, (host, threads) in present.items():
            self._workers.setdefault(address, ClusterWorker(host)).threads = threads
        # Workers that were there before
        for address in sorted(before - present.keys()):
            self._workers[address].threads = 0
            self.note(address, "is gone: killed, preempted or cut off; its tasks are done again")
        return present.keys() - before

    def check(self, address: str, host: str, fault: str) -> None:
        """Set machine and fault of a worker; the same fault is noted once."""
        worker = self._workers.setdefault(address, ClusterWorker())
        worker.host = host or worker.host
        if fault and worker.fault != fault:
            worker.fault = fault
            self.note(address, f"{fault}; it gets no task")

    def add_task(self, address: str, host: str, seconds: float) -> None:
        """Count a finished task of a worker."""
        worker = self._workers.setdefault(address, ClusterWorker())
        worker.host, worker.tasks = host, worker.tasks + 1
        worker.seconds += seconds

    def fit(self) -> dict[str, int]:
        """Return the fit workers that are present: address -> threads."""
        return {name: one.threads for name, one in self._copy() if one.threads and not one.fault}

    def unfit(self) -> list[str]:
        """Return the workers that are present and unfit, each with its reason."""
        present = [(name, one) for name, one in self._copy() if one.threads and one.fault]
        return [f"{one.host} ({name}) {one.fault}" for name, one in present]

    def facts(self) -> dict[str, Any]:
        """Return every worker with its work, and all events, as plain values."""
        # Workers that are gone have done their part as well
        workers = [
            {
                "address": name,
                "host": one.host,
                "tasks": one.tasks,
                "seconds": round(one.seconds, 3),
            }
            for name, one in sorted(self._copy(), key=itemgetter(0))
            if one.threads or one.tasks
        ]
        events = [*self._events]
        return {"workers": workers, "events": events, "events_left_out": self._left_out}

    def note(self, address: str, reason: str) -> None:
        """Keep and log one event."""
        host = self._workers.get(address, ClusterWorker()).host
        at = datetime.now(UTC).isoformat(timespec="seconds")
        event = {"at": at, "worker": address, "host": host, "reason": printable(reason)}
        # A cluster may lose workers all day
        if len(self._events) < EVENTS_KEPT:
            self._events.append(event)
        else:
            self._left_out += 1
        LOG.warning("worker %s (%s) %s", host, address, event["reason"])

    def _copy(self) -> list[tuple[str, ClusterWorker]]:
        """Return addresses and workers as they are now."""
        return list(self._workers.items())


@dataclass(eq=False)
class _Sent:
    """A task that was submitted, and how often it was tried."""

    task: SentTask
    attempts: int = 0
    refusals: int = 0
    result: Future[Any] = field(default_factory=Future)


class DaskExecutor(ElasticExecutor):
    """Executor of a Dask cluster at a checked address, connected when the first run begins."""

    def __init__(self, address: str) -> None:
        self.address = address
        self.workers = ClusterWorkers()
        self._stack = ExitStack()
        self._client: Any = None
        self._engine = Engine(dask=address)
        self._shared: Shared | None = None
        self._numbers = count()
        self._pending: dict[int, _Sent] = {}
        self._broken = ""
        self._closed = Event()

    @contextmanager
    def sharing(self, folder: Path, engine: Engine) -> Iterator[None]:
        """
        Share the output folder of a run, which is made if need be, while its tasks are done.

        Its path is absolute, and the same for the workers.

        Raises
        ------
        MissingExtra
            If Dask is not installed.
        TryLater
            If there is no scheduler, or no fit worker within the time that is configured.
        """
        self._engine = engine
        # A new folder of results is often made by its first file only
        with writing(folder):
            folder.mkdir(parents=True, exist_ok=True)
        with temporary_folder(folder) as shared:
            self._shared = Shared(shared, secrets.token_hex(16))
            with writing(shared):
                token_file(self._shared).write_text(self._shared.token, encoding="utf-8")
            self._connect()
            try:
                yield
            finally:
                self._end_tasks()
                self._shared = None

    def ahead(self) -> int:
        """Return how many tasks are kept ahead of the results."""
        return max(FEWEST_AHEAD, AHEAD * sum(self.workers.fit().values()))

    def facts(self) -> dict[str, Any]:
        """Return scheduler, workers and events as plain values, for ``run.json``."""
        return {"dask": self.address, **self.workers.facts()}

    def submit(self, do: Callable[..., Any], /, *arguments: Any, **named: Any) -> Future[Any]:
        """
        Submit a task.

        Raises
        ------
        BrokenExecutor
            If the cluster is broken.
        WriteError
            If a large task cannot be written into the shared folder.
        """
        assert self._shared is not None  # inside of sharing()
        if self._broken:
            raise BrokenExecutor(self._broken)
        number = next(self._numbers)
        sent = _Sent(sent_task(partial(do, *arguments, **named), self._shared, number))
        self._pending[number] = sent
        sent.result.add_done_callback(lambda _: self._forget(number))
        self._try(sent)
        return sent.result

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Leave the cluster; one that was started for this executor ends."""
        del wait, cancel_futures
        self._closed.set()
        self._stack.close()

    def _connect(self) -> None:
        """Connect to the scheduler, if not done yet, and wait for the first fit worker."""
        if self._client is None:
            self._client = self._stack.enter_context(connected_client(self.address))
            LOG.info("dask: %s, dashboard %s", self.address, self._client.dashboard_link)
            self._look()
            Thread(target=self._watch, daemon=True).start()
        end = time.monotonic() + self._engine.wait
        while not self.workers.fit():
            if time.monotonic() > end:
                raise TryLater(printable(self._no_worker()))
            time.sleep(0.1)
        # Tasks of a run that was killed may still write into the same folder
        self._wait_until_idle(self._engine.wait)

    def _no_worker(self) -> str:
        """Return the reason for which there is no worker."""
        unfit = "; ".join(self.workers.unfit()[:3])
        return f"{self.address}: no usable worker within {self._engine.wait:g} s" + (
            f": {unfit}" if unfit else ""
        )

    def _look(self) -> None:
        """Update the present workers, and check the new ones."""
        new = self.workers.update(present_workers(self._client))
        for address, host, fault in unfit_workers(self._client, new):
            self.workers.check(address, host, fault)

    def _watch(self) -> None:
        """Poll the workers; without any for too long the cluster counts as broken."""
        seen = time.monotonic()
        while not self._closed.wait(LOOK):
            with self._at_scheduler(passing=("running", "connecting")):
                self._look()
            if self.workers.fit():
                seen = time.monotonic()
            elif self._pending and time.monotonic() - seen > self._engine.wait:
                self._break(self._no_worker())

    @contextmanager
    def _at_scheduler(self, passing: tuple[str, ...] = ()) -> Iterator[None]:
        """Fail all tasks if the client loses its scheduler; states in which an error passes."""
        try:
            yield
        except Exception as error:  # noqa: BLE001 - of network and scheduler, of any class
            if self._client.status not in passing:
                self._break(f"the scheduler {self.address} is gone: {error}")

    def _break(self, reason: str) -> None:
        """Fail all tasks: none of them can be done."""
        if not self._closed.is_set():
            self._broken = printable(reason)
            for sent in list(self._pending.values()):
                _fail(sent, BrokenExecutor(self._broken))

    def _try(self, sent: _Sent) -> None:
        """Send a task to any fit worker."""
        if sent.result.done():
            return
        sent.attempts += 1
        # Where all are unfit, a worker that was mended may take it
        where: dict[str, Any] = {}
        if self.workers.unfit():
            where = {"workers": list(self.workers.fit()), "allow_other_workers": True}
        with self._at_scheduler():
            executor = self._client.get_executor(pure=False, retries=self._engine.retries)
            future = executor.submit(do_sent, sent.task, **where)
            sent.result.add_done_callback(lambda one: future.cancel() if one.cancelled() else None)
            future.add_done_callback(partial(self._finish, sent))

    def _finish(self, sent: _Sent, future: Future[Outcome]) -> None:
        """Pass on the outcome of a task, or try again."""
        if sent.result.done():
            return
        if future.cancelled():
            self._break(f"the scheduler {self.address} is gone")
        elif error := future.exception():
            # Of the cluster itself: each worker that tried it died
            self._try_again(sent, MachineFault(_reason(error)))
        elif future.result().refusal:
            self._refuse(sent, future.result())
        else:
            self._settle(sent, future.result())

    def _refuse(self, sent: _Sent, outcome: Outcome) -> None:
        """Try a task again that a worker has refused, on another one if there is any."""
        self.workers.check(outcome.worker, outcome.host, outcome.refusal)
        # The fault is the worker's alone while there are others
        if self.workers.fit() and sent.refusals < MOST_REFUSALS:
            sent.refusals, sent.attempts = sent.refusals + 1, sent.attempts - 1
        reason = f"{outcome.host} ({outcome.worker}) {outcome.refusal}"
        self._try_again(sent, MachineFault(reason))

    def _settle(self, sent: _Sent, outcome: Outcome) -> None:
        """Pass on the result or the error of a task that a worker has done."""
        self.workers.add_task(outcome.worker, outcome.host, outcome.seconds)
        if isinstance(outcome.error, TryLater):
            self.workers.note(outcome.worker, f"failed at a task: {outcome.error}")
            self._try_again(sent, outcome.error)
        elif outcome.error is not None:
            _fail(sent, outcome.error)
        else:
            # It may be cancelled meanwhile
            with suppress(InvalidStateError):
                sent.result.set_result(outcome.value)

    def _try_again(self, sent: _Sent, error: Exception) -> None:
        """Try a task once more, a little later, unless it was tried often enough."""
        if sent.attempts <= self._engine.retries and not self._closed.is_set():
            timer = Timer(PAUSE * max(1, sent.attempts), self._try, [sent])
            timer.daemon = True
            timer.start()
            return
        _fail(sent, error)

    def _forget(self, number: int) -> None:
        """Forget a task that is done, and remove its file."""
        sent = self._pending.pop(number)
        if sent.task.file is not None:
            with suppress(OSError):
                remove_file(sent.task.file)

    def _end_tasks(self) -> None:
        """Cancel tasks that are left, and wait for those that are at work."""
        left = list(self._pending.values())
        for sent in left:
            sent.result.cancel()
        if left and not self._broken:
            self._wait_until_idle(PATIENCE)

    def _wait_until_idle(self, seconds: float) -> None:
        """Wait until no worker is at work: its task could write after another run has begun."""
        fit = list(self.workers.fit())
        with suppress(Exception):  # a worker that is lost just now
            idle = self._client.run(wait_until_idle, seconds, workers=fit, on_error="ignore")
            for address in [name for name, has_ended in idle.items() if not has_ended]:
                self.workers.note(address, f"is still at work after {seconds:g} s")


def _fail(sent: _Sent, error: Exception) -> None:
    """Pass on the error of a task that is not done yet."""
    with suppress(InvalidStateError):
        sent.result.set_exception(error)


def _reason(error: BaseException) -> str:
    """Return the reason for which the cluster could not do a task."""
    worker = getattr(getattr(error, "last_worker", None), "address", "")
    died = f"its worker was killed each time, the last one at {worker}"
    return died if worker else f"{type(error).__name__}: {error}"


def dask_executor(address: str | None) -> AbstractContextManager[Executor | None]:
    """
    Return the executor of a Dask cluster, connected when there is work; None without an address.

    Raises
    ------
    CatalogError
        If the address has none of the forms ``local``, ``local:N``, ``PROTOCOL://HOST:PORT``,
        ``HOST:PORT`` and scheduler file.
    MissingExtra
        If Dask is not installed.
    """
    return nullcontext() if address is None else DaskExecutor(_address(address))


def on_cluster(settings: Run, address: str | None) -> Run:
    """
    Return settings whose every run connects to a Dask cluster by itself; unchanged without one.

    A program of many runs outlives a scheduler that is started again. Errors are those of
    :func:`dask_executor`.
    """
    if address is None:
        return settings
    require_extra("dask", "distributed")
    engine = settings.engine.model_copy(update={"dask": _address(address)})
    return settings.model_copy(update={"engine": engine})


def _address(address: str) -> str:
    """Return a checked address of the command line."""
    try:
        return checked_address(address, Path.cwd())
    except ValueError as error:
        raise CatalogError("--dask", str(error)) from error


@contextmanager
def opened_executor(engine: Engine, workers: Workers, folder: Path) -> Iterator[Workers]:
    """
    Yield the workers of a run, of the configured cluster if they have no executor.

    Workers of a cluster share the folder of the results meanwhile.

    Raises
    ------
    MissingExtra
        If Dask is not installed.
    TryLater
        If the cluster has no scheduler or no usable worker.
    """
    with ExitStack() as stack:
        if workers.executor is None and engine.dask is not None:
            workers = replace(workers, executor=stack.enter_context(DaskExecutor(engine.dask)))
        if isinstance(workers.executor, DaskExecutor):
            stack.enter_context(workers.executor.sharing(folder.resolve(), engine))
        yield workers


def engine_facts(executor: Executor | None) -> dict[str, Any] | None:
    """Return workers and events of a cluster for ``run.json``; None for other executors."""
    return executor.facts() if isinstance(executor, DaskExecutor) else None
