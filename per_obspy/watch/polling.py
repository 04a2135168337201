"""Poll the list of earthquakes: open, update and close those that matter for the inventory."""

import logging
from collections.abc import Mapping
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

from per_obspy.config import Watch
from per_obspy.errors import CatalogError, PerError, ServiceError, TryLater, shortened
from per_obspy.files import content_hash
from per_obspy.records.earthquakes.earthquake import Earthquake
from per_obspy.watch.event_feed import Feed, present_event, read_feed
from per_obspy.watch.event_settings import Watcher
from per_obspy.watch.relevance import circle_around, distances, matters
from per_obspy.watch.state import (
    EVENT,
    WATCH,
    EventState,
    WatchState,
    after_pause,
    changed,
    event_folder,
    is_paused,
    iso,
    moment,
    noted_faults,
    read_watch_state,
    write_state,
)

log = logging.getLogger(__name__)

#: Time after which an open earthquake is requested by its identifier, s.
CONFIRM = 900.0

#: Facts by which an earthquake counts as changed.
FACTS = ("time", "latitude", "longitude", "depth", "magnitude")

#: Ignored earthquakes that are kept for the status, the latest.
MOST_IGNORED = 1000

#: Reason of an earthquake that its service or file no longer has.
DELETED = "deleted at its source"

#: Identifier of an earthquake without runs -> its QuakeML file, and its facts with the reason.
Ignored = dict[str, tuple[str, str]]


def is_over(watcher: Watcher, state: WatchState) -> bool:
    """Return whether the time between two polls has passed, or the clock was put back."""
    now = watcher.now()
    if state.last_poll is None or is_paused(now, state.not_before):
        return False
    elapsed = (now - moment(state.last_poll)).total_seconds()
    return not 0.0 <= elapsed < watcher.watch.poll


def polled(watcher: Watcher, states: dict[str, EventState], errors: list[PerError]) -> WatchState:
    """Poll the list of earthquakes, and write changed states; a failure is noted."""
    now, state = watcher.now(), _state_of(watcher)
    if is_paused(now, state.not_before):
        errors.append(TryLater(f"{state.last_error}; asked again after {state.not_before}"))
        return state
    # Runs that are due do not wait for the list
    faults = list[PerError]()
    reach = max(reach.distance for reach in watcher.watch.magnitudes)
    with noted_faults(faults):
        feed = read_feed(watcher.watch, state, circle_around(watcher.places, reach), now)
    if faults:
        errors += faults
        update = _failure(state.failures + 1, faults[0], now)
    else:
        errors += _problems(watcher.watch, feed)
        ignored = enter_feed(watcher, states, feed, state.ignored)
        # The list comes last: states that it opened are written
        update = {"last_poll": iso(now), "since": iso(now), "seen": feed.seen, "ignored": ignored}
        update |= {"failures": 0, "not_before": None, "last_error": None}
    state = state.model_copy(update=update)
    write_state(watcher.folder / WATCH, state)
    return state


def _failure(failures: int, fault: PerError, now: datetime) -> dict[str, object]:
    """Return what the state of a folder notes after some lists that could not be read."""
    pause = after_pause(now, failures, fault)
    return {"failures": failures, "not_before": pause, "last_error": shortened(str(fault))}


def _state_of(watcher: Watcher) -> WatchState:
    """Return the state of the watched folder; pauses and marks of another list count no longer."""
    watch, state = watcher.watch, read_watch_state(watcher.folder)
    source = str(watch.service or watch.folder)
    if state.source != source:
        state = WatchState(source=source, resting=state.resting)
    # With other settings or buildings, what was ignored may matter now: all is looked at again
    places = [watcher.places.longitude.tolist(), watcher.places.latitude.tolist()]
    deciding = {"region", "magnitudes", "assumed_magnitude", "oldest"}
    settings = watch.model_dump_json(include=deciding)
    judged_by = {"settings": settings, "places": places, "radius": watcher.places.radius}
    digest = content_hash(judged_by)
    if state.judged != digest:
        update: dict[str, object] = {"judged": digest, "seen": {}, "since": None, "ignored": {}}
        state = state.model_copy(update=update)
    return state


