"""Look at the list of earthquakes, and write what it changes in their states."""

import logging
from datetime import datetime

from per_obspy.config import Watch
from per_obspy.errors import CatalogError, PerError, ServiceError, TryLater, shortened
from per_obspy.files import content_hash
from per_obspy.watch.event_feed import Feed, noted_poll, read_feed
from per_obspy.watch.event_settings import Watcher, watch_of
from per_obspy.watch.open_events import (
    ignored_events,
    judged_feed,
    listed_states,
    present_state,
)
from per_obspy.watch.relevance import Circle, circle_around
from per_obspy.watch.state import (
    EventState,
    WatchState,
    after_pause,
    event_folder,
    is_paused,
    moment,
    noted_faults,
    read_watch_state,
    write_event_state,
    write_watch_state,
)

log = logging.getLogger(__name__)

#: Time after which an open earthquake is requested by its identifier, s.
CONFIRM = 900.0


def is_over(watcher: Watcher, state: WatchState) -> bool:
    """Return whether the time between two polls has passed, or the clock was put back."""
    now = watcher.now()
    if state.last_poll is None or is_paused(now, state.not_before):
        return False
    elapsed = (now - moment(state.last_poll)).total_seconds()
    return not 0.0 <= elapsed < watch_of(watcher.settings).poll


def polled(watcher: Watcher, states: dict[str, EventState], errors: list[PerError]) -> WatchState:
    """Poll the list of earthquakes, and write changed states; a failure is noted."""
    watch, now = watch_of(watcher.settings), watcher.now()
    state = _state_of(watcher)
    if is_paused(now, state.not_before):
        errors.append(TryLater(f"{state.last_error}; asked again after {state.not_before}"))
        return state
    # Runs that are due do not wait for the list
    faults = list[PerError]()
    with noted_faults(faults):
        feed = read_feed(watch, state, _circle(watcher), now)
    errors += faults
    if faults:
        state = _failed_poll(state, faults[0], now)
    else:
        errors += _problems(watch, feed)
        judgement = judged_feed(watch, watcher.places, states, feed, now)
        for known in list(listed_states(watch, states, judgement, now)):
            keep(watcher, states, known)
        # The list comes last: states that it opened are written
        ignored = ignored_events(state.ignored, states, judgement, feed.seen)
        state = noted_poll(state, feed, now).model_copy(update={"ignored": ignored})
    write_watch_state(watcher.folder, state)
    return state


def _state_of(watcher: Watcher) -> WatchState:
    """Return the state of the watched folder; pauses and marks of another list count no longer."""
    watch = watch_of(watcher.settings)
    source = str(watch.service or watch.folder)
    state = read_watch_state(watcher.folder)
    if state.source != source:
        state = WatchState(source=source, resting=state.resting)
    # With other settings or buildings, what was ignored may matter now: all is looked at again
    places = [watcher.places.longitude.tolist(), watcher.places.latitude.tolist()]
    deciding = {"region", "magnitudes", "assumed_magnitude", "oldest"}
    settings = watch.model_dump_json(include=deciding)
    judged = content_hash({"settings": settings, "places": places, "radius": watcher.places.radius})
    if state.judged != judged:
        update: dict[str, object]
        update = {"judged": judged, "seen": {}, "since": None, "ignored": {}}
        state = state.model_copy(update=update)
    return state


def _circle(watcher: Watcher) -> Circle:
    """Return the circle within which an earthquake can be relevant."""
    reach = max(reach.distance for reach in watch_of(watcher.settings).magnitudes)
    return circle_around(watcher.places, reach)


def _problems(watch: Watch, feed: Feed) -> list[PerError]:
    """Return an error per line or file of a list that cannot be read."""
    # Lines of a service may be mended there, files of a folder by its user
    if watch.folder is None:
        return [ServiceError(problem) for problem in feed.problems]
    return [CatalogError(str(watch.folder), problem) for problem in feed.problems]


def _failed_poll(state: WatchState, fault: PerError, now: datetime) -> WatchState:
    """Return the state after a list that could not be read."""
    failures = state.failures + 1
    update = {
        "failures": failures,
        "not_before": after_pause(now, failures, fault),
        "last_error": shortened(str(fault)),
    }
    return state.model_copy(update=update)


def keep(watcher: Watcher, states: dict[str, EventState], state: EventState) -> None:
    """Write the state of an earthquake, and remember it."""
    write_event_state(event_folder(watcher.folder, state.event_id), state)
    before = states.get(state.event_id)
    if state.state == "closed" and (before is None or before.state != "closed"):
        log.info("%s: closed: %s", shortened(state.event_id, 80), state.reason)
    states[state.event_id] = state


def confirm(watcher: Watcher, states: dict[str, EventState], errors: list[PerError]) -> None:
    """Ask for the open earthquakes that no list has confirmed for a while."""
    watch = watch_of(watcher.settings)
    for state in list(states.values()):
        now = watcher.now()
        elapsed = (now - moment(state.confirmed)).total_seconds()
        recent = 0.0 <= elapsed < CONFIRM
        if state.state != "open" or recent or is_paused(now, state.not_before):
            continue
        faults = list[PerError]()
        with noted_faults(faults):
            present = present_state(watch, watcher.places, state, now)
        # The service of all others fails as well
        if faults:
            errors += faults
            return
        keep(watcher, states, present)
