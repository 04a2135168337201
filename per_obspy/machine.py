"""Distinguish faults of the machine from faults of the data by the type of the error."""

import errno
import math
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import PurePath

from per_obspy.errors import MachineFault, TryLater

#: Errors of the operating system that pass or do not depend on the contents of a file.
PASSING = {
    *(errno.EIO, errno.ENXIO, errno.ENODEV, errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EFBIG),
    *(errno.EMFILE, errno.ENFILE, errno.ENOMEM, errno.EAGAIN, errno.EBUSY, errno.EINTR),
    *(errno.ESTALE, errno.ETIMEDOUT, errno.ENOTCONN, errno.EHOSTDOWN, errno.ENETDOWN),
}


def machine_fault(error: BaseException, missing: bool = True) -> MachineFault | None:
    """
    Return the fault of the machine that an error is or was raised from; None if there is none.

    Short memory and failures of devices and services are faults of the machine, and so is a file
    that has vanished. Memory beyond that of the machine is asked for by damaged data only.

    Parameters
    ----------
    error : Exception
        Whatever a task raised.
    missing : bool
        Whether a missing file is one that has vanished, rather than one of a wrong name.

    Examples
    --------
    >>> str(machine_fault(OSError(errno.EIO, os.strerror(errno.EIO), "S1.mseed")))
    'S1.mseed: Input/output error'
    >>> machine_fault(ValueError("no number")) is None
    True
    """
    # The first cause that is a fault of the machine decides
    for cause in _causes(error):
        if isinstance(cause, MachineFault):
            return cause
        if isinstance(cause, MemoryError) and not _is_impossible(cause):
            return MachineFault(f"not enough memory: {str(cause) or type(cause).__name__}")
        if not isinstance(cause, OSError):
            continue
        if cause.errno in PASSING or (missing and _vanished(cause, error)):
            named = f"{cause.filename}: " if cause.filename is not None else ""
            return MachineFault(f"{named}{cause.strerror}")
    return None


def raise_machine_fault(error: BaseException) -> None:
    """Raise the fault of the machine from which an error was raised, if there is one."""
    fault = machine_fault(error)
    if fault is not None:
        raise fault from error


@contextmanager
def machine_faults() -> Iterator[None]:
    """Raise the fault of the machine from which an error of the block was raised, if any."""
    try:
        yield
    finally:
        error = sys.exception()
        if isinstance(error, Exception) and not isinstance(error, TryLater):
            raise_machine_fault(error)


def _causes(error: BaseException) -> Iterator[BaseException]:
    """Yield an error and the errors from which it was raised."""
    cause: BaseException | None = error
    while cause is not None:
        # Faults that pass later have a separate class
        if isinstance(cause, TryLater) and not isinstance(cause, MachineFault):
            return
        yield cause
        cause = cause.__cause__


def _is_impossible(error: MemoryError) -> bool:
    """Return whether an array was asked for that is larger than the memory of the machine."""
    shape, kind = getattr(error, "shape", None), getattr(error, "dtype", None)
    if shape is None or kind is None or not hasattr(os, "sysconf"):
        return False
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    return bool(math.prod(shape) * kind.itemsize > memory)


def _vanished(cause: OSError, error: BaseException) -> bool:
    """Return whether a file is missing that was there, rather than one that a record names."""
    if cause.errno != errno.ENOENT:
        return False
    if cause is error:
        return True
    # The record itself, or the archive that holds it
    record = PurePath(str(getattr(error, "record", getattr(error, "source", ""))))
    return cause.filename is not None and record.is_relative_to(str(cause.filename))
