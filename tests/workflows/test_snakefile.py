"""The Snakemake workflow on the smoke data: two scenarios of one run each, joined."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytest.importorskip("snakemake", reason="an extra: per_obspy[workflows]; `make workflows` has it")

CHECKOUT = Path(__file__).parents[2]
SCENARIO = "[scenario]\nstations = 1\ndt = 0.02\nmagnitude = {}\n[pairs]\ncount = 4\n"
RUN = 'name = "{0}"\noutput = "out/{0}"\nsimulation = "{0}_scenario.toml"\n[spectra]\ncount = 10\n'
ENSEMBLE = 'name = "both"\noutput = "out/both"\n'


@pytest.fixture
def folder(tmp_path):
    text = ENSEMBLE
    for name, magnitude in (("near", 6.5), ("far", 7.0)):
        (tmp_path / f"{name}_scenario.toml").write_text(SCENARIO.format(magnitude))
        (tmp_path / f"{name}.toml").write_text(RUN.format(name))
        text += f'[[scenario]]\nname = "{name}"\nrun = "{name}.toml"\nweight = 1.0\n'
    (tmp_path / "ensemble.toml").write_text(text)
    return tmp_path


def started(folder, *options):
    """Start the workflow in a session of its own, so that all of its processes can be killed."""
    program = f"program={sys.executable} -m per_obspy"
    command = ["-s", str(CHECKOUT / "workflows" / "Snakefile"), "--nolock", "--cores", "1"]
    configured = ["--config", "ensemble=ensemble.toml", program]
    paths = os.pathsep.join([str(CHECKOUT), os.environ.get("PYTHONPATH", "")])
    return subprocess.Popen(
        [sys.executable, "-m", "snakemake", *command, *options, *configured],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": paths},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )


def said(process):
    """Return the output of a workflow that ends well."""
    output, _ = process.communicate(timeout=900)
    assert process.returncode == 0, output
    return output


def test_a_workflow_that_was_killed_goes_on(folder):
    # a trial shows the jobs and does none
    trial = said(started(folder, "-n"))
    assert all(f"output/done/{name}" in trial for name in ("near.run", "far.run"))
    assert "output/done/ensemble.ensemble" in trial
    assert not (folder / "out").exists()

    # killed at once with everything that it has started, in the middle of its first run
    killed = started(folder)
    for _ in range(2400):
        if list(folder.glob("out/*/stations/*.json")):
            break
        time.sleep(0.1)
    os.killpg(killed.pid, signal.SIGKILL)
    killed.communicate(timeout=60)
    assert not (folder / "out" / "both").exists()
    (station,) = folder.glob("out/*/stations/*.json")
    before = station.stat().st_mtime_ns

    # the rest; the station is not done again
    said(started(folder))
    assert (folder / "out" / "both" / "ensemble.json").exists()
    assert station.stat().st_mtime_ns == before
    assert "Nothing to be done" in said(started(folder, "-n"))
