"""Scratch memory that begins at a cache line: full-width vectors would else take two loads each."""

import numpy as np

from per_obspy.kernels._jit import kernel

#: Bytes of a number, and numbers of a cache line.
NUMBER_BYTES, LINE_NUMBERS = 8, 8


@kernel
def aligned(rows, columns):
    """Return an uninitialised array (rows, columns) of float64 that begins at a cache line."""
    memory = np.empty(rows * columns + LINE_NUMBERS)
    start = -(memory.ctypes.data // NUMBER_BYTES) % LINE_NUMBERS
    return memory[start : start + rows * columns].reshape((rows, columns))
