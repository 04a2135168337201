"""Buildings of a row from the pairs on both sides of each."""

import numpy as np
import pytest

from per_obspy.screening.building_rows.members import members_of

from .terraces import contacts


def members(table, first=None):
    count = len(table["gap"])
    ends = np.array([0, count] if first is None else first)
    return members_of(table, ends, np.full(ends.size - 1, 90.0))


def test_a_building_has_one_oscillator_and_a_contact_height_on_each_side():
    table = contacts(3)
    found = members(table)
    rows = found.rows
    np.testing.assert_allclose(rows.period, [*table["period_1"], table["period_2"][-1]])
    np.testing.assert_allclose(rows.participation_right[:-1], table["participation_1"])
    np.testing.assert_allclose(rows.participation_left[1:], table["participation_2"])
    # the mass of the mode does not depend on the height of the contact
    for side, building in ((1, found.left), (2, found.right)):
        at_contact = rows.mass[building] / table[f"participation_{side}"] ** 2
        np.testing.assert_allclose(at_contact, table[f"contact_mass_{side}"])
    assert not found.reconciled.any()


def test_rows_stand_one_after_the_other():
    found = members(contacts(5), first=[0, 2, 3, 5])
    assert found.rows.first.tolist() == [0, 3, 5, 8]
    assert found.left.tolist() == [0, 1, 3, 5, 6]
    assert found.right.tolist() == [1, 2, 4, 6, 7]


def test_a_turned_pair_has_its_building_2_on_the_left():
    table = contacts(2, turned=np.array([False, True]))
    rows = members(table).rows
    assert rows.period[2] == table["period_1"][1]
    assert rows.participation_left[2] == table["participation_1"][1]
    assert rows.participation_right[1] == table["participation_2"][1]


@pytest.mark.parametrize(
    ("derived", "expected"),
    [(("", ""), 0.7), (("period_2", ""), 0.8), (("", "period_1"), 0.6)],
)
def test_a_given_value_goes_before_a_derived_one(derived, expected):
    table = contacts(2, derived=np.array(derived, dtype=object))
    table["period_2"], table["period_1"] = np.array([0.6, 1.0]), np.array([1.0, 0.8])
    found = members(table)
    assert found.rows.period[1] == pytest.approx(expected)
    assert found.reconciled.all()


def test_rounding_is_not_noted():
    table = contacts(2)
    table["period_1"] = table["period_2"][[1, 0]] * 1.004
    assert not members(table).reconciled.any()


def test_a_yield_displacement_of_one_pair_is_that_of_the_building():
    table = contacts(2, yield_displacement_1=np.array([np.inf, 0.02]))
    found = members(table)
    assert found.rows.yield_displacement.tolist() == [np.inf, 0.02, np.inf]
    assert found.reconciled.all()
