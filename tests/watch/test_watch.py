"""A watcher and a service on loopback, by a clock of the test: every result is kept.

Tests ``per_obspy.watch.watch``, ``per_obspy.watch.event_feed``,
``per_obspy.watch.event_run``, ``per_obspy.watch.state`` and
``per_obspy.watch.polling`` as well.
"""

import errno
import json
import logging
import os
import shutil
import sys
import time
import tracemalloc
from io import BytesIO
from pathlib import Path

import obspy
import pytest
from fdsn_server import content, empty, event_text, status, whole
from watched_city import (
    magnified,
    other_event,
    quick_run,
)

from per_obspy.config import Notify, Reach
from per_obspy.errors import CatalogError, FolderInUse, ServiceError, TryLater, WriteError
from per_obspy.files import file_hash
from per_obspy.records.fdsn.web import PassingFault
from per_obspy.runs.inputs.description import describe
from per_obspy.runs.run import run
from per_obspy.watch import event_feed, event_run, watch
from per_obspy.watch.health import folder_health, read_status
from per_obspy.watch.state import read_event_states
from per_obspy.watch.watch import watch_forever

from ..runs.small_run import page_content, plain_figures


def test_life_of_an_earthquake(city, server, simulation):
    server.silent = {"S002"}
    assert city.at(30).errors == ()
    assert city.revisions() == []
    # The first result comes with the stations that there are
    city.at(61)
    assert city.revisions() == ["0001"]
    first = {path: file_hash(path) for path in city.event().glob("revisions/0001/*")}
    # A station that arrives late
    server.silent = set()
    city.at(301)
    assert city.revisions() == ["0001", "0002"]
    assert ("station", "XX.S002", "state", "absent", "used") in city.changes()
    # A magnitude that is revised, without a delay
    server.events["xx1"] = magnified(simulation, 7.2)
    city.at(400)
    assert city.revisions() == ["0001", "0002", "0003"]
    assert ("event", "xx1", "magnitude", "6.5", "7.2") in city.changes()
    assert ("pair", "XX.S001", "state", "no", "yes") in city.changes()
    assert str((city.event() / "latest").readlink()) == "revisions/0003"
    # Without anything new there is no new revision
    city.at(901)
    assert city.revisions() == ["0001", "0002", "0003"]
    assert {path: file_hash(path) for path in first} == first
    facts = json.loads((city.event() / "latest" / "run.json").read_text())
    assert (facts["event_id"], facts["revision"]) == ("xx1", 3)


def test_unchanged_files_of_revisions_share_their_room(city, server, simulation):
    city.at(61)
    server.events["xx1"] = magnified(simulation, 6.6)
    city.at(301)
    stations = [city.event() / "revisions" / name / "stations.csv" for name in city.revisions()]
    assert len(stations) == 2
    assert stations[0].samefile(stations[1])
    # Never with the folder in which runs write
    assert not stations[0].samefile(city.event() / "work" / "stations.csv")


def test_a_deleted_earthquake_is_closed_and_comes_back(city, server):
    city.at(61)
    server.deleted = {"xx1"}
    city.at(1200)
    assert (city.state().state, city.state().reason) == ("closed", "deleted at its source")
    assert city.revisions() == ["0001"]
    assert city.at(1300).open_events == 0
    server.deleted = set()
    city.at(1400)
    assert city.state().state == "open"


@pytest.mark.parametrize("fault", [status(404), status(409), status(410)])
def test_services_say_in_several_ways_that_an_earthquake_is_deleted(city, server, fault):
    city.at(30)
    server.fail("event", "*", status(204), fault)
    city.at(61)
    assert city.state().reason == "deleted at its source"


def test_a_service_that_fails_deletes_nothing(city, server):
    city.at(30)
    server.fail("event", "*", *[status(500)] * 4)
    assert isinstance(city.at(61).errors[0], ServiceError)
    assert city.state().state == "open"


@pytest.mark.parametrize(
    ("event", "reason"),
    [
        (other_event(longitude=40.0), "magnitude 6.5 at 4"),
        (other_event(magnitude=3.0), "magnitude 3 at "),
    ],
)
def test_an_earthquake_that_moves_away_or_shrinks_is_closed(city, server, event, reason):
    city.at(61)
    # Services leave it out of their circle: its identifier is asked for
    server.events["xx1"] = event
    city.at(1000)
    assert city.state().state == "closed"
    assert reason in city.state().reason
    assert city.revisions() == ["0001"]


