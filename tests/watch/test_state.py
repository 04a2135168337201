"""State files: whole, checked, and safe whatever an identifier holds."""

import json

import pytest

from per_obspy.watch.state import (
    EVENT,
    WATCH,
    EventState,
    WatchState,
    event_folder,
    read_event_states,
    read_watch_state,
    write_state,
)

STATE = EventState(
    event_id="us7000abcd",
    first_seen="2026-11-23T01:00:00+00:00",
    confirmed="2026-11-23T01:00:00+00:00",
    time="2026-11-23T00:59:00",
    latitude=14.6,
    longitude=-90.5,
    magnitude=6.1,
    done={"120": "2026-11-23T01:02:00+00:00"},
)


def test_what_is_written_is_read(tmp_path):
    write_state(event_folder(tmp_path, STATE.event_id) / EVENT, STATE)
    assert read_event_states(tmp_path) == ({"us7000abcd": STATE}, [])
    state = WatchState(last_poll="2026-11-23T01:00:00+00:00", seen={"a.xml": (3, 10**18)})
    write_state(tmp_path / WATCH, state)
    assert read_watch_state(tmp_path) == state


@pytest.mark.parametrize("name", ["../../etc", "/etc/passwd", "a" * 300, "ü\n", "..", "a/b", "CON"])
def test_no_identifier_leads_out_of_the_folder(tmp_path, name):
    folder = event_folder(tmp_path, name)
    assert folder.parent == tmp_path / "events"
    assert folder.resolve().is_relative_to(tmp_path.resolve())


def test_identifiers_that_differ_have_folders_that_differ(tmp_path):
    names = ["a/b", "a:b", "a b", "a-b"]
    assert len({event_folder(tmp_path, name) for name in names}) == len(names)


@pytest.mark.parametrize("text", ["", "{}", "[]", '{"event_id": "x"', "\x00\xff", "null"])
def test_a_damaged_state_is_one_line_and_costs_no_other(tmp_path, text):
    write_state(event_folder(tmp_path, STATE.event_id) / EVENT, STATE)
    write_state(event_folder(tmp_path, "b") / EVENT, STATE.model_copy(update={"event_id": "b"}))
    (tmp_path / "events" / "b" / "event.json").write_text(text, encoding="utf-8")
    states, (problem,) = read_event_states(tmp_path)
    assert list(states) == ["us7000abcd"]
    assert "events/b/event.json" in problem
    assert "\n" not in problem


def test_a_damaged_state_of_the_folder_asks_for_everything_again(tmp_path):
    (tmp_path / "watch.json").write_text('{"since": "yesterday"}')
    assert read_watch_state(tmp_path) == WatchState()


def test_numbers_that_are_none_are_refused(tmp_path):
    write_state(event_folder(tmp_path, "a") / EVENT, STATE)
    file = tmp_path / "events" / "a" / "event.json"
    content = json.loads(file.read_text()) | {"latitude": 1e400}
    file.write_text(json.dumps(content))
    assert read_event_states(tmp_path)[0] == {}
