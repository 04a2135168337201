"""Run of one watched earthquake: current facts, records, results and a revision."""

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from per_obspy.config import Run
from per_obspy.files import file_hash, written_whole
from per_obspy.jobs.output_folder import Result
from per_obspy.operation.events.due import Task
from per_obspy.operation.events.event_feed import present_event
from per_obspy.operation.events.event_settings import (
    Watcher,
    has_other_sources,
    settings_of_event,
    watch_of,
)
from per_obspy.operation.events.late_records import fetched_for, has_missing, records_hash
from per_obspy.operation.events.open_events import DELETED, closed, judged, with_facts
from per_obspy.operation.events.revisions import (
    content_of,
    newest_revision,
    point_latest,
    publish,
    revision_facts,
    shown_content,
)
from per_obspy.operation.events.state import EventState, changed, event_folder, iso
from per_obspy.pipeline.run import run
from per_obspy.records.fdsn.cache import Fetched, fetched_stations
from per_obspy.records.file_list import file_states, files_below, growing_files
from per_obspy.tables.ranked_table import table_outputs


class Done(NamedTuple):
    """
    Outcome of a run of an earthquake.

    Attributes
    ----------
    state : EventState
        Of the earthquake afterwards, not written yet.
    line : str
        Outcome in a few words, for the log.
    result : Result or None
        Result of the run, None if there was none.
    """

    state: EventState
    line: str
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
    watch = watch_of(watcher.settings)
    started = iso(watcher.now())
    present = present_event(watch, state.event_id, state.file, state.time)
    if present is None:
        return Done(closed(state, DELETED), f"closed: {DELETED}")
    # Its place or magnitude may have changed since it was listed
    state = with_facts(changed(state, confirmed=started), present.row)
    (reason,) = judged(watch, watcher.places, [present.row])
    if reason:
        return Done(closed(state, reason), f"closed: {reason}")
    folder = event_folder(watcher.folder, state.event_id)
    _write_if_new(folder / "event.xml", present.quakeml)
    settings = settings_of_event(watcher.settings, folder, state, task.delay)

    return _run_with_records(watcher, settings, state, (task, started))


def _run_with_records(
    watcher: Watcher, settings: Run, state: EventState, occasion: tuple[Task, str]
) -> Done:
    """Fetch the records of an earthquake, and run with those available."""
    watch, (task, started) = watch_of(watcher.settings), occasion
    # Records that come while the run goes on are for the next one
    arrivals = arrivals_of(watcher.settings)
    fetched = fetched_for(watcher, settings)
    complete = fetched is None or fetched.is_complete
    passed = [delay for delay in watch.delays if delay <= task.delay]
    done = {**state.done, **{f"{delay:g}": started for delay in passed}}
    state = changed(state, changed=False, complete=complete, done=done, arrivals=arrivals)
    missing = has_missing(fetched)
    state = changed(state, fetched=records_hash(fetched), missing=missing)
    # The number is in the page and the summary
    if not _has_records(settings, fetched):
        return Done(state, "no records yet")
    folder = event_folder(watcher.folder, state.event_id)
    number = max(state.revision, newest_revision(folder)) + 1
    facts = {"event_id": state.event_id, "revision": number, "revised": started}
    result = run(settings, None, watcher.executor, watcher.progress, facts, fetched)
    return _published(folder, state, result, occasion)


def _write_if_new(file: Path, content: bytes) -> None:
    """Write a file unless it has the same content already."""
    if file.is_file() and file.read_bytes() == content:
        return
    with written_whole(file) as part:
        part.write_bytes(content)


def _has_records(settings: Run, fetched: Fetched | None) -> bool:
    """Return whether records or a ShakeMap are available for a run."""
    assert settings.records is not None
    if has_other_sources(settings.records):
        return True
    return fetched is not None and bool(fetched_stations(fetched).stations)


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


def _published(folder: Path, state: EventState, result: Result, occasion: tuple[Task, str]) -> Done:
    """Make a revision of the results of a run, if they differ from those of the newest one."""
    record, newest = result.record, newest_revision(folder)
    if not table_outputs(record["outputs"]):
        return Done(state, "no pair could be screened: see work/rejected.csv", result)
    # Unchanged results are no new revision
    shown = content_of(record, file_hash(folder / "event.xml"))
    if newest and shown_content(folder, newest) == shown:
        point_latest(folder)
        return Done(changed(state, revision=newest), f"revision {newest} stays", result)
    # A run that a killed watcher had finished bears the number that it was given
    number = max(state.revision, newest) + 1
    task, started = occasion
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
    states = ("yes", "likely", "possible", "unlikely", "no", "unknown")
    named = ", ".join(f"{counts[name]} {name}" for name in states if counts.get(name))
    resumed = counts.get("stations_resumed", 0)
    return f"{counts['stations']} stations ({resumed} as before), {counts['pairs']} pairs: {named}"
