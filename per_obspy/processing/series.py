"""
Series of samples: blocks of long ones, runs of equal conditions, energy, running sizes, lines.

Ordinary records are worked on at once; a record of a day in blocks, as the temporary arrays of
most functions would take several times its memory.
"""

from collections.abc import Callable, Iterator
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.fft import rfft
from scipy.ndimage import uniform_filter1d

from per_obspy.checks import FloatArray

#: Samples that are worked on at a time; ordinary records have fewer and are worked on at once.
BLOCK = 2**20

#: Plans of transforms that SciPy keeps.
PLANS = 16

#: Share of the squared acceleration at which the significant shaking ends.
SIGNIFICANT = 0.95


def is_long(count: int) -> bool:
    """Return whether a record of so many samples is worked on in parts."""
    return count > BLOCK


def blocks(first: int, last: int) -> Iterator[slice]:
    """Yield the parts of the places from the first to before the last, in their order."""
    for start in range(first, last, BLOCK):
        yield slice(start, min(start + BLOCK, last))


def filter_blocks(
    running: Callable[[FloatArray], FloatArray], values: FloatArray, margin: int
) -> FloatArray:
    """
    Return the output of a running filter, block by block: SciPy's filters hold three copies.

    The filter gives as many values as it gets, each of which depends on at most ``margin``
    neighbours on each side.
    """
    out = np.empty(values.size)
    for block in blocks(0, values.size):
        first = max(block.start - margin, 0)
        part = running(values[first : block.stop + margin])
        out[block] = part[block.start - first : block.stop - first]
    return out


def first_least(values: Callable[[slice], FloatArray], first: int, last: int) -> int | None:
    """Return the first place of the least value, computed block by block; None without places."""
    least = list[tuple[float, int]]()
    for block in blocks(first, last):
        part = values(block)
        place = int(part.argmin())
        least.append((float(part[place]), block.start + place))
    return min(least)[1] if least else None


def forget_plans(length: int) -> None:
    """
    Make SciPy forget the plan of a long transform, which takes as much memory as the record.

    SciPy keeps the plans of the last transforms of real series: short ones take their places.
    """
    if is_long(length):
        for short in range(1, PLANS + 1):
            rfft(np.zeros(short))


def runs(values: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the first position of each run of true values, and the position after its end."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], values, [False]))))
    return edges[::2], edges[1::2]


def significant_samples(acceleration: FloatArray) -> int:
    """Return the number of samples from the first on that have 95 % of the squared motion."""
    energy = np.square(acceleration)
    np.cumsum(energy, out=energy)
    return int(np.searchsorted(energy, SIGNIFICANT * energy[-1])) + 1


def integral(samples: FloatArray, dt: float) -> FloatArray:
    """
    Return the running integral of samples by the trapezoidal rule, from 0 at the first one.

    SciPy's takes the memory of four more records.
    """
    out = np.zeros(samples.size)
    areas = np.add(samples[:-1], samples[1:], out=out[1:])
    areas *= dt
    areas /= 2.0
    return np.cumsum(out, out=out)


def running_rms(
    samples: FloatArray, seconds: float, dt: float, mode: Literal["reflect", "constant"]
) -> FloatArray:
    """Return the running root mean square of samples over a time, s."""
    width = max(round(seconds / dt), 1)

    def root_mean_square(part: FloatArray) -> FloatArray:
        means = uniform_filter1d(part**2, width, mode=mode)
        # Rounding of the running sum may leave small negative values
        return np.asarray(np.sqrt(np.maximum(means, 0)))

    return filter_blocks(root_mean_square, samples, width)


def without_line(data: FloatArray) -> FloatArray:
    """
    Return evenly spaced samples without their least-squares straight line, in a new array.

    The line is the mean and a multiple of places that are orthogonal to it.
    """
    line = np.linspace(-1, 1, data.size)
    slope = (line @ data) / (line @ line)
    # The places give way to the values of the line there
    line *= slope
    line += data.mean()
    return np.subtract(data, line, out=line)
