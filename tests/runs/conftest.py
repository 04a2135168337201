"""Fixtures of the tests of runs."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from filelock import FileLock

from per_obspy.runs.run import run
from per_obspy.runs.tasks.worker_start import forked_workers

from .small_run import InProcess, real_reports, write_configuration
from .small_run import plain_figures as with_plain_figures
from .small_run import plain_reports as with_plain_reports


@pytest.fixture(scope="module")
def plain_figures() -> Iterator[None]:
    """Write figures and PDF of all runs of a module as short files: its tests look at tables."""
    with with_plain_figures():
        yield


@pytest.fixture(scope="module")
def plain_reports() -> Iterator[None]:
    """Write figures, PDF and page of all runs of a module as short files."""
    with with_plain_reports():
        yield


@pytest.fixture(scope="session")
def small_run(tmp_path_factory) -> Path:
    """Return the folder of one finished small run, which tests read, or copy before a change."""
    place = tmp_path_factory.getbasetemp()
    # Processes of tests share one folder
    place = place.parent if "PYTEST_XDIST_WORKER" in os.environ else place
    folder = place / "small_run"
    with FileLock(place / "small_run.lock"), real_reports():
        folder.mkdir(exist_ok=True)
        if not (folder / "out" / "run.json").is_file():
            run(write_configuration(folder), executor=InProcess())
    return folder


@pytest.fixture
def forked() -> Iterator[None]:
    """Fork workers from one server, as commands do: fresh ones load libraries for seconds."""
    with forked_workers():
        yield
