"""Scratch memory at cache lines: per_obspy.kernels._aligned."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from per_obspy.kernels._aligned import aligned, aligned_copy, aligned_line, store_line


@pytest.mark.parametrize("rows", [1, 3, 8])
def test_memory_starts_at_a_cache_line(rows):
    # mutation: the remainder the wrong way round
    memory = aligned(rows, 5)
    assert memory.shape == (rows, 5)
    assert memory.flags.c_contiguous
    assert memory.ctypes.data % 64 == 0


def test_a_line_is_the_rows_of_a_table_one_after_the_other():
    # mutations: rows and columns exchanged, a row too many stored
    table = np.arange(12.0).reshape(4, 3)
    line = aligned_line(table, 2, 3)
    assert_array_equal(line, np.arange(6.0))
    assert_array_equal(aligned_copy(table, 2, 3), table[:2])
    stored = np.full((4, 3), -1.0)
    store_line(line, stored, 2)
    assert_array_equal(stored[:2], table[:2])
    assert (stored[2:] == -1.0).all()
