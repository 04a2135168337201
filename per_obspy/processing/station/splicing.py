"""Pieces of one record with contradicting clocks, joined at the overlap where samples agree."""

from functools import reduce

import numpy as np
from obspy import Stream, Trace

from per_obspy.checks import FloatArray
from per_obspy.processing.notes import noted

#: Shortest and longest overlap of two pieces, s.
SHORTEST_OVERLAP, LONGEST_OVERLAP = 2.0, 30.0

#: Smallest correlation of the samples in an overlap, dimensionless.
AGREEMENT = 0.98


def spliced(pieces: Stream) -> Trace | None:
    """
    Join pieces that overlap in time and contradict each other, if they agree at another overlap.

    Recorders that wrote a long record to several files gave each the whole second of its
    clock, off by seconds. The overlap with the highest correlation is used; inside it one piece
    fades into the other.

    Parameters
    ----------
    pieces : obspy Stream
        Of one channel, with equal sampling.

    Returns
    -------
    obspy Trace or None
        From the start of the first piece on; None if no overlap agrees.
    """
    ordered = sorted(pieces, key=lambda piece: piece.stats.starttime)
    return reduce(_spliced_pair, ordered[1:], ordered[0].copy())


def _spliced_pair(first: Trace | None, second: Trace) -> Trace | None:
    """Return two pieces as one trace, None if they agree at no overlap."""
    if first is None:
        return None
    # Overlap by the samples, and by the clocks
    dt = first.stats.delta
    shortest, longest = round(SHORTEST_OVERLAP / dt), round(LONGEST_OVERLAP / dt)
    count, correlation = best_overlap(first.data, second.data, shortest, longest)
    if correlation < AGREEMENT:
        return None
    by_clocks = (first.stats.endtime - second.stats.starttime) / dt + 1
    shift = float(by_clocks - count) * dt
    # The first piece fades into the second
    fade = np.linspace(0, 1, count)
    both = (1 - fade) * first.data[-count:] + fade * second.data[:count]
    out = first.copy()
    out.data = np.concatenate((first.data[:-count], both, second.data[count:]))
    agreement = f"pieces joined where they agree ({correlation:.3f})"
    noted(out, f"{agreement}, {shift:.2f} s from their clocks", splice_shift=shift)
    return out


def best_overlap(
    first: FloatArray, second: FloatArray, shortest: int, longest: int
) -> tuple[int, float]:
    """
    Return the number of samples by which the end of one piece best overlaps the next one.

    Parameters
    ----------
    first, second : (n_samples,) ndarray
        Samples in the same unit.
    shortest, longest : int
        Range of trial overlaps, samples.

    Returns
    -------
    (count, correlation)
        Samples, and their coefficient of correlation; (0, 0.0) if the pieces are too short.
    """
    counts = range(shortest, min(longest, first.size, second.size) + 1)
    matches = [(_correlation(first[-count:], second[:count]), count) for count in counts]
    correlation, count = max(matches, default=(0.0, 0))
    return count, correlation


def _correlation(first: FloatArray, second: FloatArray) -> float:
    """Return the coefficient of correlation, 0 if a part is constant."""
    first, second = first - first.mean(), second - second.mean()
    size = np.sqrt((first @ first) * (second @ second))
    return float(first @ second / size) if size > 0 else 0.0
