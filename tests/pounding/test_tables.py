"""Tables of structures, steps per sampling interval and the end of a record."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from per_obspy.kernels.pounding_events import motion
from per_obspy.kernels.pounding_lanes.run_block import SETTLING_STEPS
from per_obspy.pounding.kernel_tables import (
    closed_record,
    free_samples,
    largest_ground_velocity,
    refinement,
    row_at_rest,
    structure_table,
)
from per_obspy.pounding.structure import Structure


def test_columns_of_a_structure():
    # mutation: columns exchanged, damping without its frequency
    table = structure_table([Structure(math.pi, 0.05, 3.0, 0.02, 0.1, 1.2)])
    assert table == pytest.approx(np.array([[0.1, 4.0, 0.1, 0.02, 1.2, 3.0]]))


def test_structures_without_a_gap_start_in_contact():
    # mutation: gaps of the right neighbour
    table = structure_table([Structure(1.0, 0.05, 1.0)] * 3)
    row = row_at_rest(table, np.array([0.0, 0.1]), np.array([0.5, 0.6]))
    assert row[:, motion.IN_CONTACT].tolist() == [1.0, 0.0, 0.0]
    assert row[:2, motion.GAP].tolist() == [0.0, 0.1]
    assert row[:2, motion.RESTITUTION].tolist() == [0.5, 0.6]
    assert_array_equal(row[:, :6], table)


@given(st.floats(0.1, 1e4), st.floats(1e-4, 0.1))
def test_segments_are_as_short_as_needed_and_no_shorter(frequency, dt):
    # mutation: rounding down, a phase of a whole sampling interval
    parts = refinement(frequency, dt)
    assert math.log2(parts) == int(math.log2(parts))
    assert frequency * dt / parts <= motion.LARGEST_ANGLE * (1.0 + 1e-12)
    assert parts == 1 or frequency * dt / (parts / 2) > motion.LARGEST_ANGLE


@given(st.floats(0.01, 10.0), st.floats(1e-3, 0.1))
def test_free_vibration_lasts_twenty_periods_in_whole_rounds(period, dt):
    samples = free_samples(period, dt)
    assert samples % SETTLING_STEPS == 0
    assert samples >= SETTLING_STEPS
    assert samples == SETTLING_STEPS or samples * dt <= 20.0 * period * (1.0 + 1e-12)
    assert (samples + SETTLING_STEPS) * dt > 20.0 * period * (1.0 - 1e-12)


def test_only_an_open_record_is_closed():
    assert closed_record(np.array([0.0, 1.0])).tolist() == [0.0, 1.0, 0.0]
    assert closed_record(np.array([1.0, 0.0])).tolist() == [1.0, 0.0]
    # one open component of two is enough
    both = closed_record(np.array([[1.0, 0.0], [1.0, 2.0]]))
    assert both.tolist() == [[1.0, 0.0, 0.0], [1.0, 2.0, 0.0]]


def test_ground_velocity_of_a_pulse():
    # a triangle of 2 m/s² over two intervals of 0.1 s: an area of 0.2 m/s
    assert largest_ground_velocity(np.array([0.0, 2.0, 0.0]), 0.1) == pytest.approx(0.2)
    assert largest_ground_velocity(np.array([3.0]), 0.1) == 0.0
