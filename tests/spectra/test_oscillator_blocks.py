"""Records and oscillators as the kernels take them: complete, unscaled and in order."""

import itertools

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from per_obspy.kernels.spectra import tile_search as blocks
from per_obspy.spectra.elastic import (
    over_blocks,
    prepare_oscillators,
    stretches,
    tiled_record,
)

RANDOM = np.random.default_rng(4)


@pytest.mark.parametrize("count", [1, blocks.TILE - 1, blocks.TILE, 3 * blocks.TILE + 7])
@pytest.mark.parametrize("factor", [1e-200, 1.0, 7e150])
def test_the_scale_is_undone_exactly_and_zeros_close_the_record(count, factor):
    # would catch a scale that is no power of two, and a last sample without its ramp
    motion = factor * RANDOM.normal(size=count)
    record = tiled_record(motion)
    assert_array_equal(record.north[:count] * record.scale, motion)
    assert 1.0 <= np.abs(record.north).max() < 2.0
    assert (record.north.size - 1) % blocks.TILE == 0
    assert record.north.size > count
    assert not record.north[count:].any()


def test_no_motion_is_not_scaled():
    # would catch a logarithm of zero
    record = tiled_record(np.zeros(5), np.zeros(5))
    assert record.scale == 1.0
    assert not record.peaks.any()


def test_peaks_and_jumps_are_those_of_each_tile():
    # would catch a tile without its last sample, which belongs to the next one too
    north, east = RANDOM.normal(size=(2, 4 * blocks.TILE))
    record = tiled_record(north, east)
    for component, scaled in enumerate((record.north, record.east)):
        for tile in range(4):
            samples = scaled[tile * blocks.TILE : (tile + 1) * blocks.TILE + 1]
            assert record.peaks[component, tile] == np.abs(samples).max()
            assert record.jumps[component, tile] == np.abs(np.diff(samples)).max()


def test_stretches_share_one_sample_and_hold_the_whole_record():
    count = blocks.TILES * blocks.TILE
    record = tiled_record(*RANDOM.normal(size=(2, 2 * count + 5)))
    parts = list(stretches(record))
    assert [part.peaks.shape[1] for part in parts] == [blocks.TILES, blocks.TILES, 1]
    # The state at the shared sample is where the next stretch goes on
    for part, following in itertools.pairwise(parts):
        assert following.north[0] == part.north[-1]
    joined = np.concatenate([parts[0].east, *(part.east[1:] for part in parts[1:])])
    assert_array_equal(joined, record.east)


def test_oscillators_feel_their_own_azimuth():
    oscillators = prepare_oscillators(
        0.01, np.array([0.5, 2.0]), np.array([0.0, 0.1]), np.array([0.0, 90.0])
    )
    np.testing.assert_allclose(oscillators.weights, [[1.0, 0.0], [0.0, 1.0]], atol=1e-16)
    assert_array_equal(oscillators.phases, oscillators.omegas * 0.01)


@pytest.mark.parametrize("count", [1, blocks.LANES, 2 * blocks.LANES + 3])
def test_blocks_return_every_oscillator_once_and_in_order(count):
    # would catch results of the copies that fill up the last block
    periods = RANDOM.uniform(0.1, 1.0, count)
    oscillators = prepare_oscillators(0.01, periods, np.zeros(count))
    sizes = []

    def omegas_of(block):
        sizes.append(block.size)
        assert block.omegas.size == blocks.LANES
        return block.omegas[np.newaxis]

    rows = over_blocks(omegas_of, oscillators, tiled_record(np.ones(3)))
    assert_array_equal(rows, [2.0 * np.pi / periods])
    assert sum(sizes) == count
