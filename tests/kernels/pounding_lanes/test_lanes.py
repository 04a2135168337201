"""Sweep of many pairs side by side, on inputs small enough for the interpreter."""

import itertools
import math

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from per_obspy.kernels.oscillator.exact_step import unit_responses
from per_obspy.kernels.pounding_events import motion
from per_obspy.kernels.pounding_lanes import lanes
from per_obspy.kernels.pounding_lanes.deferred_maxima import write_lane
from per_obspy.kernels.pounding_lanes.lanes import sweep_tile
from per_obspy.kernels.pounding_lanes.maxima_in_step import complete_state, state_after_step
from per_obspy.kernels.pounding_lanes.phases import rest_row, write_constants
from per_obspy.pounding.kernel_tables import pair_table, row_at_rest
from per_obspy.pounding.structure import Pairs

LINEAR = {
    "period_1": 0.9, "damping_1": 0.05, "mass_1": 2.0,
    "period_2": 0.4, "damping_2": 0.2, "mass_2": 1.0,
    "gap": 1.0, "participation_1": 1.0, "participation_2": 1.0,
    "yield_displacement_1": math.inf, "hardening_1": 0.0,
    "yield_displacement_2": math.inf, "hardening_2": 0.0,
}  # fmt: skip


def lane_of(fields, duration, yielding=0.0):
    """Return the numbers of the lane of a pair at rest, of which bilinear structures may yield."""
    table = pair_table(Pairs.of(**{name: [value] for name, value in fields.items()}))
    row = row_at_rest(table, np.array([[fields["gap"]]]), np.array([[0.5]]))[0]
    row[:, motion.PHASE] = np.where(row[:, motion.YIELD] < math.inf, yielding, 0.0)
    # along the north component
    pair = np.zeros(lanes.LANE_ROWS)
    write_constants(pair, row, 1.0, 0.0, duration)
    return pair


def empty_lanes():
    """Return room for the numbers of all lanes and for their flags."""
    numbers = np.zeros(lanes.LANE_ROWS * lanes.PAIR_LANES)
    return numbers, np.zeros(lanes.PAIR_LANES, np.int64)


def write_pair(table, lane, pair):
    """Write the numbers of a pair to its lane."""
    for i in range(2):
        write_lane(table, lane + i * lanes.BANK, pair, i * lanes.STRUCTURE_ROWS)


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
            write_pair(table, lane, pair)
        sweep_tile(lanes.PAIRS, table, flags, np.zeros((2, lanes.TILE_STEPS + 1)), lanes.TILE_STEPS)
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
            write_pair(table, lane, pair)
        sweep_tile(lanes.PAIRS, table, flags, np.zeros((2, lanes.TILE_STEPS + 1)), lanes.TILE_STEPS)
        assert_array_equal(flags, lanes.PEAK_FLAGS[1])


def test_four_steps_at_once_are_four_steps():
    # catches: a ground acceleration of the unrolled loop in the wrong place
    random = np.random.default_rng(0)
    ground = random.normal(size=(2, 5))
    pair = lane_of({**LINEAR, "gap": 0.05}, 0.01)
    once, _ = empty_lanes()
    for lane in range(lanes.PAIR_LANES):
        pair[[lanes.DISPLACEMENT, lanes.VELOCITY]] = random.normal(size=2)
        for first in (0, lanes.STRUCTURE_ROWS):
            pair[first + lanes.AXIS_COSINE] = math.cos(lane)
            pair[first + lanes.AXIS_SINE] = math.sin(lane)
        write_pair(once, lane, pair)
    lanes.start_structures(once, lanes.PAIRS)
    lanes.lower_contacts(once, lanes.PAIRS, *ground[:, 0], True)
    each = once.copy()
    lanes.advance_pairs(once, *ground.T.ravel())
    for k in range(4):
        lanes.advance_one_step(each, lanes.PAIRS, *ground[:, k], *ground[:, k + 1])
        lanes.lower_contacts(each, lanes.PAIRS, *ground[:, k + 1], False)
    np.testing.assert_allclose(once, each, rtol=1e-14, atol=1e-16)  # rounding


def test_a_resting_lane_is_never_flagged():
    pair = lane_of({**LINEAR, "gap": 0.0, "yield_displacement_2": 1e-6}, 0.01)
    rest_row(pair, 2)
    # under strong ground motion
    table, flags = empty_lanes()
    for lane in range(lanes.PAIR_LANES):
        write_pair(table, lane, pair)
    ground = 100.0 * np.random.default_rng(0).normal(size=(2, lanes.TILE_STEPS + 1))
    assert sweep_tile(lanes.PAIRS, table, flags, ground, lanes.TILE_STEPS) == 0


