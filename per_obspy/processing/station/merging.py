"""Channels made whole from their pieces; what is missing is a reason, never a zero."""

from collections import defaultdict
from collections.abc import Iterable

import numpy as np
from obspy import Stream, Trace

from per_obspy.errors import RecordRejected, Rejection
from per_obspy.processing.copying import copied
from per_obspy.processing.notes import is_processed
from per_obspy.processing.quality.findings import surviving
from per_obspy.processing.station.splicing import spliced

LARGEST = 1e30  # counts or m/s2; beyond it squares overflow, and no recorder goes there


def merged(stream: Stream) -> tuple[Stream, tuple[Rejection, ...]]:
    """
    Join the pieces of each channel; gaps, masked samples and samples that are not finite are reasons, never zeros.

    Parameters
    ----------
    stream : obspy Stream
        Any number of pieces of any number of channels.

    Returns
    -------
    whole : obspy Stream
        One new float64 trace a channel.
    rejected : tuple of Rejection
        The channels that cannot be joined.
    """
    pieces: dict[tuple[str, bool, str], Stream] = defaultdict(Stream)
    for trace in stream:
        pieces[_channel(trace)] += trace
    firsts = Stream([parts[0] for parts in pieces.values()])
    return surviving(lambda first: _joined(first[0].id, pieces[_channel(first[0])]), firsts)


def _channel(trace: Trace) -> tuple[str, bool, str]:
    """Return the key of the pieces of one channel; its velocity and displacement are others."""
    units = str(trace.stats.get("units", ""))
    return trace.id, is_processed(trace), units if units in ("m/s", "m") else ""


def _joined(name: str, pieces: Stream) -> Stream:
    copies = Stream([_in_float64(piece) for piece in pieces if piece.stats.npts])
    reasons = [f"pieces differ in {field}: {values}" for field, values in _differences(copies)]
    if not copies:
        reasons = ["no samples"]
    if reasons:
        raise RecordRejected(name, *reasons)
    whole = copied(copies).merge(method=0)  # samples that overlap and disagree are masked
    reasons = _holes(whole[0])
    if reasons:
        joined = (
            None if any(seconds > 0 for *_, seconds, _ in copies.get_gaps()) else spliced(copies)
        )
        if joined is None or len(copies) == 1:
            raise RecordRejected(name, *reasons)
        whole = Stream([joined])
    whole[0].data = np.ascontiguousarray(np.ma.getdata(whole[0].data))
    return whole


def _in_float64(trace: Trace) -> Trace:
    out = copied(Stream([trace]))[0]
    out.data = (
        np.ma.asarray(out.data, dtype=np.float64)
        if np.ma.isMA(out.data)
        else out.data.astype(np.float64)
    )
    return out


def _differences(pieces: Iterable[Trace]) -> list[tuple[str, str]]:
    found = []
    for field in ("sampling_rate", "calib", "units"):
        values = {piece.stats.get(field) for piece in pieces}
        if len(values) > 1:
            found.append((field, ", ".join(sorted(map(str, values)))))
    return found


def _holes(trace: Trace) -> list[str]:
    missing = np.ma.getmaskarray(trace.data)
    wrong = ~(np.abs(np.ma.getdata(trace.data)) < LARGEST) & ~missing
    texts = (
        (missing, "samples are missing (gap or contradicting overlap)"),
        (wrong, f"samples are not finite or beyond {LARGEST:g}"),
    )
    times = trace.stats.starttime, trace.stats.delta
    return [
        f"{np.count_nonzero(bad)} of {bad.size} {text}, the first at {times[0] + int(bad.argmax()) * times[1]}"
        for bad, text in texts
        if bad.any()
    ]
