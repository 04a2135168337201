"""Open earthquakes: relevant ones of the list, until deleted or moved away."""

import logging
from collections.abc import Container, Iterator, Mapping
from datetime import datetime, timedelta
from typing import NamedTuple

import numpy as np

from per_obspy.config import Watch
from per_obspy.errors import shortened
from per_obspy.files import content_hash
from per_obspy.records.earthquakes.earthquake import Earthquake
from per_obspy.watch.event_feed import Feed, present_event
from per_obspy.watch.relevance import Places, distances, matters
from per_obspy.watch.state import EventState, changed, iso, moment

log = logging.getLogger(__name__)

#: Facts by which an earthquake counts as changed.
FACTS = ("time", "latitude", "longitude", "depth", "magnitude")

#: Ignored earthquakes that are kept for the status, the latest.
MOST_IGNORED = 1000

#: Reason of an earthquake that its service or file no longer has.
DELETED = "deleted at its source"


class Listed(NamedTuple):
    """Listed earthquake, reason for which it is irrelevant (empty if relevant), and its file."""

    row: Earthquake
    reason: str
    file: str


def judged(watch: Watch, places: Places, rows: list[Earthquake]) -> list[str]:
    """
    Return the reason for which each earthquake is irrelevant; empty for relevant ones.

    Parameters
    ----------
    watch : Watch
        With the table of magnitudes; one that is unknown is assumed.
    places : Places
        Of the inventory.
    rows : list of Earthquake
        Facts of the earthquakes.
    """
    longitude = np.array([row.longitude for row in rows], dtype=np.float64)
    latitude = np.array([row.latitude for row in rows], dtype=np.float64)
    found = distances(places, longitude, latitude) if rows else np.empty(0)
    return [
        _reason(watch, row, distance) for row, distance in zip(rows, found.tolist(), strict=True)
    ]


def _reason(watch: Watch, row: Earthquake, distance: float) -> str:
    """Return the reason for which an earthquake at a distance is irrelevant; empty if relevant."""
    magnitude = watch.assumed_magnitude if row.magnitude is None else row.magnitude
    if matters(watch.magnitudes, distance, magnitude):
        return ""
    known = "assumed magnitude" if row.magnitude is None else "magnitude"
    return f"{known} {magnitude:g} at {distance / 1000:.0f} km does not matter (watch.magnitudes)"


def with_facts(state: EventState, row: Earthquake) -> EventState:
    """Return the state of an earthquake with new facts, under its own identifier."""
    facts = {**row._asdict(), "event_id": state.event_id}
    return changed(state, **facts, magnitude_assumed=row.magnitude is None)


def closed(state: EventState, reason: str) -> EventState:
    """Return the state of an earthquake that is closed; its results stay."""
    return changed(state, state="closed", reason=reason, not_before=None, failures=0)


def judged_feed(
    watch: Watch, places: Places, states: Container[str], feed: Feed, now: datetime
) -> list[Listed]:
    """
    Return the earthquakes of a list, each with the reason for which it has no runs, or none.

    Parameters
    ----------
    watch : Watch
        Which earthquakes matter.
    places : Places
        Of the inventory.
    states : container of str
        Identifiers of the earthquakes known so far: an old one of them may be updated.
    feed : Feed
        Earthquakes listed as new or changed.
    now : datetime
        With its zone.
    """
    rows = list(feed.rows.values())
    oldest = now - timedelta(seconds=watch.oldest)
    judgement = list[Listed]()
    for row, irrelevance in zip(rows, judged(watch, places, rows), strict=True):
        # Old ones are listed where a watcher begins, or their magnitude is revised
        is_old = row.event_id not in states and moment(row.time) < oldest
        age = f"older than {watch.oldest:g} s (watch.oldest)" if is_old else ""
        reason = "; ".join(filter(None, (age, irrelevance)))
        judgement.append(Listed(row, reason, feed.files.get(row.event_id, "")))
    return judgement


