"""Blocks of pairs: checked arguments, one table, and blocks that hold every pair once."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from per_obspy.kernels.pounding_events.motion import ROW_COLUMNS
from per_obspy.kernels.pounding_lanes.lanes import PAIR_LANES
from per_obspy.pounding.kernel_tables import (
    CACHE_LINE,
    aligned,
    pair_blocks,
    pair_table,
    structure_table,
)
from per_obspy.pounding.structure import Pairs, Structure


def test_the_table_is_that_of_single_structures():
    # mutation: structures or columns exchanged; every value differs, so that an exchange shows
    random = np.random.default_rng(1)
    ranges = {"period": 3.0, "damping": 0.2, "mass": 2.0, "yield_displacement": 0.1,
              "hardening": 0.2, "participation": 1.5}  # fmt: skip
    fields = {
        f"{name}_{i}": random.uniform(0.0, top, 5) for name, top in ranges.items() for i in (1, 2)
    }
    for pair, rows in enumerate(pair_table(Pairs.of(**fields))):
        first = Structure(*(fields[f"{name}_1"][pair] for name in ranges))
        second = Structure(*(fields[f"{name}_2"][pair] for name in ranges))
        np.testing.assert_allclose(rows, structure_table([first, second]), rtol=1e-14)


def test_two_walls_are_refused():
    walls = Pairs.of(period_1=1.0, period_2=1.0, mass_1=[1.0, np.inf, 1.0], mass_2=np.inf)
    with pytest.raises(ValueError, match="must not both be infinite, got inf at index 1"):
        pair_table(walls)


@given(st.lists(st.sampled_from([1, 2, 8]), max_size=200))
def test_every_pair_is_in_one_block_with_its_equals(parts):
    parts = np.array(parts, dtype=np.int64)
    rows = np.random.default_rng(0).random((parts.size, 2, ROW_COLUMNS))
    blocks = pair_blocks(parts, rows)
    members = [index for block in blocks for index in block]
    assert sorted(members) == list(range(parts.size))
    assert all(len(block) <= PAIR_LANES and len(set(parts[block])) == 1 for block in blocks)


@given(st.integers(1, 1000))
def test_memory_begins_at_a_cache_line(size):
    memory = aligned(size)
    assert memory.shape == (size,)
    assert memory.ctypes.data % CACHE_LINE == 0
    assert not memory.any()
