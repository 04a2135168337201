"""The end of free vibration: no impact that counts may come after it."""

import numpy as np
import pytest

from per_obspy.kernels.pounding_events import motion as columns
from per_obspy.kernels.pounding_rows.last_impacts import is_over, recoverable_energy


def row_of_two():
    """Return a row that touches, with a fastest impact of 1 m/s and maxima of 0.1 m."""
    row = np.zeros((2, columns.ROW_COLUMNS))
    row[:, columns.STIFFNESS], row[:, columns.MASS], row[:, columns.YIELD] = (
        100.0,
        [1.0, 4.0],
        np.inf,
    )
    row[:, columns.LARGEST_DISPLACEMENT], row[0, columns.APPROACH] = 0.1, 1.0
    return row


def test_energy_of_both():
    # catches: stiffness per mass taken for a stiffness
    row = row_of_two()
    row[:, columns.U], row[:, columns.V] = [0.01, 0.0], [0.0, 0.2]
    assert recoverable_energy(row) == pytest.approx(0.5 * 1.0 * 100 * 1e-4 + 0.5 * 4.0 * 0.04)


@pytest.mark.parametrize(("speed", "expected"), [(0.006, True), (0.007, False)])
def test_impacts_below_a_hundredth_of_the_fastest_do_not_count(speed, expected):
    # catches: the share of one building; with all energy both reach 1.5 times this speed in all
    row = row_of_two()
    row[0, columns.V] = speed
    assert is_over(row) == expected


def test_a_first_impact_always_counts():
    # catches: an interface that has not been hit yet
    row = row_of_two()
    row[0, columns.V], row[0, columns.APPROACH] = 1e-6, 0.0
    assert not is_over(row)
    row[0, columns.GAP] = 1e-6  # out of reach: 1e-7 and 0.5e-7 m
    assert is_over(row)


def test_a_displacement_may_still_grow():
    # catches: maxima of a building that takes up the energy of the other
    row = row_of_two()
    row[0, columns.V], row[0, columns.GAP] = 0.5, 1.0
    assert is_over(row)  # 0.05 m at most
    row[0, columns.LARGEST_DISPLACEMENT] = 0.04
    assert not is_over(row)


@pytest.mark.parametrize(("column", "value"), [(columns.YIELD, 0.1), (columns.MASS, np.inf)])
def test_yielding_buildings_and_walls_have_no_bound(column, value):
    # catches: an energy that a wall can give again and again
    row = row_of_two()
    row[1, column] = value
    assert not is_over(row)
