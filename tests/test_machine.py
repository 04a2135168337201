"""Faults of the machine and of the data differ by the type of the error."""

import errno
import os
import pickle

import numpy as np
import pytest

from per_obspy.errors import CatalogError, MachineFault, RecordRejected, Unfinished, WriteError
from per_obspy.machine import machine_fault, raise_machine_fault


def system_error(number, path="S1.mseed"):
    return OSError(number, os.strerror(number), path)


def caused(error, cause):
    """Return an error as it is when raised from another."""
    error.__cause__ = cause
    return error


MACHINE = {
    "device": system_error(errno.EIO),
    "open files": system_error(errno.EMFILE),
    "limit of size": system_error(errno.EFBIG, "kernel.nbi"),
    "vanished": system_error(errno.ENOENT),
    "memory": MemoryError(),
    "small array": np._core._exceptions._ArrayMemoryError((1000,), np.dtype(float)),
    "device below a reader": caused(
        RecordRejected("S1.mseed", "cannot be read"), system_error(errno.EIO)
    ),
    "two levels below": caused(
        CatalogError("grid.xml", "wrong"), caused(ValueError("wrong"), MemoryError())
    ),
    "vanished below a reader": caused(
        RecordRejected("S1.mseed", "cannot be read"), system_error(errno.ENOENT)
    ),
    "archive vanished": caused(
        RecordRejected("all.tar/S1.mseed", "no"), system_error(errno.ENOENT, "all.tar")
    ),
}


@pytest.mark.parametrize("name", MACHINE)
def test_faults_of_the_machine(name):
    # would catch: a record that is refused for ever because a disk failed for a moment
    error = MACHINE[name]
    assert isinstance(machine_fault(error), MachineFault)
    with pytest.raises(MachineFault):
        raise_machine_fault(error)


DATA = {
    "value": ValueError("no number"),
    "record": RecordRejected("S1.mseed", "clipped"),
    "library": OSError(-101, "NetCDF: HDF error", "S1.h5"),
    "no number": OSError("Could not open parquet file"),
    "not allowed": system_error(errno.EACCES),
    "name": system_error(errno.ENAMETOOLONG),
    # a header that names its samples' file, which was never there
    "other file": caused(RecordRejected("S1.wfdisc", "no"), system_error(errno.ENOENT, "S1.w")),
    # a damaged header asks for 8 EB, more than any machine has
    "huge array": np._core._exceptions._ArrayMemoryError((10**18,), np.dtype(float)),
    # ends the run by itself
    "written": WriteError("risk.csv", "No space left on device"),
}


@pytest.mark.parametrize("name", DATA)
def test_other_errors(name):
    # would catch: a damaged file that keeps a run unfinished for ever
    assert machine_fault(DATA[name]) is None
    raise_machine_fault(DATA[name])


def test_an_unfinished_run_names_ten_tasks_and_counts_the_others():
    faults = [f"station XX.S{number}: killed" for number in range(12)]
    error = pickle.loads(pickle.dumps(Unfinished(*faults)))
    assert error.faults == tuple(faults)
    assert "XX.S9: killed and 2 more; all else is kept" in str(error)
    assert "XX.S10" not in str(error)