def test_an_unknown_magnitude_is_assumed_and_marked(city, server):
    server.events = {"none": other_event(magnitude=None)}
    city.at(61)
    assert (city.state("none").magnitude, city.state("none").magnitude_assumed) == (None, True)
    assert city.revisions("none") == ["0001"]
    city.at(70, assumed_magnitude=1.0)


def test_two_earthquakes_have_results_of_their_own_the_larger_first(city, server, caplog):
    server.events["xx2"] = other_event(10.0, 7.3)
    with caplog.at_level("INFO"):
        city.at(75)
    runs = [line for line in caplog.messages if ": run at" in line]
    assert [line[:3] for line in runs] == ["xx2", "xx1"]
    assert city.revisions("xx1") == city.revisions("xx2") == ["0001"]
    assert city.event("xx1") != city.event("xx2")


def test_an_aftershock_starts_from_the_newest_result_of_the_main_shock(
    city, server, caplog, monkeypatch
):
    # catches: an earthquake after itself or after a later one, a result that is not there yet
    after, ran = {}, event_run.run

    def noted(settings, *others):
        after[settings.output.parent.name] = settings.after
        return ran(settings, *others)

    monkeypatch.setattr(event_run, "run", noted)
    server.events |= {"xx2": other_event(10.0, 7.3), "far": other_event(20.0, 6.5, longitude=1.0)}
    # larger ones first: the second has a result before the first one has
    city.at(90, aftershocks=True)
    assert (after["xx1"], after["xx2"]) == (None, None)
    assert "xx2: what xx1 left is not known: it has no result" in caplog.messages
    # 111 km away, where magnitude 7.3 reaches 77 km
    assert after["far"] is None
    city.at(330, aftershocks=True)
    assert after["xx2"] == city.event("xx1") / "revisions" / city.revisions("xx1")[-1]
    assert (after["xx1"], after["far"]) == (None, None)
    # only where it is asked for
    city.at(930)
    assert set(after.values()) == {None}


def test_a_second_watcher_is_refused(city):
    with watch.locked_folder(city.folder), pytest.raises(FolderInUse, match="another run"):
        city.at(61)


def test_a_list_that_fails_does_not_hold_up_runs(city, server):
    city.at(30)
    refused = status(503, Retry_After="300")
    server.fail("event", "*", refused)
    found = city.at(61)
    assert [type(error) for error in found.errors] == [PassingFault]
    assert city.revisions() == ["0001"]
    # The service is left alone for as long as it demands
    asked = server.asked("event")
    assert isinstance(city.at(200).errors[0], TryLater)
    assert server.asked("event") == asked
    assert "503" in read_status(city.folder).last_error
    assert city.at(400).errors == ()
    assert read_status(city.folder).last_error is None


def test_the_pause_of_a_service_ends_with_another_address(city):
    # A wrong address is mended: the user does not wait for the pause of the wrong one
    (error,) = city.at(30, service="http://127.0.0.1:9").errors
    assert "no answer" in str(error)
    assert city.at(61).errors == ()
    assert city.revisions() == ["0001"]


def test_a_list_that_is_none_is_one_line(city, server):
    server.fail("event", "*", content(b"<html><body>busy</body></html>"))
    (error,) = city.at(61).errors
    assert isinstance(error, ServiceError)
    assert "answer is no list of events" in str(error)
    assert "\n" not in str(error)


def test_a_line_that_cannot_be_read_costs_no_other(city, server):
    whole = server.events["xx1"]
    rows = b"#EventID|Time|\nbad|2000-01-01|x\n"
    good = b"xx1|2000-01-01T00:00:00|0.0|0.0|15|A|B|C|D|Mw|6.5|A|Nowhere\n"
    odd = b"odd|2000-01-01T00:00:00|nan|0.0|15|A|B|C|D|Mw|6.5|A|Nowhere\n"
    server.fail("event", "*", content(rows + good + odd))
    errors = city.at(61).errors
    assert whole is server.events["xx1"]
    assert len(errors) == 2
    assert city.revisions() == ["0001"]


def test_a_station_that_fails_is_asked_again_after_a_pause(city, server):
    server.fail("dataselect", "S002", status(503))
    city.at(61)
    assert city.state().complete is False
    assert city.revisions() == ["0001"]
    city.at(90)
    assert city.revisions() == ["0001"]
    city.at(125)
    assert city.revisions() == ["0001", "0002"]
    assert (city.state().complete, city.state().failures) == (True, 0)


