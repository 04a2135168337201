"""
Notes on a trace: steps and chosen numbers in its ``stats``, copies that share its samples.

``stats.processing`` has one line per step, ``stats.per_obspy`` every number that was chosen for the
record.
"""

from collections.abc import Iterable, Iterator
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
        Changed in place: always the copy of the step.
    step : str
        Short description; appended to ``stats.processing``.
    **numbers : str, float or int
        Choices for this record; stored in ``stats.per_obspy``.
    """
    trace.stats.setdefault("processing", []).append(f"per_obspy: {step}")
    remembered(trace, **numbers)


def remembered(trace: Trace, **numbers: Value) -> None:
    """Store numbers of a record in ``stats.per_obspy`` of the copy of a step; see `noted`."""
    trace.stats.setdefault("per_obspy", AttribDict()).update(numbers)


def rejection(trace: Trace, *reasons: str) -> Rejection:
    """Return the row of ``rejected.csv`` for a trace."""
    return Rejection("record", trace.id, str(trace.stats.get("source", "")), None, reasons)


def is_processed(trace: Trace) -> bool:
    """Return whether a trace is marked as processed, by others or by an earlier run."""
    return bool(trace.stats.get("processing_level") == "processed")


def copied(stream: Iterable[Trace]) -> Stream:
    """
    Return traces with separate notes that share samples and ``stats.response`` with the others.

    Neither is ever changed in place: a step that changes samples assigns new ones. Copies of a day
    of three components took gigabytes, those of the response a quarter of the whole chain.

    Parameters
    ----------
    stream : iterable of obspy Trace

    Returns
    -------
    obspy Stream
    """
    return Stream([copied_trace(trace) for trace in stream])


def copied_trace(trace: Trace) -> Trace:
    """Return one trace as `copied` does."""
    shared = ("response", "endtime")
    own = {name: deepcopy(value) for name, value in trace.stats.items() if name not in shared}
    out = Trace(trace.data, own)
    if "response" in trace.stats:
        out.stats.response = trace.stats.response
    return out


def taken(stream: Stream) -> Iterator[Trace]:
    """
    Yield the traces of a stream while taking them out of it.

    The caller that receives them is their only owner, so that a record of a day leaves memory as
    soon as its next form is there.
    """
    while stream:
        yield stream.pop(0)
