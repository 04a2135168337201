"""Health of a folder and its exit code; covers ``per_obspy.cli.watch``."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from per_obspy.files import file_hash
from per_obspy.resume import write_status as write_record
from per_obspy.runs.output_folder import file_hashes
from per_obspy.watch import health
from per_obspy.watch.health import STATUS, WatchStatus, folder_health
from per_obspy.watch.state import write_state

DUE = "2099-01-01T00:00:00+00:00"
PAST = "2001-01-01T00:00:00+00:00"


def dead_process():
    """Return the number of a process that has ended."""
    return int(
        subprocess.run(
            [sys.executable, "-c", "import os; print(os.getpid())"],
            capture_output=True,
            text=True,
            check=True,
        ).stdout
    )


@pytest.mark.parametrize(
    ("facts", "state", "code"),
    [
        ({"next_due": DUE, "running": True}, "fine", 0),
        ({"next_due": DUE}, "fine", 0),
        ({"next_due": PAST}, "late", 75),
        ({"next_due": DUE, "last_error": "503", "failures": 2}, "failing", 75),
        # a clock without a zone is UTC
        ({"next_due": PAST[:19]}, "late", 75),
    ],
)
def test_a_watcher_has_an_exit_code_for_monitoring(tmp_path, call, facts, state, code):
    write_state(tmp_path / STATUS, WatchStatus(**facts))
    found, out, err = call("status", tmp_path, "--json")
    assert (found, err) == (code, "")
    assert json.loads(out)["state"] == state
    assert f"watcher: {state}" in call("status", tmp_path)[1]


def test_a_watcher_whose_process_is_gone_has_stopped(tmp_path):
    # between two runs of a timer there is no process
    pid = dead_process()
    write_state(tmp_path / STATUS, WatchStatus(next_due=DUE, pid=pid, running=True))
    assert folder_health(tmp_path).state == "stopped"
    write_state(tmp_path / STATUS, WatchStatus(next_due=DUE, pid=pid, running=False))
    assert folder_health(tmp_path).state == "fine"
    # the number says nothing on another machine
    write_state(
        tmp_path / STATUS, WatchStatus(next_due=DUE, pid=pid, running=True, host="elsewhere")
    )
    assert folder_health(tmp_path).state == "fine"


@pytest.mark.parametrize(
    ("record", "code", "words"),
    [
        ({"state": "complete", "name": "Town"}, 0, "run Town: fine"),
        ({"state": "complete", "faults": ["summary.pdf: no font"]}, 75, "no font"),
        ({"state": "complete", "failed": True}, 75, "failing"),
        ({"state": "unfinished"}, 75, "unfinished"),
        ({"state": "nothing_usable"}, 3, "nothing_usable"),
        ({"state": "complete", "stations": {"expected": "x", "serves": 1}}, 0, "0 expected"),
    ],
)
def test_a_run_has_an_exit_code_too(tmp_path, call, record, code, words):
    (tmp_path / "run.json").write_text(json.dumps({"key": "", "outputs": {}, **record}))
    found, out, _ = call("status", tmp_path)
    assert found == code
    assert words in out


def write_run(folder: Path) -> Path:
    """Write a run of two results and a station, as they are left."""
    (folder / "stations").mkdir(parents=True)
    for name in ("risk.csv", "report.html", "stations/XX.A.nc"):
        (folder / name).write_text(name * 100)
    made = [folder / "risk.csv", folder / "report.html"]
    facts = {"state": "complete", "name": "Town"}
    write_record(folder / "run.json", "k", file_hashes(folder, made), facts)
    station = folder / "stations" / "XX.A.nc"
    write_record(folder / "stations" / "XX.A.json", "k", {"XX.A.nc": file_hash(station)}, {})
    return folder


def flipped(file: Path) -> None:
    content = bytearray(file.read_bytes())
    content[50] ^= 1
    file.write_bytes(content)


def replaced_by_a_folder(file: Path) -> None:
    file.unlink()
    file.mkdir()


def replaced_by_a_pipe(file: Path) -> None:
    file.unlink()
    os.mkfifo(file)


@pytest.mark.parametrize("name", ["risk.csv", "report.html", "stations/XX.A.nc"])
@pytest.mark.parametrize(
    "damage",
    [
        flipped,
        Path.unlink,
        lambda file: file.write_bytes(b""),
        lambda file: file.write_bytes(file.read_bytes()[:-1]),
        lambda file: file.write_bytes(file.read_bytes() + b" "),
        replaced_by_a_folder,
        replaced_by_a_pipe,
    ],
)
def test_a_damaged_result_is_not_fine(tmp_path: Path, call, name: str, damage):
    folder = write_run(tmp_path / "run")
    assert call("status", folder)[0] == 0
    damage(folder / name)
    code, out, err = call("status", folder)
    assert (code, err) == (75, "")
    assert f"damaged: {folder / name}: is not as it was written" in out
    assert json.loads(call("status", folder, "--json")[1])["damaged"] == [str(folder / name)]


def test_the_newest_results_of_a_watcher_are_compared(tmp_path: Path, call):
    write_state(tmp_path / STATUS, WatchStatus(next_due=DUE))
    revision = write_run(tmp_path / "events" / "x1" / "revisions" / "0001")
    (revision / "run.json").rename(revision / "revision.json")
    (tmp_path / "events" / "x1" / "latest").symlink_to("revisions/0001")
    assert call("status", tmp_path)[0] == 0
    flipped(revision / "report.html")
    code, out, _ = call("status", tmp_path)
    assert code == 75
    assert "watcher: damaged" in out


def test_results_of_any_size_are_compared_for_a_limited_time(tmp_path: Path, call, monkeypatch):
    folder = write_run(tmp_path / "run")
    # A file of 8 GB that takes no room on the disk
    with (folder / "risk.csv").open("wb") as file:
        file.truncate(8 << 30)
    monkeypatch.setattr(health, "COMPARED_WITHIN", 0.3)
    began = time.monotonic()
    code, out, _ = call("status", folder)
    # 0.3 s, and what a busy machine adds
    assert time.monotonic() - began < 5.0
    assert code == 0
    assert "results: 2 of 3 files compared within 0.3 s, the largest are not" in out


@pytest.mark.parametrize("content", [None, "", "[]", '{"key": "", "outputs": {}, "state": "odd"}'])
def test_other_folders_are_wrong_input(tmp_path, call, content):
    if content is not None:
        (tmp_path / "run.json").write_text(content)
    code, _, err = call("status", tmp_path)
    assert code == 2
    assert len(err.splitlines()) == 1
