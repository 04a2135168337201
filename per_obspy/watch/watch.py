"""
Watching for earthquakes: poll a list, do due runs, keep revisions.

One pass looks at the list once and does everything that is due. The daemon is a loop of passes.
Whatever ends a pass, the next one goes on: state files are written whole, after everything that
they describe. A failure of one earthquake stops no other.
"""

import logging
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import NamedTuple

from per_obspy import termination
from per_obspy.config import Run, Watch
from per_obspy.errors import PerError, TryLater, shortened
from per_obspy.files import read_json, remove_file, write_json
from per_obspy.progress import Progress, silent
from per_obspy.runs.output_folder import RECORD, Result, locked_folder
from per_obspy.watch.event_run import arrivals_of, done_task, is_look_due, looked
from per_obspy.watch.event_settings import Watcher
from per_obspy.watch.health import STATUS, WatchStatus
from per_obspy.watch.notified_run import notify_failure, notify_result, undelivered
from per_obspy.watch.polling import confirm, is_over, keep, polled
from per_obspy.watch.relevance import inventory_places
from per_obspy.watch.revisions import WORK, point_latest, revision_folder
from per_obspy.watch.state import (
    INCOMPLETE,
    EventState,
    Task,
    WatchState,
    changed,
    due_task,
    event_folder,
    failed,
    ignored_lines,
    iso,
    moment,
    next_due,
    noted_faults,
    pause,
    read_event_states,
    write_state,
)

log = logging.getLogger(__name__)


def utc_now() -> datetime:
    """Return the time of the machine, UTC."""
    return datetime.now(UTC)


class Clock(NamedTuple):
    """Time and waiting, which tests replace."""

    #: Returns the time, with its zone.
    now: Callable[[], datetime] = utc_now
    #: Waits for some seconds, and returns whether the program shall end.
    wait: Callable[[float], bool] = termination.pause


class Pass(NamedTuple):
    """Outcome of one pass."""

    #: Why the list could not be read, and the failure of each earthquake.
    errors: tuple[PerError, ...]
    #: Number of earthquakes with runs to come.
    open_events: int
    #: Time of the next poll or run.
    next_due: datetime


def watch_once(
    settings: Run,
    clock: Clock | None = None,
    progress: Progress = silent,
    executor: Executor | None = None,
) -> Pass:
    """
    Poll the list of earthquakes once, do all due runs, and end.

    Parameters
    ----------
    settings : Run
        From :func:`per_obspy.watch.event_settings.read_settings`.
    clock : Clock, optional
        That of the machine if not given.
    progress : callable
        Called for every stage of every run.
    executor : Executor, optional
        Where stations and chunks are done, if not in processes of this machine.

    Raises
    ------
    CatalogError
        If the inventory cannot be read, or the folder cannot be used.
    FolderInUse
        If another watcher holds the folder.
    WriteError
        If the state cannot be written.
    """
    with _watcher_of(settings, clock or Clock(), progress, executor) as watcher:
        return _one_pass(watcher, running=False)


def watch_forever(
    settings: Run,
    clock: Clock | None = None,
    progress: Progress = silent,
    executor: Executor | None = None,
) -> None:
    """
    Repeat passes until the program is asked to end; parameters and errors as `watch_once`.

    A pass that fails is tried again after a pause, which grows up to an hour.
    """
    used, failures, end = clock or Clock(), 0, False
    with _watcher_of(settings, used, progress, executor) as watcher:
        while not end:
            try:
                next_due = _one_pass(watcher, running=True).next_due
                failures, seconds = 0, (next_due - used.now()).total_seconds()
            except TryLater as error:
                # The state could not be written: all else is kept, and done again
                failures += 1
                log.error("%s", error)
                seconds = pause(failures)
            seconds = min(max(seconds, 1.0), watcher.watch.poll)
            end = termination.requested() or used.wait(seconds)


