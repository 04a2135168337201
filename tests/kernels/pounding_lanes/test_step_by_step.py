"""A tile of one pair step by step, against the event code of single histories."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from per_obspy.kernels.pounding_events import motion
from per_obspy.kernels.pounding_events.contact import LOG_COLUMNS, count_impacts
from per_obspy.kernels.pounding_lanes import lanes
from per_obspy.kernels.pounding_lanes.deferred_maxima import write_back
from per_obspy.kernels.pounding_lanes.maxima_in_step import ground_along
from per_obspy.kernels.pounding_lanes.phases import (
    load_row,
    update_phases,
    write_constants,
    write_steps,
)
from per_obspy.kernels.pounding_lanes.step_by_step import (
    run_events,
    segment_of_step,
    step_through_tile,
)
from per_obspy.pounding.kernel_tables import row_at_rest, structure_table
from per_obspy.pounding.structure import Structure

DURATION, LINES = 0.01, 1000


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
    return pair, row


def single_history(pair, row, ground):
    """Return row and log after all steps of the tile, each from event to event."""
    after, log = row.copy(), np.zeros((LINES, LOG_COLUMNS))
    for k in range(lanes.TILE_STEPS):
        start, end = ground_along(pair, ground, k), ground_along(pair, ground, k + 1)
        after[0, motion.BOUNCES] = 0.0
        assert run_events(after, log, segment_of_step(after, start, end, DURATION), 0.0, False)
    return after, log


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
    expected, expected_log = single_history(pair, row, ground)
    log = np.zeros((LINES, LOG_COLUMNS))
    assert step_through_tile(pair, row, log, ground, lanes.TILE_STEPS, DURATION, False)
    load_row(pair, row)
    # impacts that count; others may have no line of the log
    counts = count_impacts(np.stack([row, expected]), np.stack([log, expected_log]))
    assert counts[0] == counts[1]
    assert (counts[0] > 0) == meets
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


def test_coefficients_of_a_new_phase_are_written_back():
    # catches: coefficients that stay in the line of the pair, states or maxima that do
    pair, row = pair_at_rest(0.002, math.inf, 0.6)
    table = np.zeros(lanes.LANE_ROWS * lanes.PAIR_LANES)
    pair[lanes.DISPLACEMENT], row[1, motion.LARGEST_DISPLACEMENT] = 0.1, 0.2
    row[0, motion.IN_CONTACT] = 1.0
    update_phases(pair, row)
    write_steps(pair, row, DURATION)
    for i in range(2):
        write_back(table, 3 + i * lanes.BANK, pair, row, i)
    again = table[3 :: lanes.PAIR_LANES]
    second = lanes.STRUCTURE_ROWS
    for rows in (
        slice(lanes.STEP_DISPLACEMENT, lanes.ACCELERATION + 4),
        slice(second + lanes.STEP_DISPLACEMENT, second + lanes.ACCELERATION + 4),
        slice(lanes.CONTACT_FUNCTION, lanes.CONTACT_ROUNDING + 1),
    ):
        assert_array_equal(again[rows], pair[rows])
    assert again[lanes.DISPLACEMENT] == 0.1
    assert again[second + lanes.MAXIMUM_SO_FAR] == 0.2
    assert pair[lanes.IS_CHANGED] == pair[second + lanes.IS_CHANGED] == 0.0
