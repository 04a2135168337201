"""
State of a watched folder and of each earthquake in it: what is known, due, done and failed.

State is JSON files that are replaced atomically. A folder that is watched into holds
``watch.json``, ``status.json`` and ``events/ID/``. The folder of an earthquake holds ``event.json``
(its state), ``event.xml`` (QuakeML as it was screened last), ``records/``, ``work/`` (the output
folder of its runs), ``revisions/`` and ``latest``.

Runs are counted by their delay after the origin time. A clock that jumps ahead makes several delays
due at once, which one run serves; a clock that is put back makes those due again that were done at
times still to come.
"""

import logging
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypeVar

from pydantic import ConfigDict, Field, ValidationError

from per_obspy.config.section import Latitude, Longitude, Moment, Section
from per_obspy.errors import CatalogError, MachineFault, PerError, TryLater, reason_of, shortened
from per_obspy.files import write_json
from per_obspy.machine import machine_fault
from per_obspy.names import inside
from per_obspy.records.earthquakes.earthquake import Earthquake
from per_obspy.records.earthquakes.quakeml import file_name
from per_obspy.records.fdsn.web import PassingFault

#: State files of a watched folder and of an earthquake.
WATCH, EVENT = "watch.json", "event.json"

#: Bytes of the largest state file that is read.
LARGEST = 1 << 24


class State(Section):
    """A group of values that a later version of the program may extend."""

    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)


StateType = TypeVar("StateType", bound=State)


class EventState(State):
    """State of one earthquake."""

    #: As its service names it, or of its file.
    event_id: str
    #: ``"open"``: runs are due; ``"closed"``: deleted, or no longer strong or near enough;
    #: ``"finished"``: too old for further runs.
    state: Literal["open", "closed", "finished"] = "open"
    #: Why it is closed.
    reason: str = ""
    #: Time at which it was opened first, ISO 8601, UTC.
    first_seen: Moment
    #: Origin time, ISO 8601, UTC.
    time: Moment
    #: Of the epicentre, degrees.
    latitude: Latitude
    longitude: Longitude
    #: m.
    depth: float | None = None
    magnitude: float | None = None
    magnitude_type: str = ""
    place: str = ""
    #: Whether it matters only because of the magnitude that is assumed where none is known.
    magnitude_assumed: bool = False
    #: QuakeML file in the watched folder of QuakeML; empty if a service lists it.
    file: str = ""
    #: Hash of its facts in the latest list.
    listed: str = ""
    #: Time at which its service or file had it last.
    confirmed: Moment
    #: Delay of each run that was done, s, as text -> its time.
    done: dict[str, Moment] = Field(default_factory=dict)
    #: Whether the earthquake has changed since its latest run.
    changed: bool = True
    #: Whether the services of records answered everything at its latest run.
    complete: bool = True
    #: Hash of the names, sizes and times of the record files at its latest run.
    arrivals: str = ""
    #: Hash of the records of services at its latest run.
    fetched: str = ""
    #: Whether a station that a service lists has no records, or incomplete ones.
    missing: bool = False
    #: Time of the latest request for missing records between two runs.
    looked: Moment | None = None
    #: Number of its newest revision, 0 if there is none.
    revision: int = Field(0, ge=0)
    #: Number of failures in succession.
    failures: int = Field(0, ge=0)
    #: Time before which no run is tried again.
    not_before: Moment | None = None
    #: Reason of the latest failure.
    last_error: str | None = None

    @property
    def facts(self) -> Earthquake:
        """Facts of the earthquake in the form of a list."""
        values = {name: getattr(self, name) for name in Earthquake._fields}
        return Earthquake(**values)


class WatchState(State):
    """State of a watched folder."""

    #: Service or folder to which all of this belongs.
    source: str = ""
    #: Time of the latest look at the list of earthquakes that succeeded, ISO 8601, UTC.
    last_poll: Moment | None = None
    #: Time from which on changes are asked for; None: everything is asked for.
    since: Moment | None = None
    #: Number of looks in succession that failed.
    failures: int = Field(0, ge=0)
    #: Time before which the list is not asked for again.
    not_before: Moment | None = None
    #: Why the latest look failed.
    last_error: str | None = None
    #: Host of a service -> time before which it is not asked for records, as it demanded.
    resting: dict[str, Moment] = Field(default_factory=dict)
    #: File of a folder of QuakeML -> size in bytes and time of change in ns, as it was read.
    seen: dict[str, tuple[int, int]] = Field(default_factory=dict)
    #: Hash of the settings and places by which earthquakes were opened or ignored.
    judged: str = ""
    #: Identifier of a listed earthquake without runs -> its QuakeML file (empty if a service lists
    #: it) and its facts with the reason, the latest last.
    ignored: dict[str, tuple[str, str]] = Field(default_factory=dict)


