"""Scratch memory at cache lines: per_obspy.kernels._aligned."""

import pytest

from per_obspy.kernels._aligned import aligned


@pytest.mark.parametrize("rows", [1, 3, 8])
def test_memory_starts_at_a_cache_line(rows):
    # mutation: the remainder the wrong way round
    memory = aligned(rows, 5)
    assert memory.shape == (rows, 5)
    assert memory.flags.c_contiguous
    assert memory.ctypes.data % 64 == 0
