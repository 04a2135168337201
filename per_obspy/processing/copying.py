"""Copies of raw traces that share the response: nobody changes it, and copying it took a quarter of the whole chain."""

from copy import deepcopy

from obspy import Stream, Trace


def copied(stream: Stream) -> Stream:
    """
    Return a copy of every trace with the same ``stats.response``.

    Parameters
    ----------
    stream : obspy Stream

    Returns
    -------
    obspy Stream
    """
    return Stream([_copied(trace) for trace in stream])


def _copied(trace: Trace) -> Trace:
    own = {
        name: deepcopy(value)
        for name, value in trace.stats.items()
        if name not in ("response", "endtime")
    }
    out = Trace(trace.data.copy(), own)
    if "response" in trace.stats:
        out.stats.response = trace.stats.response
    return out
