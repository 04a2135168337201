"""Channels joined from their pieces; missing samples reject a channel and never become zeros."""

from collections import defaultdict
from collections.abc import Iterable

import numpy as np
from obspy import Stream, Trace

from per_obspy.errors import RecordRejected, Rejection
from per_obspy.processing.notes import copied, copied_trace, is_processed, taken
from per_obspy.processing.quality.findings import surviving
from per_obspy.processing.station.splicing import spliced

#: Largest sample, counts or m/s2: squares of larger ones overflow, and no recorder writes them.
LARGEST = 1e30


def merged(stream: Iterable[Trace]) -> tuple[Stream, tuple[Rejection, ...]]:
    """
    Join the pieces of each channel.

    Gaps, masked samples and samples that are not finite are reasons for rejection, never zeros.

    Parameters
    ----------
    stream : iterable of obspy Trace
        Any number of pieces of any number of channels.

    Returns
    -------
    whole : obspy Stream
        One new float64 trace per channel.
    rejected : tuple of Rejection
        The channels that cannot be joined.
    """
    pieces = _pieces(stream)
    firsts = Stream([parts[0] for parts in pieces.values()])

    def joined(first: Stream) -> Stream:
        return _joined(first[0].id, pieces.pop(_channel(first[0])))

    return surviving(joined, taken(firsts))


def _pieces(stream: Iterable[Trace]) -> dict[tuple[str, bool, str], Stream]:
    """Return the pieces of each channel."""
    pieces: dict[tuple[str, bool, str], Stream] = defaultdict(Stream)
    for trace in stream:
        pieces[_channel(trace)] += trace
    return pieces


def _channel(trace: Trace) -> tuple[str, bool, str]:
    """Return the key of the pieces of one channel; its velocity and displacement are others."""
    units = str(trace.stats.get("units", ""))
    return trace.id, is_processed(trace), units if units in ("m/s", "m") else ""


def _joined(name: str, pieces: Stream) -> Stream:
    """Return the pieces of one channel as one trace."""
    copies = Stream([_in_float64(piece) for piece in pieces if piece.stats.npts])
    reasons = [f"pieces differ in {field}: {values}" for field, values in _differences(copies)]
    if not copies:
        reasons = ["no samples"]
    if reasons:
        raise RecordRejected(name, *reasons)
    # Samples that overlap and disagree are masked
    whole = copied(copies).merge(method=0)
    reasons = _holes(whole[0])
    # Overlapping pieces may still agree at other times than their clocks have
    if reasons:
        joined = None if _has_gaps(copies) else spliced(copies)
        if joined is None or len(copies) == 1:
            raise RecordRejected(name, *reasons)
        whole = Stream([joined])
    whole[0].data = np.ascontiguousarray(np.ma.getdata(whole[0].data))
    return whole


def _in_float64(trace: Trace) -> Trace:
    """Return a copy in float64, masked if the samples were masked."""
    out = copied_trace(trace)
    out.data = out.data.astype(np.float64)
    return out


def _has_gaps(pieces: Stream) -> bool:
    """Return whether time is missing between pieces; overlaps are negative gaps."""
    return any(seconds > 0 for *_, seconds, _ in pieces.get_gaps())


def _differences(pieces: Iterable[Trace]) -> list[tuple[str, str]]:
    """Return name and values of each property in which the pieces of a channel differ."""
    found = []
    for field in ("sampling_rate", "calib", "units"):
        values = {piece.stats.get(field) for piece in pieces}
        if len(values) > 1:
            found.append((field, ", ".join(sorted(map(str, values)))))
    return found


def _holes(trace: Trace) -> list[str]:
    """Return the reasons for missing and unusable samples, with their number and first time."""
    is_missing = np.ma.getmaskarray(trace.data)
    is_wrong = ~(np.abs(np.ma.getdata(trace.data)) < LARGEST) & ~is_missing
    faults = {
        "samples are missing (gap or contradicting overlap)": is_missing,
        f"samples are not finite or beyond {LARGEST:g}": is_wrong,
    }
    # Number and first time of the samples of each fault
    reasons = []
    for fault, samples in faults.items():
        if samples.any():
            count = np.count_nonzero(samples)
            first = trace.stats.starttime + int(samples.argmax()) * trace.stats.delta
            reasons.append(f"{count} of {samples.size} {fault}, the first at {first}")
    return reasons
