"""Channels joined from their pieces; missing samples reject a channel and never become zeros."""

from collections import defaultdict
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from obspy import Stream, Trace

from per_obspy.checks import FloatArray
from per_obspy.errors import RecordRejected, Rejection
from per_obspy.processing.instrument_response import as_recorded
from per_obspy.processing.notes import copied_trace, is_processed, taken
from per_obspy.processing.quality.findings import surviving
from per_obspy.processing.station.components import SAMPLING_TOLERANCE
from per_obspy.processing.station.splicing import spliced

#: Largest sample, counts or m/s2: squares of larger ones overflow, and no recorder writes them.
LARGEST = 1e30

#: Most samples that may be missing between pieces, reasoned: two days at 100 Hz. A wrong date must
#: not take the memory of years.
MOST_MISSING = 2**24

#: Difference of coordinates of one place, degrees.
SAME_PLACE = 0.01


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


def _pieces(stream: Iterable[Trace]) -> dict[tuple[str, bool, str, str], Stream]:
    """Return the pieces of each channel."""
    pieces: dict[tuple[str, bool, str, str], Stream] = defaultdict(Stream)
    for trace in stream:
        pieces[_channel(trace)] += trace
    return pieces


def _channel(trace: Trace) -> tuple[str, bool, str, str]:
    """
    Return the key of the pieces of one channel.

    Its velocity and displacement are others, and so are directions that the reader does not know.
    """
    units = str(trace.stats.get("units", ""))
    direction = str(trace.stats.get("direction", ""))
    return trace.id, is_processed(trace), units if units in ("m/s", "m") else "", direction


def _joined(name: str, pieces: Stream) -> Stream:
    """Return the pieces of one channel as one trace."""
    copies = Stream([_in_float64(as_recorded(piece)) for piece in pieces if piece.stats.npts])
    reasons = _differences(copies) if copies else ["no samples"]
    if reasons:
        raise RecordRejected(name, *reasons)
    # All pieces are compared before any is joined
    whole, contradicts = _overlaid(copies)
    reasons = _holes(whole, contradicts)
    # Overlapping pieces may still agree at other times than their clocks have
    if reasons:
        joined = None if _has_gaps(copies) else spliced(copies)
        if joined is None or len(copies) == 1:
            raise RecordRejected(name, *reasons)
        whole = joined
    whole.data = np.ascontiguousarray(np.ma.getdata(whole.data))
    return Stream([whole])


def _in_float64(trace: Trace) -> Trace:
    """Return a copy in float64, masked if the samples were masked."""
    out = copied_trace(trace)
    out.data = out.data.astype(np.float64)
    return out


def _overlaid(pieces: Stream) -> tuple[Trace, NDArray[np.bool_]]:
    """
    Return all pieces on the samples of the first one, masked where none has any, and the conflicts.

    Clocks that differ by a fraction of a sample follow the first piece. A sample is in conflict
    where any two pieces differ.
    """
    ordered = sorted(pieces, key=lambda piece: piece.stats.starttime)
    if len(ordered) == 1:
        return ordered[0], np.zeros(ordered[0].stats.npts, dtype=bool)
    # The interval of the longest piece, by which its last sample is in its place
    out = copied_trace(ordered[0])
    out.stats.delta = max(ordered, key=lambda piece: piece.stats.npts).stats.delta
    spans = _spans(ordered, out.stats.delta)
    count = max(span.stop for span in spans)
    samples, is_filled, contradicts = np.zeros(count), *np.zeros((2, count), dtype=bool)
    for span, piece in zip(spans, ordered, strict=True):
        _lay(piece, samples[span], is_filled[span], contradicts[span])
    # Masked only where it must be
    out.data = samples if is_filled.all() else np.ma.masked_array(samples, ~is_filled)
    return out, contradicts


def _lay(
    piece: Trace,
    samples: FloatArray,
    is_filled: NDArray[np.bool_],
    contradicts: NDArray[np.bool_],
) -> None:
    """Compare a piece with the samples that are there already, and write it in their place."""
    part, is_present = np.ma.getdata(piece.data), ~np.ma.getmaskarray(piece.data)
    contradicts |= is_present & is_filled & (samples != part)
    samples[is_present] = part[is_present]
    is_filled |= is_present


def _spans(ordered: list[Trace], dt: float) -> list[slice]:
    """Return the places of the samples of each piece, in steps of an interval, s."""
    start, samples, spans = ordered[0].stats.starttime, 0, []
    for piece in ordered:
        first = round((piece.stats.starttime - start) / dt)
        spans.append(slice(first, first + piece.stats.npts))
        samples += piece.stats.npts
    # All of them would be in memory
    count = max(span.stop for span in spans)
    if count > MOST_MISSING + samples:
        raise RecordRejected(ordered[0].id, f"pieces are up to {count * dt:g} s apart")
    return spans


def _has_gaps(pieces: Stream) -> bool:
    """Return whether time is missing between pieces; overlaps are negative gaps."""
    return any(seconds > 0 for *_, seconds, _ in pieces.get_gaps())


def _differences(pieces: Stream) -> list[str]:
    """Return the properties in which the pieces of a channel differ, with their values."""
    places = [piece.stats.get("coordinates") or {} for piece in pieces]
    fields: dict[str, list[Any]] = {
        "sampling_rate": [piece.stats.sampling_rate for piece in pieces],
        "calib": [piece.stats.calib for piece in pieces],
        "sensitivity": [_sensitivity(piece) for piece in pieces],
        "latitude": [place.get("latitude") for place in places],
        "longitude": [place.get("longitude") for place in places],
    }
    # Rounding is no difference, neither are two descriptions of one place
    reasons = []
    for field, values in fields.items():
        known = [value for value in values if value is not None]
        margin = SAME_PLACE if field in ("latitude", "longitude") else 0.0
        if not np.allclose(known, known[:1] or 0.0, SAMPLING_TOLERANCE, margin):
            reasons.append(_difference(field, known))
    # Counts are what has no unit
    units = [str(piece.stats.get("units", "counts")) for piece in pieces]
    return reasons if len(set(units)) == 1 else [*reasons, _difference("units", units)]


def _difference(field: str, values: list[Any]) -> str:
    """Return the reason for a property in which pieces differ."""
    return f"pieces differ in {field}: {', '.join(sorted(set(map(str, values))))}"


def _sensitivity(trace: Trace) -> float | None:
    """Return the overall sensitivity of the response, None where there is none."""
    response = trace.stats.get("response")
    sensitivity = response.instrument_sensitivity if response else None
    return sensitivity.value if sensitivity else None


def _holes(trace: Trace, contradicts: NDArray[np.bool_]) -> list[str]:
    """Return the reasons for missing and unusable samples, with their number and first time."""
    is_missing = np.ma.getmaskarray(trace.data)
    is_wrong = ~(np.abs(np.ma.getdata(trace.data)) < LARGEST) & ~is_missing
    faults = {
        "samples are missing (a gap)": is_missing,
        "samples contradict each other in overlapping pieces": contradicts,
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
