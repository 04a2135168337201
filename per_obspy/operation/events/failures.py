"""Failures of a watcher: the error for users, and the pause until the next attempt."""

import logging
from datetime import datetime, timedelta

from per_obspy.errors import MachineFault, PerError, TryLater, shortened
from per_obspy.machine import machine_fault
from per_obspy.operation.events.due import pause
from per_obspy.operation.events.state import EventState, changed, iso
from per_obspy.records.fdsn.web import PassingFault

log = logging.getLogger(__name__)


def known_fault(error: Exception) -> PerError:
    """Convert any error to one for users; log the traceback of a programming error."""
    # A missing file of the configuration is a wrong name, as for other commands
    fault = machine_fault(error, missing=not isinstance(error, PerError))
    if isinstance(error, PerError) and (fault is None or isinstance(error, TryLater)):
        return error
    if fault is not None:
        return fault
    log.error("an error of the program", exc_info=error)
    return MachineFault(shortened(f"{type(error).__name__}: {error}"))


def after_pause(now: datetime, failures: int, fault: PerError | None) -> str:
    """
    Return the time after the pause that follows some failures in succession.

    Parameters
    ----------
    now : datetime
        Time of the latest failure.
    failures : int
        At least 1.
    fault : PerError or None
        The latest failure; a service may demand a longer pause.
    """
    demanded = fault.pause if isinstance(fault, PassingFault) else None
    return iso(now + timedelta(seconds=pause(failures, demanded)))


def failed(state: EventState, reason: str, now: datetime, fault: PerError | None) -> EventState:
    """Return the state of an earthquake after a failure: it is tried again after a pause."""
    failures = state.failures + 1
    return changed(
        state,
        failures=failures,
        not_before=after_pause(now, failures, fault),
        last_error=shortened(reason),
    )
