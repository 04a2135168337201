"""Sweep of many pairs side by side, on inputs small enough for the interpreter."""

import math

import numpy as np
from numpy.testing import assert_array_equal

from per_obspy.kernels.oscillator.exact_step import unit_responses
from per_obspy.kernels.pounding_lanes import lanes
from per_obspy.kernels.pounding_lanes.deferred_maxima import write_lane
from per_obspy.kernels.pounding_lanes.lanes import sweep_tile
from per_obspy.kernels.pounding_lanes.pair_rows import rest_pair, write_constants, write_phase
from per_obspy.pounding.history.pair_blocks import pair_table
from per_obspy.pounding.history.tables import row_at_rest

LINEAR = {
    "period_1": 0.9, "damping_1": 0.05, "mass_1": 2.0,
    "period_2": 0.4, "damping_2": 0.2, "mass_2": 1.0,
    "gap": 1.0, "participation_1": 1.0, "participation_2": 1.0,
    "yield_displacement_1": math.inf, "hardening_1": 0.0,
    "yield_displacement_2": math.inf, "hardening_2": 0.0,
}  # fmt: skip


def lane_of(fields, duration):
    """Return the numbers of the lane of a pair at rest."""
    table = pair_table({name: np.array([value]) for name, value in fields.items()})
    row = row_at_rest(table, np.array([[fields["gap"]]]), np.array([[0.5]]))[0]
    # along the north component
    pair = np.zeros(lanes.LANE_ROWS)
    write_constants(pair, row, 1.0, 0.0, duration)
    write_phase(pair, row, duration)
    return pair


def empty_lanes():
    """Return room for the numbers of all lanes and for their flags."""
    numbers = np.zeros(lanes.LANE_ROWS * lanes.PAIR_LANES)
    return numbers, np.zeros(lanes.PAIR_LANES, np.int64)


class TestFlags:
    def swept(self, velocities, **changes):
        """Return the flags of lanes of one pair that start with these velocities, m/s."""
        pair = lane_of({**LINEAR, **changes}, 0.001)
        table, flags = empty_lanes()
        for lane in range(lanes.PAIR_LANES):
            velocity = velocities[lane] if lane < len(velocities) else 0.0
            pair[lanes.VELOCITY] = velocity / pair[lanes.OMEGA]
            # no maximum is looked for
            pair[lanes.MAXIMUM_SO_FAR] = pair[lanes.RADIUS_SQUARED_SO_FAR] = math.inf
            pair[lanes.STRUCTURE_ROWS + lanes.MAXIMUM_SO_FAR] = math.inf
            write_lane(table, lane, pair)
        sweep_tile(table, flags, np.zeros((2, lanes.TILE_STEPS + 1)), lanes.TILE_STEPS)
        return flags

    def test_a_lane_that_meets_within_the_tile(self):
        # catches: a contact function of the last sample only, the clearance with the wrong sign
        duration, omega = 0.001 * lanes.TILE_STEPS, 2 * math.pi / 0.9
        reach = unit_responses(omega * duration, 0.05)[0] / omega  # of 1 m/s
        flags = self.swept([0.0, 1.001 / reach, 0.999 / reach, -1.001 / reach], gap=1.0)
        assert flags.tolist() == [0, lanes.EVENT_FLAG, 0, 0] + 28 * [0]

    def test_a_structure_that_yields_within_the_tile(self):
        flags = self.swept([0.1, -0.1, 0.001], gap=100.0, yield_displacement_1=0.002)
        assert flags.tolist() == [lanes.EVENT_FLAG, lanes.EVENT_FLAG, 0] + 29 * [0]

    def test_a_structure_that_may_pass_its_maximum(self):
        # catches: flags of the two structures exchanged, a maximum of the last sample only
        pair = lane_of(LINEAR, 0.001)
        pair[lanes.RADIUS_SQUARED_SO_FAR] = math.inf
        pair[lanes.STRUCTURE_ROWS + lanes.RADIUS_SQUARED_SO_FAR] = math.inf
        pair[[lanes.DISPLACEMENT, lanes.MAXIMUM_SO_FAR]] = 0.02, 0.03
        pair[lanes.STRUCTURE_ROWS + lanes.DISPLACEMENT] = -0.02  # beyond its maximum, 0
        table, flags = empty_lanes()
        for lane in range(lanes.PAIR_LANES):
            write_lane(table, lane, pair)
        sweep_tile(table, flags, np.zeros((2, lanes.TILE_STEPS + 1)), lanes.TILE_STEPS)
        assert_array_equal(flags, lanes.PEAK_FLAGS[1])


def test_four_steps_at_once_are_four_steps():
    # catches: a ground acceleration of the unrolled loop in the wrong place
    random = np.random.default_rng(0)
    ground = random.normal(size=(2, 5))
    pair = lane_of({**LINEAR, "gap": 0.05}, 0.01)
    once, _ = empty_lanes()
    for lane in range(lanes.PAIR_LANES):
        pair[[lanes.DISPLACEMENT, lanes.VELOCITY]] = random.normal(size=2)
        pair[[lanes.AXIS_COSINE, lanes.AXIS_SINE]] = math.cos(lane), math.sin(lane)
        write_lane(once, lane, pair)
    lanes.start_tile(once, *ground[:, 0])
    each = once.copy()
    lanes.advance_four_steps(once, *ground.T.ravel())
    for k in range(4):
        lanes.advance_one_step(each, *ground[:, k], *ground[:, k + 1])
    np.testing.assert_allclose(once, each, rtol=1e-14, atol=1e-16)  # rounding


def test_a_resting_lane_is_never_flagged():
    pair = lane_of({**LINEAR, "gap": 0.0, "yield_displacement_2": 1e-6}, 0.01)
    rest_pair(pair)
    # under strong ground motion
    table, flags = empty_lanes()
    for lane in range(lanes.PAIR_LANES):
        write_lane(table, lane, pair)
    ground = 100.0 * np.random.default_rng(0).normal(size=(2, lanes.TILE_STEPS + 1))
    assert sweep_tile(table, flags, ground, lanes.TILE_STEPS) == 0
