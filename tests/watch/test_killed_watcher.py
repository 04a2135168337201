"""
A watcher that is killed at a random moment leaves work that the next one completes.

``killed_watcher.py`` does as many kills as it is asked for.
"""

import json
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.long

PROGRAM = Path(__file__).with_name("killed_watcher.py")


def test_tables_after_a_kill_are_those_of_an_undisturbed_watcher():
    # One during the first run of an earthquake, one during that for a late station
    command = [sys.executable, str(PROGRAM), "2"]
    done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert (found["kills"], found["faults"]) == (2, {})
