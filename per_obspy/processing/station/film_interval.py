"""Resample components of digitised film with different mean intervals to one interval."""

import numpy as np
from obspy import Stream

from per_obspy.processing.notes import noted


def at_one_interval(stream: Stream) -> Stream:
    """
    Return traces of an instrument whose digitised ones share the smallest of their intervals.

    Every component of a film is digitised separately, so that mean intervals differ by some parts
    in a hundred thousand, or more where operators chose the points. Those with a longer interval
    are interpolated linearly; all else stays as it is.

    Parameters
    ----------
    stream : Stream
        Components of one instrument; film has ``stats.digitised``.

    Returns
    -------
    stream : Stream
        In the same order; a trace that was interpolated is a copy with a note.

    Examples
    --------
    >>> from obspy import Trace
    >>> film = {"digitised": True}
    >>> fine, coarse = Trace(np.arange(5.0), film | {"delta": 0.01}), Trace(np.arange(3.0), film)
    >>> coarse.stats.delta = 0.02
    >>> at_one_interval(Stream([fine, coarse]))[1].data
    array([0. , 0.5, 1. , 1.5, 2. ])
    """
    intervals = [trace.stats.delta for trace in stream if trace.stats.get("digitised")]
    dt = min(intervals, default=0.0)
    out = Stream()
    for trace in stream:
        if not trace.stats.get("digitised") or trace.stats.delta == dt:
            out += trace
            continue
        # Times from the first sample, s, old and new
        copy = trace.copy()
        old = trace.stats.delta * np.arange(trace.stats.npts)
        new = dt * np.arange(int(old[-1] / dt + 1e-6) + 1)
        copy.data = np.interp(new, old, trace.data)
        copy.stats.delta = dt
        noted(
            copy, f"film interpolated from {trace.stats.delta:.9g} s to {dt:.9g} s, its partner's"
        )
        out += copy
    return out
