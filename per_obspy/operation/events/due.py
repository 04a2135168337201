"""
Times at which the run of an earthquake is due, from its state and the time alone.

Runs are counted by their delay after the origin time. A clock that jumps ahead makes several
delays due at once, which one run serves; a clock that is put back makes those due again that were
done at times still to come.
"""

from collections.abc import Sequence
from datetime import datetime, timedelta
from typing import NamedTuple

from per_obspy.operation.events.state import EventState, moment

#: Pauses after failures, s: the shortest, which doubles, and the longest.
SHORTEST_PAUSE, LONGEST_PAUSE = 60.0, 3600.0

#: Failure that holds up only its own repetition: the run was done with what there is.
INCOMPLETE = "services of records did not answer everything: asked again"

#: Difference between two clocks that is no jump, s.
TOLERANCE = 60.0


class Task(NamedTuple):
    """
    A run that is due.

    Attributes
    ----------
    delay : float
        Latest delay that has passed, s after the origin time.
    reasons : tuple of str
        ``"delay"``, ``"update"``, ``"records"`` and ``"retry"``, as many as apply.
    """

    delay: float
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
    conditions = {
        "delay": is_open and not is_done(now, state, passed[-1]),
        "update": state.changed,
        "records": is_open and has_arrivals,
        "retry": is_open and not is_paused(now, state.not_before) and _is_unfinished(state),
    }
    reasons = tuple(name for name, holds in conditions.items() if holds)
    return Task(passed[-1], reasons) if reasons else None


def _is_unfinished(state: EventState) -> bool:
    """Return whether the latest run has failed, or lacked an answer of a service."""
    return not state.complete or state.failures > 0


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
