"""One run of one watched earthquake: its present facts, its records, its results, a revision."""

import hashlib
import logging
import shutil
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from datetime import datetime
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import obspy
from obspy import UTCDateTime

from per_obspy.config import Fdsn, Run
from per_obspy.errors import CatalogError
from per_obspy.files import file_hash, is_part, written_whole
from per_obspy.jobs.output_folder import Result
from per_obspy.operation.events.due import Task
from per_obspy.operation.events.event_feed import current_event, plain_quakeml, row_problem
from per_obspy.operation.events.event_settings import has_other_sources, settings_of_event
from per_obspy.operation.events.relevance import Places, distances, matters
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
from per_obspy.progress import Progress
from per_obspy.records.contents.file_list import files_below
from per_obspy.records.fdsn.cache import Fetched, fetch, fetched_stations
from per_obspy.records.fdsn.event_list import EventRow, quakeml_row

log = logging.getLogger(__name__)

#: Records that end this long before their window may be continued at their service, s.
CUT = 5.0


class Watcher(NamedTuple):
    """
    Everything that the runs of all earthquakes share.

    Attributes
    ----------
    settings : Run
        With a section ``watch``.
    folder : Path
        Watched folder.
    places : Places
        Of the inventory.
    now : callable
        Returns the time, with its zone.
    progress : callable
        Called for every stage of a run.
    executor : Executor or None
        Where stations and chunks are done, if not in processes of this machine.
    """

    settings: Run
    folder: Path
    places: Places
    now: Callable[[], datetime]
    progress: Progress
    executor: Executor | None


class Done(NamedTuple):
    """
    Outcome of a run of an earthquake.

    Attributes
    ----------
    state : EventState
        Of the earthquake afterwards, not written yet.
    line : str
        Outcome in a few words, for the log.
    """

    state: EventState
    line: str


def judged(watcher: Watcher, row: EventRow) -> tuple[str, bool]:
    """
    Return why an earthquake does not matter, and whether its magnitude is assumed for that.

    Parameters
    ----------
    watcher : Watcher
        With the places of the inventory.
    row : EventRow
        Facts of the earthquake.

    Returns
    -------
    reason : str
        Empty if it matters.
    is_assumed : bool
    """
    watch = watcher.settings.watch
    assert watch is not None
    place = np.array([row.longitude]), np.array([row.latitude])
    distance = float(distances(watcher.places, *place)[0])
    is_assumed = row.magnitude is None
    magnitude = watch.assumed_magnitude if row.magnitude is None else row.magnitude
    if matters(watch.magnitudes, distance, magnitude):
        return "", is_assumed
    known = "assumed magnitude" if is_assumed else "magnitude"
    reason = f"{known} {magnitude:g} at {distance / 1000:.0f} km does not matter (watch.magnitudes)"
    return reason, is_assumed


def with_facts(state: EventState, row: EventRow) -> EventState:
    """Return the state of an earthquake with new facts, under its own identifier."""
    facts = {**row._asdict(), "event_id": state.event_id}
    return changed(state, **facts, magnitude_assumed=row.magnitude is None)


