"""Workers of a cluster as the client knows them: fit, unfit or gone, and the work of each."""

import logging
from collections.abc import Mapping
from datetime import UTC, datetime
from threading import Lock
from typing import Any

from per_obspy.errors import printable

LOG = logging.getLogger("per_obspy.cluster")

#: Events that are kept; of a cluster that loses workers all day the first ones explain the rest.
EVENTS_KEPT = 1000


class Workers:
    """
    Workers by address, with their events.

    Every fault is logged with the worker's machine and address when it happens.
    """

    def __init__(self) -> None:
        self._lock = Lock()
        self._present: dict[str, int] = {}
        self._hosts: dict[str, str] = {}
        self._unfit: dict[str, str] = {}
        self._work: dict[str, tuple[int, float]] = {}
        self._events: list[dict[str, str]] = []
        self._events_left_out = 0

    def update(self, present: Mapping[str, tuple[str, int]]) -> set[str]:
        """
        Update the present workers, note those that disappeared, and return new addresses.

        Parameters
        ----------
        present : mapping of str to (str, int)
            Address -> machine, threads.
        """
        with self._lock:
            lost = self._present.keys() - present.keys()
            new = present.keys() - self._present.keys()
            self._present = {address: threads for address, (_, threads) in present.items()}
            for address in new:
                self._hosts.setdefault(address, present[address][0])
        # Logging may take its time
        for address in sorted(lost):
            self._note(address, "is gone: killed, preempted or cut off; its tasks are done again")
        return new

    def known_as(self, address: str, host: str) -> None:
        """Set the machine name of a worker."""
        self._hosts[address] = host

    def refuse(self, address: str, reason: str) -> None:
        """Note that a worker is unfit for this run; the same fault is noted once."""
        with self._lock:
            known = self._unfit.get(address) == reason
            self._unfit[address] = reason
        if not known:
            self._note(address, f"{reason}; it gets no task")

    def failed(self, address: str, reason: str) -> None:
        """Note that a task failed for a fault of a worker's machine."""
        self._note(address, reason)

    def did(self, address: str, host: str, seconds: float) -> None:
        """Count a finished task of a worker."""
        with self._lock:
            self._hosts[address] = host
            tasks, before = self._work.get(address, (0, 0.0))
            self._work[address] = (tasks + 1, before + seconds)

    def fit(self) -> dict[str, int]:
        """Return the fit workers that are present: address -> threads."""
        with self._lock:
            return {name: one for name, one in self._present.items() if name not in self._unfit}

    def unfit(self) -> list[str]:
        """Return the workers that are present and unfit, each with its reason."""
        with self._lock:
            present = [name for name in self._present if name in self._unfit]
            return [f"{self._hosts[name]} ({name}) {self._unfit[name]}" for name in present]

    def facts(self) -> dict[str, Any]:
        """Return every worker with its work, and all events, as plain values."""
        with self._lock:
            # Workers that are gone have done their part as well
            names = sorted({*self._present, *self._work})
            rows = [(name, *self._work.get(name, (0, 0.0))) for name in names]
            workers = [
                {"address": n, "host": self._hosts[n], "tasks": tasks, "seconds": round(spent, 3)}
                for n, tasks, spent in rows
            ]
            left_out = self._events_left_out
            return {"workers": workers, "events": [*self._events], "events_left_out": left_out}

    def _note(self, address: str, reason: str) -> None:
        """Keep and log one event."""
        host, at = self._hosts.get(address, "unknown"), datetime.now(UTC)
        event = {"at": at.isoformat(timespec="seconds"), "worker": address, "host": host}
        # A cluster may lose workers all day
        with self._lock:
            if len(self._events) < EVENTS_KEPT:
                self._events.append({**event, "reason": printable(reason)})
            else:
                self._events_left_out += 1
        LOG.warning("worker %s (%s) %s", host, address, printable(reason))