def ignored_lines(state: WatchState) -> tuple[str, ...]:
    """Return one line per ignored earthquake: identifier, facts and reason."""
    return tuple(f"{shortened(name, 80)}: {line}" for name, (_, line) in state.ignored.items())


def moment(text: str) -> datetime:
    """
    Return a stored time; one without a zone is UTC.

    Examples
    --------
    >>> moment("2026-11-23T01:00:00").isoformat()
    '2026-11-23T01:00:00+00:00'
    """
    time = datetime.fromisoformat(text)
    return time.astimezone(UTC) if time.tzinfo else time.replace(tzinfo=UTC)


def iso(time: datetime) -> str:
    """Return a time in ISO 8601, UTC, to the millisecond."""
    return time.astimezone(UTC).isoformat(timespec="milliseconds")


def event_folder(folder: Path, event_id: str) -> Path:
    """
    Return the folder of an earthquake, whatever letters its identifier has.

    Examples
    --------
    >>> event_folder(Path("watched"), "../../etc").as_posix()
    'watched/events/------etc-492ebcf5'
    """
    return inside(folder / "events", file_name(event_id))


def write_state(file: Path, state: State) -> None:
    """Write a state, whole or not at all."""
    write_json(file, state.model_dump(mode="json"))


def read_watch_state(folder: Path) -> WatchState:
    """Return the state of a watched folder; an empty one if there is none or it is damaged."""
    # Without it everything is asked for again
    try:
        return read_state(folder / WATCH, WatchState)
    except CatalogError:
        return WatchState()


def read_event_states(folder: Path) -> tuple[dict[str, EventState], list[str]]:
    """
    Return the state of every earthquake of a watched folder.

    Returns
    -------
    states : dict
        Identifier -> state.
    problems : list of str
        One per state that cannot be read; its earthquake is opened again when it is listed.
    """
    states, problems = dict[str, EventState](), list[str]()
    for file in sorted(folder.glob(f"events/*/{EVENT}")):
        try:
            state = read_state(file, EventState)
        except CatalogError as error:
            problems.append(str(error))
        else:
            states[state.event_id] = state
    return states, problems


def changed(known: EventState, /, **values: Any) -> EventState:
    """Return a state with other values, which are checked."""
    return EventState(**{**known.model_dump(), **values})


def read_state(file: Path, kind: type[StateType]) -> StateType:
    """Return a state from its file; raise ``CatalogError`` if it cannot be read."""
    # A file of another program may be of any size
    try:
        with file.open(encoding="utf-8") as text:
            return kind.model_validate_json(text.read(LARGEST))
    except ValidationError as error:
        fault = error.errors()[0]
        place = ".".join(map(str, fault["loc"]))
        problem = f"damaged: {place}: {fault['msg']}, expected the state of a watcher"
        raise CatalogError(str(file), problem) from error
    except (OSError, ValueError) as error:
        problem = f"cannot be read: {shortened(reason_of(error), 200)}"
        raise CatalogError(str(file), problem) from error


#: Pauses after failures, s: the shortest, which doubles, and the longest.
SHORTEST_PAUSE, LONGEST_PAUSE = 60.0, 3600.0

#: Failure that holds up only its own repetition: the run was done with what there is.
INCOMPLETE = "services of records did not answer everything: asked again"

#: Difference between two clocks that is no jump, s.
TOLERANCE = 60.0


class Task(NamedTuple):
    """A run that is due."""

    #: Latest delay that has passed, s after the origin time.
    delay: float
    #: ``"delay"``, ``"update"``, ``"records"`` and ``"retry"``, as many as apply.
    reasons: tuple[str, ...]


def due_task(
    now: datetime, state: EventState, delays: Sequence[float], has_arrivals: bool = False
) -> Task | None:
    """
    Return the due run of an earthquake, None if no run is due.

    Parameters
    ----------
    now : datetime
        With its zone.
    state : EventState
        Of the earthquake.
    delays : sequence of float
        s, rising.
    has_arrivals : bool
        Whether records have come or changed since the latest run.
    """
    passed = passed_delays(now, state, delays)
    if state.state == "closed" or not passed or is_held(now, state):
        return None
    # A finished earthquake is screened again only if it is updated
    is_open = state.state == "open"
    is_unfinished = not state.complete or state.failures > 0
    conditions = {
        "delay": is_open and not is_done(now, state, passed[-1]),
        "update": state.changed,
        "records": is_open and has_arrivals,
        "retry": is_open and is_unfinished and not is_paused(now, state.not_before),
    }
    reasons = tuple(name for name, holds in conditions.items() if holds)
    return Task(passed[-1], reasons) if reasons else None