def closed(state: EventState, reason: str) -> EventState:
    """Return the state of an earthquake that is closed; its results stay."""
    return changed(state, state="closed", reason=reason, not_before=None)


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
        If the run fails; what is done is kept.
    """
    assert watcher.settings.watch is not None
    started = iso(watcher.now())
    event = current_event(watcher.settings.watch, state.event_id, state.file)
    if event is None:
        return Done(closed(state, "deleted at its source"), "closed: deleted at its source")
    # Its place or magnitude may have changed since it was listed
    row = quakeml_row(event)
    if problem := row_problem(row):
        raise CatalogError(state.event_id, problem)
    state = with_facts(changed(state, confirmed=started), row)
    reason, _ = judged(watcher, row)
    if reason:
        return Done(closed(state, reason), f"closed: {reason}")

    folder = event_folder(watcher.folder, state.event_id)
    _write_if_new(folder / "event.xml", plain_quakeml(event, state.event_id))
    settings = settings_of_event(watcher.settings, folder, state, event, task.delay)
    arrivals = arrivals_of(watcher.settings)
    fetched = _fetched(settings, watcher.progress)
    facts = {"done": _with_delays(watcher, state, task, started), "arrivals": arrivals}
    state = changed(state, changed=False, complete=fetched is None or fetched.is_complete, **facts)
    if not _has_records(settings, fetched):
        return Done(state, "no records yet")
    number = max(state.revision, newest_revision(folder)) + 1
    known = {"event_id": state.event_id, "revision": number}
    result = run(settings, None, watcher.executor, watcher.progress, known)
    return _published(folder, state, task, result, started)


def _write_if_new(file: Path, content: bytes) -> None:
    """Write a file unless it has the same content already."""
    if file.is_file() and file.read_bytes() == content:
        return
    with written_whole(file) as part:
        part.write_bytes(content)


def _with_delays(watcher: Watcher, state: EventState, task: Task, now: str) -> dict[str, str]:
    """Return the delays that are done after a task: its own, and those before that it serves."""
    assert watcher.settings.watch is not None
    passed = [delay for delay in watcher.settings.watch.delays if delay <= task.delay]
    return {**state.done, **{f"{delay:g}": now for delay in passed}}


def _fetched(settings: Run, progress: Progress) -> Fetched | None:
    """Bring the records of services into the folder of an earthquake, None if there are none."""
    assert settings.records is not None
    request, event = settings.records.fdsn, settings.records.event
    if request is None:
        return None
    # Records that were cut at the last attempt may be longer by now
    _restore_cut(request.cache)
    _set_cut_aside(request)
    try:
        return fetch(request, event, progress, again=True)
    finally:
        _restore_cut(request.cache)


def _set_cut_aside(request: Fdsn) -> None:
    """Move records that end before the window of a request aside, so that they are fetched again."""
    assert request.end is not None
    limit = UTCDateTime(request.end) - CUT
    for file in request.cache.glob(f"*-*-*/*{_SUFFIX}"):
        if is_part(file) or not _is_of(file.parent, request) or _ends(file) >= limit:
            continue
        aside = request.cache / _ASIDE / file.parent.name
        aside.mkdir(parents=True, exist_ok=True)
        # The status first: records without it are fetched again, and status alone is none
        for path in (file.with_suffix(".json"), file):
            path.replace(aside / path.name)


#: Folder of records set aside, in the cache of an earthquake, and suffix of records.
_ASIDE, _SUFFIX = "cut", ".mseed"


def _is_of(folder: Path, request: Fdsn) -> bool:
    """Return whether a folder of a cache is that of the window of a request."""
    times = [UTCDateTime(time or 0) for time in (request.start, request.end)]
    return folder.name.startswith("-".join(time.strftime("%Y%m%dT%H%M%S") for time in times))


def _ends(file: Path) -> UTCDateTime:
    """Return the end of the shortest channel of a file; that of an unreadable one is long ago."""
    try:
        traces = obspy.read(file, format="MSEED", headonly=True)
        ends: dict[str, UTCDateTime] = {}
        for trace in traces:
            ends[trace.id] = max(ends.get(trace.id, UTCDateTime(0)), trace.stats.endtime)
        return min(ends.values())
    except (OSError, ValueError, TypeError):
        return UTCDateTime(0)


def _restore_cut(cache: Path) -> None:
    """Return records that were set aside to their place, unless they have been fetched again."""
    for file in cache.glob(f"{_ASIDE}/*/*{_SUFFIX}"):
        place = cache / file.parent.name / file.name
        status = file.with_suffix(".json")
        if not place.is_file() and status.is_file():
            status.replace(place.with_suffix(".json"))
            file.replace(place)
    if (cache / _ASIDE).is_dir():
        shutil.rmtree(cache / _ASIDE, ignore_errors=True)


def _has_records(settings: Run, fetched: Fetched | None) -> bool:
    """Return whether there is anything that a run can use."""
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
    latest = time.time() - getattr(records, "settle", 0.0)
    digest = hashlib.sha256()
    for path in files_below(records.folder)[0] if records.folder.is_dir() else []:
        try:
            facts = path.stat()
        except OSError:
            continue
        if facts.st_mtime <= latest:
            digest.update(f"{path}\0{facts.st_size}\0{facts.st_mtime_ns}\n".encode())
    return digest.hexdigest()


def _published(
    folder: Path, state: EventState, task: Task, result: Result, started: str
) -> Done:
    """Make a revision of the results of a run, if they differ from those of the newest one."""
    record = result.record
    if "risk.parquet" not in record["outputs"]:
        return Done(state, "no pair could be screened: see work/rejected.csv")
    newest = newest_revision(folder)
    shown = content_of(record, file_hash(folder / "event.xml"))
    if newest and shown_content(folder, newest) == shown:
        point_latest(folder)
        return Done(changed(state, revision=newest), f"nothing new, revision {newest} stays")
    # A run that an earlier process finished bears the number that it was given
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
    state = changed(state, revision=number)
    return Done(state, f"revision {number}: {counts_line(record)}")


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
