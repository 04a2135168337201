"""Inventories and measurements of whole runs: unique names, the time of all processes."""

import os
import subprocess
import sys

import numpy as np
import pyarrow.parquet as pq
import pytest
import screening
import xarray as xr


@pytest.fixture
def stations(tmp_path, monkeypatch):
    """A folder of two station files, of which only the place is read."""
    for number in (1, 2):
        (tmp_path / f"S{number}.nc").touch()

    def place(path):
        return xr.Dataset({"longitude": -67.9 + 0.01 * int(path.stem[1:]), "latitude": -20.3})

    monkeypatch.setattr(screening, "read_spectra", place)
    monkeypatch.setattr(screening, "TOGETHER", 40)
    return tmp_path


def test_no_name_occurs_in_two_parts(stations):
    file = stations / "pairs.parquet"
    screening.write_inventory(file, 100, stations)
    table = pq.read_table(file).to_pandas()
    assert len(table) == 100
    assert table["pair_id"].is_unique
    # a building is in the pairs of one row only, which is within a part
    parts = np.arange(100) // 40
    for name in ("building_id_1", "building_id_2"):
        assert (table[name].groupby(table[name]).transform("size") <= 2).all()
        assert table.assign(part=parts).groupby(name)["part"].nunique().max() == 1


#: Ends at once and leaves a process that needs half a second of the processor.
LEAVING = """
import os, time
if not os.fork():
    while time.process_time() < 0.5:
        pass
"""


@pytest.mark.skipif(sys.platform != "linux", reason="orphans are adopted on Linux only")
def test_processes_that_outlive_the_command_count():
    # would catch the time of workers, whose server ends after the command, left out. In a process
    # of its own, because it waits for all that are left
    program = f"""
import resource, subprocess, sys
import screening
screening.adopt_orphans()
subprocess.run([sys.executable, "-c", {LEAVING!r}], check=True)
screening.await_orphans()
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(used.ru_utime + used.ru_stime)
"""
    paths = os.pathsep.join(path for path in sys.path if path)
    environment = {**os.environ, "PYTHONPATH": paths}
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert float(done.stdout) >= 0.5
