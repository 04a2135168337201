"""History of a row, so short that it also runs without compilation: indices are checked then."""

import math

import numpy as np
from numpy.testing import assert_allclose

from per_obspy.kernels.pounding_events import motion
from per_obspy.kernels.pounding_events.row_history import (
    is_settled,
    raise_openings,
    reach_in_free_vibration,
    run_history,
)
from per_obspy.pounding.kernel_tables import row_at_rest, structure_table
from per_obspy.pounding.row_history import pounding_history
from per_obspy.pounding.structure import Structure


def pulse(count=40, dt=0.02):
    return -4.0 * np.sin(2 * np.pi * np.arange(count) * dt / 0.8)


def row_of(structures, gap):
    """Return a row of structures at rest with equal gaps."""
    gaps = np.full(len(structures) - 1, gap)
    row = row_at_rest(structure_table(structures), gaps, np.full_like(gaps, 0.5))
    row[0, motion.STICKING_SPEED], row[0, motion.BOUNCE_LIMIT] = 1e-12, 1000
    return row


def test_row_with_a_wall_keeps_its_energy():
    row = [
        Structure(0.9, 0.05, 2.0),
        Structure(0.4, 0.05, 1.0),
        Structure(1.0, 0.0, math.inf, participation=0.0),
    ]
    history = pounding_history(pulse(), 0.02, row, [0.0, 0.004], 0.4)
    assert set(history.impacts["left"]) == {0, 1}
    assert history.closure <= 1e-10  # required


class TestFreeVibration:
    structures = (Structure(0.9, 0.05, 2.0, 0.05, 0.1), Structure(0.4, 0.002, 1.0))

    def run(self, row, count=60, dt=0.02):
        """Return the displacements of a row that vibrates freely."""
        moved, work = np.zeros((count, 2, 3)), np.zeros((count, 2, 4))
        used = run_history(np.zeros(count), dt, 1, row, np.zeros((0, 9)), moved, work)
        assert used == count
        return moved[:, :, 0]

    def test_stays_within_its_reach_and_gets_there(self):
        # catches: a reach about zero instead of the plastic displacement, velocity over omega²
        row = row_of(self.structures, 1.0)
        row[0, motion.PLASTIC], row[0, motion.U] = 0.02, 0.04
        row[:, motion.V] = 0.1, 0.2
        reach = np.array([reach_in_free_vibration(row, i) for i in range(2)])
        displacement = self.run(row)
        assert (displacement >= reach[:, 0] - 1e-15).all()
        assert (displacement <= reach[:, 1] + 1e-15).all()
        # the one with little damping gets there but for the samples
        assert_allclose(displacement[:, 1].max(), reach[1, 1], rtol=0.02)

    def test_rests_where_it_has_no_force(self):
        # catches: a reach about zero or about the plastic displacement
        row = row_of(self.structures, 1.0)
        row[0, motion.PLASTIC], row[0, motion.U] = 0.02, (1.0 - 0.1) * 0.02
        assert_allclose(reach_in_free_vibration(row, 0), 0.018, rtol=1e-14)  # rounding

    def test_a_structure_that_can_still_yield_has_no_bound(self):
        row = row_of(self.structures, 1.0)
        row[0, motion.V] = 10.0
        assert reach_in_free_vibration(row, 0) == (-math.inf, math.inf)

    def test_is_settled_when_no_gap_can_close_and_no_maximum_grow(self):
        row = row_of(self.structures, 0.05)
        row[:, motion.U] = 0.03, -0.01
        row[:, motion.LARGEST_DISPLACEMENT] = 0.03, 0.01
        assert is_settled(row)  # at most 0.04 towards each other
        row[0, motion.GAP] = 0.039
        assert not is_settled(row)
        row[0, motion.GAP] = 0.05
        row[1, motion.LARGEST_DISPLACEMENT] = 0.0099
        assert not is_settled(row)


def test_the_largest_opening_lies_inside_a_piece():
    # catches: openings at the ends only; both move undamped with one period
    row = row_of([Structure(1.0, 0.0, 1.0), Structure(1.0, 0.0, 1.0)], 1.0)
    omega = 2.0 * math.pi
    row[:, motion.U] = -0.02, 0.03
    row[:, motion.V] = -0.1 * 0.02 * omega, 0.1 * 0.03 * omega
    motion.fill_displacements(row, 0.0, 0.0, 22)
    raise_openings(row, 0.1, 22)
    assert_allclose(row[0, motion.OPENING], 0.05 * math.sqrt(1.01), rtol=1e-13)  # rounding
