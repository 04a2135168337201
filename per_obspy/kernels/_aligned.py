"""Scratch space that begins where a cache line does: vectors as wide as a line would else take two loads each."""

import numpy as np

from per_obspy.kernels._jit import kernel

#: Bytes of a number and numbers of a cache line.
SIZE, LINE = 8, 8


@kernel
def aligned(rows, columns):
    """Return an uninitialised array (rows, columns) of numbers."""
    space = np.empty(rows * columns + LINE)
    start = -(space.ctypes.data // SIZE) % LINE
    return space[start : start + rows * columns].reshape((rows, columns))