def _problems(watch: Watch, feed: Feed) -> list[PerError]:
    """Return an error per line or file of a list that cannot be read."""
    # Lines of a service may be mended there, files of a folder by its user
    if watch.folder is None:
        return [ServiceError(problem) for problem in feed.problems]
    return [CatalogError(str(watch.folder), problem) for problem in feed.problems]


def keep(watcher: Watcher, states: dict[str, EventState], state: EventState) -> None:
    """Write the state of an earthquake, and remember it."""
    write_state(event_folder(watcher.folder, state.event_id) / EVENT, state)
    before = states.get(state.event_id)
    if state.state == "closed" and (before is None or before.state != "closed"):
        log.info("%s: closed: %s", shortened(state.event_id, 80), state.reason)
    states[state.event_id] = state


def enter_feed(
    watcher: Watcher,
    states: dict[str, EventState],
    feed: Feed,
    ignored: Mapping[str, tuple[str, str]],
) -> Ignored:
    """
    Open, update and close earthquakes as a list demands, and return those without runs.

    Parameters
    ----------
    watcher : Watcher
        Which earthquakes matter.
    states : dict
        Identifier -> state of every earthquake so far; gets the new states.
    feed : Feed
        Earthquakes listed as new or changed.
    ignored : mapping
        As it was after the poll before.
    """
    rows, now = list(feed.rows.values()), watcher.now()
    # Those whose file is gone are gone
    kept = {name: entry for name, entry in ignored.items() if not entry[0] or entry[0] in feed.seen}
    for row, reason in zip(rows, judged(watcher, rows), strict=True):
        file, before = feed.files.get(row.event_id, ""), states.get(row.event_id)
        if before is None:
            state = _opened(watcher, row, reason, file, kept)
        else:
            state = _updated(before, row, reason, file, now)
        if state is not None:
            keep(watcher, states, state)
    if watcher.watch.folder is not None:
        _close_deleted(watcher, states, watcher.watch.folder)
    # The latest of those without runs, for the status
    listed = {name: entry for name, entry in kept.items() if name not in states}
    return dict(list(listed.items())[-MOST_IGNORED:])


def _close_deleted(watcher: Watcher, states: dict[str, EventState], folder: Path) -> None:
    """Close the earthquakes whose file is gone from a folder: they were deleted."""
    for state in list(states.values()):
        if state.state == "open" and not (folder / state.file).exists():
            keep(watcher, states, closed(state, DELETED))


def judged(watcher: Watcher, rows: list[Earthquake]) -> list[str]:
    """Return the reason for which each earthquake is irrelevant; empty for relevant ones."""
    if not rows:
        return []
    longitude = np.array([row.longitude for row in rows], dtype=np.float64)
    latitude = np.array([row.latitude for row in rows], dtype=np.float64)
    reasons = []
    for row, distance in zip(rows, distances(watcher.places, longitude, latitude), strict=True):
        # A magnitude that is unknown is assumed
        known = "magnitude" if row.magnitude is not None else "assumed magnitude"
        magnitude = watcher.watch.assumed_magnitude if row.magnitude is None else row.magnitude
        words = f"{known} {magnitude:g} at {distance / 1000:.0f} km does not matter"
        is_relevant = matters(watcher.watch.magnitudes, float(distance), magnitude)
        reasons.append("" if is_relevant else f"{words} (watch.magnitudes)")
    return reasons


def closed(state: EventState, reason: str) -> EventState:
    """Return the state of an earthquake that is closed; its results stay."""
    return changed(state, state="closed", reason=reason, not_before=None, failures=0)


def _digest(row: Earthquake) -> str:
    """Return a hash of the facts of an earthquake by which it counts as changed."""
    return content_hash({name: getattr(row, name) for name in FACTS})[:16]


