"""Requests to FDSN services: circle, window and codes, and the services that routers name."""

from pathlib import Path

import numpy as np
import pytest
from obspy import UTCDateTime
from obspy.core.event import Event, Origin
from obspy.core.inventory import Inventory, Network, Station

from per_obspy.config import Fdsn
from per_obspy.errors import CatalogError, ServiceError
from per_obspy.records.fdsn import providers
from per_obspy.records.fdsn.providers import base_urls
from per_obspy.records.fdsn.request import (
    channel_parameters,
    digest,
    folder_name,
    station_parameters,
    stations_inside,
    wanted_around,
    window,
)
from per_obspy.records.fdsn.web import WebPool

ORIGIN = UTCDateTime(2020, 1, 1, 12)
EVENT = Event(origins=[Origin(time=ORIGIN, latitude=10.0, longitude=20.0)])


def request(**changes: object) -> Fdsn:
    given = {"providers": ("http://a.example",), "event_id": "xx1", "event_provider": "USGS"}
    given |= {"radius": 1e5, "before": 30.0, "after": 90.0, "locations": ("--", "00")}
    return Fdsn(cache=Path("cache"), **given | changes)


def test_parameters_are_those_of_the_services():
    wanted = wanted_around(request(networks=("XX", "Y*"), channels=("HN?",)), EVENT)
    parameters = station_parameters(wanted)
    assert (parameters["latitude"], parameters["longitude"]) == ("10", "20")
    assert (parameters["network"], parameters["location"]) == ("XX,Y*", "--,00")
    assert parameters["starttime"] == "2020-01-01T11:59:30.000000"
    # The parameters of one station lack the circle
    assert channel_parameters(wanted).keys() == {"location", "channel", "starttime", "endtime"}


def test_a_folder_belongs_to_window_and_channels():
    wanted = wanted_around(request(), EVENT)
    assert folder_name(wanted).startswith("20200101T115930-20200101T120130-")
    # elsewhere with the same window: the same records of a station
    assert folder_name(wanted._replace(latitude=0.0, radius=5.0)) == folder_name(wanted)
    assert folder_name(wanted._replace(channels=("BN?",))) != folder_name(wanted)
    assert digest(("a", "b")) != digest(("ab",))


def test_stations_inside_match_codes_and_circle():
    places = {"NEAR": (10.0, 20.5), "FAR": (10.0, 21.5), "OTHER": (10.0, 20.1)}
    stations = [Station(code, *place, elevation=0.0) for code, place in places.items()]
    networks = [Network(code, stations=stations) for code in ("XX", "YY")]
    inventory = Inventory(networks, source="test")
    # The radius is 0.9 degrees
    wanted = wanted_around(request(networks=("X?",), stations=("NEAR", "F*")), EVENT)
    assert stations_inside(inventory, wanted) == {"XX.NEAR"}


def test_a_router_that_does_not_answer_is_a_rejection(monkeypatch):
    def answered(*_: object) -> bytes:
        raise ServiceError("no answer")

    monkeypatch.setattr(providers, "answer", answered)
    urls, (rejection,) = base_urls(WebPool(1.0, 0, 0.0), ["eida-routing", "http://a.example"], {})
    assert urls == ["http://a.example"]
    assert (rejection.name, rejection.reasons) == ("eida-routing", ("no answer",))


KILOMETRES_PER_DEGREE = np.pi * 6371.0 / 180.0


def test_missing_place_and_window_are_those_of_the_event():
    wanted = wanted_around(request(), EVENT)
    assert (wanted.latitude, wanted.longitude) == (10.0, 20.0)
    assert (wanted.start, wanted.end) == (ORIGIN - 30, ORIGIN + 90)
    assert wanted.radius == pytest.approx(100.0 / KILOMETRES_PER_DEGREE, rel=1e-6)


def test_place_and_window_need_no_event():
    times = {"start": "2021-05-06T07:08:09", "end": "2021-05-06T07:09:00"}
    wanted = wanted_around(request(latitude=-1.0, longitude=2.0, **times), None)
    assert (wanted.latitude, wanted.longitude) == (-1.0, 2.0)
    assert wanted.end - wanted.start == 51.0


def test_a_window_must_end_after_its_start():
    with pytest.raises(CatalogError, match="window: must end after its start, got 2020-01-01T11"):
        window(request(end="2020-01-01T11:00:00"), EVENT)
