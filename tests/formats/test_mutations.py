"""Damaged files of every format are read or refused within a limit of memory."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from format_samples import SAMPLES

#: damaged copies of every format; 100 of one without limits held three that asked for gigabytes
COUNT = 200


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="the limit of memory needs Linux")
def test_damaged_files_with_long_words_stay_within_a_limit_of_memory():
    program = Path(__file__).with_name("mutations.py")
    # A process of its own, because the limit holds for all that follows
    done = subprocess.run(
        [sys.executable, str(program), str(COUNT)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr[-2000:]
    outcome = json.loads(done.stdout)
    assert outcome["faults"] == []
    assert outcome["read"] + outcome["refused"] == COUNT * len(SAMPLES)
    assert min(outcome["read"], outcome["refused"]) > COUNT
