"""Damaged files of every kind are read or refused, within limits of memory and time."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.long

HERE = Path(__file__).parent

#: Damaged copies of every kind of file; by hand thousands are read, see ``docs/security.md``.
COUNT = 6

linux = pytest.mark.skipif(
    not Path("/proc/self/statm").exists(), reason="the limit of memory needs Linux"
)


def fuzz(*arguments: str) -> dict[str, dict]:
    # A process of its own, because the limit holds for all that follows
    command = [sys.executable, str(HERE / "fuzz.py"), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    results = [json.loads(line) for line in done.stdout.splitlines()]
    return {result["entry"]: result for result in results}


@linux
def test_damaged_files_are_read_or_refused():
    results = fuzz(str(COUNT))
    assert {name: result["faults"] for name, result in results.items() if result["faults"]} == {}
    counts = {name: result["read"] + result["refused"] for name, result in results.items()}
    assert set(counts.values()) == {COUNT}
    # A reader that refused everything, or read everything, would not be tried
    assert sum(result["read"] for result in results.values()) > len(results)
    assert sum(result["refused"] for result in results.values()) > len(results)


@linux
def test_files_that_once_were_at_fault_are_read_or_refused():
    results = fuzz("--again")
    assert {name: result["faults"] for name, result in results.items() if result["faults"]} == {}
    kept = sum(1 for path in (HERE / "findings").glob("*/*"))
    assert sum(result["read"] + result["refused"] for result in results.values()) == kept > 0
