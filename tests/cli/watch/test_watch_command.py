"""Exit codes and lines of ``per_obspy.cli.watch``."""

import pytest
from fdsn_server import content, serving, status
from watched_city import city_earthquake, write_city

from per_obspy.watch import event_feed, watch


@pytest.fixture
def server():
    with serving(city_earthquake(stations=1)) as running:
        yield running


@pytest.fixture
def city(server, tmp_path, monkeypatch):
    monkeypatch.setattr(event_feed, "_PATIENCE", (10.0, 0, 0.01, 10.0, 64 * 2**20))
    return write_city(tmp_path, server)


def lines(text: str) -> list[str]:
    return [line for line in text.splitlines() if line.startswith("per-obspy: ")]


def test_without_earthquakes_it_ends_with_0(call, city, server):
    # The earthquake of the city was in 2000
    assert call("watch", city, "--once")[0] == 0
    assert server.asked("event") == 1
    assert (city.parent / "out" / "status.json").is_file()


@pytest.mark.parametrize("fault", [status(503, Retry_After="300"), content(b"<html>busy</html>")])
def test_a_service_that_fails_is_one_line_and_75(call, city, server, fault):
    server.fail("event", "*", fault)
    code, _, err = call("watch", city, "--once")
    assert (code, len(lines(err))) == (75, 1)


def test_an_unknown_service_is_one_line_and_2(call, city, server):
    text = city.read_text().replace(f'service = "{server.url}"', 'service = "USSGS"')
    city.write_text(text)
    code, _, err = call("watch", city, "--once")
    assert (code, len(lines(err))) == (2, 1)
    assert "USSGS" in err
    assert server.requests == []


def test_a_file_that_is_no_quakeml_is_one_line_and_2(call, city, server, tmp_path):
    import os

    (tmp_path / "feed").mkdir()
    (tmp_path / "feed" / "a.xml").write_text("<html/>")
    os.utime(tmp_path / "feed" / "a.xml", (1e9, 1e9))
    city.write_text(city.read_text().replace(f'service = "{server.url}"', 'folder = "feed"'))
    code, _, err = call("watch", city, "--once")
    assert (code, len(lines(err))) == (2, 1)
    assert "a.xml: is no QuakeML" in err


def test_a_folder_that_cannot_be_made_is_one_line(call, city):
    (city.parent / "out").write_text("a file")
    code, _, err = call("watch", city, "--once")
    assert (code, len(lines(err))) == (2, 1)


def test_pairs_that_are_missing_are_one_line_and_2(call, city):
    (city.parent / "pairs.csv").unlink()
    code, _, err = call("watch", city, "--once")
    assert (code, len(lines(err))) == (2, 1)
    assert "pairs.csv" in err


def test_a_cluster_is_that_of_every_run(call, city, monkeypatch):
    pytest.importorskip("distributed")
    seen = []

    def noted(settings, **_):
        seen.append(settings.engine.dask)
        return watch.Pass((), 0, watch.utc_now())

    monkeypatch.setattr(watch, "watch_once", noted)
    assert call("watch", city, "--once", "--dask", "local:2")[0] == 0
    assert seen == ["local:2"]
    code, _, err = call("watch", city, "--once", "--dask", "nowhere")
    assert (code, len(lines(err))) == (2, 1)
    assert "--dask" in err
