"""Fetching from an HTTP server on loopback that fails on demand: each file arrives, and once."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from fdsn_server import (
    FdsnServer,
    changed,
    content,
    cut,
    dripping,
    empty,
    late,
    moved,
    mseed,
    serving,
    stalled,
    status,
)
from obspy import Stream, UTCDateTime, read

from per_obspy.config import Fdsn, Scenario
from per_obspy.errors import CatalogError, ServiceError
from per_obspy.files import file_hash
from per_obspy.records.fdsn import providers
from per_obspy.records.fdsn.cache import Fetched, fetch, fetched_stations
from per_obspy.records.folder import read_station
from per_obspy.simulation.earthquake import Simulation, simulate

STATIONS = ["XX.S001", "XX.S002", "XX.S003", "XX.S004"]
Ask = Callable[..., Fetched]


@pytest.fixture(scope="module")
def simulation() -> Simulation:
    return simulate(Scenario(stations=4, dt=0.02, magnitude=5.0))


@pytest.fixture
def server(simulation: Simulation) -> Iterator[FdsnServer]:
    with serving(simulation) as running:
        yield running


def request_to(server: FdsnServer, cache: Path, **changes: object) -> Fdsn:
    given = {
        "providers": (server.url,),
        "event_id": "xx1",
        "event_provider": server.url,
        "wait": 0.01,
        "timeout": 10.0,
    }
    return Fdsn(cache=cache, **given | changes)


@pytest.fixture
def ask(server: FdsnServer, tmp_path: Path) -> Ask:
    """Fetch from the server into a cache of the test."""
    return lambda again=False, cache=tmp_path, **changes: fetch(
        request_to(server, cache, **changes), again=again
    )


def names(fetched: Fetched) -> list[str]:
    return list(fetched_stations(fetched).stations)


def test_what_arrives_is_what_the_service_has(simulation: Simulation, ask: Ask):
    contents = fetched_stations(ask())
    assert (list(contents.stations), contents.rejected) == (STATIONS, ())
    for name, paths in contents.stations.items():
        stream, rejected = read_station(paths, contents.inventory, name)
        assert rejected == ()
        assert len(stream) == 3
        for trace in stream:
            (sent,) = simulation.stream.select(id=trace.id)
            # MiniSEED keeps whole counts exactly and the start to 100 us, here to the microsecond
            # in blockette 1001
            assert np.array_equal(trace.data, sent.data)
            assert abs(trace.stats.starttime - sent.stats.starttime) < 1e-6
            assert trace.stats.coordinates == sent.stats.coordinates


def test_the_window_and_the_circle_are_those_of_the_event(server: FdsnServer, ask: Ask):
    fetched = ask(before=10, after=20, radius=50_000.0)
    origin = fetched.event.event.origins[0]
    assert fetched.wanted.start == origin.time - 10
    assert fetched.wanted.end == origin.time + 20
    # the one list of stations that was asked for
    lists = [request for request in server.requests if request.service == "station"]
    (listed,) = [request.parameters for request in lists if request.subject == "*"]
    # 50 km on a sphere of 6371 km, six digits
    assert float(listed["maxradius"]) == pytest.approx(np.rad2deg(50 / 6371), rel=1e-5)
    assert float(listed["latitude"]) == origin.latitude
    assert float(listed["longitude"]) == origin.longitude


def test_place_and_time_need_no_event(server: FdsnServer, ask: Ask, simulation: Simulation):
    start = simulation.event.origins[0].time
    place = simulation.inventory[0][1]
    fetched = ask(
        event_id=None,
        latitude=place.latitude,
        longitude=place.longitude,
        radius=10.0,  # m: only the station that stands there
        start=str(start),
        end=str(start + 30),
    )
    assert fetched.event is None
    assert names(fetched) == ["XX.S002"]
    assert server.asked("event") == 0


def test_a_larger_circle_fetches_only_what_is_new(
    server: FdsnServer, ask: Ask, simulation: Simulation
):
    place = {
        "latitude": simulation.inventory[0][1].latitude,
        "longitude": simulation.inventory[0][1].longitude,
    }
    assert names(ask(**place, radius=10.0)) == ["XX.S002"]
    assert names(ask(**place, radius=100_000.0)) == STATIONS
    assert server.asked("dataselect") == len(STATIONS)
    assert names(ask(**place, radius=10.0)) == [
        "XX.S002"
    ]  # what others have brought is not taken for wanted


def test_codes_select(ask: Ask):
    fetched = ask(
        networks=("YY", "X?"), stations=("S001", "*3"), channels=("HNE", "HNN"), locations=("--",)
    )
    contents = fetched_stations(fetched)
    assert list(contents.stations) == ["XX.S001", "XX.S003"]
    stream, _ = read_station(contents.stations["XX.S001"], contents.inventory, "XX.S001")
    assert sorted(trace.stats.channel for trace in stream) == ["HNE", "HNN"]


#: faults that a time-out ends; the others must not depend on how busy the machine is
TIMED = ("stalled body", "no answer in time")

PASSING = {
    "429": (status(429),),
    "500": (status(500),),
    "502": (status(502),),
    "503": (status(503),),
    "504": (status(504),),
    "cut body": (cut,),
    "stalled body": (stalled(1.5),),
    "no answer in time": (late(1.5),),
    "one after the other": (status(503), cut, status(429)),
}


@pytest.mark.parametrize(
    ("fault", "service", "subject"),
    [(fault, "dataselect", "S002") for fault in PASSING]
    + [
        ("one after the other", *asked)
        for asked in (("station", "S002"), ("station", "*"), ("event", "*"))
    ],
)
def test_a_fault_that_passes_costs_a_retry_and_loses_nothing(server, ask, fault, service, subject):
    server.fail(service, subject, *PASSING[fault])
    fetched = ask(timeout=1.0 if fault in TIMED else 10.0)
    assert (names(fetched), fetched.rejected) == (STATIONS, ())
    assert server.asked(service, subject) == 1 + len(PASSING[fault])
    assert server.faults == []


def test_a_slow_answer_is_waited_for(server: FdsnServer, ask: Ask):
    server.fail(
        "dataselect", "S002", dripping(0.3, parts=5)
    )  # 1.2 s in all, but never 1 s without a byte
    assert names(ask(timeout=1.0)) == STATIONS
    assert server.asked("dataselect", "S002") == 1


def test_retry_after_is_honoured(server: FdsnServer, ask: Ask):
    server.fail("dataselect", "S002", status(429, Retry_After="1"))
    assert names(ask()) == STATIONS
    moments = [
        moment
        for request, moment in zip(server.requests, server.times, strict=True)
        if (request.service, request.subject) == ("dataselect", "S002")
    ]
    # without the header the first retry comes at once
    assert moments[1] - moments[0] >= 1.0


def test_waits_double(server: FdsnServer, ask: Ask):
    server.fail("station", "*", *[status(503)] * 3)
    ask(wait=0.1)
    moments = [
        moment
        for request, moment in zip(server.requests, server.times, strict=True)
        if request.subject == "*"
    ][-4:]
    # nothing, then 0.2 and 0.4 s
    assert np.diff(moments)[1] >= 0.2
    assert np.diff(moments)[2] >= 0.4


LASTING = {
    "500": (status(500), "HTTP 500: the service is unwell"),
    "403": (status(403), "HTTP 403"),
    "413": (status(413), "refuses to answer so much at once (HTTP 413)"),
    "cut body": (cut, "IncompleteRead"),
    "stalled body": (stalled(1.5), "Read timed out"),
}


@pytest.mark.parametrize("fault", LASTING)
def test_a_fault_that_stays_costs_its_station_and_is_the_reason(server, ask, fault):
    answer, reason = LASTING[fault]
    server.fail("dataselect", "S002", *[answer] * 6)
    fetched = ask(retries=1, timeout=1.0 if fault in TIMED else 10.0)
    assert names(fetched) == ["XX.S001", "XX.S003", "XX.S004"]
    (rejection,) = fetched.rejected
    assert (rejection.kind, rejection.name) == ("station", "XX.S002")
    assert reason in rejection.reasons[0]
    # the next fetch asks for this station only
    server.faults.clear()
    assert names(ask()) == STATIONS
    assert {server.asked("dataselect", name) for name in ("S001", "S003", "S004")} == {1}


@pytest.mark.parametrize("wrong", [b"<html>log in first</html>", b"", b"<FDSNStationXML>"])
def test_records_without_metadata_are_kept_until_it_comes(
    server: FdsnServer, ask: Ask, wrong: bytes
):
    server.fail("station", "S002", content(wrong))
    fetched = ask()
    assert names(fetched) == ["XX.S001", "XX.S003", "XX.S004"]
    assert [rejection.name for rejection in fetched.rejected] == ["XX.S002"]
    ask(again=True)
    assert server.asked("dataselect", "S002") == 1
    assert server.asked("station", "S002") == 2


def test_another_stations_records_are_refused(server: FdsnServer, ask: Ask):
    server.fail("dataselect", "S002", content(mseed(server.stream.select(station="S001").copy())))
    (rejection,) = ask().rejected
    assert "answers with XX.S001 instead of XX.S002" in rejection.reasons[0]
    # wrong content is no reason to ask again at once
    assert server.asked("dataselect", "S002") == 1


@pytest.mark.parametrize("subject", ["station", "event"])
def test_an_empty_list_or_event_is_no_answer(server: FdsnServer, ask: Ask, subject: str):
    server.fail(subject, "*", empty)
    with pytest.raises(ServiceError, match='which is not "no data"'):
        ask()
    assert names(ask()) == STATIONS


def test_a_file_in_the_cache_of_another_time_is_a_row(ask: Ask):
    fetched = ask()
    # As a version that did not compare has left it: the hash is right, the year is not
    file = fetched.folder / "XX.S002.mseed"
    file.write_bytes(mseed(moved(-365 * 86400.0)(read(str(file)))))
    status_file = file.with_suffix(".json")
    known = json.loads(status_file.read_text())
    known["outputs"][file.name] = file_hash(file)
    status_file.write_text(json.dumps(known))
    contents = fetched_stations(fetched)
    assert list(contents.stations) == [name for name in STATIONS if name != "XX.S002"]
    (row,) = contents.rejected
    assert (row.name, "of another time" in row.reasons[0]) == ("XX.S002", True)


def test_channels_that_are_left_out_of_an_answer_are_rows(server: FdsnServer, ask: Ask):
    def with_stray(stream):
        stray = stream[0].copy()
        stray.stats.starttime -= 5 * 3600
        return Stream([stray, *stream])

    server.fail("dataselect", "S003", changed(with_stray))
    for fetched in (ask(), ask()):
        contents = fetched_stations(fetched)
        assert list(contents.stations) == STATIONS
        (row,) = contents.rejected
        assert (row.kind, row.name[:7]) == ("record", "XX.S003")
        assert "are left out of the answer" in row.reasons[0]


@pytest.mark.parametrize(
    ("field", "value"),
    [(4, "nan"), (5, ""), (15, "x"), (15, "2023-13-01T00:00:00"), (3, ""), (4, "91"), (1, "\xff")],
)
def test_a_wrong_line_of_a_list_costs_no_other_line(server: FdsnServer, ask: Ask, field, value):
    head, *lines = server.fdsn_list().decode().splitlines()
    cells = next(line for line in lines if "|S002|" in line).split("|")
    cells[field] = value
    bad = "|".join(cells).encode("latin-1")
    server.fail("station", "*", content(b"\n".join([head.encode(), bad, *map(str.encode, lines)])))
    fetched = ask()
    assert names(fetched) == STATIONS
    (row,) = fetched.rejected
    assert row.kind == "station"
    assert row.row == (2 if field != 1 else None)


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("1990-01-01T00:00:00|", "1990-01-01T00:00:00|1995-01-01T00:00:00", "of another time"),
        ("|HN", "|BH", "of another channel"),
        ("|S0", "|T0", "which the request does not cover"),
    ],
)
def test_a_list_of_nothing_that_was_asked_for_is_a_fault(server, ask: Ask, old, new, problem):
    wrong = server.fdsn_list().decode().replace(old, new).encode()
    server.fail("station", "S00?", content(wrong))
    with pytest.raises(ServiceError, match=problem):
        ask(stations=("S00?",))
    assert names(ask(stations=("S00?",))) == STATIONS


def test_no_data_is_a_reason_and_is_asked_for_again_on_demand_only(server: FdsnServer, ask: Ask):
    server.fail("dataselect", "S002", status(204))
    fetched = ask()
    assert names(fetched) == ["XX.S001", "XX.S003", "XX.S004"]
    assert fetched.rejected[0].reasons == (
        f"127.0.0.1:{server.server_port} has no data of the window",
    )
    # a complete request asks for nothing
    asked = len(server.requests)
    assert ask() == fetched
    assert len(server.requests) == asked
    assert names(ask(again=True)) == STATIONS
    assert server.asked("dataselect") == len(STATIONS) + 1


def test_a_request_that_is_too_large_is_asked_for_channel_by_channel(server: FdsnServer, ask: Ask):
    server.fail("dataselect", "S002", status(413))
    contents = fetched_stations(ask())
    stream, _ = read_station(contents.stations["XX.S002"], contents.inventory, "XX.S002")
    assert sorted(trace.stats.channel for trace in stream) == ["HNE", "HNN", "HNZ"]
    assert server.asked("dataselect", "S002") == 4


def test_the_next_provider_serves_what_the_first_cannot(
    server: FdsnServer, simulation: Simulation, ask: Ask
):
    with serving(simulation) as second:
        server.fail("dataselect", "S002", status(204))
        server.fail("dataselect", "S003", *[status(500)] * 2)
        fetched = ask(providers=(server.url, second.url), retries=1)
    assert (names(fetched), fetched.rejected) == (STATIONS, ())
    # the second is asked for what the first has not
    records = [request for request in second.requests if request.service == "dataselect"]
    assert [request.subject for request in records] == ["S002", "S003"]


def test_a_provider_that_is_down_is_one_row_and_the_other_serves(server: FdsnServer, ask: Ask):
    fetched = ask(providers=("http://127.0.0.1:1", server.url), retries=0)
    assert names(fetched) == STATIONS
    (rejection,) = fetched.rejected
    assert (rejection.kind, rejection.name) == ("service", "127.0.0.1:1")
    assert "no answer" in rejection.reasons[0]


#: Answers of routers, with the URL of the service.
ROUTES = {
    "eida-routing": """\
{url}/fdsnws/station/1/query
XX * * * 1990-01-01T00:00:00 2000-01-01T00:00:00
""",
    "earthscope-federator": """\