def test_a_service_of_records_is_left_alone_for_as_long_as_it_demands(city, server):
    server.fail("dataselect", "S002", status(503, Retry_After="600"))
    city.at(61)
    assert city.revisions() == ["0001"]
    asked = [server.asked(service) for service in ("station", "dataselect")]
    # Neither the repetition after a failure nor the delay at 300 s nor a poll asks it
    for seconds in (125, 301, 500, 655):
        city.at(seconds)
    assert [server.asked(service) for service in ("station", "dataselect")] == asked
    assert (city.state().revision, city.state().complete) == (1, False)
    city.at(901)
    assert (city.state().revision, city.state().complete) == (2, True)
    assert "XX.S002" in (city.event() / "latest" / "stations.csv").read_text()


def test_a_failure_stops_no_other_earthquake_and_is_tried_again(city, server, monkeypatch):
    server.events["xx2"] = other_event(0.0, 7.3)

    def failing(settings, *others):
        if "xx2" in settings.name:
            raise WriteError("work", "No space left on device; try again when there is room")
        return quick_run(settings, *others)

    monkeypatch.setattr(event_run, "run", failing)
    (error,) = city.at(61).errors
    assert isinstance(error, WriteError)
    assert (city.revisions("xx1"), city.revisions("xx2")) == (["0001"], [])
    assert "No space left" in city.state("xx2").last_error
    monkeypatch.setattr(event_run, "run", quick_run)
    assert city.at(100).errors == ()
    assert city.revisions("xx2") == []
    city.at(130)
    assert city.revisions("xx2") == ["0001"]


def test_a_fault_of_the_program_is_one_line_and_stops_no_other(city, monkeypatch):
    monkeypatch.setattr(event_run, "run", lambda *_: 1 / 0)
    (error,) = city.at(61).errors
    assert "ZeroDivisionError" in str(error)


@pytest.mark.parametrize("place", ["publish", "point_latest", "keep"])
def test_a_kill_around_a_revision_neither_repeats_nor_reuses_its_number(
    city, server, simulation, monkeypatch, place
):
    city.at(61)
    server.events["xx1"] = magnified(simulation, 7.2)
    module = watch if place == "keep" else event_run
    if place == "point_latest":
        from per_obspy.watch import revisions as module

    def killed(*_, **__):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(module, place, killed)
        with pytest.raises(KeyboardInterrupt):
            city.at(301)
    city.at(310)
    assert city.revisions() == ["0001", "0002"]
    assert str((city.event() / "latest").readlink()) == "revisions/0002"
    assert list(city.folder.rglob("*.part*")) == []


@pytest.mark.parametrize("number", [errno.EROFS, errno.EACCES])
@pytest.mark.parametrize("place", ["watch.json", "event.json", "revision.json", "status.json"])
def test_output_that_cannot_be_written_is_one_line_and_tried_again(
    city, monkeypatch, number, place
):
    replace = Path.replace

    def refused(path, target):
        # Rights and mounts do not hold back every user: the system call fails instead
        if Path(target).name == place:
            raise OSError(number, os.strerror(number))
        return replace(path, target)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "replace", refused)
        try:
            (error,) = city.at(61).errors
        except WriteError as raised:
            error = raised
    assert isinstance(error, WriteError)
    assert os.strerror(number) in str(error)
    assert "\n" not in str(error)
    # Nothing half is left, and everything is done by a later pass
    assert list(city.folder.rglob("*.part*")) == []
    assert city.at(130).errors == ()
    assert city.revisions() == ["0001"]
    assert "XX.S002" in (city.event() / "latest" / "stations.csv").read_text()


def test_a_file_in_the_place_of_the_earthquakes_is_one_line(city):
    city.folder.mkdir()
    (city.folder / "events").write_text("a file")
    with pytest.raises((CatalogError, WriteError), match="events") as refused:
        city.at(61)
    assert "\n" not in str(refused.value)
    (city.folder / "events").unlink()
    assert city.at(130).errors == ()
    assert city.revisions() == ["0001"]


def test_a_folder_in_the_place_of_the_link_stops_no_other_earthquake(city, server):
    city.at(61)
    latest = city.event() / "latest"
    results = latest.resolve()
    latest.unlink()
    shutil.copytree(results, latest)
    server.events["xx2"] = other_event(0.0, 7.3)
    (error, *_) = city.at(305).errors
    assert str(error).endswith("as copies without links leave it: remove it")
    assert city.revisions("xx2") == ["0001"]
    shutil.rmtree(latest)
    assert city.at(700).errors == ()
    assert latest.is_symlink()


