"""
Health of a folder of results: state of its watcher or latest run, for monitoring.

``status.json`` of a watched folder is replaced atomically. The watcher writes it after every poll;
``per-obspy status`` and monitoring read it.
"""

import os
import platform
from collections.abc import Sequence
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import Field

from per_obspy.config.section import Moment
from per_obspy.errors import CatalogError
from per_obspy.resume import Comparison, Status, StatusError, compare_outputs
from per_obspy.resume import read_status as read_record
from per_obspy.watch.state import State, moment, read_state

#: Name of the file in the folder that is watched into.
STATUS = "status.json"


class WatchStatus(State):
    """State of a watcher after its latest poll."""

    #: Time of the latest poll that succeeded, ISO 8601, UTC; None: none did yet.
    last_poll: Moment | None = None
    #: Number of earthquakes that are still updated.
    events_open: int = Field(0, ge=0)
    #: Reason why the latest poll or update failed; None: it succeeded.
    last_error: str | None = None
    #: Time at which the watcher works next, ISO 8601, UTC; None: it has ended for good.
    next_due: Moment | None = None
    #: Number of polls and updates in succession that failed.
    failures: int = Field(0, ge=0)
    #: Reason why the latest message was not delivered; None: it was, or there was none.
    last_notification_error: str | None = None
    #: Listed earthquakes without runs, each with the reason, the latest last.
    ignored: tuple[str, ...] = ()
    #: Whether the process stays between polls, rather than being started by a timer.
    running: bool = False
    #: Number of the process that wrote the status.
    pid: int = Field(default_factory=os.getpid, ge=0)
    #: Name of its machine.
    host: str = Field(default_factory=platform.node)
    #: Of per_obspy.
    version: str = Field(default_factory=lambda: version("per_obspy"))


def read_status(folder: Path) -> WatchStatus:
    """
    Read the status of a watched folder.

    Raises
    ------
    CatalogError
        If the folder has no status, or a damaged one.
    """
    return read_state(folder / STATUS, WatchStatus)


#: Record of a run in its folder.
RECORD = "run.json"

#: Ignored earthquakes that are printed; ``status --json`` has up to 1000.
SHOWN = 50

#: Longest time of a comparison of results with their hashes, s: a check of health has 30 s.
COMPARED_WITHIN = 10.0

#: s that work may last beyond the time at which a watcher is due.
LATE = 900.0


class Health(NamedTuple):
    """Health of a folder."""

    #: ``"fine"``, ``"late"``, ``"failing"``, ``"damaged"``, ``"stopped"``, ``"unfinished"`` or
    #: ``"nothing_usable"``.
    state: str
    #: Facts in words.
    lines: tuple[str, ...]
    #: The same as plain values.
    facts: dict[str, Any]


def folder_health(folder: Path, late: float = LATE, now: datetime | None = None) -> Health:
    """
    Return the health of a folder of a watcher or of a run.

    Parameters
    ----------
    folder : Path
        With ``status.json`` or ``run.json``.
    late : float
        s after the time at which a watcher is due, from which it counts as late.
    now : datetime, optional
        Time with its zone, instead of that of the clock.

    Raises
    ------
    CatalogError
        If the folder has neither, or a damaged one.
    """
    if (folder / STATUS).exists():
        health = _watcher(read_status(folder), late, now or datetime.now(UTC))
        # The newest results of every earthquake, the latest first
        newest = folder.glob("events/*/latest/revision.json")
        latest_first = sorted(newest, key=lambda file: file.stat().st_mtime, reverse=True)
        return _with_comparison(health, latest_first)
    if (folder / RECORD).exists():
        return _run(folder / RECORD)
    raise CatalogError(
        str(folder), f"holds neither {STATUS} of a watcher nor {RECORD} of a run: name its folder"
    )


def _with_comparison(health: Health, files: Sequence[Path]) -> Health:
    """Return the health of a folder after a comparison of its results with their hashes."""
    statuses, unreadable = dict[Path, Status](), list[str]()
    for file in files:
        try:
            statuses[file] = read_record(file)
        except StatusError as error:
            unreadable.append(f"damaged: {file}: {error}")
    if not statuses and not unreadable:
        return health
    comparison = compare_outputs(statuses, COMPARED_WITHIN)
    # Whatever else is wrong needs a person first
    is_damaged = bool(unreadable or comparison.changed)
    state = "damaged" if is_damaged and health.state in ("fine", "late") else health.state
    facts = {
        **health.facts,
        "state": state,
        "damaged": [str(file) for file in comparison.changed],
        "compared": [comparison.compared, comparison.files],
    }
    # The first line names the state
    first = health.lines[0].replace(health.state, state)
    lines = (first, *health.lines[1:], *_comparison_lines(comparison), *unreadable)
    return Health(state, lines, facts)


