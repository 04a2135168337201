"""Fetching alone: the cache of a configuration is filled, and nothing else happens."""

import pytest
from fdsn_server import serving, status

from per_obspy.config import Scenario
from per_obspy.errors import CatalogError
from per_obspy.pipeline.fetch import fetch_configured
from per_obspy.records.simulation.earthquake import simulate

CONFIGURATION = """\
name = "x"
output = "out"
[pairs]
file = "pairs.csv"
[records.fdsn]
providers = ["{url}"]
cache = "cache"
event_id = "xx1"
event_provider = "{url}"
wait = 0.01
"""


@pytest.fixture
def server():
    with serving(simulate(Scenario(stations=2, dt=0.02, magnitude=5.0))) as running:
        yield running


@pytest.fixture
def configuration(server, tmp_path):
    (tmp_path / "run.toml").write_text(CONFIGURATION.format(url=server.url))
    return tmp_path / "run.toml"


def test_the_cache_is_filled_once(server, configuration, tmp_path):
    steps = []
    result = fetch_configured(configuration, progress=lambda *step: steps.append(step))
    assert result.stations == ["XX.S001", "XX.S002"]
    assert result.rejected == ()
    assert steps[-1] == ("fetching", 2, 2)
    # neither results nor further requests
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cache", "run.toml"]
    asked = len(server.requests)
    assert fetch_configured(configuration) == result
    assert len(server.requests) == asked


def test_stations_without_data_are_asked_for_again_on_demand(server, configuration):
    server.fail("dataselect", "S002", status(204))
    result = fetch_configured(configuration)
    assert result.stations == ["XX.S001"]
    assert [row.name for row in result.rejected] == ["XX.S002"]
    assert fetch_configured(configuration, again=True).stations == ["XX.S001", "XX.S002"]


def test_a_configuration_without_services_is_refused(tmp_path):
    text = 'name = "x"\noutput = "out"\n[records]\nfolder = "records"\n[pairs]\nfile = "p.csv"\n'
    (tmp_path / "run.toml").write_text(text)
    with pytest.raises(CatalogError, match=r"run\.toml: has no section \[records\.fdsn\]"):
        fetch_configured(tmp_path / "run.toml")