def test_messages_show_the_revision_and_a_failing_one_is_in_the_status(city, server, tmp_path):
    program = "import os; print(os.environ['PER_OBSPY_REPORT'], file=open(os.sys.argv[1], 'a'))"
    sent = tmp_path / "sent"
    works = Notify(command=(sys.executable, "-c", program, str(sent)))
    fails = Notify(command=("/no/such/program",))
    city.settings = city.settings.model_copy(update={"notify": fails})
    assert city.at(61).errors == ()
    assert "No such file" in read_status(city.folder).last_notification_error
    # It is the latest message until there is another
    city.at(90)
    assert "No such file" in read_status(city.folder).last_notification_error
    city.settings = city.settings.model_copy(update={"notify": works})
    server.events["xx2"] = other_event(0.0, 7.3)
    city.at(130)
    assert sent.read_text().split() == [
        str(city.event("xx2").resolve() / "revisions" / "0001" / "report.html")
    ]
    assert read_status(city.folder).last_notification_error is None


def test_only_what_changes_is_computed(city, server, simulation, monkeypatch):
    """With real runs, whose windows of records are the same at both delays."""
    monkeypatch.setattr(event_run, "run", run)
    server.silent = {"S002"}
    with plain_figures():
        city.at(201, delays=[200, 400])
        server.silent = set()
        city.at(401, delays=[200, 400])
        # Neither a station nor a chunk of pairs or rows depends on the magnitude
        server.events["xx1"] = magnified(simulation, 7.2)
        city.at(500, delays=[200, 400])
    assert city.revisions() == ["0001", "0002", "0003"]
    records = [
        json.loads((city.event() / "revisions" / name / "run.json").read_text())
        for name in city.revisions()
    ]
    counts = [record["counts"] for record in records]
    assert [count["stations"] for count in counts] == [1, 2, 2]
    assert [count["stations_resumed"] for count in counts] == [0, 1, 2]
    assert [count["chunks_resumed"] for count in counts] == [0, 0, counts[2]["chunks"]]
    assert counts[2]["row_chunks_resumed"] == counts[2]["row_chunks"] > 0
    described = dict(describe(str(city.event() / "latest")).lines)
    assert described["earthquake"] == "2000-01-01T00:00:00, 2 stations"
    # People see which revision of which earthquake they have
    for number, name in enumerate(city.revisions()[:2], start=1):
        folder = city.event() / "revisions" / name
        text = " ".join((folder / "summary.txt").read_text().split())
        assert f"xx1: Revision {number}, 2000-01-01 00:0{number * 3}" in text
        assert "Earthquake of 2000-01-01 00:00:00 UTC. Magnitude 6.5. Epicentre 0.000" in text
        assert page_content(folder / "report.html")["revision"].startswith(
            f"xx1: Revision {number}, "
        )


def test_clock_that_jumps_back_and_forth(city, server):
    # A day ahead: one run serves all delays
    city.at(86_400)
    assert sorted(city.state().done) == ["300", "60", "900"]
    # Set right, all that was done "tomorrow" is due at its own time, and the list is asked whole
    server.requests.clear()
    city.at(70)
    lists = [request.parameters for request in server.requests if request.service == "event"]
    assert "updatedafter" not in lists[0]
    assert city.state().done["60"].startswith("2000-01-01T00:01:10")
    assert city.revisions()[0] == "0001"


def test_ten_thousand_earthquakes_cost_little(city, server, monkeypatch):
    far = other_event(longitude=40.0)
    # All in the circle of the query are weak, and the limit is reached
    server.events = {f"w{number}": other_event(magnitude=2.0) for number in range(10)}
    lines = [f"e{n}|2000-01-01T00:00:00|0|0.4|15|A|B|C|D|Mw|2.1|A|Far" for n in range(10_000)]
    head = "#EventID|Time|Latitude"
    server.fail("event", "*", content("\n".join([head, *lines]).encode()))
    server.events = {"far": far, "xx1": other_event()}
    tracemalloc.start()
    start = time.process_time()
    monkeypatch.setattr(event_feed, "MOST_EVENTS", 10_000)
    found = city.at(59)
    seconds, (_, peak) = time.process_time() - start, tracemalloc.get_traced_memory()
    tracemalloc.stop()
    # 10 000 rows of about 1 kB and their table of distances, measured 30 MB
    assert peak < 100e6
    assert seconds < 20
    assert found.errors == ()
    city.at(61)
    # Weak ones crowd out no strong one
    assert city.revisions("xx1") == ["0001"]
    assert [path.name for path in (city.folder / "events").iterdir()] == ["xx1"]
    assert any("minmagnitude" in request.parameters for request in server.requests)


