"""
Run of one watched earthquake: current facts, records, results and a revision.

Between the delays only stations without whole records are requested. A service that demands a
pause by ``Retry-After`` is not asked before it has passed.
"""

import hashlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any, NamedTuple

from per_obspy.config import Fdsn, Run
from per_obspy.config.screening import EVERY_STATE
from per_obspy.errors import ServiceError
from per_obspy.files import content_hash, file_hash, written_whole
from per_obspy.progress import Progress
from per_obspy.records.fdsn.cache import (
    FDSN,
    Fetched,
    cached_hashes,
    fetch,
    fetched_stations,
    has_cut_records,
)
from per_obspy.records.fdsn.download import RECORDS
from per_obspy.records.fdsn.web import PassingFault
from per_obspy.records.file_list import file_states, files_below, growing_files
from per_obspy.results.ranked_table import table_outputs
from per_obspy.runs.output_folder import Result
from per_obspy.runs.run import run
from per_obspy.watch.aftershocks import result_before
from per_obspy.watch.event_settings import (
    Watcher,
    settings_of_event,
)
from per_obspy.watch.polling import present_state
from per_obspy.watch.revisions import (
    content_of,
    newest_revision,
    point_latest,
    publish,
    revision_facts,
)
from per_obspy.watch.state import (
    LONGEST_PAUSE,
    WATCH,
    EventState,
    Task,
    changed,
    event_folder,
    is_held,
    iso,
    moment,
    passed_delays,
    read_watch_state,
    write_state,
)

#: Requests for missing records between two runs, per time since the origin: the later, the rarer.
SHARE_OF_AGE = 0.1


def fetched_for(watcher: Watcher, settings: Run) -> Fetched | None:
    """
    Fetch the records of an earthquake that are not in its cache; return None without services.

    Parameters
    ----------
    watcher : Watcher
        Folder and clock.
    settings : Run
        Of the run of the earthquake.

    Raises
    ------
    ServiceError
        If services fail and no record is at hand.
    """
    assert settings.records is not None
    request, event = settings.records.fdsn, settings.records.event
    if request is None:
        return None
    with _pauses(watcher.folder, watcher.now()) as pauses:
        try:
            fetched = fetch(request, event, watcher.progress, True, pauses, cut=True)
        except ServiceError:
            fetched = _fetched_before(request, event, watcher.progress, pauses)
    # Stations whose earlier records were kept are not rejected
    missing = tuple(
        row
        for row in fetched.rejected
        if row.source != FDSN or not (fetched.folder / f"{row.name}{RECORDS}").is_file()
    )
    return fetched._replace(rejected=missing)


def _fetched_before(
    request: Fdsn, event: Path | None, progress: Progress, pauses: dict[str, float]
) -> Fetched:
    """Return the records in the cache after a failure; a fault lasts as long as services demand."""
    try:
        return fetch(request, event, progress, False, pauses)
    except ServiceError as error:
        if pauses:
            raise PassingFault(str(error), min(pauses.values())) from error
        raise


@contextmanager
def _pauses(folder: Path, now: datetime) -> Iterator[dict[str, float]]:
    """Yield the hosts that are not asked with their remaining s, and keep those that are added."""
    known = read_watch_state(folder).resting
    left = {host: (moment(time) - now).total_seconds() for host, time in known.items()}
    # A pause that is too long was set by a wrong clock
    pauses = {host: rest for host, rest in left.items() if 0.0 < rest <= LONGEST_PAUSE}
    before = dict(pauses)
    try:
        yield pauses
    finally:
        if pauses != before or len(before) != len(known):
            until = {
                host: iso(now + timedelta(seconds=min(rest, LONGEST_PAUSE)))
                for host, rest in pauses.items()
            }
            state = read_watch_state(folder).model_copy(update={"resting": until})
            write_state(folder / WATCH, state)


def records_hash(fetched: Fetched | None) -> str:
    """Return a hash of all fetched records and the ShakeMap; empty without services."""
    if fetched is None:
        return ""
    hashes = cached_hashes(fetched.folder)
    records = {name: known for name, known in hashes.items() if name.endswith(RECORDS)}
    return content_hash(records | dict(fetched.shakemap.hashes if fetched.shakemap else {}))


def has_missing(fetched: Fetched | None) -> bool:
    """Return whether a station that a service lists has no records, or incomplete ones."""
    if fetched is None:
        return False
    is_without = any(row.source == FDSN for row in fetched.rejected)
    return is_without or has_cut_records(fetched)


def is_look_due(watcher: Watcher, state: EventState) -> bool:
    """
    Return whether missing records of an earthquake are requested now, between two runs.

    Parameters
    ----------
    watcher : Watcher
        Settings and clock.
    state : EventState
        Of the earthquake.
    """
    watch, now = watcher.watch, watcher.now()
    if state.state != "open" or not state.missing or is_held(now, state):
        return False
    times = [moment(time) for time in (*state.done.values(), *filter(None, [state.looked]))]
    age = (now - moment(state.time)).total_seconds()
    # A latest time to come was noted by a wrong clock
    latest = (now - max(times, default=now)).total_seconds()
    return not 0.0 <= latest < max(watch.records_poll, SHARE_OF_AGE * age)


def looked(watcher: Watcher, state: EventState) -> tuple[EventState, bool]:
    """
    Request the missing records of an earthquake, in the window of its latest run.

    Returns
    -------
    state : EventState
        With the time of the request.
    has_come : bool
        Whether the records are others than those of the latest run.

    Raises
    ------
    ServiceError
        If services fail and no record is at hand.
    """
    now = watcher.now()
    delays = passed_delays(now, state, watcher.watch.delays)
    done = [delay for delay in delays if f"{delay:g}" in state.done]
    state = changed(state, looked=iso(now))
    if not done:
        return state, False
    # What is there is in the cache: only the rest is requested
    folder = event_folder(watcher.folder, state.event_id)
    settings = settings_of_event(watcher.settings, folder, state, done[-1])
    return state, records_hash(fetched_for(watcher, settings)) != state.fetched


