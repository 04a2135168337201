"""
Commands with ``--dask``: by an address, a scheduler file, and a cluster of this machine.

``watch`` is in tests/cli/watch/test_watch_command.py.
"""

import re

import pytest

from per_obspy.config import Scenario
from per_obspy.simulation.earthquake import simulate, write_simulation

from ..runs.small_run import plain_figures, write_smallest_configuration

distributed = pytest.importorskip("distributed", reason="an extra: per_obspy[dask]")

ENSEMBLE = (
    'name = "one"\noutput = "one"\n[[scenario]]\nname = "a"\nrun = "run.toml"\nweight = 1.0\n'
)


@pytest.fixture(scope="module")
def places(tmp_path_factory):
    """Return addresses of clusters by kind; the worker of two is a thread with its kernels."""
    file = tmp_path_factory.mktemp("scheduler") / "scheduler.json"
    place = {"n_workers": 1, "threads_per_worker": 1, "processes": False}
    with (
        distributed.LocalCluster(**place, dashboard_address=":0", silence_logs=50) as cluster,
        distributed.Client(cluster, set_as_default=False) as client,
    ):
        client.write_scheduler_file(file)
        yield {"ADDRESS": cluster.scheduler_address, "FILE": file, "local:1": "local:1"}


@pytest.fixture(scope="module")
def records(tmp_path_factory):
    folder = tmp_path_factory.mktemp("records")
    write_simulation(simulate(Scenario(stations=1, dt=0.02, magnitude=6.5)), folder)
    return folder


@pytest.mark.parametrize(
    ("command", "kind"),
    [
        ("run", "FILE"),
        ("screen", "ADDRESS"),
        ("process", "FILE"),
        ("process", "local:1"),
        ("spectra", "ADDRESS"),
    ],
)
def test_a_command_works_on_a_cluster_and_names_its_dashboard(
    command, kind, places, records, tmp_path, call
):
    configuration = write_smallest_configuration(tmp_path)
    (tmp_path / "ensemble.toml").write_text(ENSEMBLE)
    arguments = {
        "run": (configuration,),
        "screen": (tmp_path / "ensemble.toml",),
        "process": (records, "-o", tmp_path / "out"),
        "spectra": (records, "-o", tmp_path / "new" / "spectra.nc", "--count", 5),
    }
    with plain_figures():
        code, _, err = call(command, *arguments[command], "--dask", places[kind])
    assert code == 0, err
    # would catch a command that takes the option and works on this machine
    found = re.findall(r"dask: (\S+), dashboard (http://\S+/status)", err)
    assert [address for address, _ in found] == [str(places[kind])]


@pytest.mark.parametrize("command", ["run", "screen", "process", "spectra"])
def test_what_is_no_scheduler_is_refused_before_any_work(command, records, tmp_path, call):
    configuration = write_smallest_configuration(tmp_path)
    first = configuration if command in ("run", "screen") else records
    output = tmp_path / ("spectra.nc" if command == "spectra" else "out")
    code, _, err = call(command, first, "-o", output, "--dask", "head")
    assert (code, len(err.splitlines())) == (2, 1)
    assert "--dask: 'head' is no scheduler" in err
    assert not output.exists()
