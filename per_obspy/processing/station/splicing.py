"""Pieces of one record with contradicting clocks, joined at the overlap where samples agree."""

import math
from functools import reduce

import numpy as np
from obspy import Stream, Trace

from per_obspy.checks import FloatArray
from per_obspy.processing.notes import noted

#: Shortest and longest overlap of two pieces, s.
SHORTEST_OVERLAP, LONGEST_OVERLAP = 2.0, 30.0

#: Smallest concordance of the samples in an overlap, dimensionless.
AGREEMENT = 0.98

#: Largest error between the clocks of two pieces, s: reasoned, records of Maule 2010 are up to 13 s
#: off. Two copies of which one is shifted overlap by more than that.
LARGEST_SHIFT = 20.0


def spliced(pieces: Stream) -> Trace | None:
    """
    Join pieces that overlap in time and contradict each other, if they agree at another overlap.

    Recorders that wrote a long record to several files gave each the whole second of its
    clock, off by seconds. The overlap with the highest concordance (Lin 1989, Biometrics 45) is
    used: copies of another size or mean do not agree. Inside it one piece fades into the other.

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
    # Overlap by the clocks, and by the samples
    dt = first.stats.delta
    by_clocks = float((first.stats.endtime - second.stats.starttime) / dt + 1)
    count, agreement = _agreed_overlap(first, second, by_clocks)
    if agreement < AGREEMENT:
        return None
    shift = (by_clocks - count) * dt
    # The first piece fades into the second
    fade = np.linspace(0, 1, count)
    both = (1 - fade) * first.data[-count:] + fade * second.data[:count]
    out = first.copy()
    out.data = np.concatenate((first.data[:-count], both, second.data[count:]))
    place = f"pieces joined where they agree ({agreement:.3f}), {shift:.2f} s from their clocks"
    noted(out, place, splice_shift=shift)
    return out


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

    Parameters
    ----------
    first, second : (n_samples,) ndarray
        Samples in the same unit.
    shortest, longest : int
        Range of trial overlaps, samples.

    Returns
    -------
    (count, concordance)
        Samples, and the coefficient of concordance, dimensionless; (0, 0.0) if the pieces are too
        short.
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
