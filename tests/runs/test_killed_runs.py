"""A run that was killed before any of its replacements of a file is completed by the next run."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.long

PROGRAM = Path(__file__).with_name("killed_runs.py")


def test_a_run_killed_at_any_write_is_completed_by_the_next_one(tmp_path):
    # would catch a part file that later runs take for one of their own files, or that stays
    command = [sys.executable, str(PROGRAM), str(tmp_path), "os.rename"]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["faults"] == {}
    # Records, station file, pairs, part, tables, figures, and a status after each stage
    assert found["kills"] > 10