def test_services_without_updatedafter_are_asked_for_everything(city, server):
    city.at(30)
    server.fail("event", "*", status(400))
    assert city.at(61).errors == ()
    assert city.revisions() == ["0001"]


def test_what_changed_is_asked_for_with_an_overlap(city, server):
    city.at(30)
    server.requests.clear()
    city.at(59)
    (request,) = server.requests
    # Ten minutes before the latest poll
    assert request.parameters["updatedafter"] == "1999-12-31T23:50:30"


def test_old_earthquakes_are_not_opened_and_open_ones_finish(city):
    city.at(30)
    city.at(8 * 86_400)
    assert (city.state().state, city.revisions()) == ("finished", ["0001"])
    shutil.rmtree(city.event())
    city.at(8 * 86_400 + 60)
    assert not city.event().exists()


def write_event(folder: Path, name: str, event) -> Path:
    obspy.core.event.Catalog([event]).write(folder / name, format="QUAKEML")
    return folder / name


def in_folder(folder: Path) -> dict[str, object]:
    folder.mkdir()
    return {"service": None, "folder": folder}


def test_folder_of_quakeml(city, simulation, tmp_path):
    feed = in_folder(tmp_path / "feed")
    file = write_event(tmp_path / "feed", "a.xml", simulation.event)
    assert city.at(61, **feed).errors == ()
    ((name, state),) = read_event_states(city.folder)[0].items()
    assert (name, state.file, state.revision) == ("event", "a.xml", 1)
    write_event(tmp_path / "feed", "a.xml", magnified(simulation, 7.2))
    city.at(100, **feed)
    assert city.revisions("event") == ["0001", "0002"]
    file.unlink()
    city.at(150, **feed)
    assert city.state("event").reason == "deleted at its source"


def test_a_file_with_another_name_is_the_same_earthquake(city, simulation, tmp_path):
    feed = in_folder(tmp_path / "feed")
    file = write_event(tmp_path / "feed", "a.xml", simulation.event)
    city.at(61, **feed)
    file.rename(file.with_name("b.xml"))
    city.at(100, **feed)
    state = city.state("event")
    assert (state.state, state.file) == ("open", "b.xml")
    # Its name is no news, and no run; what it says is
    assert city.revisions("event") == ["0001"]
    write_event(tmp_path / "feed", "b.xml", magnified(simulation, 7.2))
    city.at(150, **feed)
    assert city.revisions("event") == ["0001", "0002"]


@pytest.mark.parametrize("listed_by", ["service", "folder"])
@pytest.mark.parametrize(
    ("event", "reason", "wider"),
    [
        (
            other_event(-20 * 86_400, 7.0),
            "older than 604800 s (watch.oldest)",
            {"oldest": 30 * 86_400.0},
        ),
        (
            other_event(-60, 4.0),
            "magnitude 4 at 33 km does not matter (watch.magnitudes)",
            {"magnitudes": (Reach(distance=5e5, magnitude=3.0),)},
        ),
        (
            other_event(-60, 7.0, longitude=9.0),
            " km does not matter (watch.magnitudes)",
            {"magnitudes": (Reach(distance=2e6, magnitude=6.0),)},
        ),
    ],
)
def test_an_ignored_earthquake_is_a_line_and_matters_after_a_change(
    city, server, tmp_path, caplog, event, reason, wider, listed_by
):
    caplog.set_level(logging.INFO)
    # A service leaves out by itself what is too old or too far
    server.events = {"old1": event}
    feed = {"updatedafter": True}
    if listed_by == "folder":
        feed = in_folder(tmp_path / "feed")
        write_event(tmp_path / "feed", "old1.xml", event)
    else:
        server.fail("event", "*", content(event_text(server.events).encode()))
    city.at(100, **feed)
    assert read_event_states(city.folder)[0] == {}
    (line,) = read_status(city.folder).ignored
    assert reason in line
    assert [
        reason in record.message for record in caplog.records if "ignored" in record.message
    ] == [True]
    assert any(reason in shown for shown in folder_health(city.folder, 1e9).lines)
    # It is one line however often the list is looked at
    city.at(200, **feed)
    assert len(read_status(city.folder).ignored) == 1
    assert sum("ignored" in record.message for record in caplog.records) == 1
    # With another configuration the same file, or an answer without changes, is looked at again
    city.at(300, **feed, **wider)
    (state,) = read_event_states(city.folder)[0].values()
    assert state.state in ("open", "finished")
    assert read_status(city.folder).ignored == ()


