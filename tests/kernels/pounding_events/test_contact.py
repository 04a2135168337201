"""Impacts and closed interfaces at one instant."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from per_obspy.kernels.pounding_events import contact, motion
from per_obspy.pounding.kernel_tables import row_at_rest, structure_table
from per_obspy.pounding.structure import Structure

MASSES = [(2.0, 1.0), (1.0, 5.0), (1.0, 1.0)]


def touching_row(masses, velocities, restitution, periods=None):
    """Return a row of structures without clearance that are not yet in contact."""
    periods = periods or [1.0] * len(masses)
    structures = [Structure(t, 0.0, m) for t, m in zip(periods, masses, strict=True)]
    gaps = np.zeros(len(masses) - 1)
    row = row_at_rest(structure_table(structures), gaps, np.full_like(gaps, restitution))
    row[:, motion.IN_CONTACT] = 0.0
    # velocities, and the end of bounces
    row[:, motion.V] = velocities
    row[0, motion.STICKING_SPEED], row[0, motion.BOUNCE_LIMIT] = 1e-12, 100
    return row


def empty_log(lines=10):
    return np.zeros((lines, contact.LOG_COLUMNS))


class TestImpact:
    @pytest.mark.parametrize("restitution", [0.0, 0.6, 1.0])
    @pytest.mark.parametrize("masses", MASSES)
    def test_momentum_restitution_and_energy(self, masses, restitution):
        # catches: masses exchanged, the sign of (9) and (10) as printed in the paper
        before = np.array([0.7, -0.4])
        row = touching_row(masses, before, restitution)
        contact.apply_impact(row, empty_log(), 0, 0.0)
        after, mass = row[:, motion.V], np.array(masses)
        assert_allclose(mass @ after, mass @ before, rtol=1e-14)  # rounding, as below
        assert_allclose(after[1] - after[0], restitution * 1.1, rtol=1e-14, atol=1e-15)
        # each structure transfers its kinetic energy; both lose (1 - e²) m1 m2 / (2 M) v²
        kinetic = 0.5 * mass * (before**2 - after**2)
        assert_allclose(row[:, motion.TRANSFERRED], kinetic, rtol=1e-13, atol=1e-15)
        loss = 0.5 * (1.0 - restitution**2) * mass.prod() / mass.sum() * 1.1**2
        assert_allclose(row[:, motion.TRANSFERRED].sum(), loss, rtol=1e-13, atol=1e-15)

    def test_a_wall_reflects(self):
        row = touching_row((2.0, math.inf), (0.5, 0.0), 0.6)
        contact.apply_impact(row, empty_log(), 0, 0.0)
        assert_allclose(row[:, motion.V], [-0.3, 0.0], rtol=1e-14)  # rounding

    def test_is_logged_and_counted(self):
        # catches: velocities logged in the wrong order, a log without room overrun
        row, log = touching_row((1.0, 1.0), (0.5, 0.1), 1.0), empty_log(1)
        row[:, motion.U] = 0.02
        contact.apply_impact(row, log, 0, 3.5)
        assert_allclose(log[0], [3.5, 0, 0.5, 0.1, 0.1, 0.5, 0.4, 0.02, 0.02], rtol=1e-14)
        row[:, motion.V] = 0.9, 0.1
        contact.apply_impact(row, log, 0, 4.0)
        assert log[0, contact.LOG_TIME] == 3.5
        assert row[0, motion.IMPACTS] == row[0, motion.BOUNCES] == 2.0
        assert_allclose(row[0, motion.APPROACH], 0.8, rtol=1e-14)

    def test_counts_above_both_limits_only(self):
        # catches: a limit that counts itself, lines beyond the last impact, limits of another pair
        speeds = [[1.0, 0.01, 0.010001, 9.0], [0.01, 0.001, 0.0010001, 0.002]]
        rows, logs = np.zeros((2, 2, motion.ROW_COLUMNS)), np.zeros((2, 4, contact.LOG_COLUMNS))
        logs[:, :, contact.LOG_BEFORE_1] = speeds
        rows[:, 0, motion.IMPACTS] = 3, 4
        rows[:, 0, motion.APPROACH] = 1.0, 0.01
        assert_array_equal(contact.count_impacts(rows, logs), [2, 3])


class TestRow:
    def test_an_impact_passes_through_touching_structures(self):
        # catches: a row that is passed through once only, or from right to left
        row = touching_row([1.0] * 4, (0.0, 0.0, 0.8, 0.0), 1.0)
        contact.apply_impacts(row, empty_log(), 2, 0.0)
        assert_array_equal(row[:, motion.V], [0.0, 0.0, 0.0, 0.8])
        row = touching_row([1.0] * 4, (0.8, 0.0, 0.0, 0.0), 1.0)
        contact.apply_impacts(row, empty_log(), 0, 0.0)
        assert_array_equal(row[:, motion.V], [0.0, 0.0, 0.0, 0.8])

    def test_structures_with_a_clearance_are_left_alone(self):
        row = touching_row([1.0] * 3, (0.8, 0.0, 0.0), 1.0)
        row[1, motion.GAP] = 1e-6
        contact.apply_impacts(row, empty_log(), 0, 0.0)
        assert_array_equal(row[:, motion.V], [0.0, 0.8, 0.0])
        assert [contact.is_touching(row, j) for j in range(2)] == [True, False]

    def test_a_cluster_keeps_its_momentum(self):
        mass, velocity = np.array([2.0, 1.0, 3.0]), np.array([0.5, 0.5, -0.1])
        row = touching_row(mass, velocity, 0.0)
        contact.join_cluster(row, 0, 2)
        assert_allclose(row[:, motion.V], mass @ velocity / 6.0, rtol=1e-14)  # rounding
        lost = 0.5 * mass @ (velocity**2 - row[:, motion.V] ** 2)
        assert_allclose(row[:, motion.TRANSFERRED].sum(), lost, rtol=1e-13)


class TestEndOfBounces:
    @pytest.mark.parametrize(("ground", "stays"), [(2.0, False), (-2.0, True)])
    def test_only_pressed_structures_stay_in_contact(self, ground, stays):
        # catches: the sign of the closing acceleration; the ground drives the right structure less
        row = touching_row((1.0, 1.0), (0.3, 0.3), 0.0)
        row[1, motion.PARTICIPATION] = 0.5
        segment = motion.Segment(0.0, 0.01, ground, 0.0, 10)
        contact.resolve_contact(row, empty_log(), segment, 0.0, 0)
        assert bool(row[0, motion.IN_CONTACT]) is stays

    def test_slow_separation_is_measured_by_the_closing_acceleration(self):
        # bounces shorter than 2 * STICKING_DELAY end
        row = touching_row((1.0, 1.0), (0.0, 0.5e-3), 0.5)
        row[1, motion.PARTICIPATION] = 0.0
        row[0, motion.STICKING_DELAY] = 1e-3
        assert contact.is_lingering(row, 0, -1.0)  # pressed by 1 m/s²
        assert not contact.is_lingering(row, 0, -0.4)
        assert not contact.is_lingering(row, 0, 1.0)

    def test_a_yielding_structure_that_is_reversed_unloads(self):
        row = touching_row((1.0, 1.0), (-0.2, 0.2), 0.5)
        row[0, motion.YIELD], row[0, motion.PHASE], row[0, motion.U] = 0.02, 1.0, 0.05
        contact.unload_reversed(row)
        assert row[0, motion.PHASE] == 0.0
        assert row[0, motion.UNLOADING] == 1.0
        assert_allclose(row[0, motion.PLASTIC], 0.03, rtol=1e-14)  # rounding
