"""
Records of services for a watched earthquake: those of a run, and those that come between two runs.

Between the delays only stations without whole records are requested. A service that demands a
pause by ``Retry-After`` is not asked before it has passed.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime, timedelta
from pathlib import Path

from per_obspy.config import Fdsn, Run
from per_obspy.errors import ServiceError
from per_obspy.files import content_hash
from per_obspy.operation.events.due import LONGEST_PAUSE, is_held, passed_delays
from per_obspy.operation.events.event_settings import Watcher, settings_of_event, watch_of
from per_obspy.operation.events.state import (
    EventState,
    changed,
    event_folder,
    iso,
    moment,
    read_watch_state,
    write_watch_state,
)
from per_obspy.progress import Progress
from per_obspy.records.fdsn.cache import FDSN, Fetched, cached_hashes, fetch, has_cut_records
from per_obspy.records.fdsn.download import RECORDS
from per_obspy.records.fdsn.web import PassingFault

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
    return _without_restored(fetched)


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


def _without_restored(fetched: Fetched) -> Fetched:
    """Return records without the rejections of stations whose earlier records were kept."""
    missing = tuple(
        row
        for row in fetched.rejected
        if row.source != FDSN or not (fetched.folder / f"{row.name}{RECORDS}").is_file()
    )
    return fetched._replace(rejected=missing)


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
            write_watch_state(folder, state)


def records_hash(fetched: Fetched | None) -> str:
    """Return a hash of the names and contents of all fetched records; empty without services."""
    if fetched is None:
        return ""
    hashes = cached_hashes(fetched.folder)
    return content_hash({name: known for name, known in hashes.items() if name.endswith(RECORDS)})


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
    watch, now = watch_of(watcher.settings), watcher.now()
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
    delays = passed_delays(now, state, watch_of(watcher.settings).delays)
    done = [delay for delay in delays if f"{delay:g}" in state.done]
    state = changed(state, looked=iso(now))
    if not done:
        return state, False
    # What is there is in the cache: only the rest is requested
    folder = event_folder(watcher.folder, state.event_id)
    settings = settings_of_event(watcher.settings, folder, state, done[-1])
    return state, records_hash(fetched_for(watcher, settings)) != state.fetched