def test_a_file_with_one_wrong_earthquake_costs_no_other(city, simulation, tmp_path):
    feed = in_folder(tmp_path / "feed")
    placeless = other_event(-60, 7.0)
    placeless.origins[0].longitude = None
    catalog = obspy.core.event.Catalog([placeless, simulation.event])
    catalog.write(tmp_path / "feed" / "a.xml", format="QUAKEML")
    (error,) = city.at(61, **feed).errors
    assert "has an origin without longitude" in str(error)
    assert len(read_event_states(city.folder)[0]) == 1


def test_an_answer_of_another_earthquake_is_no_update(city, server):
    city.at(61)
    server.fail("event", "*", whole, content(quakeml(other_event(-86_400, 7.9))))
    (error,) = city.at(8000, poll=1e9).errors
    assert "with an earthquake of 1999-12-31T00:00:00, listed was 2000-01-01T00:00:00" in str(error)
    assert city.state().magnitude == 6.5


def test_an_empty_answer_deletes_nothing(city, server):
    city.at(61)
    server.fail("event", "*", empty, empty)
    assert 'which is not "no data"' in str(city.at(8000).errors[0])
    assert city.state().state == "open"


def quakeml(event) -> bytes:
    file = BytesIO()
    obspy.core.event.Catalog([event]).write(file, format="QUAKEML")
    return file.getvalue()


def test_file_that_is_no_quakeml_waits_while_it_is_young(city, tmp_path, simulation):
    feed = in_folder(tmp_path / "feed")
    write_event(tmp_path / "feed", "b.xml", simulation.event)
    half = tmp_path / "feed" / "a.xml"
    half.write_bytes((tmp_path / "feed" / "b.xml").read_bytes()[:300])
    assert city.at(61, **feed).errors == ()
    os.utime(half, (1e9, 1e9))
    (error,) = city.at(100, **feed).errors
    assert isinstance(error, CatalogError)
    assert "a.xml: is no QuakeML" in str(error)
    # No address in memory, which would be another message at each poll
    assert "0x" not in str(error)
    assert city.revisions("event") == ["0001"]
    # It is tried again
    shutil.copy(tmp_path / "feed" / "b.xml", half)
    assert city.at(150, **feed).errors == ()


def test_missing_folder_of_quakeml_is_one_line(city, tmp_path):
    (error,) = city.at(61, service=None, folder=tmp_path / "none").errors
    assert str(error).endswith("none: cannot be read: No such file or directory")


def test_records_that_come_into_a_folder_are_run_at_once(city, tmp_path):
    folder = tmp_path / "records"
    folder.mkdir()
    (folder / "XX.S001.mseed").write_bytes(b"one")
    records = city.settings.records.model_copy(update={"fdsn": None, "folder": folder})
    city.settings = city.settings.model_copy(update={"records": records})
    city.at(61)
    (folder / "XX.S002.mseed").write_bytes(b"two")
    city.at(120)
    assert city.revisions() == ["0001", "0002"]
    # One that is being written waits
    waiting = records.model_copy(update={"settle": 3600.0})
    city.settings = city.settings.model_copy(update={"records": waiting})
    city.at(170)
    (folder / "XX.S003.mseed").write_bytes(b"thr")
    city.at(240)
    assert "XX.S003" not in (city.event() / "latest" / "stations.csv").read_text()


def test_the_daemon_goes_on_after_a_full_disk(city, clock, monkeypatch):
    passes, wait = [], clock.wait
    one_pass = watch._one_pass

    def spoiled(*arguments, **named):
        passes.append(clock.time)
        if len(passes) == 2:
            raise WriteError("watch.json", "No space left on device")
        return one_pass(*arguments, **named)

    monkeypatch.setattr(watch, "_one_pass", spoiled)
    clock.at(30)
    ended = watch.Clock(clock.now, lambda seconds: wait(seconds) or len(passes) >= 5)
    watch_forever(city.settings, ended)
    assert len(passes) == 5
    assert city.revisions() == ["0001"]
    # It never waits longer than the time between two polls
    assert max(clock.waits) <= 30
    assert read_status(city.folder).running