def _comparison_lines(comparison: Comparison) -> list[str]:
    """Return the outcome of a comparison in words."""
    # Huge results take longer than a check of health may
    lines = [f"results: {comparison.compared} of {comparison.files} files compared"]
    if comparison.compared < comparison.files:
        lines[0] += f" within {COMPARED_WITHIN:g} s, the largest are not"
    lines += [f"damaged: {file}: is not as it was written" for file in comparison.changed[:SHOWN]]
    if len(comparison.changed) > SHOWN:
        lines.append(f"damaged: {len(comparison.changed) - SHOWN} further files")
    return lines


def _watcher(status: WatchStatus, late: float, now: datetime) -> Health:
    """Return the health of a watcher."""
    # Negative before it is due
    due = status.next_due
    behind = (now - moment(due)).total_seconds() if due is not None else 0.0
    # The reason that needs a person first comes first
    if status.running and not _is_alive(status):
        state = "stopped"
    elif status.last_error:
        state = "failing"
    else:
        state = "late" if behind > late else "fine"
    # Facts in words, errors last
    lines = [
        f"watcher: {state}",
        f"last poll: {status.last_poll or 'none yet'}",
        f"events open: {status.events_open}",
        f"next due: {status.next_due or 'never'}" + (f", {behind:.0f} s ago" if behind > 0 else ""),
    ]
    lines += _ignored_lines(status.ignored)
    if status.last_error:
        lines.append(f"last error: {status.last_error} ({status.failures} in succession)")
    if status.last_notification_error:
        lines.append(f"notification: {status.last_notification_error}")
    lines.append(f"process: {status.pid} on {status.host}, per_obspy {status.version}")
    return Health(state, tuple(lines), {"state": state, **status.model_dump(mode="json")})


def _ignored_lines(ignored: Sequence[str]) -> list[str]:
    """Return the earthquakes without runs, the latest first; none if there are none."""
    latest = [f"  {line}" for line in ignored[: -SHOWN - 1 : -1]]
    return [f"events ignored: {len(ignored)}", *latest] if ignored else []


def _is_alive(status: WatchStatus) -> bool:
    """Return whether the process of a watcher exists; on another machine it counts as alive."""
    if status.host != platform.node() or os.name != "posix" or not status.pid:
        return True
    try:
        os.kill(status.pid, 0)  # signal 0 only asks
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return True
    return True


def _run(file: Path) -> Health:
    """Return the health of the latest run of a folder."""
    try:
        record = read_record(file)
    except StatusError as error:
        raise CatalogError(str(file), f"cannot be read as run.json: {error}") from error
    # A run whose record is unfinished was killed, or is at work
    state = str(record.get("state"))
    known = {"complete": "fine", "unfinished": "unfinished", "nothing_usable": "nothing_usable"}
    if state not in known:
        raise CatalogError(str(file), f"state: unknown, got {state!r:.40}")
    # Pictures that failed are no reason to distrust the tables, but need a look
    health = "failing" if record.get("failed") or record.get("faults") else known[state]
    stations = record.get("stations")
    facts = stations if isinstance(stations, dict) else {}
    lines = [f"run {record.get('name', '')}: {health}", *_station_lines(facts)]
    lines += [str(fault) for fault in _list(record.get("faults"))]
    plain = Health(health, tuple(lines), {"state": health, "stations": facts})
    # A run at work replaces its results one by one
    if health == "unfinished":
        return plain
    # Stations are results too, which a later screening reads
    return _with_comparison(plain, [file, *sorted(file.parent.glob("stations/*.json"))])


def _station_lines(stations: dict[str, Any]) -> list[str]:
    """Return the numbers of stations of a run in words; empty if its record has none."""
    if not stations:
        return []
    # Damaged records have no lists
    kinds = ("expected", "received", "late", "rejected")
    counts = [f"{len(_list(stations.get(kind)))} {kind}" for kind in kinds]
    lines = [f"stations: {', '.join(counts)}"]
    if waiting := _list(stations.get("waiting")):
        lines.append(f"files still being written: {len(waiting)}")
    share = stations.get("share_of_pairs")
    if isinstance(share, int | float):
        lines.append(f"pairs that have a record: {share:.1%}")
    return lines


def _list(found: object) -> list[Any]:
    """Return a list of a record, empty if it is damaged."""
    return found if isinstance(found, list) else []
