"""Health of a folder and its exit code; covers ``per_obspy.commands.operation.status``."""

import json
import subprocess
import sys

import pytest

from per_obspy.operation.health import folder_health
from per_obspy.operation.status import WatchStatus, write_status

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
    write_status(tmp_path, WatchStatus(**facts))
    found, out, err = call("status", tmp_path, "--json")
    assert (found, err) == (code, "")
    assert json.loads(out)["state"] == state
    assert f"watcher: {state}" in call("status", tmp_path)[1]


def test_a_watcher_whose_process_is_gone_has_stopped(tmp_path):
    # between two runs of a timer there is no process
    pid = dead_process()
    write_status(tmp_path, WatchStatus(next_due=DUE, pid=pid, running=True))
    assert folder_health(tmp_path).state == "stopped"
    write_status(tmp_path, WatchStatus(next_due=DUE, pid=pid, running=False))
    assert folder_health(tmp_path).state == "fine"
    # the number says nothing on another machine
    write_status(tmp_path, WatchStatus(next_due=DUE, pid=pid, running=True, host="elsewhere"))
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


@pytest.mark.parametrize("content", [None, "", "[]", '{"key": "", "outputs": {}, "state": "odd"}'])
def test_other_folders_are_wrong_input(tmp_path, call, content):
    if content is not None:
        (tmp_path / "run.json").write_text(content)
    code, _, err = call("status", tmp_path)
    assert code == 2
    assert len(err.splitlines()) == 1
