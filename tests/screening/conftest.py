"""Fixtures: a station with a record, as a Dataset and decoded."""

import pytest
from screening_samples import make_station

from per_obspy.screening.station_motion import station_motion


@pytest.fixture(scope="session")
def station():
    return make_station()


@pytest.fixture(scope="session")
def record(station):
    return station_motion(station)