def listed_states(
    watch: Watch, states: Mapping[str, EventState], judgement: list[Listed], now: datetime
) -> Iterator[EventState]:
    """
    Yield the states that a list opens, updates, closes or opens again.

    Parameters
    ----------
    watch : Watch
        With the folder of QuakeML, if there is one.
    states : mapping
        Identifier -> state of every earthquake known so far.
    judgement : list of Listed
        From :func:`judged_feed`.
    now : datetime
        With its zone.
    """
    for listed in judgement:
        known = states.get(listed.row.event_id)
        state = _opened(listed, now) if known is None else _updated(known, listed, now)
        if state is not None:
            yield state
    # A file that is gone is that of an earthquake that was deleted
    for state in states.values() if watch.folder is not None else ():
        assert watch.folder is not None
        if state.state == "open" and not (watch.folder / state.file).exists():
            yield closed(state, DELETED)


def ignored_events(
    known: Mapping[str, tuple[str, str]],
    states: Container[str],
    judgement: list[Listed],
    files: Container[str],
) -> dict[str, tuple[str, str]]:
    """
    Return the listed earthquakes without runs, and log those that are new or have another reason.

    Parameters
    ----------
    known : mapping
        As stored after the poll before, see ``WatchState.ignored``.
    states : container of str
        Identifiers of the earthquakes that have, or had, runs.
    judgement : list of Listed
        From :func:`judged_feed`.
    files : container of str
        Names of the QuakeML files of the folder.
    """
    # Those whose file is gone are gone
    ignored = {
        name: entry
        for name, entry in known.items()
        if name not in states and (not entry[0] or entry[0] in files)
    }
    for row, reason, file in judgement:
        if row.event_id in states:
            continue
        name, line = shortened(row.event_id, 80), f"{in_words(row)}: {reason}"
        before = ignored.pop(row.event_id, ("", ""))[1]
        if before != line:
            log.info("%s: ignored, %s", name, line)
        ignored[row.event_id] = (file, line)
    return dict(list(ignored.items())[-MOST_IGNORED:])


def _digest(row: Earthquake) -> str:
    """Return a hash of the facts of an earthquake by which it counts as changed."""
    return content_hash({name: getattr(row, name) for name in FACTS})[:16]


def _opened(listed: Listed, now: datetime) -> EventState | None:
    """Return the state of a newly listed earthquake, None if it is irrelevant."""
    row = listed.row
    if listed.reason:
        return None
    log.info("%s: opened, %s", shortened(row.event_id, 80), in_words(row))
    return EventState(
        **row._asdict(),
        magnitude_assumed=row.magnitude is None,
        first_seen=iso(now),
        confirmed=iso(now),
        file=listed.file,
        listed=_digest(row),
    )


def _updated(known: EventState, listed: Listed, now: datetime) -> EventState | None:
    """Return the new state of a known earthquake, None if it has not changed."""
    digest = _digest(listed.row)
    if known.state != "closed" and digest == known.listed:
        return None
    if known.state == "closed" and listed.reason:
        return None
    state = with_facts(known, listed.row)
    state = changed(state, listed=digest, confirmed=iso(now), file=listed.file or known.file)
    if listed.reason:
        return closed(state, listed.reason)
    # One that comes back, or changes, is screened again
    log.info("%s: %s", shortened(known.event_id, 80), _change(known, listed.row))
    is_closed = known.state == "closed"
    return changed(
        state, state="open" if is_closed else known.state, reason="", changed=True, not_before=None
    )


def _change(known: EventState, row: Earthquake) -> str:
    """Describe the return or change of a known earthquake."""
    if known.state == "closed":
        return f"opened again, {in_words(row)}"
    return f"updated, {in_words(row)}, before: {in_words(known.facts)}"


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


def present_state(watch: Watch, places: Places, state: EventState, now: datetime) -> EventState:
    """
    Return the state of an open earthquake by its current facts in service or file.

    Raises
    ------
    PerError
        If the service does not answer, or its answer is not the earthquake.
    """
    present = present_event(watch, state.event_id, state.file, state.time)
    if present is None:
        return closed(state, DELETED)
    row, confirmed = present.row, changed(state, confirmed=iso(now))
    if all(getattr(row, name) == getattr(state, name) for name in FACTS):
        return confirmed
    # Moved or of another size
    (reason,) = judged(watch, places, [row])
    updated = with_facts(confirmed, row)
    return closed(updated, reason) if reason else changed(updated, changed=True)
