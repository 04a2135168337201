"""The kernel of relative displacement without any wrapper, so short that it also runs uncompiled."""

from itertools import pairwise

import numpy as np
import pytest

from per_obspy.kernels.oscillator.exact_step import step
from per_obspy.kernels.relative.maxima import relative_maxima
from per_obspy.kernels.relative.samples import (
    DISTANCE,
    EXTREMES,
    HIGHEST,
    KEPT,
    LANES,
    LOWEST,
    ROWS,
    TILE,
    pack_pair,
    run_tiles,
    start_at_rest,
    state_of,
)


def test_a_constant_push_overshoots_to_twice_the_static_displacement():
    # u1 alone (structure 2 hardly takes part): 1 - cos, whose peak lies between the samples
    omega, dt, push = 2 * np.pi, 0.09, -1.5
    north = np.full(9, push)
    north[-1] = 0.0
    pair = np.array([[omega], [0.0], [1.0], [9.0], [0.5], [1e-15], [1.0], [0.0]])
    largest = np.empty((2, 1))
    relative_maxima(north[:7], np.zeros(7), dt, pair, largest)
    assert abs(largest[0, 0] / (2 * 1.5 / omega**2) - 1) < 1e-9


def test_east_is_felt_by_the_sine_of_the_azimuth():
    # mutation: cosine and sine exchanged
    east = np.array([0.0, 1.0, -1.0, 0.0])
    pairs = np.array(
        [
            [6.0, 6.0],
            [0.05, 0.05],
            [1.0, 1.0],
            [3.0, 3.0],
            [0.05, 0.05],
            [1.0, 1.0],
            [1.0, 0.0],
            [0.0, 1.0],
        ]
    )
    largest = np.empty((2, 2))
    relative_maxima(np.zeros(4), east, 0.1, pairs, largest)
    assert largest[0, 0] == largest[1, 0] == 0.0
    assert largest[0, 1] > 0.0


@pytest.mark.parametrize("period", [0.5, 3.0, 0.1, 0.05, 0.025])
def test_shifted_states_are_the_states(period):
    # mutation: shift, rotation or scale not undone; at 0.1 s / k the undamped input vanishes and
    # cannot be scaled
    dt, ground = 0.1, np.random.default_rng(2).standard_normal((2, 2 * TILE + 1))
    damping = 0.05 if period > dt else 0.0
    pair = np.array([2 * np.pi / period, damping, 1.2, 5.0, 0.02, 0.9, 0.8, 0.6])
    table, kept = np.empty((ROWS, LANES)), np.empty((2, KEPT, LANES))
    for lane in range(LANES):
        pack_pair(pair, dt, table, lane)
    start_at_rest(ground[0, 0], ground[1, 0], table)
    run_tiles(ground[0], ground[1], table, kept)
    along = pair[6] * ground[0] + pair[7] * ground[1]
    c = np.array([step(pair[0], pair[1], dt), step(pair[3], pair[4], dt)])
    state, apart = np.zeros((2, 2)), [0.0]
    for start, end in pairwise(along):
        u, z = state.T
        state = np.stack([c[:, 0] * u + c[:, 1] * z + c[:, 4] * start + c[:, 5] * end,
                          c[:, 2] * u + c[:, 3] * z + c[:, 6] * start + c[:, 7] * end], axis=1)  # fmt: skip
        apart.append(pair[2] * state[0, 0] - pair[5] * state[1, 0])
        if len(apart) == TILE + 1:
            middle = state
    size = np.abs(apart).max()  # 1e-13 of it: rounding of 128 steps
    np.testing.assert_allclose(
        kept[:, HIGHEST, 7], [max(apart[: TILE + 1]), max(apart[TILE:])], atol=1e-13 * size
    )
    np.testing.assert_allclose(
        kept[:, LOWEST, 7], [min(apart[: TILE + 1]), min(apart[TILE:])], atol=1e-13 * size
    )
    found = [
        state_of(i, table, 7, kept[1, 2 * i, 7], kept[1, 2 * i + 1, 7], along[TILE])
        for i in range(2)
    ]
    np.testing.assert_allclose(found, middle, atol=1e-13 * size)
    assert table[EXTREMES, 7] == kept[1, HIGHEST, 7]
    assert table[DISTANCE, 7] != 0.0


def test_equal_structures_never_part_and_unequal_ones_are_not_taken_for_them():
    # mutation: one of period, damping and participation not compared; results of the others out of
    # place
    north = np.array([0.0, 1.0, -1.0, 0.0])
    twins = np.array([6.0, 0.05, 1.0, 6.0, 0.05, 1.0, 1.0, 0.0])
    pairs = np.tile(twins[:, None], 5)
    for place, row in ((1, 3), (2, 4), (4, 5)):
        pairs[row, place] *= 1.01
    largest = np.full((2, 5), np.nan)
    relative_maxima(north, np.zeros(4), 0.1, pairs, largest)
    assert (largest > 0.0).tolist() == [[False, True, True, False, True]] * 2
    assert np.all(largest[:, [0, 3]] == 0.0)
