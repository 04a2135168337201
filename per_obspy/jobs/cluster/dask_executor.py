"""
Executor whose tasks are done by the workers of a Dask cluster.

A task is tried again, on another worker if there is one, after a fault of the worker or of its
machine. Only tasks that fail each time stay undone. The client keeps few tasks ahead of the results
(:mod:`per_obspy.jobs.parallel`), and large ones travel by the shared folder, so that the memory of
client and scheduler does not grow with the number of tasks.
"""

import logging
import secrets
import time
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Future, InvalidStateError
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from itertools import count
from pathlib import Path
from threading import Event, Thread, Timer
from typing import Any

from per_obspy.config.engine import Engine
from per_obspy.errors import MachineFault, TryLater, printable
from per_obspy.files import remove_file, temporary_folder, writing
from per_obspy.jobs.cluster.dask_client import connected_client, fit_identities, present_workers
from per_obspy.jobs.cluster.worker_side import (
    Outcome,
    SentTask,
    Shared,
    do_sent,
    own_versions,
    sent_task,
    token_file,
    wait_until_idle,
)
from per_obspy.jobs.cluster.workers import Workers
from per_obspy.jobs.parallel import AHEAD, ElasticExecutor

LOG = logging.getLogger("per_obspy.cluster")

#: Seconds between two looks at the workers, and before a task is tried again (times the attempt).
LOOK, PAUSE = 1.0, 0.5

#: Unfit workers that one task may meet.
MOST_REFUSALS = 100

#: Tasks ahead while no worker has come yet.
FEWEST_AHEAD = 4

#: Seconds that tasks of a run that ends early, or of an earlier run, may take to end.
PATIENCE = 10.0


class _Sent:
    """A task that was submitted, and how often it was tried."""

    def __init__(self, task: SentTask) -> None:
        self.task = task
        self.attempts = 0
        self.refusals = 0
        self.result: Future[Any] = Future()


class DaskExecutor(ElasticExecutor):
    """
    Executor of a Dask cluster, which is connected when the first run begins.

    Parameters
    ----------
    address : str
        As :func:`per_obspy.config.engine.checked_address` returns it.
    """

    def __init__(self, address: str) -> None:
        self.address = address
        self.workers = Workers()
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
        Share the output folder of a run with the workers while its tasks are done.

        Parameters
        ----------
        folder : Path
            Absolute; made if need be; workers see it under the same path.
        engine : Engine
            Retries and patience.

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
        for address, found in fit_identities(self._client, new).items():
            if isinstance(found, str):
                self.workers.refuse(address, found)
                continue
            # Tasks are refused by a worker of another version too, if it came since the last look
            host, versions = found
            self.workers.known_as(address, host)
            if difference := versions.difference(own_versions()):
                self.workers.refuse(address, f"runs {difference}")

    def _watch(self) -> None:
        """Poll the workers; without any for too long the cluster counts as broken."""
        seen = time.monotonic()
        while not self._closed.wait(LOOK):
            try:
                self._look()
            except Exception as error:  # noqa: BLE001 - of network and scheduler, of any class
                if self._client.status not in ("running", "connecting"):
                    self._break(f"the scheduler {self.address} is gone: {error}")
            if self.workers.fit():
                seen = time.monotonic()
            elif self._pending and time.monotonic() - seen > self._engine.wait:
                self._break(self._no_worker())

    def _break(self, reason: str) -> None:
        """Fail all tasks: none of them can be done."""
        if not self._closed.is_set():
            self._broken = printable(reason)
            for sent in list(self._pending.values()):
                with suppress(InvalidStateError):
                    sent.result.set_exception(BrokenExecutor(self._broken))

    def _try(self, sent: _Sent) -> None:
        """Send a task to any fit worker."""
        if sent.result.done():
            return
        sent.attempts += 1
        # Where all are unfit, a worker that was mended may take it
        where: dict[str, Any] = {}
        if self.workers.unfit():
            where = {"workers": list(self.workers.fit()), "allow_other_workers": True}
        try:
            executor = self._client.get_executor(pure=False, retries=self._engine.retries)
            future = executor.submit(do_sent, sent.task, **where)
        except Exception as error:  # noqa: BLE001 - a client that lost its scheduler
            self._break(f"the scheduler {self.address} is gone: {error}")
            return
        sent.result.add_done_callback(lambda one: future.cancel() if one.cancelled() else None)
        future.add_done_callback(partial(self._finish, sent))

    def _finish(self, sent: _Sent, future: Future[Outcome]) -> None:
        """Pass on the outcome of a task, or try again."""
        if sent.result.done():
            return
        if future.cancelled():
            self._break(f"the scheduler {self.address} is gone")
            return
        error = future.exception()
        if error is not None:  # of the cluster itself: each worker that tried it died
            self._try_again(sent, MachineFault(_reason(error)))
            return
        outcome = future.result()
        self.workers.did(outcome.worker, outcome.host, outcome.seconds)
        if outcome.refusal:
            self.workers.refuse(outcome.worker, outcome.refusal)
            # The fault is the worker's alone while there are others
            if self.workers.fit() and sent.refusals < MOST_REFUSALS:
                sent.refusals, sent.attempts = sent.refusals + 1, sent.attempts - 1
            where = f"{outcome.host} ({outcome.worker})"
            self._try_again(sent, MachineFault(f"{where} {outcome.refusal}"))
        elif isinstance(outcome.error, TryLater):
            self.workers.failed(outcome.worker, f"failed at a task: {outcome.error}")
            self._try_again(sent, outcome.error)
        else:
            _settle(sent.result, outcome)

    def _try_again(self, sent: _Sent, error: Exception) -> None:
        """Try a task once more, a little later, unless it was tried often enough."""
        if sent.attempts <= self._engine.retries and not self._closed.is_set():
            timer = Timer(PAUSE * max(1, sent.attempts), self._try, [sent])
            timer.daemon = True
            timer.start()
            return
        with suppress(InvalidStateError):
            sent.result.set_exception(error)

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
                self.workers.failed(address, f"is still at work after {seconds:g} s")


def _reason(error: BaseException) -> str:
    """Return the reason for which the cluster could not do a task."""
    worker = getattr(getattr(error, "last_worker", None), "address", "")
    died = f"its worker was killed each time, the last one at {worker}"
    return died if worker else f"{type(error).__name__}: {error}"


def _settle(result: Future[Any], outcome: Outcome) -> None:
    """Pass on the value or the error of a task."""
    with suppress(InvalidStateError):
        if outcome.error is not None:
            result.set_exception(outcome.error)
        else:
            result.set_result(outcome.value)