@contextmanager
def _watcher_of(
    settings: Run, clock: Clock, progress: Progress, executor: Executor | None
) -> Iterator[Watcher]:
    """Yield a watcher that alone works in its folder."""
    folder = settings.output.resolve()
    with locked_folder(folder):
        places = inventory_places(settings, folder)
        yield Watcher(settings, folder, places, clock.now, progress, executor)


def _one_pass(watcher: Watcher, running: bool) -> Pass:
    """Poll the list, do due runs and write the status; a failure is an error of the pass."""
    states, problems = read_event_states(watcher.folder)
    for problem in problems:
        log.warning("%s", problem)
    # A power cut may have come between a revision and the link to it
    errors = list[PerError]()
    for event_id in states:
        with noted_faults(errors):
            point_latest(event_folder(watcher.folder, event_id))
    # Messages that a killed watcher has left
    for event in states.values():
        deliver(watcher, event)
    state = polled(watcher, states, errors)
    confirm(watcher, states, errors)
    come = _records_that_came(watcher, states, errors)
    while not termination.requested() and (found := _most_urgent(watcher, states, come)):
        event_id, task = found
        come.discard(event_id)
        states[event_id] = _attempt(watcher, states[event_id], task, errors)
        # A new and larger earthquake does not wait for the runs of all others
        if is_over(watcher, state):
            state = polled(watcher, states, errors)
    return _ended(watcher, states, state, errors, running)


def _records_that_came(
    watcher: Watcher, states: dict[str, EventState], errors: list[PerError]
) -> set[str]:
    """Request missing records between the delays; return the earthquakes of which some came."""
    come = set[str]()
    for state in list(states.values()):
        if not is_look_due(watcher, state) or termination.requested():
            continue
        # Runs that are due do not wait for these
        after, has_come = changed(state, looked=iso(watcher.now())), False
        with noted_faults(errors):
            after, has_come = looked(watcher, state)
        keep(watcher, states, after)
        if has_come:
            come.add(state.event_id)
    return come


def _most_urgent(
    watcher: Watcher, states: dict[str, EventState], come: set[str]
) -> tuple[str, Task] | None:
    """Return the earthquake whose run comes next: those without a result first, larger first."""
    now, watch = watcher.now(), watcher.watch
    arrivals = arrivals_of(watcher.settings)
    # The identifier makes the order certain
    found = []
    for state in states.values():
        has_come = state.event_id in come or _has_arrivals(state, arrivals, now, watch.poll)
        task = due_task(now, state, watch.delays, has_come)
        if task is not None:
            found.append((state.revision > 0, -(state.magnitude or 0.0), state.event_id, task))
    if not found:
        return None
    *_, event_id, task = min(found, key=lambda entry: entry[:3])
    return event_id, task


def _has_arrivals(state: EventState, arrivals: str, now: datetime, poll: float) -> bool:
    """Return whether record files have changed since the latest run, which is some time ago."""
    if arrivals == state.arrivals or not state.done:
        return False
    latest = max(moment(time) for time in state.done.values())
    return not 0.0 <= (now - latest).total_seconds() < poll


def _attempt(watcher: Watcher, state: EventState, task: Task, errors: list[PerError]) -> EventState:
    """Do the run of an earthquake, write its state, and notify people; a failure is noted."""
    name = shortened(state.event_id, 80)
    log.info("%s: run at %g s for %s", name, task.delay, " and ".join(task.reasons))
    faults = list[PerError]()
    with noted_faults(faults):
        done = done_task(watcher, state, task)
    if faults:
        errors += faults
        log.error("%s: %s", name, faults[0])
        after = failed(state, str(faults[0]), watcher.now(), faults[0])
        message_waits(watcher, after, after.last_error or "")
    else:
        log.info("%s: %s", name, done.line)
        # What is missing because a service failed is asked for again after a pause
        if done.state.complete:
            after = changed(done.state, failures=0, not_before=None, last_error=None)
        else:
            after = failed(done.state, INCOMPLETE, watcher.now(), None)
        # The message waits on the disk before the run counts as done
        if done.result is not None:
            message_waits(watcher, after)
    keep(watcher, {state.event_id: state}, after)
    deliver(watcher, after)
    return after


