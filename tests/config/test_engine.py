"""Addresses of a cluster."""

from pathlib import Path

import pytest

from per_obspy.config import Run, checked
from per_obspy.config.engine import checked_address, local_workers
from per_obspy.errors import CatalogError


@pytest.mark.parametrize(
    ("given", "used"),
    [
        ("local", "local"),
        ("local:4", "local:4"),
        ("tcp://10.0.0.1:8786", "tcp://10.0.0.1:8786"),
        ("tls://[::1]:8786", "tls://[::1]:8786"),
        ("head:8786", "tcp://head:8786"),
    ],
)
def test_an_address_is_used_as_it_is_meant(given, used):
    assert checked_address(given, Path.cwd()) == used


@pytest.mark.parametrize(
    "given", ["", " ", ".", "local:", "local:0", "local:x", "local:99999", "head", "head:0", "a:b"]
)
def test_anything_else_is_refused(given):
    with pytest.raises(ValueError, match="is no scheduler: local, local:4, tcp://HOST:PORT"):
        checked_address(given, Path.cwd())


def test_a_scheduler_file_is_seen_from_the_folder_of_the_configuration(tmp_path):
    content = {"name": "x", "output": "out", "simulation": "s.toml"}
    run = checked(Run, {**content, "engine": {"dask": "dask.json"}}, "run.toml", tmp_path)
    assert run.engine.dask == str(tmp_path / "dask.json")
    with pytest.raises(CatalogError, match=r"engine.dask.*'head' is no scheduler"):
        checked(Run, {**content, "engine": {"dask": "head"}}, "run.toml", tmp_path)


def test_workers_of_this_machine_are_counted():
    assert [local_workers(one) for one in ("local", "local:3", "head:3")] == [0, 3, None]