class Done(NamedTuple):
    """Outcome of a run of an earthquake."""

    #: Of the earthquake afterwards, not written yet.
    state: EventState
    #: Outcome in a few words, for the log.
    line: str
    #: Result of the run, None if there was none.
    result: Result | None = None


def done_task(watcher: Watcher, state: EventState, task: Task) -> Done:
    """
    Do the run of an earthquake that is due.

    Parameters
    ----------
    watcher : Watcher
        Settings, folder and clock.
    state : EventState
        Of the earthquake.
    task : Task
        Delay and reasons.

    Raises
    ------
    PerError
        If the run fails; finished parts are kept.
    """
    started = iso(watcher.now())
    # Its place or magnitude may have changed since it was listed
    state, quakeml = present_state(watcher, state)
    if state.state == "closed":
        return Done(state, f"closed: {state.reason}")
    folder = event_folder(watcher.folder, state.event_id)
    event = folder / "event.xml"
    if not event.is_file() or event.read_bytes() != quakeml:
        with written_whole(event) as part:
            part.write_bytes(quakeml)
    return _run_with_records(watcher, folder, state, task, started)


def _run_with_records(
    watcher: Watcher, folder: Path, state: EventState, task: Task, started: str
) -> Done:
    """Fetch the records of an earthquake, and run with those available."""
    settings = settings_of_event(watcher.settings, folder, state, task.delay)
    # Records that come while the run goes on are for the next one
    arrivals = arrivals_of(watcher.settings)
    fetched = fetched_for(watcher, settings)
    passed = [delay for delay in watcher.watch.delays if delay <= task.delay]
    state = changed(
        state,
        changed=False,
        complete=fetched is None or fetched.is_complete,
        done={**state.done, **{f"{delay:g}": started for delay in passed}},
        arrivals=arrivals,
        fetched=records_hash(fetched),
        # A ShakeMap is revised for days
        missing=has_missing(fetched) or _follows_map(settings),
    )
    if not _has_records(settings, fetched):
        return Done(state, "no records yet")
    # The number is in the page and the summary
    number = max(state.revision, newest_revision(folder)) + 1
    if earlier := result_before(watcher, state):
        settings = settings.model_copy(update={"after": earlier})
    facts = {"event_id": state.event_id, "revision": number, "revised": started}
    result = run(settings, None, watcher.executor, watcher.progress, facts, fetched)
    return _published(folder, state, result, task, started)


def _follows_map(settings: Run) -> bool:
    """Return whether the ShakeMap of the earthquake is fetched."""
    fdsn = settings.records.fdsn if settings.records else None
    return fdsn is not None and fdsn.shakemap


def _has_records(settings: Run, fetched: Fetched | None) -> bool:
    """Return whether records or a ShakeMap are available for a run."""
    records = settings.records
    assert records is not None
    motions = (records.shakemap, records.stationlist)
    others = (records.folder, records.columns, records.sds, records.asdf, *motions)
    if any(map(bool, others)):
        return True
    if fetched is None:
        return False
    return fetched.shakemap is not None or bool(fetched_stations(fetched).stations)


def arrivals_of(settings: Run) -> str:
    """
    Return a hash of the names, sizes and times of all files in the folder of records.

    A file that has changed within the last moments is left out: it is still being written.
    """
    records = settings.records
    if records is None or records.folder is None:
        return ""
    states = file_states(files_below(records.folder)[0] if records.folder.is_dir() else [])
    # A file that is being written counts when it is finished
    growing = growing_files(states, records.settle)
    digest = hashlib.sha256()
    for path, found in sorted(states.items()):
        if path not in growing:
            digest.update(f"{path}\0{found.size}\0{found.changed}\n".encode())
    return digest.hexdigest()


def _published(folder: Path, state: EventState, result: Result, task: Task, started: str) -> Done:
    """Make a revision of the results of a run, if they differ from those of the newest one."""
    record, newest = result.record, newest_revision(folder)
    if not table_outputs(record["outputs"]):
        return Done(state, "no pair could be screened: see work/rejected.csv", result)
    # Unchanged results are no new revision
    shown = content_of(record, file_hash(folder / "event.xml"))
    if newest and revision_facts(folder, newest).get("key") == shown:
        point_latest(folder)
        return Done(changed(state, revision=newest), f"revision {newest} stays", result)
    # A run that a killed watcher had finished bears the number that it was given
    number = max(state.revision, newest) + 1
    facts = {
        "event_id": state.event_id,
        "revision": number,
        "made": started,
        "delay": task.delay,
        "reasons": list(task.reasons),
        "event": state.facts._asdict(),
        "event_before": revision_facts(folder, newest).get("event"),
        "counts": record["counts"],
    }
    publish(folder, number, record, facts)
    line = f"revision {number}: {counts_line(record)}"
    return Done(changed(state, revision=number), line, result)


def counts_line(record: Mapping[str, Any]) -> str:
    """
    Return the numbers of stations and of pairs in each state as one line.

    Examples
    --------
    >>> counts_line({"counts": {"stations": 3, "stations_resumed": 1, "pairs": 9, "yes": 2}})
    '3 stations (1 as before), 9 pairs: 2 yes'
    """
    counts = record["counts"]
    named = ", ".join(f"{counts[name]} {name}" for name in EVERY_STATE if counts.get(name))
    resumed = counts.get("stations_resumed", 0)
    return f"{counts['stations']} stations ({resumed} as before), {counts['pairs']} pairs: {named}"
