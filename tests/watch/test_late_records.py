"""Records that come between the delays: only what is missing is asked for, not too often."""

import json
from datetime import timedelta
from itertools import pairwise

import pytest
from fdsn_server import status
from obspy import UTCDateTime
from test_shakemap import FIELDS, grid_xml, make_rows
from watched_city import ORIGIN

from per_obspy.progress import silent
from per_obspy.watch import watch
from per_obspy.watch.event_run import is_look_due
from per_obspy.watch.event_settings import Watcher
from per_obspy.watch.state import EventState, changed, iso


@pytest.fixture(autouse=True)
def one_delay(city):
    """Let no delay come between the first run and the end of the test."""
    section = city.settings.watch.model_copy(update={"delays": (60.0, 500_000.0)})
    city.settings = city.settings.model_copy(update={"watch": section})


def subjects(server, service="dataselect"):
    """Return the stations that a service was asked for since the last call."""
    found = [request.subject for request in server.requests if request.service == service]
    server.requests.clear()
    return found


def test_a_late_station_is_asked_for_alone_and_makes_a_revision(city, server):
    server.silent = {"S002"}
    city.at(61)
    assert sorted(subjects(server)) == ["S001", "S002"]
    # Not at every poll
    city.at(91)
    assert subjects(server) == []
    city.at(185)
    assert subjects(server) == ["S002"]
    assert city.revisions() == ["0001"]
    server.silent = set()
    city.at(215)
    assert subjects(server) == []
    city.at(310)
    assert subjects(server) == ["S002"]
    assert city.revisions() == ["0001", "0002"]
    facts = json.loads((city.event() / "latest" / "revision.json").read_text())
    assert facts["reasons"] == ["records"]
    assert ("station", "XX.S002", "state", "absent", "used") in city.changes()
    # Everything is there: nothing is asked for any more
    city.at(10_000)
    assert subjects(server) == []


def test_a_map_serves_before_the_records_and_each_version_makes_a_revision(city, server):
    fdsn = city.settings.records.fdsn.model_copy(update={"shakemap": True})
    records = city.settings.records.model_copy(update={"fdsn": fdsn})
    city.settings = city.settings.model_copy(update={"records": records})
    server.silent = {"S001", "S002"}
    city.at(61)
    # Neither a map nor a record
    assert (city.revisions(), city.state().missing) == ([], True)
    server.add_map("1", grid_xml=grid_xml(FIELDS, make_rows(), (2, 3)).encode())
    city.at(185)
    assert (city.event() / "records" / "shakemap-1" / "grid.xml").is_file()
    assert city.revisions() == ["0001"]
    first = city.state().fetched
    server.silent = set()
    city.at(310)
    assert city.revisions() == ["0001", "0002"]
    second = city.state().fetched
    # All records are there, and the map is still asked for
    server.add_map("2", grid_xml=grid_xml(FIELDS, make_rows(), (2, 3)).encode())
    city.at(435)
    third = city.state().fetched
    assert len({first, second, third}) == 3
    assert (city.event() / "records" / "shakemap-2" / "grid.xml").is_file()


def test_a_record_that_was_cut_is_asked_for_again(city, server):
    # Records end 30 s after the origin, 20 s before their window
    server.records_until = UTCDateTime(ORIGIN) + 30
    city.at(61)
    before = city.state().fetched
    city.at(185)
    assert city.revisions() == ["0001"]
    subjects(server)
    server.records_until = None
    city.at(310)
    assert sorted(subjects(server)) == ["S001", "S002"]
    assert (city.state().fetched != before, city.state().missing) == (True, False)


def test_the_later_the_rarer(city, clock):
    known = {"first_seen": iso(ORIGIN), "time": iso(ORIGIN), "confirmed": iso(ORIGIN)}
    done = {"60": iso(ORIGIN + timedelta(minutes=1))}
    state = EventState(event_id="xx1", latitude=0, longitude=0, missing=True, done=done, **known)
    watcher = Watcher(city.settings, city.folder, None, clock.now, silent, None)
    minutes = []
    for minute in range(1, 7 * 24 * 60):
        clock.at(60.0 * minute)
        if is_look_due(watcher, state):
            minutes.append(minute)
            state = changed(state, looked=iso(clock.now()))
    gaps = [later - earlier for earlier, later in pairwise(minutes)]
    # Two minutes at first, later a tenth of the age: each step is 10/9, which is
    # ln(7 * 24 * 3) / ln(10 / 9) = 59 steps from 20 minutes on, after 9 steps of two minutes
    assert gaps[:8] == [2] * 8
    assert all(gap >= 0.1 * later for gap, later in zip(gaps, minutes[1:], strict=True))
    assert gaps[-1] == pytest.approx(0.1 * minutes[-1], abs=2)
    assert 60 <= len(minutes) <= 70
    # Not at all if everything is there, or for an earthquake that is closed
    clock.at(8 * 86_400.0)
    assert is_look_due(watcher, state)
    assert not is_look_due(watcher, changed(state, missing=False))
    assert not is_look_due(watcher, changed(state, state="closed"))


def test_a_service_that_fails_at_a_look_costs_nothing_and_is_an_error_of_the_pass(city, server):
    server.silent = {"S002"}
    city.at(61)
    subjects(server)
    server.fail("station", "*", status(503, Retry_After="900"))
    city.at(185)
    assert city.revisions() == ["0001"]
    server.silent = set()
    # As long as it demands, and no run fails for it
    city.at(800)
    assert subjects(server) == []
    assert city.state().failures == 0
    city.at(1090)
    assert subjects(server) == ["S002"]
    assert city.revisions() == ["0001", "0002"]


def test_records_that_came_before_a_kill_are_found_by_the_next_watcher(city, server, monkeypatch):
    server.silent = {"S002"}
    city.at(61)
    server.silent = set()

    def killed(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(watch, "done_task", killed)
        with pytest.raises(KeyboardInterrupt):
            city.at(185)
    city.at(310)
    assert city.revisions() == ["0001", "0002"]
