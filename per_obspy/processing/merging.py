"""Channels joined from their pieces; missing samples reject a channel and never become zeros."""

import math
from collections import defaultdict
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from obspy import Stream, Trace

from per_obspy.checks import FloatArray
from per_obspy.errors import RecordRejected, Rejection
from per_obspy.processing.account import copy_header, is_processed, survivors, with_note
from per_obspy.processing.components import SAMPLING_TOLERANCE
from per_obspy.processing.instrument_response import as_recorded

#: Largest sample, counts or m/s2: squares of larger ones overflow, and no recorder writes them.
LARGEST = 1e30

#: Most samples that may be missing between pieces, reasoned: two days at 100 Hz. A wrong date must
#: not take the memory of years.
MOST_MISSING = 2**24

#: Difference of coordinates of one place, degrees.
SAME_PLACE = 0.01

#: Shortest and longest overlap of two pieces whose clocks contradict each other, s.
SHORTEST_OVERLAP, LONGEST_OVERLAP = 2.0, 30.0

#: Smallest concordance of the samples in an overlap, dimensionless.
AGREEMENT = 0.98

#: Largest error between the clocks of two pieces, s: reasoned, records of Maule 2010 are up to 13 s
#: off. Two copies of which one is shifted overlap by more than that.
LARGEST_SHIFT = 20.0


def merged(stream: Iterable[Trace]) -> tuple[Stream, tuple[Rejection, ...]]:
    """
    Join the pieces of each channel to one new float64 trace; reject those that cannot be joined.

    Gaps, masked samples and samples that are not finite are reasons for rejection, never zeros.
    """
    pieces: dict[tuple[str, bool, str, str], list[Trace]] = defaultdict(list)
    for trace in stream:
        pieces[_channel(trace)].append(trace)
    return survivors(
        lambda first: _join(first.id, pieces.pop(_channel(first))),
        (parts[0] for parts in pieces.values()),
    )


def _channel(trace: Trace) -> tuple[str, bool, str, str]:
    """
    Return the key of the pieces of one channel.

    Its velocity and displacement are others, and so are directions that the reader does not know.
    """
    units = str(trace.stats.get("units", ""))
    direction = str(trace.stats.get("direction", ""))
    return trace.id, is_processed(trace), units if units in ("m/s", "m") else "", direction


def _join(name: str, pieces: list[Trace]) -> Trace:
    """Return the pieces of one channel as one trace."""
    copies = []
    for piece in pieces:
        if piece.stats.npts:
            copies.append(copy_header(as_recorded(piece)))
            copies[-1].data = piece.data.astype(np.float64)
    reasons = _differences(copies) if copies else ["no samples"]
    if reasons:
        raise RecordRejected(name, *reasons)
    # All pieces are compared before any is joined
    whole, contradicts = _overlay(copies)
    reasons = _holes(whole, contradicts)
    # Overlapping pieces may still agree at other times than their clocks have
    if reasons:
        has_gaps = any(seconds > 0 for *_, seconds, _ in Stream(copies).get_gaps())
        joined = None if has_gaps or len(copies) == 1 else splice(copies)
        if joined is None:
            raise RecordRejected(name, *reasons)
        whole = joined
    whole.data = np.ascontiguousarray(np.ma.getdata(whole.data))
    return whole


def _differences(pieces: list[Trace]) -> list[str]:
    """Return the properties in which the pieces of a channel differ, with their values."""
    # Numbers of each piece where it has them
    fields: dict[str, list[Any]] = defaultdict(list)
    for piece in pieces:
        place = piece.stats.get("coordinates") or {}
        sensitivity = getattr(piece.stats.get("response"), "instrument_sensitivity", None)
        fields["sampling_rate"].append(piece.stats.sampling_rate)
        fields["calib"].append(piece.stats.calib)
        fields["sensitivity"].append(sensitivity.value if sensitivity else None)
        fields["latitude"].append(place.get("latitude"))
        fields["longitude"].append(place.get("longitude"))
        # Counts are what has no unit
        fields["units"].append(str(piece.stats.get("units", "counts")))
    return [
        f"pieces differ in {field}: {', '.join(sorted(set(map(str, values))))}"
        for field, values in fields.items()
        if not _are_equal(field, values)
    ]


def _are_equal(field: str, values: list[Any]) -> bool:
    """Return whether values differ by rounding at most, or places by two descriptions of one."""
    if field == "units":
        return len(set(values)) == 1
    numbers = [value for value in values if value is not None]
    margin = SAME_PLACE if field in ("latitude", "longitude") else 0.0
    return np.allclose(numbers, numbers[:1] or 0.0, SAMPLING_TOLERANCE, margin)


