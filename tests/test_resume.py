"""Resuming after faults: work counts as done only if its status and every output are whole."""

import json
import subprocess
import sys
from contextlib import suppress
from itertools import count
from pathlib import Path

import pytest

from per_obspy.errors import CatalogError
from per_obspy.files import file_hash, written_whole
from per_obspy.resume import (
    StatusError,
    changed_outputs,
    earlier_status,
    read_status,
    write_status,
)

KEY = "key of the work"
OUTPUTS = ("table.csv", "layers/pairs.bin")

#: Changes of the file system: events of Python's audit hook.
CHANGES = {"open", "os.rename", "os.remove", "os.mkdir", "os.truncate"}

#: Does the work in a process that is killed before its n-th change of the file system.
KILLED = """
import os, sys
from pathlib import Path
sys.path.insert(0, {tests!r})
from test_resume import is_change, work
folder, left = Path({folder!r}), {number}

def kill(event, arguments):
    global left
    if is_change(event, arguments, folder):
        left -= 1
        if not left:
            os._exit(9)

sys.addaudithook(kill)
work(folder)
"""


def work(folder):
    """Write two outputs and their status, as stations, chunks and whole runs do."""
    for number, name in enumerate(OUTPUTS):
        with written_whole(folder / name) as part:
            part.write_bytes(bytes([number]) * 1000)
    hashes = {name: file_hash(folder / name) for name in OUTPUTS}
    write_status(folder / "work.json", KEY, hashes, {"rejected": [], "note": "é"})


def is_change(event, arguments, folder):
    """Return whether an audit event changes a file of a folder."""
    if event not in CHANGES or not str(arguments[0]).startswith(str(folder)):
        return False
    return event != "open" or bool(set(arguments[1] or "") & set("wax+"))


def is_done(folder):
    return earlier_status(folder / "work.json", KEY) is not None


def has_whole_outputs(folder):
    """Return whether every output is there with its content."""
    contents = [bytes([number]) * 1000 for number in range(len(OUTPUTS))]
    return all(
        (folder / name).is_file() and (folder / name).read_bytes() == content
        for name, content in zip(OUTPUTS, contents, strict=True)
    )


class Fault:
    """An audit hook that raises at the n-th change of a folder, and is silent later."""

    def __init__(self):
        self.folder, self.left, self.error = None, 0, None
        sys.addaudithook(self)

    def __call__(self, event, arguments):
        if self.folder is None or not is_change(event, arguments, self.folder):
            return
        self.left -= 1
        if not self.left:
            raise self.error


@pytest.fixture(scope="module")
def fault():
    return Fault()  # audit hooks stay until the process ends


@pytest.fixture
def finished(tmp_path):
    work(tmp_path)
    assert is_done(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    "error", [KeyboardInterrupt(), OSError(28, "No space left"), MemoryError()]
)
def test_a_fault_at_any_change_leaves_work_undone_or_whole(tmp_path, fault, error):
    # would catch a status that is written before an output, or not as a whole
    for number in count(1):
        folder = tmp_path / str(number)
        folder.mkdir()
        fault.folder, fault.left, fault.error = folder, number, error
        with suppress(KeyboardInterrupt, MemoryError, OSError, CatalogError):
            work(folder)
        fault.folder = None
        if fault.left > 0:
            break
        assert not is_done(folder) or has_whole_outputs(folder)
        # What was left does not hinder the same work
        work(folder)
        assert is_done(folder)
        assert has_whole_outputs(folder)
    assert number > 3 * len(OUTPUTS)  # every file is opened, renamed, and its folder made


def test_a_kill_at_any_change_leaves_work_undone_or_whole(tmp_path):
    # would catch whatever is put right only by a handler that a killed process never runs
    for number in count(1):
        folder = tmp_path / str(number)
        folder.mkdir()
        code = KILLED.format(tests=str(Path(__file__).parent), folder=str(folder), number=number)
        process = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True)
        if process.returncode == 0:
            break
        assert process.returncode == 9, process.stderr
        assert not is_done(folder) or has_whole_outputs(folder)
        work(folder)
        assert is_done(folder)
    assert number > 3 * len(OUTPUTS)


@pytest.mark.parametrize("name", OUTPUTS)
@pytest.mark.parametrize("fault", ["truncated", "changed", "removed", "a folder"])
def test_an_output_that_is_not_whole_is_made_again(finished, name, fault):
    output = finished / name
    content = output.read_bytes()
    output.unlink()
    if fault == "truncated":
        output.write_bytes(content[:-1])
    elif fault == "changed":
        output.write_bytes(b"x" + content[1:])
    elif fault == "a folder":
        output.mkdir()
    assert not is_done(finished)
    # The other output is whole
    status_file = finished / "work.json"
    assert changed_outputs(status_file, read_status(status_file)) == [output]


DAMAGES = {
    "empty": b"",
    "half": b'{"rejected": [], "outputs": {"table',
    "not UTF-8": b"\xff\xfe\x00",
    "a list": b"[]",
    "a number": b"1",
    "no outputs": b'{"key": "key of the work"}',
    "no key": b'{"outputs": {}}',
    "outputs in a list": b'{"key": "key of the work", "outputs": ["table.csv"]}',
    "a key that is no text": b'{"key": 1, "outputs": {}}',
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_status_means_that_the_work_is_done_again(finished, damage):
    (finished / "work.json").write_bytes(DAMAGES[damage])
    assert not is_done(finished)
    with pytest.raises(StatusError):
        read_status(finished / "work.json")


def test_every_truncation_of_a_status_is_seen(finished):
    content = (finished / "work.json").read_bytes()
    for length in range(len(content)):
        (finished / "work.json").write_bytes(content[:length])
        assert not is_done(finished)


def test_a_status_without_its_file_is_none(finished):
    (finished / "work.json").unlink()
    assert not is_done(finished)


def test_other_work_is_not_taken_for_this(finished):
    assert earlier_status(finished / "work.json", "another key") is None


def test_work_without_a_key_is_always_done_again(tmp_path):
    write_status(tmp_path / "work.json", "", {}, {})
    assert earlier_status(tmp_path / "work.json", "") is None


def test_facts_come_back(finished):
    status = earlier_status(finished / "work.json", KEY)
    assert status is not None
    assert status["note"] == "é"
    assert status == json.loads((finished / "work.json").read_text(encoding="utf-8"))


def test_outputs_far_from_their_status_are_not_looked_at(tmp_path):
    # hashing a device or a pipe would never end
    status = tmp_path / "run" / "stations" / "work.json"
    status.parent.mkdir(parents=True)
    victim = tmp_path / "victim"
    victim.write_text("whole")
    far = {"../../victim": file_hash(victim), "/dev/zero": "", "\0": ""}
    write_status(status, KEY, far, {})
    assert len(changed_outputs(status, read_status(status))) == len(far)
    # a folder beside that of the status is near
    near = tmp_path / "run" / "structures" / "table.csv"
    near.parent.mkdir()
    near.write_text("whole")
    write_status(status, KEY, {"../structures/table.csv": file_hash(near)}, {})
    assert changed_outputs(status, read_status(status)) == []
