"""Earlier earthquakes whose damage a watched one finds: by the window of Gardner & Knopoff."""

import logging
from collections.abc import Iterable
from datetime import timedelta
from pathlib import Path

from per_obspy.errors import shortened
from per_obspy.screening.motion_field import great_circle
from per_obspy.watch.event_settings import Watcher
from per_obspy.watch.revisions import newest_revision, revision_folder
from per_obspy.watch.state import EventState, event_folder, moment, read_event_states

log = logging.getLogger(__name__)


def window_after(magnitude: float) -> tuple[float, timedelta]:
    """
    Return the distance, m, and the time after an earthquake in which others count as of it.

    References
    ----------
    Gardner & Knopoff (1974), BSSA 64(5), 1363-1367, as the formulas of van Stiphout and others
    (2012): ``10^(0.1238 M + 0.983)`` km; ``10^(0.032 M + 2.7389)`` days from magnitude 6.5 on, else
    ``10^(0.5409 M - 0.547)`` days.

    Examples
    --------
    >>> distance, time = window_after(7.0)
    >>> round(distance / 1000), time.days
    (71, 918)
    """
    slope, constant = (0.032, 2.7389) if magnitude >= 6.5 else (0.5409, -0.547)
    days = 10.0 ** (slope * magnitude + constant)
    return 1000.0 * 10.0 ** (0.1238 * magnitude + 0.983), timedelta(days=days)


def earlier_earthquakes(
    event: EventState, states: Iterable[EventState], assumed_magnitude: float
) -> list[EventState]:
    """Return the earthquakes in whose window a later one of any size is, the latest first."""
    found = []
    for state in states:
        reach, time = window_after(
            assumed_magnitude if state.magnitude is None else state.magnitude
        )
        apart = great_circle(state.longitude, state.latitude, event.longitude, event.latitude)
        later = moment(event.time) - moment(state.time)
        # Not one that was deleted
        if state.state != "closed" and timedelta() < later <= time and float(apart) <= reach:
            found.append(state)
    return sorted(found, key=lambda state: moment(state.time), reverse=True)


def result_before(watcher: Watcher, event: EventState) -> Path | None:
    """Return the newest revision of the earlier earthquake whose damage an earthquake finds."""
    if not watcher.watch.aftershocks:
        return None
    states, _ = read_event_states(watcher.folder)
    for state in earlier_earthquakes(event, states.values(), watcher.watch.assumed_magnitude):
        folder, name = event_folder(watcher.folder, state.event_id), shortened(state.event_id, 80)
        if number := newest_revision(folder):
            log.info("%s: after %s, revision %d", shortened(event.event_id, 80), name, number)
            return revision_folder(folder, number)
        log.warning(
            "%s: what %s left is not known: it has no result",
            shortened(event.event_id, 80), name,
        )  # fmt: skip
    return None
