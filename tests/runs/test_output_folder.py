"""Output folders: one run at a time, a record that is written last, dead part files removed."""

import json
import subprocess
import sys

import pytest

from per_obspy.errors import CatalogError
from per_obspy.resume import earlier_status
from per_obspy.runs.output_folder import (
    file_hashes,
    locked_folder,
    recorded,
    software_versions,
)

TRIES = """
import sys
from pathlib import Path
from per_obspy.runs.output_folder import locked_folder
with locked_folder(Path(sys.argv[1])):
    print("locked")
"""


def locks(folder):
    """Return output and errors of another process that locks a folder."""
    arguments = [sys.executable, "-c", TRIES, str(folder)]
    process = subprocess.run(arguments, capture_output=True, text=True, check=False)
    return process.stdout, process.stderr


def test_a_folder_is_made_and_locked_by_one_process_at_a_time(tmp_path):
    folder = tmp_path / "new" / "out"
    with locked_folder(folder):
        holder = json.loads((folder / ".holder.json").read_text())
        _, errors = locks(folder)
        assert f"another run holds this folder: process {holder['process']} on" in errors
    # afterwards it is free
    assert locks(folder) == ("locked\n", "")
    assert not (folder / ".holder.json").exists()


def test_a_folder_is_free_after_an_error(tmp_path):
    def fails():
        with locked_folder(tmp_path):
            raise RuntimeError("no luck")

    with pytest.raises(RuntimeError, match="no luck"):
        fails()
    assert locks(tmp_path) == ("locked\n", "")


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"process": 1'])
def test_a_holder_that_cannot_be_read_is_unknown(tmp_path, content):
    with locked_folder(tmp_path):
        (tmp_path / ".holder.json").write_text(content)
        _, errors = locks(tmp_path)
    assert errors.strip().endswith("its process is unknown; try again after it")


def test_a_file_is_no_output_folder(tmp_path):
    (tmp_path / "out").write_text("")
    with pytest.raises(CatalogError, match="cannot be used as output folder"):
        locked_folder(tmp_path / "out").__enter__()


def test_part_files_of_a_killed_run_are_removed(tmp_path):
    # no process has a number above the largest of Linux, 2 ** 22
    left = tmp_path / "stations" / ".XX.S001.4194305.part.nc"
    left.parent.mkdir()
    left.write_bytes(b"half")
    with locked_folder(tmp_path):
        assert not left.exists()


def test_a_record_is_a_status_that_people_can_read(tmp_path):
    (tmp_path / "risk.csv").write_text("rank\n")
    outputs = file_hashes(tmp_path, [tmp_path / "risk.csv"])
    record = {"key": "k", "name": "a run", "outputs": outputs, "versions": software_versions()}
    result = recorded(tmp_path / "run.json", record)
    assert result.record == record == earlier_status(tmp_path / "run.json", "k")
    # names come first, one per line
    assert (tmp_path / "run.json").read_text().startswith('{\n "name": "a run",\n')
    (tmp_path / "risk.csv").write_text("changed")
    assert earlier_status(tmp_path / "run.json", "k") is None