def _overlay(pieces: list[Trace]) -> tuple[Trace, NDArray[np.bool_]]:
    """
    Return all pieces on the samples of the first one, masked where none has any, and the conflicts.

    Clocks that differ by a fraction of a sample follow the first piece. A sample is in conflict
    where any two pieces differ.
    """
    ordered = sorted(pieces, key=lambda piece: piece.stats.starttime)
    if len(ordered) == 1:
        return ordered[0], np.zeros(ordered[0].stats.npts, dtype=bool)
    # The interval of the longest piece, by which its last sample is in its place
    out = copy_header(ordered[0])
    out.stats.delta = max(ordered, key=lambda piece: piece.stats.npts).stats.delta
    spans = _spans(ordered, out.stats.delta)
    count = max(span.stop for span in spans)
    samples, is_filled, contradicts = np.zeros(count), *np.zeros((2, count), dtype=bool)
    for span, piece in zip(spans, ordered, strict=True):
        _lay(piece, samples[span], is_filled[span], contradicts[span])
    # Masked only where it must be
    out.data = samples if is_filled.all() else np.ma.masked_array(samples, ~is_filled)
    return out, contradicts


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


def _holes(trace: Trace, contradicts: NDArray[np.bool_]) -> list[str]:
    """Return the reasons for missing and unusable samples, with their number and first time."""
    is_missing = np.ma.getmaskarray(trace.data)
    faults = {
        "samples are missing (a gap)": is_missing,
        "samples contradict each other in overlapping pieces": contradicts,
        f"samples are not finite or beyond {LARGEST:g}": ~(
            np.abs(np.ma.getdata(trace.data)) < LARGEST
        )
        & ~is_missing,
    }
    # Number and first time of the samples of each fault
    reasons = []
    for fault, samples in faults.items():
        if samples.any():
            first = trace.stats.starttime + int(samples.argmax()) * trace.stats.delta
            count = f"{np.count_nonzero(samples)} of {samples.size}"
            reasons.append(f"{count} {fault}, the first at {first}")
    return reasons


def splice(pieces: Sequence[Trace]) -> Trace | None:
    """
    Join pieces that overlap in time and contradict each other, if they agree at another overlap.

    Recorders that wrote a long record to several files gave each the whole second of its
    clock, off by seconds. The overlap with the highest concordance (Lin 1989, Biometrics 45) is
    used: copies of another size or mean do not agree. Inside it one piece fades into the other.
    None if no overlap of the pieces, which share a channel and its sampling, agrees.
    """
    whole, *others = sorted(pieces, key=lambda piece: piece.stats.starttime)
    for piece in others:
        # Overlap by the clocks, and by the samples
        dt = whole.stats.delta
        by_clocks = float((whole.stats.endtime - piece.stats.starttime) / dt + 1)
        count, agreement = _agreed_overlap(whole, piece, by_clocks)
        if agreement < AGREEMENT:
            return None
        # The first piece fades into the second
        shift, fade = (by_clocks - count) * dt, np.linspace(0, 1, count)
        both = (1 - fade) * whole.data[-count:] + fade * piece.data[:count]
        samples = np.concatenate((whole.data[:-count], both, piece.data[count:]))
        place = f"pieces joined where they agree ({agreement:.3f}), {shift:.2f} s from their clocks"
        whole = with_note(whole, place, samples, splice_shift=shift)
    return whole


def _agreed_overlap(first: Trace, second: Trace, by_clocks: float) -> tuple[int, float]:
    """Return the best overlap of two pieces, samples, and its concordance, 0 if there is none."""
    # By their clocks one covers the other: they are copies, not parts
    if by_clocks >= min(first.stats.npts, second.stats.npts):
        return 0, 0.0
    rate = first.stats.sampling_rate
    shortest = max(round(SHORTEST_OVERLAP * rate), math.ceil(by_clocks - LARGEST_SHIFT * rate))
    longest = min(round(LONGEST_OVERLAP * rate), math.floor(by_clocks + LARGEST_SHIFT * rate))
    return best_overlap(first.data, second.data, shortest, longest)


def best_overlap(
    first: FloatArray, second: FloatArray, shortest: int, longest: int
) -> tuple[int, float]:
    """
    Return the number of samples by which the end of one piece best overlaps the next one.

    Trial overlaps run from the shortest to the longest. With the coefficient of concordance,
    dimensionless; (0, 0.0) if the pieces are too short.
    """
    counts = range(shortest, min(longest, first.size, second.size) + 1)
    matches = [(_concordance(first[-count:], second[:count]), count) for count in counts]
    concordance, count = max(matches, default=(0.0, 0))
    return count, concordance


def _concordance(first: FloatArray, second: FloatArray) -> float:
    """Return Lin's coefficient of concordance, 0 if both parts are constant."""
    between = first.size * (first.mean() - second.mean()) ** 2
    first, second = first - first.mean(), second - second.mean()
    size = first @ first + second @ second + between
    return float(2 * first @ second / size) if size > 0 else 0.0