def _opened(
    watcher: Watcher, row: Earthquake, reason: str, file: str, ignored: Ignored
) -> EventState | None:
    """Return the state of an earthquake that is new to the watcher, or enter it as ignored."""
    now, oldest = watcher.now(), watcher.watch.oldest
    # Old ones are listed where a watcher begins, or their magnitude is revised
    if moment(row.time) < now - timedelta(seconds=oldest):
        reason = "; ".join(filter(None, (f"older than {oldest:g} s (watch.oldest)", reason)))
    if reason:
        # The latest comes last; it is logged if it is new or has a new reason
        line = f"{in_words(row)}: {reason}"
        if ignored.pop(row.event_id, ("", ""))[1] != line:
            log.info("%s: ignored, %s", shortened(row.event_id, 80), line)
        ignored[row.event_id] = (file, line)
        return None
    log.info("%s: opened, %s", shortened(row.event_id, 80), in_words(row))
    return EventState(
        **row._asdict(),
        magnitude_assumed=row.magnitude is None,
        first_seen=iso(now),
        confirmed=iso(now),
        file=file,
        listed=_digest(row),
    )


def _updated(
    known: EventState, row: Earthquake, reason: str, file: str, now: datetime
) -> EventState | None:
    """Return the new state of a known earthquake, None if it has not changed."""
    digest, is_closed = _digest(row), known.state == "closed"
    file = file or known.file
    if is_closed and reason:
        return None
    if not is_closed and digest == known.listed:
        # Its file may have another name
        return changed(known, file=file) if file != known.file else None
    state = with_facts(changed(known, listed=digest, confirmed=iso(now), file=file), row)
    if reason:
        return closed(state, reason)
    # One that comes back, or changes, is screened again
    words = f"updated, {in_words(row)}, before: {in_words(known.facts)}"
    if is_closed:
        words, state = f"opened again, {in_words(row)}", changed(state, state="open")
    log.info("%s: %s", shortened(known.event_id, 80), words)
    return changed(state, reason="", changed=True, not_before=None)


def with_facts(state: EventState, row: Earthquake) -> EventState:
    """Return the state of an earthquake with new facts, under its own identifier."""
    facts = {**row._asdict(), "event_id": state.event_id}
    return changed(state, **facts, magnitude_assumed=row.magnitude is None)


def in_words(row: Earthquake) -> str:
    """
    Return magnitude, place and time of an earthquake in words.

    Examples
    --------
    >>> in_words(Earthquake("x", "2026-11-23T01:00:00", 14.6, -90.5, None, None, "", "Guatemala"))
    'magnitude unknown, 14.600 -90.500 Guatemala, 2026-11-23T01:00:00'
    """
    size = "unknown" if row.magnitude is None else f"{row.magnitude:g}"
    place = f"{row.latitude:.3f} {row.longitude:.3f} {row.place}".strip()
    return f"magnitude {size}, {place}, {row.time[:19]}"


def confirm(watcher: Watcher, states: dict[str, EventState], errors: list[PerError]) -> None:
    """Ask for the open earthquakes that no list has confirmed for a while."""
    for state in list(states.values()):
        now = watcher.now()
        recent = 0.0 <= (now - moment(state.confirmed)).total_seconds() < CONFIRM
        if state.state != "open" or recent or is_paused(now, state.not_before):
            continue
        faults = list[PerError]()
        with noted_faults(faults):
            present, _ = present_state(watcher, state)
        # The service of all others fails as well
        if faults:
            errors += faults
            return
        keep(watcher, states, present)


def present_state(watcher: Watcher, state: EventState) -> tuple[EventState, bytes]:
    """
    Return the state of an earthquake by its current facts, and its QuakeML.

    It is closed if it was deleted, or moved away, or became too small.

    Raises
    ------
    PerError
        If the service does not answer, or its answer is not the earthquake.
    """
    present = present_event(watcher.watch, state.event_id, state.file, state.time)
    if present is None:
        return closed(state, DELETED), b""
    # Moved or of another size
    row, quakeml = present
    is_same = all(getattr(row, name) == getattr(state, name) for name in FACTS)
    state = with_facts(changed(state, confirmed=iso(watcher.now())), row)
    (reason,) = judged(watcher, [row])
    if reason:
        return closed(state, reason), quakeml
    return changed(state, changed=state.changed or not is_same), quakeml
