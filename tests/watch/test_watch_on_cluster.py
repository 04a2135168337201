"""A watcher on a Dask cluster: its scheduler may end during a task, and the next pass goes on."""

import json

import pytest
from fdsn_server import serving
from watched_city import City, FakeClock, city_earthquake

from per_obspy.config.engine import Engine
from per_obspy.errors import TryLater

from ..runs.small_run import InProcess, plain_figures

distributed = pytest.importorskip("distributed", reason="an extra: per_obspy[dask]")

pytestmark = pytest.mark.long


@pytest.fixture
def server():
    with serving(city_earthquake(stations=2)) as running:
        yield running


def test_a_scheduler_that_ends_during_a_task_is_retried_at_the_next_pass(
    server, tmp_path, monkeypatch
):
    started = []
    start = distributed.LocalCluster
    monkeypatch.setattr(
        distributed,
        "LocalCluster",
        lambda **options: started.append(start(**options)) or started[-1],
    )

    def ending(stage, done, _):
        # One station is done, the next one is under way
        if (stage, done, len(started)) == ("stations", 1, 1):
            started[0].close()

    city = City(tmp_path, server, FakeClock(), None)
    city.progress = ending
    engine = Engine(dask="local:1", wait=1, retries=1)
    city.settings = city.settings.model_copy(update={"engine": engine})
    with plain_figures():
        (error,) = city.at(201, delays=(200.0,)).errors
        # A fault of the machine, exit code 75, in one line
        assert isinstance(error, TryLater)
        assert "\n" not in str(error)
        assert city.revisions() == []
        # Not before its pause; what the cluster has done is kept
        assert city.at(230, delays=(200.0,)).errors == ()
        assert city.revisions() == []
        city.executor = InProcess()
        assert city.at(265, delays=(200.0,)).errors == ()
    assert (len(started), city.revisions()) == (1, ["0001"])
    counts = json.loads((city.event() / "latest" / "run.json").read_text())["counts"]
    # the worker may have finished the second one before it heard of the end
    assert counts["stations"] == 2
    assert counts["stations_resumed"] in (1, 2)
