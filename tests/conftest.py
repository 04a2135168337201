"""Shared by several test modules: the place of the real records."""

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

from per_obspy import threads
from per_obspy.cli import application

# The first example of a test may compile a kernel, which takes seconds. In CI every run tries the
# same examples, so that a change is judged by itself; elsewhere each run tries new ones.
settings.register_profile("compiling", deadline=None, derandomize="CI" in os.environ)
settings.load_profile("compiling")

CHECKOUT = Path(__file__).parents[1]


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with what takes long: at the end all workers have something short to do."""
    items.sort(key=lambda item: item.get_closest_marker("long") is None)


@pytest.fixture(scope="session")
def real_data() -> Path:
    """Folder of real records: PER_OBSPY_DATA, or ``shared/data`` next to the checkout."""
    folder = Path(os.environ.get("PER_OBSPY_DATA", CHECKOUT.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"real records are not at {folder}: set PER_OBSPY_DATA")
    return folder


@pytest.fixture(scope="session", autouse=True)
def _disk() -> Iterator[None]:
    """Let no test wait for the disk: none of them loses power."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", lambda _: None)
        yield


@pytest.fixture(autouse=True)
def _threads(monkeypatch):
    """Keep the number of threads of this process, which a worker in it limits to one."""
    monkeypatch.setitem(threads._limit, "threads", threads._limit["threads"])


@pytest.fixture
def call(monkeypatch, capsys):
    """Return exit code, output and errors of ``per-obspy`` with these arguments; no traceback."""

    def called(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["per-obspy", *map(str, arguments)])
        with pytest.raises(SystemExit) as stop:
            application.main()
        out, err = capsys.readouterr()
        assert "Traceback" not in err
        code = stop.value.code
        return (code if isinstance(code, int) else 0), out, err

    return called
