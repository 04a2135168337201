"""The next event of a row, against closed forms of undamped oscillators."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.kernels.polynomial_roots import value_and_slope
from per_obspy.kernels.pounding_events import motion, next_event
from per_obspy.pounding.kernel_tables import row_at_rest, structure_table
from per_obspy.pounding.structure import Structure

OMEGA = 2.0 * math.pi
LOG = np.zeros((0, 9))
#: A segment of 0.1 s at rest ground.
SEGMENT = motion.Segment(0.0, 0.1, 0.0, 0.0, 22)


def row_of(gap, structure, other=None):
    """Return a row at rest: a structure left of another one, or of a wall."""
    other = other or Structure(1.0, 0.0, math.inf, participation=0.0)
    table = structure_table([structure, other])
    row = row_at_rest(table, np.array([gap]), np.array([0.5]))
    row[0, motion.STICKING_SPEED], row[0, motion.BOUNCE_LIMIT] = 1e-12, 100
    return row


class TestFindEvent:
    def test_no_event(self):
        row = row_of(1.0, Structure(1.0, 0.0, 1.0))
        row[0, motion.V] = 0.1
        assert next_event.find_event(row, SEGMENT, 0.04) == (0.1 - 0.04, next_event.SEGMENT_END, -1)

    def test_impact(self):
        # u = v / omega sin(omega t) reaches the gap
        row = row_of(0.03, Structure(1.0, 0.0, 1.0))
        row[0, motion.V] = 0.04 * OMEGA * 1.5
        span, kind, index = next_event.find_event(row, SEGMENT, 0.0)
        assert (kind, index) == (next_event.HIT, 0)
        assert_allclose(span, math.asin(0.03 / 0.06) / OMEGA, rtol=1e-12)  # rounding, as below

    @pytest.mark.parametrize("side", [1, -1])
    def test_yielding_and_unloading(self, side):
        row = row_of(1.0, Structure(1.0, 0.0, 1.0, 0.03, 0.0))
        row[0, motion.V] = side * 0.06 * OMEGA
        # the elastic part of the motion
        span, kind, index = next_event.find_event(row, SEGMENT, 0.0)
        assert (kind, index) == (next_event.YIELDING, 0)
        assert_allclose(span, math.asin(0.5) / OMEGA, rtol=1e-12)
        next_event.finish_piece(row, LOG, SEGMENT, span, span, kind, index)
        assert row[0, motion.PHASE] == side
        # without hardening the velocity falls by omega² u_y per second
        velocity = 0.06 * OMEGA * math.cos(math.asin(0.5))
        longer = motion.Segment(0.0, 0.4, 0.0, 0.0, 22)
        span, kind, index = next_event.find_event(row, longer, 0.0)
        assert (kind, index) == (next_event.REVERSAL, 0)
        assert_allclose(span, velocity / (OMEGA**2 * 0.03), rtol=1e-12)
        # then the plastic displacement is that of the yielding
        next_event.finish_piece(row, LOG, longer, span, span, kind, index)
        plastic = 0.5 * velocity**2 / (OMEGA**2 * 0.03)
        assert row[0, motion.PHASE] == 0.0
        assert_allclose(row[0, motion.PLASTIC], side * plastic, rtol=1e-12)

    @pytest.mark.parametrize("side", [1, -1])
    @pytest.mark.parametrize("reaches", [False, True])
    def test_yielding_at_the_end_of_a_short_piece(self, side, reaches):
        # catches: a bound of the motion in a piece that is too small
        row = row_of(1.0, Structure(1.0, 0.0, 1.0, 0.03, 0.0))
        amplitude = (1.001 if reaches else 0.999) * 0.03 / math.sin(0.02 * OMEGA)
        row[0, motion.V] = side * amplitude * OMEGA
        span, kind, _ = next_event.find_event(row, SEGMENT, 0.08)
        assert kind == (next_event.YIELDING if reaches else next_event.SEGMENT_END)
        expected = math.asin(0.03 / amplitude) / OMEGA if reaches else 0.02
        assert_allclose(span, expected, rtol=1e-12)

    def test_release(self):
        # in contact u = u0 cos(W t) + v0 / W sin(W t); the force is m1 (W² - omega1²) u
        row = row_of(0.0, Structure(1.0, 0.0, 1.0), Structure(0.8, 0.0, 1.0))
        row[:, motion.U], row[:, motion.V] = 0.01, -0.2
        together = math.sqrt(0.5 * OMEGA**2 * (1.0 + 1.0 / 0.64))
        span, kind, index = next_event.find_event(row, SEGMENT, 0.0)
        assert (kind, index) == (next_event.RELEASE, 0)
        expected = math.atan(0.01 * together / 0.2) / together
        assert_allclose(span, expected, rtol=1e-9)  # the force is zero within its rounding
        next_event.finish_piece(row, LOG, SEGMENT, span, span, kind, index)
        assert row[0, motion.IN_CONTACT] == 0.0


class TestPeaks:
    def test_of_an_elastic_structure_are_exact_inside_a_piece(self):
        # catches: peaks at the ends only; the radius of free vibration is constant
        row = row_of(1.0, Structure(1.0, 0.0, 1.0))
        row[0, motion.U], row[0, motion.V] = 0.05, 0.3 * 0.05 * OMEGA
        span, kind, index = next_event.find_event(row, SEGMENT, 0.0)
        next_event.finish_piece(row, LOG, SEGMENT, span, span, kind, index)
        assert row[0, motion.V] < 0.0
        squared = 0.05**2 * (1.0 + 0.3**2)
        assert_allclose(row[0, motion.LARGEST_DISPLACEMENT], math.sqrt(squared), rtol=1e-12)
        assert_allclose(row[0, motion.LARGEST_RADIUS_SQUARED], squared, rtol=1e-12)

    def test_of_the_radius_lie_where_the_ground_acceleration_changes_its_sign(self):
        # catches: roots of the velocity only; without damping u'' + omega² u = -a
        segment = motion.Segment(0.0, 0.1, -2.0, 40.0, 22)
        row = row_of(1.0, Structure(1.0, 0.0, 1.0))
        row[0, motion.V] = 0.5
        span, kind, index = next_event.find_event(row, segment, 0.0)
        u, v = value_and_slope(row, 0, motion.TAYLOR, 22, 0.05)
        next_event.finish_piece(row, LOG, segment, span, span, kind, index)
        largest = row[0, motion.LARGEST_RADIUS_SQUARED]
        assert_allclose(largest, u**2 + (v / OMEGA) ** 2, rtol=1e-12)
        assert largest > 1.01 * (row[0, motion.U] ** 2 + (row[0, motion.V] / OMEGA) ** 2)

    def test_of_the_recoverable_energy_do_not_grow_while_yielding(self):
        row = row_of(1.0, Structure(1.0, 0.0, 1.0, 0.03, 0.0))
        row[0, motion.V] = 0.06 * OMEGA
        # an elastic and a yielding piece
        for _ in range(2):
            span, kind, index = next_event.find_event(row, SEGMENT, 0.0)
            next_event.finish_piece(row, LOG, SEGMENT, span, span, kind, index)
        energy = row[0, motion.LARGEST_ENERGY_RADIUS_SQUARED]
        assert_allclose(energy, 0.06**2, rtol=1e-12)
        assert row[0, motion.LARGEST_RADIUS_SQUARED] > 1.01 * energy
