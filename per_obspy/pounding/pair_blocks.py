"""Many pairs against one record in blocks of 32: their table of structures, and the memory that a block works in."""

import numpy as np
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.kernels.pounding_lanes import LANES

#: Bytes of a line of the processor's cache.
CACHE_LINE = 64


def pair_table(fields: dict[str, FloatArray]) -> FloatArray:
    """Return the kernels' table of structures, (n_pairs, 2, 6)."""
    table = np.empty((fields["gap"].size, 2, 6))
    for i, name in enumerate(("1", "2")):
        frequency = 2.0 * np.pi / fields[f"period_{name}"]
        table[:, i, 0] = fields[f"damping_{name}"] * frequency
        table[:, i, 1] = frequency**2
        table[:, i, 2] = fields[f"hardening_{name}"]
        table[:, i, 3] = fields[f"yield_displacement_{name}"]
        table[:, i, 4] = fields[f"participation_{name}"]
        table[:, i, 5] = fields[f"mass_{name}"]
    walls = np.flatnonzero(np.isinf(table[:, :, 5]).all(axis=1))
    if walls.size:
        raise ValueError(f"mass_1 and mass_2 must not both be infinite, got inf at index {walls[0]}")
    return table


def aligned(size: int) -> FloatArray:
    """Return zeros that begin at a cache line: a step of vectors that straddle two lines takes a third longer."""
    numbers = np.zeros(size + CACHE_LINE // 8)
    first = -numbers.ctypes.data % CACHE_LINE // 8
    return numbers[first : first + size]


def pair_blocks(refinements: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Return the pairs of each block: at most 32, of equal refinement."""
    blocks = []
    for parts in np.unique(refinements):
        same = np.flatnonzero(refinements == parts)
        blocks += [same[start : start + LANES] for start in range(0, same.size, LANES)]
    return blocks