def is_held(now: datetime, state: EventState) -> bool:
    """Return whether no run of an earthquake is tried, because the latest one failed."""
    return state.last_error != INCOMPLETE and is_paused(now, state.not_before)


def passed_delays(now: datetime, state: EventState, delays: Sequence[float]) -> list[float]:
    """Return the delays that have passed since the origin time, s."""
    elapsed = (now - moment(state.time)).total_seconds()
    return [delay for delay in delays if delay <= elapsed]


def is_done(now: datetime, state: EventState, delay: float) -> bool:
    """Return whether the run of a delay was done, not counting times in the future."""
    time = state.done.get(f"{delay:g}")
    return time is not None and moment(time) <= now + timedelta(seconds=TOLERANCE)


def is_paused(now: datetime, not_before: str | None) -> bool:
    """Return whether a pause lasts; too long a pause was set by a wrong clock and is ignored."""
    if not_before is None:
        return False
    return 0 < (moment(not_before) - now).total_seconds() <= LONGEST_PAUSE


def pause(failures: int, demanded: float | None = None) -> float:
    """
    Return the pause after some failures in succession, s.

    Parameters
    ----------
    failures : int
        One or more.
    demanded : float, optional
        Pause that a service demands by ``Retry-After``, s.

    Examples
    --------
    >>> [pause(number) for number in (1, 2, 3, 100)], pause(1, 300.0)
    ([60.0, 120.0, 240.0, 3600.0], 300.0)
    """
    usual = SHORTEST_PAUSE * 2.0 ** min(max(failures - 1, 0), 10)
    return min(max(usual, demanded or 0.0), LONGEST_PAUSE)


def next_due(now: datetime, state: EventState, delays: Sequence[float]) -> datetime | None:
    """Return the next time at which a run of an earthquake may be due, None if no run is left."""
    if state.state != "open":
        return None
    # A delay that has passed without its run is due now, or after the pause
    origin = moment(state.time)
    times = [
        origin + timedelta(seconds=delay) for delay in delays if not is_done(now, state, delay)
    ]
    pending = [time for time in times if time > now]
    unpaused = state.model_copy(update={"not_before": None})
    if due_task(now, unpaused, delays) is not None:
        waits = state.not_before is not None and is_paused(now, state.not_before)
        pending.append(moment(state.not_before or "") if waits else now)
    return min(pending, default=None)


log = logging.getLogger(__name__)


@contextmanager
def noted_faults(errors: list[PerError]) -> Iterator[None]:
    """Add whatever prevents a block to the errors of a pass: nothing else waits for it."""
    try:
        yield
    except Exception as error:  # noqa: BLE001 - of a service, a run or a way of delivery
        errors.append(_fault_for_users(error))


def _fault_for_users(error: Exception) -> PerError:
    """Convert any error to one for users; log the traceback of a programming error."""
    # A missing file of the configuration is a wrong name, as for other commands
    fault = machine_fault(error, missing=not isinstance(error, PerError))
    if isinstance(error, PerError) and (fault is None or isinstance(error, TryLater)):
        return error
    if fault is not None:
        return fault
    log.error("an error of the program", exc_info=error)
    return MachineFault(shortened(f"{type(error).__name__}: {error}"))


def after_pause(now: datetime, failures: int, fault: PerError | None) -> str:
    """
    Return the time after the pause that follows some failures in succession.

    Parameters
    ----------
    now : datetime
        Time of the latest failure.
    failures : int
        At least 1.
    fault : PerError or None
        The latest failure; a service may demand a longer pause.
    """
    demanded = fault.pause if isinstance(fault, PassingFault) else None
    return iso(now + timedelta(seconds=pause(failures, demanded)))


def failed(state: EventState, reason: str, now: datetime, fault: PerError | None) -> EventState:
    """Return the state of an earthquake after a failure: it is tried again after a pause."""
    failures = state.failures + 1
    return changed(
        state,
        failures=failures,
        not_before=after_pause(now, failures, fault),
        last_error=shortened(reason),
    )
