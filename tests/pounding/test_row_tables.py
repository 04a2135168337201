"""Scales of rows: both participations of every interface become 1."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from per_obspy.pounding.row_tables import (
    BuildingRows,
    building_table,
    checked_rows,
    row_scales,
)


def rows_of(first, participation_left, participation_right):
    """Rows of buildings that differ in participation and mass alone."""
    count = first[-1]
    same = {"period": 0.5, "damping": 0.05, "yield_displacement": 0.1, "hardening": 0.1,
            "gap": 0.02, "restitution": 0.6}  # fmt: skip
    fields = {name: np.full(count, value) for name, value in same.items()}
    return BuildingRows(
        np.array(first),
        **fields,
        mass=np.arange(1.0, count + 1.0),
        participation_left=np.array(participation_left),
        participation_right=np.array(participation_right),
        azimuth=np.zeros(len(first) - 1),
    )


ROWS = rows_of([0, 3, 4, 6], [9.0, 0.5, 1.4, 1.0, 9.0, 0.8], [1.3, 0.9, 9.0, 1.0, 0.7, 9.0])


def test_the_scales_turn_every_interface_into_one_of_plain_displacements():
    # catches: left and right exchanged, a chain that goes on in the next row
    rows = checked_rows(ROWS)
    scales = row_scales(rows)
    for j in (0, 1, 4):
        # c a = s on the left of an interface, c b = s on its right; rounding
        left = scales.clearance[j] * rows.participation_right[j]
        right = scales.clearance[j] * rows.participation_left[j + 1]
        assert_allclose(scales.displacement[[j, j + 1]], [left, right], rtol=1e-15)
    # the first interface of a row has the unit of its buildings
    assert_array_equal(scales.clearance[[0, 3, 4]], 1.0)


def test_equal_participations_are_scales_without_rounding():
    # catches: a row of a pair that differs from the pair in the last bit
    rows = checked_rows(rows_of([0, 4], [0.7, 1.1, 0.3, 0.9], [0.7, 1.1, 0.3, 0.9]))
    scales = row_scales(rows._replace(participation_left=rows.participation_right))
    assert_array_equal(scales.clearance, 1.0)
    assert_array_equal(scales.displacement[:-1], rows.participation_right[:-1])


def test_an_impulse_has_the_same_effect_in_the_table():
    # catches: a mass divided by the scale once
    rows = checked_rows(ROWS)
    scales = row_scales(rows)
    mass = building_table(rows, scales)[:, 5]
    for j in (0, 1, 4):
        # modal velocities after a unit impulse at the contact height
        changes = np.array(
            [-rows.participation_right[j] / rows.mass[j],
             rows.participation_left[j + 1] / rows.mass[j + 1]]
        )  # fmt: skip
        impulse = 1.0 / scales.clearance[j]
        in_table = np.array([-impulse / mass[j], impulse / mass[j + 1]])
        assert_allclose(in_table, changes * scales.displacement[j : j + 2], rtol=1e-14)  # rounding


def test_the_table_is_driven_and_yields_at_the_scale():
    # catches: a yield displacement of the modal coordinate beside a displacement of the table
    rows = checked_rows(ROWS)
    scales = row_scales(rows)
    table = building_table(rows, scales)
    assert_array_equal(table[:, 4], scales.displacement)
    assert_array_equal(table[:, 3], 0.1 * scales.displacement)


def test_fields_of_interfaces_that_do_not_exist_are_replaced():
    # catches: a participation of 9 that scales a row
    rows = checked_rows(ROWS)
    assert_array_equal(rows.participation_left[[0, 3, 4]], 1.0)
    assert_array_equal(rows.participation_right[[2, 3, 5]], 1.0)
    assert ROWS.participation_left[0] == 9.0  # the caller's array is unchanged


def test_a_wrong_interface_is_named():
    # catches: the index within the row in place of that of the building
    rows = rows_of([0, 3, 4, 6], np.ones(6), np.ones(6))
    rows.participation_left[5] = -1.0
    with pytest.raises(ValueError, match="at index 5"):
        checked_rows(rows)
