"""States at the samples of a tile and maxima inside steps, against densely sampled motion."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.kernels.polynomial_roots import value_and_slope
from per_obspy.kernels.pounding_events import motion
from per_obspy.kernels.pounding_lanes import lanes
from per_obspy.kernels.pounding_lanes import maxima_in_step as inside
from per_obspy.kernels.pounding_lanes.phases import store_row, write_constants
from per_obspy.pounding.kernel_tables import row_at_rest, structure_table
from per_obspy.pounding.structure import Structure

DURATION = 0.02
SHARES = np.linspace(0.0, 1.0, 401)


def pair_of(structure, cosine=1.0, sine=0.0):
    """Return the numbers of the lane of a pair of equal structures at rest, and its row."""
    row = row_at_rest(structure_table([structure] * 2), np.array([1.0]), np.array([0.5]))
    pair = np.zeros(lanes.LANE_ROWS)
    write_constants(pair, row, cosine, sine, DURATION)
    return pair, row


def sampled(pair, row, state, change):
    """Return displacement and squared radius over SHARES of a step."""
    inside.fill_displacement_in_step(pair, row, 0, 0, state, change)
    # displacement and its rate per step, which is angle times velocity over omega
    terms = int(row[0, motion.TERM_COUNT])
    values = np.array([value_and_slope(row, 0, motion.TAYLOR, terms, s) for s in SHARES]).T
    return np.abs(values[0]), values[0] ** 2 + (values[1] / pair[lanes.ANGLE]) ** 2


def test_the_polynomial_of_a_step_ends_in_its_state():
    # catches: time in seconds instead of shares, the ground's change left out
    pair, row = pair_of(Structure(0.3, 0.1, 1.0))
    start = inside.complete_state(pair, 0, 0.3, -0.7, 4.0)
    end = inside.state_after_step(pair, 0, start, 4.0, -3.0)
    inside.fill_displacement_in_step(pair, row, 0, 0, start, -7.0)
    terms = int(row[0, motion.TERM_COUNT])
    displacement, velocity = value_and_slope(row, 0, motion.TAYLOR, terms, 1.0)
    assert_allclose((displacement, velocity / pair[lanes.ANGLE]), end[:2], rtol=1e-12)  # rounding


@pytest.mark.parametrize("damping", [0.0, 0.3])
def test_maxima_are_those_of_the_sampled_motion(damping):
    # catches: a bound too small, roots of the velocity or of the power not looked for
    pair, row = pair_of(Structure(0.2, damping, 1.0))
    columns, raised = [motion.LARGEST_DISPLACEMENT, motion.LARGEST_RADIUS_SQUARED], 0
    for u, z, first, last in np.random.default_rng(0).normal(size=(150, 4)):
        ground, after = 1000.0 * first, 1000.0 * last  # accelerations over omega² of about 1
        start = inside.complete_state(pair, 0, u, z, ground)
        end = inside.state_after_step(pair, 0, start, ground, after)
        largest = [values.max() for values in sampled(pair, row, start, after - ground)]
        row[0, columns] = 0.0
        inside.raise_maxima(pair, row, 0, start, end, after - ground, 1.0)
        at_ends = max(abs(u), abs(end[0])), max(np.hypot(u, z), np.hypot(*end[:2])) ** 2
        raised += (row[0, columns] > np.array(at_ends) * (1.0 + 1e-12)).any()
        assert (row[0, columns] >= np.array(largest) * (1.0 - 1e-13)).all()
        assert_allclose(row[0, columns], largest, rtol=1e-4)  # what 400 samples miss
    assert raised > 10


@pytest.mark.parametrize("damping", [0.0, 0.3])
@pytest.mark.parametrize("strength", [0.0, 10.0, 1000.0])
def test_no_motion_just_above_the_maxima_is_far_below_them(damping, strength):
    # catches: the growth of the radius inside a step left out, by itself or by the acceleration
    pair, row = pair_of(Structure(0.2, damping, 1.0))
    inside_only = 0
    for u, z, first, last in np.random.default_rng(1).normal(size=(300, 4)):
        ground, after = strength * first, strength * last
        start = inside.complete_state(pair, 0, u, z, ground)
        end = inside.state_after_step(pair, 0, start, ground, after)
        displacement, squared = sampled(pair, row, start, after - ground)
        inside_only += squared.max() > 1.0001 * squared[[0, -1]].max()
        # maxima just below those of the step: of the radius, then of the displacement
        for largest in (np.sqrt(squared.max()), displacement.max()):
            row[0, motion.LARGEST_DISPLACEMENT] = (1.0 - 1e-9) * largest
            row[0, motion.LARGEST_RADIUS_SQUARED] = (1.0 - 1e-9) ** 2 * squared.max()
            before = row[0, motion.LARGEST_RADIUS_SQUARED]
            inside.raise_maxima(pair, row, 0, start, end, after - ground, 1.0)
            assert (
                row[0, motion.LARGEST_RADIUS_SQUARED] > before
                or row[0, motion.LARGEST_DISPLACEMENT] > (1.0 - 1e-9) * largest
            )
    assert inside_only > 10 or strength < 1000.0


class TestYielding:
    def yields(self, start, end, phase=0.0):
        """Return whether a structure may yield or unload between two states."""
        structure = Structure(0.5, 0.0, 1.0, 0.02, 0.1)
        pair, row = pair_of(structure)
        row[0, motion.PHASE] = phase
        store_row(pair, row, DURATION)
        return inside.may_yield(pair, 0, start, end)

    def test_leaves_the_elastic_range_between_the_samples(self):
        assert not self.yields((0.019, 0.0, -0.019), (0.0185, 0.0, -0.0185))
        assert self.yields((0.01999, 0.0, -0.02), (0.01999, 0.0, -0.02))
        assert self.yields((0.0, 0.0, 0.0), (-0.021, 0.0, 0.0))

    def test_unloads_where_the_velocity_turns(self):
        assert not self.yields((0.03, 0.02, -0.02), (0.031, 0.015, -0.02), phase=1.0)
        assert self.yields((0.03, 0.001, -0.02), (0.031, -0.001, -0.02), phase=1.0)
        assert self.yields((0.03, 0.02, -0.02), (0.031, 0.015, -0.02), phase=-1.0)


def test_a_tile_is_searched_along_the_axis_of_its_pair():
    # catches: sine and cosine exchanged, a tile searched from its end; a structure thrown to its
    # top under constant ground acceleration
    structure = Structure(0.5, 0.0, 1.0)
    pair, row = pair_of(structure, cosine=0.6, sine=0.8)
    omega, ground = structure.frequency, np.empty((2, lanes.TILE_STEPS + 1))
    ground[0], ground[1] = 1.0, -2.0  # -1 m/s² along the axis
    centre = 1.0 / omega**2
    inside.search_tile(pair, row, 0, 0.0, 0.01, ground, lanes.TILE_STEPS)
    top = centre + np.hypot(centre, 0.01)
    assert_allclose(row[0, motion.LARGEST_DISPLACEMENT], top, rtol=1e-12)  # rounding