DATACENTER=A,http://a
STATIONSERVICE={url}/fdsnws/station/1/
XX S001 -- HNE 1990 2000
""",
}


@pytest.mark.parametrize("router", ROUTES)
def test_routers_name_the_services(server: FdsnServer, ask: Ask, monkeypatch, router: str):
    _, *rest = providers.ROUTERS[router]
    monkeypatch.setitem(providers.ROUTERS, router, (f"{server.url}/route", *rest))
    server.extra["/route"] = ROUTES[router].format(url=server.url).encode()
    assert names(ask(providers=(router,))) == STATIONS
    # the channels select what the router has
    (asked,) = [request for request in server.requests if request.service == "/route"]
    assert asked.parameters["channel"] == "HN?,BN?,CN?,EN?"


def test_unknown_providers_and_events_are_wrong_input(ask: Ask):
    with pytest.raises(CatalogError, match="NOWHERE: is neither a base URL, nor a router"):
        ask(providers=("NOWHERE",))
    with pytest.raises(CatalogError, match="has no event yy9"):
        ask(event_id="yy9")


def test_an_event_that_is_none_is_not_kept(server: FdsnServer, ask: Ask):
    server.fail("event", "*", content(b"<html>"))
    with pytest.raises(ServiceError, match="data other than the event"):
        ask()
    assert names(ask()) == STATIONS


def test_services_that_fail_altogether_are_unavailable(server: FdsnServer, ask: Ask):
    server.fail("station", "*", *[status(503)] * 2)
    with pytest.raises(ServiceError, match=r"no station could be fetched; .*HTTP 503"):
        ask(retries=1)


def test_what_is_in_the_cache_serves_when_services_fail(server: FdsnServer, ask: Ask):
    server.fail("dataselect", "S002", status(204))
    ask()
    server.fail("station", "*", *[status(503)] * 2)
    fetched = ask(again=True, retries=1)
    assert names(fetched) == ["XX.S001", "XX.S003", "XX.S004"]
    assert fetched.rejected[0].kind == "service"


def test_no_station_is_a_reason(server: FdsnServer, ask: Ask):
    fetched = ask(stations=("NOBODY",))
    assert names(fetched) == []
    assert "no station within" in fetched.rejected[0].reasons[0]
    assert server.asked("dataselect") == 0


def test_a_window_that_is_not_over_is_fetched_later(server: FdsnServer, ask: Ask):
    end = UTCDateTime() + 60
    with pytest.raises(ServiceError, match="is still to come"):
        ask(start=str(end - 300), end=str(end))
    assert server.asked("station") == 0


#: Fetches in a process of its own.
FETCHES = """
import sys
from per_obspy.config import Fdsn
from per_obspy.records.fdsn.cache import fetch
fetch(Fdsn.model_validate_json(sys.argv[1]))
"""


@pytest.fixture
def killed(server: FdsnServer, tmp_path: Path) -> int:
    """Kill a fetch while it waits for the third station, and return the number of its process."""
    request = request_to(server, tmp_path, connections=1, timeout=30.0)
    server.fail("dataselect", "S003", late(20.0))
    process = subprocess.Popen([sys.executable, "-c", FETCHES, request.model_dump_json()])
    while not server.asked("dataselect", "S003"):
        assert process.poll() is None
        time.sleep(0.02)
    # no handler of the process runs
    process.send_signal(signal.SIGKILL)
    process.wait()
    return process.pid


def test_a_killed_fetch_goes_on_where_it_stopped(
    server: FdsnServer, ask: Ask, tmp_path: Path, killed: int
):
    (folder,) = [path for path in tmp_path.iterdir() if path.is_dir()]
    assert {path.stem for path in folder.glob("*.mseed")} == {"XX.S001", "XX.S002"}
    # as a kill while writing would leave it
    part = folder / f".XX.S003.{killed}.part.mseed"
    part.write_bytes((folder / "XX.S001.mseed").read_bytes()[:1000])
    fetched = ask(connections=1)
    assert (names(fetched), fetched.rejected) == (STATIONS, ())
    # what had arrived is not asked for again, and half a file is gone
    counts = {name: server.asked("dataselect", name) for name in ("S001", "S002", "S003", "S004")}
    assert counts == {"S001": 1, "S002": 1, "S003": 2, "S004": 1}
    assert not part.exists()


def test_half_a_file_is_no_record(ask: Ask):
    # that of a process which is still running
    fetched = ask()
    whole = fetched.folder / "XX.S001.mseed"
    part = fetched.folder / f".XX.S001.{os.getpid()}.part.mseed"
    part.write_bytes(whole.read_bytes()[:1000])
    found = fetched_stations(fetched)
    assert found.stations["XX.S001"] == (whole,)
    assert part.exists()
    assert found.hashes[whole] == file_hash(whole)


@pytest.mark.parametrize("content", ["", "[]", '[["station", "XX.S002", "FDSN", null, ["why"]]]'])
def test_a_damaged_status_asks_again(server: FdsnServer, ask: Ask, tmp_path: Path, content: str):
    # would catch a run that ends with the status of a killed or of an older program
    ask()
    asked = server.asked("dataselect")
    (status_file,) = tmp_path.glob("complete-*.json")
    status_file.write_text(content)
    fetched = ask()
    assert (names(fetched), fetched.rejected) == (STATIONS, ())
    # files that have arrived stay
    assert server.asked("dataselect") == asked
    assert json.loads(status_file.read_text())["rejected"] == []


@pytest.mark.parametrize("code", ["../../victim", "/victim", "..", "A" * 70])
def test_codes_of_a_list_that_name_no_file_are_a_row(
    server: FdsnServer, ask: Ask, tmp_path: Path, code: str
):
    (tmp_path / "cache").mkdir()
    (tmp_path / "victim.mseed").write_text("valuable")
    whole_list = server.fdsn_list().replace(b"|S002|", f"|{code}|".encode())
    server.fail("station", "*", content(whole_list))
    fetched = ask(cache=tmp_path / "cache")
    assert names(fetched) == ["XX.S001", "XX.S003", "XX.S004"]
    (row,) = fetched.rejected
    assert row.reasons[0].startswith("station code")
    assert server.asked("dataselect") == 3
    # nothing outside the cache, and the row is a property of the list: no second request
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cache", "victim.mseed"]
    assert (tmp_path / "victim.mseed").read_text() == "valuable"
    asked = len(server.requests)
    assert ask(cache=tmp_path / "cache").rejected == fetched.rejected
    assert len(server.requests) == asked


def spoiled(path: Path, how: str) -> None:
    """Cut a file at a MiniSEED record, change a byte of it, or remove it."""
    whole = path.read_bytes()
    if how == "gone":
        path.unlink()
    else:
        changed = whole[:700] + bytes([whole[700] ^ 1]) + whole[701:]
        path.write_bytes(whole[: len(whole) // 2 // 512 * 512] if how == "cut" else changed)


@pytest.mark.parametrize("how", ["cut", "changed", "gone"])
@pytest.mark.parametrize("suffix", ["mseed", "xml"])
def test_a_damaged_file_is_fetched_again(server: FdsnServer, ask: Ask, suffix: str, how: str):
    path = ask().folder / f"XX.S002.{suffix}"
    whole, before = path.read_bytes(), len(server.requests)
    spoiled(path, how)
    # offline, it is a row and never a record
    server.fail("station", "*", status(503))
    offline = fetched_stations(ask(retries=0))
    assert list(offline.stations) == ["XX.S001", "XX.S003", "XX.S004"]
    assert f"XX.S002.{suffix} is not as it was fetched" in offline.rejected[-1].reasons[0]
    # only its own file is asked for again, after the two lists
    found = fetched_stations(ask())
    assert (list(found.stations), found.rejected) == (STATIONS, ())
    assert len(server.requests) == before + 3
    if suffix == "mseed":
        assert path.read_bytes() == whole


def test_all_files_damaged_are_rows(ask: Ask):
    fetched = ask()
    for name in STATIONS:
        spoiled(fetched.folder / f"{name}.mseed", "cut")
    found = fetched_stations(fetched)
    assert (found.stations, [row.name for row in found.rejected]) == ({}, STATIONS)


@pytest.mark.parametrize("rejected", [None, 1, "why", [1], [["station"]], [None]])
def test_a_complete_status_of_other_content_asks_again(ask: Ask, tmp_path: Path, rejected):
    ask()
    (status_file,) = tmp_path.glob("complete-*.json")
    known = json.loads(status_file.read_text())
    status_file.write_text(json.dumps(known | {"rejected": rejected}))
    assert (names(ask()), ask().rejected) == (STATIONS, ())


def test_a_damaged_event_is_fetched_again(server: FdsnServer, ask: Ask, tmp_path: Path):
    ask()
    (path,) = tmp_path.glob("event-*.xml")
    path.write_bytes(path.read_bytes()[:300])
    assert names(ask()) == STATIONS
    assert server.asked("event") == 2


def test_records_end_with_the_window(ask: Ask):
    fetched = ask(before=10, after=20)
    for paths in fetched_stations(fetched).stations.values():
        for trace in read_station(paths, None)[0]:
            assert trace.stats.starttime >= fetched.wanted.start
            assert trace.stats.endtime <= fetched.wanted.end


def test_nothing_is_fetched_twice(server: FdsnServer, ask: Ask):
    first = ask()
    asked = len(server.requests)
    assert server.asked("dataselect") == len(STATIONS)
    assert ask() == first
    assert len(server.requests) == asked


def test_records_of_another_year_are_refused_and_counted(server: FdsnServer, ask: Ask):
    for name in STATIONS[1:]:
        server.fail("dataselect", name[3:], changed(moved(-365 * 86400.0)))
    first = ask()
    assert names(first) == STATIONS[:1]
    rows = fetched_stations(first).rejected
    assert [row.name for row in rows] == STATIONS[1:]
    assert all("of another time" in row.reasons[0] for row in rows)
    # the fault may pass: the rest is asked for again, and only that
    assert not first.is_complete
    assert names(ask()) == STATIONS
    assert server.asked("dataselect", "S001") == 1


def test_an_empty_answer_is_asked_again_and_no_answer_of_no_data(server: FdsnServer, ask: Ask):
    server.fail("dataselect", "S002", empty)
    first = ask()
    (row,) = first.rejected
    assert (row.name, first.is_complete) == ("XX.S002", False)
    assert 'which is not "no data"' in row.reasons[0]
    assert names(ask()) == STATIONS


def test_a_short_line_of_a_list_costs_no_other_line(server: FdsnServer, ask: Ask):
    lines = server.fdsn_list().splitlines()
    server.fail("station", "*", content(b"\n".join([lines[0], lines[1][:20], *lines[1:]])))
    fetched = ask()
    assert names(fetched) == STATIONS
    assert "columns, expected 17" in fetched.rejected[0].reasons[0]


def test_the_status_has_the_reasons_why_stations_are_missing(
    server: FdsnServer, ask: Ask, tmp_path: Path
):
    server.fail("dataselect", "S002", status(204))
    fetched = ask()
    (status_file,) = tmp_path.glob("complete-*.json")
    assert json.loads(status_file.read_text())["rejected"][0][:2] == ["station", "XX.S002"]
    assert ask().rejected == fetched.rejected


def test_the_channels_that_were_asked_for_are_kept(ask: Ask):
    status = json.loads((ask().folder / "XX.S001.json").read_text())
    assert sorted(status["channels"]) == [["", "HNE"], ["", "HNN"], ["", "HNZ"]]
    assert sorted(status["outputs"]) == ["XX.S001.mseed", "XX.S001.xml"]