class TestYieldingLanes:
    SIDE, DURATION = -1.0, 0.002

    def swept(self, number, ground, speeds):
        """Return the flags of yielding lanes that start with these speeds, and their pair."""
        structure = {f"yield_displacement_{number}": 0.01, f"hardening_{number}": 0.1}
        pair = lane_of({**LINEAR, "gap": 100.0, **structure}, self.DURATION, yielding=self.SIDE)
        first = (number - 1) * lanes.STRUCTURE_ROWS
        table, flags = empty_lanes()
        # only yielding is looked for
        for row in (lanes.MAXIMUM_SO_FAR, lanes.RADIUS_SQUARED_SO_FAR):
            pair[row] = pair[lanes.STRUCTURE_ROWS + row] = math.inf
        for lane in range(lanes.PAIR_LANES):
            pair[first + lanes.DISPLACEMENT] = self.SIDE * 0.01
            pair[first + lanes.VELOCITY] = self.SIDE * speeds[lane]
            write_pair(table, lane, pair)
        sweep_tile(lanes.PAIRS, table, flags, ground, lanes.TILE_STEPS)
        return flags, pair

    def least_speed(self, pair, first, speed, ground):
        """Return the least speed of a structure in the tile, in eight parts of every step."""
        fine = lane_of_parts(pair, first)
        state = complete_state(fine, 0, self.SIDE * 0.01, self.SIDE * speed, ground[0, 0])
        least = speed
        for k in range(lanes.TILE_STEPS):
            parts = np.linspace(ground[0, k], ground[0, k + 1], 9)
            for before, after in itertools.pairwise(parts):
                state = state_after_step(fine, 0, state, before, after)
                least = min(least, self.SIDE * state[1])
        return least

    @pytest.mark.parametrize("number", [1, 2])
    def test_a_lane_without_flag_does_not_unload(self, number):
        # catches: a velocity at the start or the end of the tile only, one towards the wrong side,
        # the other structure, the bound between the samples left out
        random = np.random.default_rng(number)
        speeds = np.geomspace(1e-4, 1.0, lanes.PAIR_LANES)
        steady = 0
        for _ in range(3):
            ground = np.zeros((2, lanes.TILE_STEPS + 1))
            ground[0] = 3.0 * random.normal(size=lanes.TILE_STEPS + 1)
            flags, pair = self.swept(number, ground, speeds)
            first = (number - 1) * lanes.STRUCTURE_ROWS
            for lane in range(lanes.PAIR_LANES):
                if not flags[lane] & lanes.EVENT_FLAG:
                    steady += 1
                    assert self.least_speed(pair, first, speeds[lane], ground) > 0.0
        assert steady > 10  # or the flags would be of no use

    @pytest.mark.parametrize("number", [1, 2])
    @pytest.mark.parametrize("sample", [0, 6])
    def test_a_velocity_that_dips_between_the_samples_is_flagged(self, number, sample):
        # catches: the bound between the samples left out, or the velocity at the start
        ground = np.zeros((2, lanes.TILE_STEPS + 1))
        ground[0, sample] = 150.0 * self.SIDE
        ground[0, sample + 1 :] = -400.0 * self.SIDE
        speeds = np.geomspace(1e-4, 1.0, lanes.PAIR_LANES)
        flags, pair = self.swept(number, ground, speeds)
        first = (number - 1) * lanes.STRUCTURE_ROWS
        dips = 0
        for lane in range(lanes.PAIR_LANES):
            if self.least_speed(pair, first, speeds[lane], ground) < 0.0:
                dips += 1
                assert flags[lane] & lanes.EVENT_FLAG
        assert 0 < dips < lanes.PAIR_LANES

    def test_a_resting_lane_has_no_flag(self):
        # catches: a lane without pair that is flagged for its velocity, which is zero
        pair = lane_of({**LINEAR, "yield_displacement_1": 0.01}, self.DURATION, yielding=self.SIDE)
        rest_row(pair, 2)
        table, flags = empty_lanes()
        for lane in range(lanes.PAIR_LANES):
            write_pair(table, lane, pair)
        assert sweep_tile(lanes.PAIRS, table, flags, np.ones((2, lanes.TILE_STEPS + 1)), 5) == 0


def lane_of_parts(pair, first):
    """Return the numbers of a lane whose steps are eighths of those of a structure of another."""
    fields = {**LINEAR, "gap": 100.0, "yield_displacement_1": 0.01, "hardening_1": 0.1}
    fields |= {"yield_displacement_2": 0.01, "hardening_2": 0.1}
    fine = lane_of(fields, 0.125 * TestYieldingLanes.DURATION, yielding=TestYieldingLanes.SIDE)
    if first:
        fine[: lanes.STRUCTURE_ROWS] = fine[lanes.STRUCTURE_ROWS : 2 * lanes.STRUCTURE_ROWS]
    assert fine[lanes.OMEGA] == pair[first + lanes.OMEGA]
    return fine
