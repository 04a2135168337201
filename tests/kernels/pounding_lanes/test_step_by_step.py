"""A tile of one pair step by step, against the event code of single histories."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.kernels.pounding_events import motion
from per_obspy.kernels.pounding_lanes import lanes
from per_obspy.kernels.pounding_lanes.maxima_in_step import ground_along
from per_obspy.kernels.pounding_lanes.pair_rows import load_pair, write_constants, write_phase
from per_obspy.kernels.pounding_lanes.step_by_step import (
    run_events,
    segment_of_step,
    step_through_tile,
)
from per_obspy.pounding.history.tables import row_at_rest, structure_table
from per_obspy.pounding.structure import Structure

DURATION, LOG = 0.01, np.zeros((0, 9))


def pair_at_rest(gap, limit, restitution):
    """Return the numbers of the lane of a pair at rest, and its row."""
    structures = (
        Structure(0.5, 0.05, 2.0, limit, 0.1),
        Structure(0.3, 0.02, 1.0, limit, 0.0, participation=1.3),
    )
    row = row_at_rest(structure_table(structures), np.array([gap]), np.array([restitution]))
    # end of bounces
    row[0, motion.STICKING_SPEED], row[0, motion.STICKING_DELAY] = 1e-12, 5e-6
    row[0, motion.BOUNCE_LIMIT] = 25
    pair = np.zeros(lanes.LANE_ROWS)
    write_constants(pair, row, 0.6, 0.8, DURATION)
    write_phase(pair, row, DURATION)
    return pair, row


def single_history(pair, row, ground):
    """Return the row after all steps of the tile, each from event to event."""
    after = row.copy()
    for k in range(lanes.TILE_STEPS):
        start, end = ground_along(pair, ground, k), ground_along(pair, ground, k + 1)
        after[0, motion.BOUNCES] = 0.0
        assert run_events(after, LOG, segment_of_step(after, start, end, DURATION), 0.0)
    return after


@pytest.mark.parametrize(
    ("gap", "limit", "restitution", "meets"),
    [
        (1.0, math.inf, 0.6, False),  # no event
        (0.002, math.inf, 0.6, True),  # impacts
        (0.002, math.inf, 0.0, True),  # contact
        (0.0, math.inf, 0.6, True),  # release of a contact
        (1.0, 0.004, 0.6, False),  # yielding
        (0.002, 0.004, 0.3, True),  # all of them
    ],
)
def test_agrees_with_the_event_code(gap, limit, restitution, meets):
    # catches: a step repeated from its end, an event that the bounds exclude, maxima or the state
    # not stored after one
    noise = np.random.default_rng(4).normal(size=(2, lanes.TILE_STEPS + 1))
    ground = np.cumsum(-5.0 * noise, axis=1) / 3.0
    pair, row = pair_at_rest(gap, limit, restitution)
    expected = single_history(pair, row, ground)
    assert step_through_tile(pair, row, LOG, ground, lanes.TILE_STEPS, DURATION)
    load_pair(pair, row)
    assert row[0, motion.IMPACTS] == expected[0, motion.IMPACTS]
    assert (row[0, motion.IMPACTS] > 0) == meets
    assert row[:, motion.PLASTIC].any() == (limit < math.inf)
    columns = [
        motion.U,
        motion.V,
        motion.PLASTIC,
        motion.LARGEST_DISPLACEMENT,
        motion.LARGEST_RADIUS_SQUARED,
    ]
    # rounding, and its growth over a few impacts
    assert_allclose(row[:, columns], expected[:, columns], rtol=1e-9, atol=1e-13)
