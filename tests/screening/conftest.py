"""A station with a record."""

import pytest
from screening_samples import make_station


@pytest.fixture(scope="session")
def station():
    return make_station()
