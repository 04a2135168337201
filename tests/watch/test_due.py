"""Times of runs: by delay, update, arrival and retry, whichever way the clock jumps."""

from datetime import UTC, datetime, timedelta

import pytest

from per_obspy.watch.state import (
    LONGEST_PAUSE,
    EventState,
    Task,
    changed,
    due_task,
    iso,
    next_due,
    pause,
)

ORIGIN = datetime(2026, 11, 23, 1, tzinfo=UTC)
DELAYS = (120.0, 300.0, 900.0)


def at(seconds: float) -> datetime:
    return ORIGIN + timedelta(seconds=seconds)


def event(**values: object) -> EventState:
    known = {"event_id": "x", "first_seen": iso(ORIGIN), "confirmed": iso(ORIGIN)}
    place = {"time": iso(ORIGIN), "latitude": 0.0, "longitude": 0.0}
    return EventState(**{**known, **place, "changed": False, **values})


def done(*delays: int, when: float | None = None) -> dict[str, str]:
    return {f"{delay:g}": iso(at(delay if when is None else when)) for delay in delays}


def test_nothing_is_due_before_the_first_delay():
    assert due_task(at(119), event(changed=True), DELAYS) is None
    assert due_task(at(120), event(), DELAYS) == Task(120.0, ("delay",))


def test_one_run_serves_all_delays_that_have_passed():
    assert due_task(at(3600), event(), DELAYS) == Task(900.0, ("delay",))
    assert due_task(at(899), event(done=done(120, 300)), DELAYS) is None


@pytest.mark.parametrize(
    ("state", "has_arrivals", "reasons"),
    [
        (event(done=done(120), changed=True), False, ("update",)),
        (event(done=done(120)), True, ("records",)),
        (event(done=done(120), complete=False), False, ("retry",)),
        (event(done=done(120), failures=1), False, ("retry",)),
        (event(done=done(120), state="closed", changed=True), True, ()),
        (event(done={}, state="finished"), True, ()),
        (event(done={}, state="finished", changed=True), True, ("update",)),
    ],
)
def test_reasons_of_a_run(state, has_arrivals, reasons):
    found = due_task(at(200), state, DELAYS, has_arrivals)
    assert (found.reasons if found else ()) == reasons


def test_a_pause_after_a_failure_holds_until_its_end():
    state = event(failures=1, not_before=iso(at(200)))
    assert due_task(at(199), state, DELAYS) is None
    assert due_task(at(201), state, DELAYS) == Task(120.0, ("delay", "retry"))


def test_a_clock_that_is_put_back_does_not_freeze_a_pause():
    # The end of the pause was set by a clock that was a day ahead
    state = event(failures=1, not_before=iso(at(86_400)))
    assert due_task(at(200), state, DELAYS) is not None


def test_a_clock_that_was_ahead_has_done_no_run():
    # All delays were done within a minute, by a clock that was a day ahead
    state = event(done=done(120, 300, 900, when=86_400))
    assert due_task(at(130), state, DELAYS) == Task(120.0, ("delay",))
    assert due_task(at(86_400), state, DELAYS) is None


def test_a_clock_before_the_origin_time_waits():
    assert due_task(at(-3600), event(changed=True), DELAYS) is None
    assert next_due(at(-3600), event(), DELAYS) == at(120)


def test_next_time():
    assert next_due(at(0), event(), DELAYS) == at(120)
    assert next_due(at(130), event(done=done(120)), DELAYS) == at(300)
    assert next_due(at(130), event(), DELAYS) == at(130)
    paused = event(failures=1, not_before=iso(at(190)))
    assert next_due(at(130), paused, DELAYS) == at(190)
    assert next_due(at(1000), event(done=done(120, 300, 900)), DELAYS) is None
    assert next_due(at(0), event(state="closed"), DELAYS) is None


def test_pauses_grow_and_are_bounded():
    pauses = [pause(failures) for failures in range(1, 30)]
    assert pauses == sorted(pauses)
    assert max(pauses) == LONGEST_PAUSE
    assert pause(1, demanded=1e9) == LONGEST_PAUSE


def test_the_state_after_a_run_is_not_due_again():
    state = changed(event(), done=done(120, when=121))
    assert due_task(at(121), state, DELAYS) is None
