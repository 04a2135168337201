"""
Notes on a trace: steps and chosen numbers in its ``stats``, and copies that share the response.

``stats.processing`` has one line per step, ``stats.per_obspy`` every number that was chosen for the
record.
"""

from copy import deepcopy

from obspy import Stream, Trace
from obspy.core import AttribDict

from per_obspy.errors import Rejection

Value = str | float | int


def noted(trace: Trace, step: str, **numbers: Value) -> None:
    """
    Record a step on the new trace that the step made.

    Parameters
    ----------
    trace : obspy Trace
        Changed in place: always the step's own copy.
    step : str
        Short description; appended to ``stats.processing``.
    **numbers : str, float or int
        Choices for this record; stored in ``stats.per_obspy``.
    """
    trace.stats.setdefault("processing", []).append(f"per_obspy: {step}")
    remembered(trace, **numbers)


def remembered(trace: Trace, **numbers: Value) -> None:
    """Store numbers of a record in ``stats.per_obspy`` of a step's own copy; see `noted`."""
    trace.stats.setdefault("per_obspy", AttribDict()).update(numbers)


def rejection(trace: Trace, *reasons: str) -> Rejection:
    """Return the row of ``rejected.csv`` for a trace."""
    return Rejection("record", trace.id, str(trace.stats.get("source", "")), None, reasons)


def is_processed(trace: Trace) -> bool:
    """Return whether a trace is marked as processed, by others or by an earlier run."""
    return bool(trace.stats.get("processing_level") == "processed")


def copied(stream: Stream) -> Stream:
    """
    Return a copy of every trace with the same ``stats.response``.

    The response is never changed, and copying it took a quarter of the whole chain.

    Parameters
    ----------
    stream : obspy Stream

    Returns
    -------
    obspy Stream
    """
    return Stream([_copied(trace) for trace in stream])


def _copied(trace: Trace) -> Trace:
    """Return a copy of one trace that shares the response."""
    shared = ("response", "endtime")
    own = {name: deepcopy(value) for name, value in trace.stats.items() if name not in shared}
    out = Trace(trace.data.copy(), own)
    if "response" in trace.stats:
        out.stats.response = trace.stats.response
    return out
