"""Blocks of pairs: checked arguments, one table, and blocks that hold every pair once."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from per_obspy.kernels.pounding_events.motion import ROW_COLUMNS
from per_obspy.kernels.pounding_lanes.lanes import PAIR_LANES
from per_obspy.pounding.kernel_tables import (
    CACHE_LINE,
    CHECKS,
    aligned,
    free_samples,
    free_vibration_steps,
    pair_blocks,
    pair_fields,
    pair_table,
    refinements,
    structure_table,
)
from per_obspy.pounding.structure import Structure


def test_arguments_broadcast_to_one_value_per_pair():
    fields, shape = pair_fields(period_1=[[1.0], [2.0]], gap=[0.1, 0.2, 0.3])
    assert shape == (2, 3)
    assert fields["period_1"].tolist() == [1.0, 1.0, 1.0, 2.0, 2.0, 2.0]
    assert fields["gap"].tolist() == [0.1, 0.2, 0.3] * 2


@pytest.mark.parametrize("name", CHECKS)
def test_every_argument_is_checked_under_its_own_name(name):
    # mutation: a check left out, the name of structure 1 for structure 2
    for argument in (name, f"{name}_2"):
        with pytest.raises(ValueError, match=rf"^{argument} "):
            pair_fields(**{argument: np.nan})


def _fields(count):
    """Return random structures, some stiff against a sampling interval."""
    random = np.random.default_rng(1)
    # every value differs, so that an exchange shows
    fields = {"gap": np.zeros(count)}
    for structure in (1, 2):
        fields[f"period_{structure}"] = random.uniform(0.02, 3.0, count)
        fields[f"damping_{structure}"] = random.uniform(0.0, 0.2, count)
        fields[f"mass_{structure}"] = random.uniform(1.0, 2.0, count)
        fields[f"yield_displacement_{structure}"] = random.uniform(0.01, 0.1, count)
        fields[f"hardening_{structure}"] = random.uniform(0.0, 0.2, count)
        fields[f"participation_{structure}"] = random.uniform(0.8, 1.5, count)
    return fields


def test_the_table_is_that_of_single_structures():
    # mutation: structures or columns exchanged
    fields = _fields(5)
    names = ("period", "damping", "mass", "yield_displacement", "hardening", "participation")
    for pair, rows in enumerate(pair_table(fields)):
        first = Structure(*(fields[f"{name}_1"][pair] for name in names))
        second = Structure(*(fields[f"{name}_2"][pair] for name in names))
        np.testing.assert_allclose(rows, structure_table([first, second]), rtol=1e-14)


def test_two_walls_are_refused():
    fields = _fields(3)
    fields["mass_1"][1] = fields["mass_2"][1] = np.inf
    with pytest.raises(ValueError, match="must not both be infinite, got inf at index 1"):
        pair_table(fields)


@given(st.lists(st.sampled_from([1, 2, 8]), max_size=200))
def test_every_pair_is_in_one_block_with_its_equals(parts):
    parts = np.array(parts, dtype=np.int64)
    rows = np.random.default_rng(0).random((parts.size, 2, ROW_COLUMNS))
    blocks = pair_blocks(parts, rows)
    members = [index for block in blocks for index in block]
    assert sorted(members) == list(range(parts.size))
    assert all(len(block) <= PAIR_LANES and len(set(parts[block])) == 1 for block in blocks)


def test_the_stiffer_structure_decides_on_steps_the_softer_on_free_vibration():
    # mutation: minimum and maximum exchanged
    fields = _fields(2)
    fields["period_1"], fields["period_2"] = np.array([0.02, 3.0]), np.array([3.0, 0.02])
    parts = refinements(pair_table(fields), 0.01)
    assert parts[0] == parts[1] > 1
    assert_array_equal(free_vibration_steps(fields, 0.01), free_samples(3.0, 0.01))


@given(st.integers(1, 1000))
def test_memory_begins_at_a_cache_line(size):
    memory = aligned(size)
    assert memory.shape == (size,)
    assert memory.ctypes.data % CACHE_LINE == 0
    assert not memory.any()