#: Message about an earthquake that waits for delivery, in its folder: a message waits on the disk
#: before the state of its run is written, and leaves when it was delivered or all ways of delivery
#: have failed. The next watcher delivers what a killed one has left: each message at least once,
#: and twice only if the watcher is killed between the delivery and the note of it.
OUTBOX = "outbox.json"


def message_waits(watcher: Watcher, state: EventState, failure: str | None = None) -> None:
    """
    Put the message about a run into the folder of its earthquake, in place of an earlier one.

    Parameters
    ----------
    watcher : Watcher
        Settings and folder.
    state : EventState
        Of the earthquake after the run.
    failure : str, optional
        Why the run failed; otherwise it has a result.

    Raises
    ------
    WriteError
        If the machine cannot write.
    """
    if not watcher.settings.notify.is_silent:
        file = event_folder(watcher.folder, state.event_id) / OUTBOX
        write_json(file, {"revision": state.revision, "failure": failure})


def deliver(watcher: Watcher, state: EventState) -> None:
    """Deliver the message of an earthquake that waits, if there is one, and remove it."""
    folder = event_folder(watcher.folder, state.event_id)
    if not (folder / OUTBOX).is_file():
        return
    # A result that cannot be read holds up no later message
    faults = list[PerError]()
    with noted_faults(faults):
        _deliver(watcher, state, folder)
    for fault in faults:
        log.warning("message about %s: %s", shortened(state.event_id, 80), fault)
    remove_file(folder / OUTBOX)


def _deliver(watcher: Watcher, state: EventState, folder: Path) -> None:
    """Deliver a message; one about counts or a failure that people know is not sent again."""
    settings, label = watcher.settings, f"{watcher.settings.name}: {state.event_id}"
    message, work = read_json(folder / OUTBOX), folder / WORK
    failure, number = message.get("failure"), message.get("revision")
    if not isinstance(number, int):
        return
    if failure is not None:
        notify_failure(settings.notify, work, label, str(failure))
        return
    # The folder of the runs works on: people are shown the revision, which never changes
    shown = revision_folder(folder, number) if number else None
    record = read_json((shown or work) / RECORD)
    if "state" in record:
        notify_result(settings, Result(work, record, did_nothing=False), label, shown)


def _ended(
    watcher: Watcher,
    states: dict[str, EventState],
    state: WatchState,
    errors: list[PerError],
    running: bool,
) -> Pass:
    """Close the pass: earthquakes that are too old are finished, and the status is written."""
    now, watch = watcher.now(), watcher.watch
    for known in list(states.values()):
        if _is_finished(known, watch, now):
            keep(watcher, states, changed(known, state="finished"))
    # The next look at the list, or a run before it
    following = now + timedelta(seconds=watch.poll)
    for known in states.values():
        following = min(following, next_due(now, known, watch.delays) or following)
    count = [known.state for known in states.values()].count("open")
    # For `per-obspy status` and monitoring
    status = WatchStatus(
        last_poll=state.last_poll,
        events_open=count,
        last_error=shortened(str(errors[0])) if errors else None,
        next_due=iso(following),
        failures=max([state.failures, *(known.failures for known in states.values())]),
        last_notification_error=undelivered(
            event_folder(watcher.folder, event_id) / WORK for event_id in states
        ),
        ignored=ignored_lines(state),
        running=running,
    )
    write_state(watcher.folder / STATUS, status)
    return Pass(tuple(errors), count, following)


def _is_finished(state: EventState, watch: Watch, now: datetime) -> bool:
    """Return whether no run of an open earthquake is to come."""
    age = (now - moment(state.time)).total_seconds()
    is_old = age > max(watch.oldest, watch.delays[-1])
    return state.state == "open" and is_old and due_task(now, state, watch.delays) is None
