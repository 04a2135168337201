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


@kernel
def aligned_copy(table, rows, columns):
    """Return a copy of a table, of a size that the compiler knows: it makes vectors."""
    # An assignment of arrays would compile the text of an error about their shapes
    local = aligned(rows, columns)
    for row in range(rows):
        for column in range(columns):
            local[row, column] = table[row, column]
    return local


@kernel
def aligned_line(table, rows, columns):
    """Return a copy of the first rows of a table in one line, which needs one pointer only."""
    line = aligned(1, rows * columns)[0]
    for row in range(rows):
        for column in range(columns):
            line[row * columns + column] = table[row, column]
    return line


@kernel
def aligned_single(numbers):
    """Return an uninitialised line of float32 that begins at a cache line."""
    memory = np.empty(numbers + 2 * LINE_NUMBERS, np.float32)
    start = -(memory.ctypes.data // (NUMBER_BYTES // 2)) % (2 * LINE_NUMBERS)
    return memory[start : start + numbers]


@kernel
def store_line(line, table, rows):
    """Store a line in the first rows of a table."""
    for row in range(rows):
        for column in range(table.shape[1]):
            table[row, column] = line[row * table.shape[1] + column]
