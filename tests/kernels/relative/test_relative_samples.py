"""Shifted states and relative displacements of blocks of pairs, against the plain step."""

import numpy as np
import pytest

from per_obspy.kernels.relative.relative_samples import (
    APPROACH,
    EXTREMES,
    FOLLOWED,
    GREATEST,
    LEAST,
    PAIR_CHECKPOINT_ROWS,
    PAIR_LANES,
    PAIR_ROWS,
    pack_pair,
    run_pair_tiles,
    state_of,
)
from per_obspy.kernels.spectra.tile_search import TILE

DT, LANE = 0.1, 7


@pytest.mark.parametrize("share", [0.9, 0.0])
@pytest.mark.parametrize("period", [0.5, 3.0, 0.1, 0.05, 0.025])
def test_shifted_states_are_the_states(period, share, plain_states):
    # mutation: shift or unit not undone; a structure of participation 0 adds nothing, although its
    # states are counted in what they add
    ground = np.random.default_rng(2).standard_normal((2, 2 * TILE + 1))
    damping = 0.05 if period > DT else 0.0
    pair = np.array([2 * np.pi / period, damping, 1.2, 5.0, 0.02, share, 0.8, 0.6])
    table = np.zeros((PAIR_ROWS, PAIR_LANES))
    checkpoints = np.empty((2, PAIR_CHECKPOINT_ROWS, PAIR_LANES))
    for lane in range(PAIR_LANES):
        pack_pair(pair, DT, table, lane)
    windows = np.array([[0], [1]]) * np.ones((2, PAIR_LANES), dtype=np.int64)
    run_pair_tiles(ground[0], ground[1], 0, windows, table, checkpoints)

    along = pair[6] * ground[0] + pair[7] * ground[1]
    # plain states, from units of a / omega² to m
    states = [plain_states(along, pair[row] * DT, pair[row + 1]) / pair[row] ** 2 for row in (0, 3)]
    distance = pair[2] * states[0][:, 0] - pair[5] * states[1][:, 0]
    tolerance = 1e-13 * np.abs(distance).max()  # rounding of 128 steps
    slope = pair[2] * states[0][:, 1] - pair[5] * states[1][:, 1] * pair[3] / pair[0]
    # the cubics of all steps are within these bounds, by their Bernstein coefficients
    greatest, least = checkpoints[:, GREATEST, LANE], checkpoints[:, LEAST, LANE]
    reach = pair[0] * DT / 3.0 * slope
    for k, tile in enumerate((slice(0, TILE + 1), slice(TILE, 2 * TILE + 1))):
        inner = np.stack([(distance + reach)[tile][:-1], (distance - reach)[tile][1:]])
        assert greatest[k] >= max(distance[tile].max(), inner.max()) - tolerance
        assert least[k] <= min(distance[tile].min(), inner.min()) + tolerance
        assert greatest[k] <= (distance + abs(reach))[tile].max() + tolerance
        assert least[k] >= (distance - abs(reach))[tile].min() - tolerance
    # velocities are stored as what they add in a third of a step
    tiles = reach[: TILE + 1], reach[TILE:]
    fastest = checkpoints[:, APPROACH, LANE]
    np.testing.assert_allclose(fastest, [tile.max() for tile in tiles], atol=tolerance)
    for body in range(2):
        shifted = checkpoints[1, 2 * body : 2 * body + 2, LANE]
        found = state_of(body, table, LANE, *shifted, along[TILE])
        np.testing.assert_allclose(found, states[body][TILE], atol=tolerance)
    assert table[EXTREMES, LANE] == checkpoints[1, GREATEST, LANE]
    assert table[FOLLOWED, LANE] != 0.0
