"""Units of systemd, the line for cron, and the container, as far as no service is needed."""

import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import matplotlib
import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

CHECKOUT = Path(__file__).parents[2]
UNITS = sorted((CHECKOUT / "workflows" / "systemd").iterdir())
SERVICES = [path for path in UNITS if path.suffix == ".service"]
PROGRAM = "/opt/per-obspy/bin/per-obspy"

#: What keeps a service from the rest of the system.
HARDENED = {
    "DynamicUser": "yes",
    "ProtectSystem": "strict",
    "ProtectHome": "yes",
    "PrivateTmp": "yes",
    "NoNewPrivileges": "yes",
    "CapabilityBoundingSet": "",
    "StateDirectory": "per-obspy",
    "KillMode": "mixed",
}

#: Largest exposure that systemd may find, of 10: network and memory that is executed remain.
EXPOSURE = 2.0


@pytest.mark.parametrize("unit", SERVICES, ids=lambda path: path.name)
def test_services_are_hardened_and_end_in_time(unit):
    keys = dict(re.findall(r"(?m)^(\w+)=(.*)$", unit.read_text()))
    assert HARDENED.items() <= keys.items()
    assert {"MemoryMax", "SystemCallFilter", "TasksMax"} <= keys.keys()
    # a watcher ends 5 s after SIGTERM at the latest
    assert int(keys["TimeoutStopSec"].removesuffix("s")) > 10
    assert keys["ExecStart"].startswith(f"{PROGRAM} watch ")


@pytest.mark.skipif(not shutil.which("systemd-analyze"), reason="needs systemd-analyze")
def test_systemd_accepts_the_units(tmp_path):
    # The program itself is not installed here
    for unit in UNITS:
        (tmp_path / unit.name).write_text(unit.read_text().replace(PROGRAM, "/bin/true"))
    files = [str(tmp_path / unit.name) for unit in UNITS]
    command = ["systemd-analyze", "verify", "--man=no", *files]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    assert (done.returncode, done.stdout + done.stderr) == (0, "")
    for file in files:
        if not file.endswith(".service"):
            continue
        command = ["systemd-analyze", "security", "--offline=yes", "--no-pager", file]
        done = subprocess.run(command, check=False, capture_output=True, text=True)
        (exposure,) = re.findall(r"exposure level for \S+: ([\d.]+)", done.stdout)
        assert float(exposure) <= EXPOSURE


def test_the_line_for_cron_works_in_the_environment_of_cron(tmp_path):
    text = (CHECKOUT / "docs" / "operation.md").read_text(encoding="utf-8")
    (line,) = re.findall(r"(?m)^\*/5 \* \* \* \* (.*)$", text)
    # The program that is installed here; the command of the line as it is
    program = tmp_path / "per-obspy" / "bin" / "per-obspy"
    program.parent.mkdir(parents=True)
    run = f'exec "{sys.executable}" -m per_obspy "$@"'
    # The fonts of Matplotlib are searched once per home folder, which takes long
    known = f'MPLCONFIGDIR="{matplotlib.get_cachedir()}" PYTHONPATH="{CHECKOUT}"'
    program.write_text(f"#!/bin/sh\n{known} {run}\n")
    program.chmod(0o755)
    (tmp_path / "town").mkdir()
    environment = ["env", "-i", f"HOME={tmp_path}", "PATH=/usr/bin:/bin"]
    done = subprocess.run(
        [*environment, "sh", "-c", line], check=False, capture_output=True, text=True, cwd="/"
    )
    # There is no configuration: the command is found, is refused, and logs it
    assert done.returncode == 2
    assert "town/run.toml" in done.stderr
    assert "town/run.toml" in (tmp_path / "town" / "per-obspy.log").read_text()


def test_the_container_runs_the_tested_steps_as_a_user_of_no_rights():
    text = (CHECKOUT / "Dockerfile").read_text()
    script = "/src/workflows/container/install.sh"
    steps = [line for line in text.splitlines() if line.startswith("RUN") and "useradd" not in line]
    assert [step.split()[1] for step in steps] == [script] * 3
    assert (
        text.index("install.sh install") < text.index("\nUSER per-obspy") < text.index(" compile ")
    )
    assert "per-obspy status /data" in text
    # Everything that is copied exists and is not ignored
    ignored = (CHECKOUT / ".dockerignore").read_text().splitlines()
    for line in re.findall(r"(?m)^COPY (.*) \S+$", text):
        for name in line.split():
            assert (CHECKOUT / name).exists()
            assert f"!{name}" in ignored
    assert os.access(CHECKOUT / "workflows" / "container" / "install.sh", os.X_OK)


def start(folder: Path, cache: Path, **options) -> subprocess.CompletedProcess[str]:
    """Start a program that prints where its kernels are, as the container does."""
    program = folder / "bin" / "per-obspy"
    program.parent.mkdir(exist_ok=True)
    program.write_text('#!/bin/sh\necho "$NUMBA_CACHE_DIR $*"\n')
    program.chmod(0o755)
    script = CHECKOUT / "workflows" / "container" / "install.sh"
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache), "MPLCONFIGDIR": ""}
    command = [str(script), "start", str(folder), "run", "a b"]
    return subprocess.run(
        command, check=True, capture_output=True, text=True, env=environment, **options
    )


def test_the_owner_of_the_kernels_of_the_container_uses_them(tmp_path: Path):
    (tmp_path / "kernels").mkdir()
    assert start(tmp_path, tmp_path / "kernels").stdout == f"{tmp_path / 'kernels'} run a b\n"


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a folder to another user")
def test_another_user_of_the_container_has_kernels_that_nobody_else_writes(tmp_path: Path):
    kernels = tmp_path / "kernels"
    kernels.mkdir()
    (kernels / "a.nbi").write_text("code")
    os.chown(kernels, 10001, 10001)
    own = Path(start(tmp_path, kernels).stdout.split()[0])
    assert own != kernels
    assert (own / "a.nbi").read_text() == "code"
    assert own.stat().st_mode & 0o777 == 0o700
    shutil.rmtree(own)


@pytest.mark.parametrize(("mode", "code"), [(0o755, 0), (0o777, 1), (0o757, 1)])
def test_kernels_that_others_may_write_fail_the_check_of_the_container(tmp_path, mode, code):
    (tmp_path / "kernels").mkdir()
    (tmp_path / "kernels").chmod(mode)
    start(tmp_path, tmp_path / "kernels")
    script = CHECKOUT / "workflows" / "container" / "install.sh"
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "kernels")}
    environment |= {"MPLCONFIGDIR": str(tmp_path / "none")}
    done = subprocess.run([str(script), "check", str(tmp_path)], check=False, env=environment)
    assert done.returncode == code


def test_constraints_name_a_version_of_everything_that_the_container_installs():
    text = (CHECKOUT / "workflows" / "container" / "constraints.txt").read_text()
    pins = dict(re.findall(r"(?m)^([a-z0-9-]+)==(\S+)$", text))
    project = tomllib.loads((CHECKOUT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    for line in [*project["dependencies"], *extras["gis"], *extras["notify"], *extras["test"]]:
        need = Requirement(line)
        name = canonicalize_name(need.name)
        if name != "per-obspy":
            # A version that the project itself refuses could not be installed
            assert pins[name] in need.specifier
