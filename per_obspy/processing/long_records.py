"""Long records: parts that are worked on in turn, and plans of transforms that are not kept."""

from collections.abc import Callable, Iterator

import numpy as np
from scipy.fft import rfft

from per_obspy.checks import FloatArray

#: Samples that are worked on at a time; ordinary records have fewer and are worked on at once.
BLOCK = 2**20

#: Plans of transforms that SciPy keeps.
PLANS = 16


def is_long(count: int) -> bool:
    """Return whether a record of so many samples is worked on in parts."""
    return count > BLOCK


def blocks(first: int, last: int) -> Iterator[slice]:
    """Yield the parts of the places from the first to before the last, in their order."""
    for start in range(first, last, BLOCK):
        yield slice(start, min(start + BLOCK, last))


def by_blocks(
    running: Callable[[FloatArray], FloatArray], values: FloatArray, margin: int
) -> FloatArray:
    """
    Return the output of a running filter, block by block.

    SciPy's filters hold three copies of a series.

    Parameters
    ----------
    running : callable
        From values to as many values.
    values : (n_values,) ndarray
    margin : int
        Neighbours on each side on which a value of the filter depends, at most.

    Returns
    -------
    (n_values,) ndarray
    """
    out = np.empty(values.size)
    for block in blocks(0, values.size):
        first = max(block.start - margin, 0)
        part = running(values[first : block.stop + margin])
        out[block] = part[block.start - first : block.stop - first]
    return out


def forget_plans(length: int) -> None:
    """
    Make SciPy forget the plan of a long transform, which takes as much memory as the record.

    SciPy keeps the plans of the last transforms of real series: short ones take their places.
    """
    if is_long(length):
        for short in range(1, PLANS + 1):
            rfft(np.zeros(short))
