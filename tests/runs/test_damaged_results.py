"""Every file of a finished run that was damaged is made again, or named in one line."""

import re
import shutil
from pathlib import Path

import pytest

from per_obspy.runs import stages
from per_obspy.runs.run import run

from .small_run import InProcess, write_smallest_configuration

#: Files of the run, seen from its output folder; their names are the same in every run.
FILES = (
    "run.json",
    "configuration.toml",
    "risk.csv",
    "risk.parquet",
    "risk.columns.csv",
    "rejected.csv",
    "stations.csv",
    "stations.columns.csv",
    "totals.csv",
    "rows.parquet",
    "rows.columns.csv",
    "rows/000000.parquet",
    "rows/000000.json",
    "buildings.parquet",
    "buildings.csv",
    "buildings.columns.csv",
    "report.html",
    "summary.txt",
    "summary.pdf",
    "risk.kml",
    "spectra.nc",
    "pairs.csv",
    "simulated.json",
    "simulated/XX.S001.mseed",
    "simulated/stations.xml",
    "simulated/event.xml",
    "stations/XX.S001.nc",
    "stations/XX.S001.json",
    "chunks/000000.parquet",
    "chunks/000000.json",
    "figures/overview.png",
    "figures/worst_pair.png",
    "worst_pairs.json",
)


pytestmark = [pytest.mark.long, pytest.mark.usefixtures("plain_reports")]


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = tmp_path_factory.mktemp("finished")
    run(write_smallest_configuration(folder), executor=InProcess())
    return folder


def contents(folder: Path) -> dict[str, bytes]:
    """Return every result of a run by its name, without the minute at which it was issued."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return {
        path.relative_to(folder).as_posix(): re.sub(rb"\nIssued [^\n]*", b"", path.read_bytes())
        for path in files
    }


def test_the_list_of_files_is_that_of_a_run(finished):
    found = set(contents(finished / "out")) - {".lock"}
    assert found == set(FILES)


def damage(path: Path, kind: str) -> None:
    """Truncate, change, empty or remove a file."""
    content = path.read_bytes()
    middle = len(content) // 2
    if kind == "removed":
        path.unlink()
        return
    # One bit in the middle
    flipped = bytes([content[middle] ^ 1])
    damaged = {
        "truncated": content[:middle],
        "a byte changed": content[:middle] + flipped + content[middle + 1 :],
        "emptied": b"",
    }
    path.write_bytes(damaged[kind])


KINDS = ("truncated", "a byte changed", "emptied", "removed")

#: Parts are compared with their hash when they are needed, which a finished run does not.
PARTS = tuple(name for name in FILES if name.startswith(("chunks/", "rows/")))


class Begun(Exception):
    """A run has found work to do."""


@pytest.mark.parametrize("kind", KINDS)
def test_every_damaged_file_is_noticed(finished, monkeypatch, kind):
    # would catch products of the run that are taken as they are
    def begins(*_):
        raise Begun

    monkeypatch.setattr(stages, "new_run", begins)
    unnoticed = set()
    for name in FILES:
        path = finished / "out" / name
        content = path.read_bytes()
        damage(path, kind)
        try:
            assert run(finished / "run.toml", executor=InProcess()).did_nothing
            unnoticed.add(name)
        except Begun:
            pass
        path.write_bytes(content)
    # A run writes the configuration anew each time, whatever was there; its record has hashes of
    # all other files and none of itself, so that another letter of a text may stay
    if kind == "a byte changed":
        unnoticed.discard("run.json")
    assert unnoticed == {*PARTS, "configuration.toml"}


@pytest.mark.parametrize("shift", range(len(KINDS)))
def test_a_damaged_file_does_not_change_the_result(finished, tmp_path, shift):
    # Each file alone, each in one way: four kinds in turn
    out, whole = finished / "out", tmp_path / "whole"
    shutil.copytree(out, whole)
    before, wrong = contents(whole), {}
    for number, name in list(enumerate(FILES))[shift :: len(KINDS)]:
        kind = KINDS[(number // len(KINDS)) % len(KINDS)]
        damage(out / name, kind)
        run(finished / "run.toml", executor=InProcess())
        after = contents(out)
        changed = [file for file in before if after.get(file) != before[file]]
        # The record states when the run began
        changed = [file for file in changed if file not in ("run.json", *PARTS)]
        if changed:
            wrong[f"{name} {kind}"] = changed
        # Chunks are part of a folder whose place is in their key: restored in place
        shutil.rmtree(out)
        shutil.copytree(whole, out)
    assert not wrong


@pytest.mark.parametrize("name", [name for name in FILES if name.startswith("chunks/")])
def test_a_damaged_part_is_made_again_when_it_is_needed(finished, name):
    # Without the risk table the run has to be done again
    before = (finished / "out" / name).read_bytes()
    (finished / "out" / name).write_bytes(before[:-1])
    (finished / "out" / "risk.csv").unlink()
    counts = run(finished / "run.toml", executor=InProcess()).record["counts"]
    assert (counts["stations_resumed"], counts["chunks_resumed"]) == (1, 0)
    assert (finished / "out" / name).read_bytes() == before
