"""A watched city with services on loopback, whose runs are quick."""

import pytest
from fdsn_server import serving
from watched_city import City, FakeClock, city_earthquake, quick_run

from per_obspy.watch import event_feed, event_run

from ..runs.small_run import InProcess


@pytest.fixture(scope="module")
def simulation():
    return city_earthquake(stations=2)


@pytest.fixture
def server(simulation):
    with serving(simulation) as running:
        yield running


@pytest.fixture
def clock():
    return FakeClock()


@pytest.fixture
def city(tmp_path, server, clock, monkeypatch):
    monkeypatch.setattr(event_run, "run", quick_run)
    monkeypatch.setattr(event_feed, "_PATIENCE", (10.0, 1, 0.01, 10.0, 64 * 2**20))
    return City(tmp_path, server, clock, InProcess())
