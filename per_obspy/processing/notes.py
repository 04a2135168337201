"""What was done to a trace: one line a step in ``stats.processing``, every chosen number in ``stats.per_obspy``."""

from obspy import Trace
from obspy.core import AttribDict

from per_obspy.errors import Rejection

Value = str | float | int


def noted(trace: Trace, step: str, **numbers: Value) -> None:
    """
    Record a step on the new trace that the step made.

    Parameters
    ----------
    trace : obspy Trace
        Changed in place: only ever a step's own copy.
    step : str
        What happened, in a few words; appended to ``stats.processing``.
    **numbers : str, float or int
        What was chosen for this record; kept in ``stats.per_obspy``.
    """
    trace.stats.setdefault("processing", []).append(f"per_obspy: {step}")
    remembered(trace, **numbers)


def remembered(trace: Trace, **numbers: Value) -> None:
    """Keep numbers of this record in ``stats.per_obspy`` of a step's own copy; see `noted`."""
    trace.stats.setdefault("per_obspy", AttribDict()).update(numbers)


def rejection(trace: Trace, *reasons: str) -> Rejection:
    """Return the row of ``rejected.csv`` for a trace."""
    return Rejection("record", trace.id, str(trace.stats.get("source", "")), None, reasons)


def is_processed(trace: Trace) -> bool:
    """Tell whether others have processed a trace."""
    return bool(trace.stats.get("processing_level") == "processed")
