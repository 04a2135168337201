"""
Health of a folder of results: state of its watcher or latest run, for monitoring.

``status.json`` of a watched folder is replaced atomically. The watcher writes it after every poll;
``per-obspy status`` and monitoring read it.
"""

import json
import os
import platform
from collections.abc import Sequence
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import ConfigDict, Field, ValidationError

from per_obspy.config.section import Moment, Section
from per_obspy.errors import CatalogError, reason_of, shortened
from per_obspy.files import written_whole
from per_obspy.resume import Comparison, Status, StatusError, compare_outputs
from per_obspy.resume import read_status as read_record

#: Name of the file in the folder that is watched into.
STATUS = "status.json"

#: Bytes of the largest status file that is read.
LARGEST = 1 << 20


class WatchStatus(Section):
    """
    State of a watcher after its latest poll.

    Attributes
    ----------
    last_poll : str or None
        Time of the latest poll that succeeded, ISO 8601, UTC; None: none did yet.
    events_open : int
        Number of earthquakes that are still updated.
    last_error : str or None
        Reason why the latest poll or update failed; None: it succeeded.
    next_due : str or None
        Time at which the watcher works next, ISO 8601, UTC; None: it has ended for good.
    failures : int
        Number of polls and updates in succession that failed.
    last_notification_error : str or None
        Reason why the latest message was not delivered; None: it was, or there was none.
    ignored : tuple of str
        Listed earthquakes without runs, each with the reason, the latest last.
    running : bool
        Whether the process stays between polls, rather than being started by a timer.
    pid : int
        Number of the process that wrote the status.
    host : str
        Name of its machine.
    version : str
        Of per_obspy.
    """

    # Later versions may write more
    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)

    last_poll: Moment | None = None
    events_open: int = Field(0, ge=0)
    last_error: str | None = None
    next_due: Moment | None = None
    failures: int = Field(0, ge=0)
    last_notification_error: str | None = None
    ignored: tuple[str, ...] = ()
    running: bool = False
    pid: int = Field(default_factory=os.getpid, ge=0)
    host: str = Field(default_factory=platform.node)
    version: str = Field(default_factory=lambda: version("per_obspy"))


def write_status(folder: Path, status: WatchStatus) -> Path:
    """
    Write the status of a watched folder, whole or not at all, and return its file.

    Raises
    ------
    WriteError
        If the machine cannot write.
    """
    file = folder / STATUS
    with written_whole(file) as part:
        text = json.dumps(status.model_dump(mode="json"), indent=1)
        part.write_text(f"{text}\n", encoding="utf-8")
    return file


def read_status(folder: Path) -> WatchStatus:
    """
    Read the status of a watched folder.

    Raises
    ------
    CatalogError
        If the folder has no status, or a damaged one.
    """
    file = folder / STATUS
    try:
        with file.open(encoding="utf-8") as text:
            return WatchStatus.model_validate_json(text.read(LARGEST))
    except ValidationError as error:
        problem = _first_fault(error)
    except (OSError, ValueError) as error:
        problem = shortened(reason_of(error), 200)
    raise CatalogError(str(file), f"not the status of a watcher: {problem}")


def _first_fault(error: ValidationError) -> str:
    """Return field and reason of the first fault of a status file."""
    fault = error.errors()[0]
    place = ".".join(map(str, fault["loc"]))
    return f"{place}: {fault['msg']}" if place else fault["msg"]


#: Record of a run in its folder.
RECORD = "run.json"

#: Ignored earthquakes that are printed; ``status --json`` has up to 1000.
SHOWN = 50

#: Longest time of a comparison of results with their hashes, s: a check of health has 30 s.
COMPARED_WITHIN = 10.0

#: s that work may last beyond the time at which a watcher is due.
LATE = 900.0


class Health(NamedTuple):
    """
    Health of a folder.

    Attributes
    ----------
    state : str
        ``"fine"``, ``"late"``, ``"failing"``, ``"damaged"``, ``"stopped"``, ``"unfinished"`` or
        ``"nothing_usable"``.
    lines : tuple of str
        Facts in words.
    facts : dict
        The same as plain values.
    """

    state: str
    lines: tuple[str, ...]
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
        return _with_comparison(health, _newest_revisions(folder))
    if (folder / RECORD).exists():
        return _run(folder / RECORD)
    raise CatalogError(
        str(folder), f"holds neither {STATUS} of a watcher nor {RECORD} of a run: name its folder"
    )


def _newest_revisions(folder: Path) -> list[Path]:
    """Return the description of the newest results of every earthquake, the latest first."""
    files = [(file.stat().st_mtime, file) for file in folder.glob("events/*/latest/revision.json")]
    return [file for _, file in sorted(files, reverse=True)]


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
    behind = _seconds_behind(status.next_due, now)
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
    lines += _ignored_lines(status)
    if status.last_error:
        lines.append(f"last error: {status.last_error} ({status.failures} in succession)")
    if status.last_notification_error:
        lines.append(f"notification: {status.last_notification_error}")
    lines.append(f"process: {status.pid} on {status.host}, per_obspy {status.version}")
    return Health(state, tuple(lines), {"state": state, **status.model_dump(mode="json")})


def _ignored_lines(status: WatchStatus) -> list[str]:
    """Return the earthquakes without runs, the latest first; none if there are none."""
    if not status.ignored:
        return []
    latest = status.ignored[: -SHOWN - 1 : -1]
    return [f"events ignored: {len(status.ignored)}", *(f"  {line}" for line in latest)]


def _seconds_behind(due: str | None, now: datetime) -> float:
    """Return the time since a watcher was due, s; negative before."""
    if due is None:
        return 0.0
    moment = datetime.fromisoformat(due)
    # A time without a zone is UTC
    zoned = moment if moment.tzinfo else moment.replace(tzinfo=UTC)
    return (now - zoned).total_seconds()


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
