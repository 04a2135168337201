"""Pieces of one record whose clocks contradict their samples: joined where the samples agree."""

from functools import reduce

import numpy as np
from obspy import Stream, Trace

from per_obspy.checks import FloatArray
from per_obspy.processing.notes import noted

SHORTEST_OVERLAP = 2.0  # s


def spliced(pieces: Stream, longest: float = 30.0, agreement: float = 0.98) -> Trace | None:
    """
    Return pieces that overlap in time and contradict each other as one trace, if they agree at another overlap.

    Recorders that wrote a long record to several files stamped each with the whole second of their
    own clock, off by seconds. The overlap with the highest correlation is taken; inside it one
    piece fades into the other.

    Parameters
    ----------
    pieces : obspy Stream
        Of one channel, with equal sampling.
    longest : float
        Longest overlap that is looked for, s.
    agreement : float
        Smallest correlation of the samples in the overlap, dimensionless.

    Returns
    -------
    obspy Trace or None
        From the start of the first piece on; None if no overlap agrees.
    """
    ordered = sorted(pieces, key=lambda piece: piece.stats.starttime)
    return reduce(
        lambda joined, piece: _two(joined, piece, longest, agreement),
        ordered[1:],
        ordered[0].copy(),
    )


def _two(first: Trace | None, second: Trace, longest: float, agreement: float) -> Trace | None:
    if first is None:
        return None
    dt = first.stats.delta
    count, correlation = best_overlap(
        first.data, second.data, round(SHORTEST_OVERLAP / dt), round(longest / dt)
    )
    if correlation < agreement:
        return None
    told = (first.stats.endtime - second.stats.starttime) / dt + 1
    fade = np.linspace(0, 1, count)
    both = (1 - fade) * first.data[-count:] + fade * second.data[:count]
    out = first.copy()
    out.data = np.concatenate((first.data[:-count], both, second.data[count:]))
    shift = float(told - count) * dt
    noted(
        out,
        f"pieces joined where they agree ({correlation:.3f}), {shift:.2f} s from their clocks",
        splice_shift=shift,
    )
    return out


def best_overlap(
    first: FloatArray, second: FloatArray, shortest: int, longest: int
) -> tuple[int, float]:
    """
    Return how many samples at the end of one piece are best matched by the beginning of another.

    Parameters
    ----------
    first, second : (n_samples,) ndarray
        In one unit.
    shortest, longest : int
        Overlaps that are tried, samples.

    Returns
    -------
    (count, correlation)
        Samples, and their coefficient of correlation; (0, 0.0) if the pieces are too short.
    """
    counts = range(shortest, min(longest, first.size, second.size) + 1)
    matches = [(_correlation(first[-count:], second[:count]), count) for count in counts]
    correlation, count = max(matches, default=(0.0, 0))
    return count, correlation


def _correlation(one: FloatArray, other: FloatArray) -> float:
    one, other = one - one.mean(), other - other.mean()
    size = np.sqrt((one @ one) * (other @ other))
    return float(one @ other / size) if size > 0 else 0.0
