"""
Buildings of a row from the pairs on both sides of each, and exact histories of rows.

A row of two is the pair; mirrored rows; effect of neighbours.
"""

import numpy as np
import pytest

from per_obspy.buildings.histories import OUTCOMES, members_of, no_outcomes, row_outcomes
from per_obspy.pounding.pair_histories import pounding_histories

from .terraces import contacts, motion, turned

#: Impact sequences are chaotic: rounding grows from impact to impact, by some 1e-9 in these.
CHAOS = {"rtol": 1e-6}


def outcomes(table, azimuth=60.0, first=None):
    ends = np.array([0, len(table["gap"])] if first is None else first)
    return row_outcomes(motion(), table, ends, np.full(ends.size - 1, azimuth))


def test_a_row_of_two_is_the_pair():
    table = contacts(6)
    found = outcomes(table, first=np.arange(7))
    north, east, dt = motion()
    sides = {}
    for name in ("period", "damping", "participation", "yield_displacement", "hardening"):
        sides |= {f"{name}_{i}": table[f"{name}_{i}"] for i in (1, 2)}
    exact = pounding_histories(
        np.stack([north, east]),
        dt,
        mass_1=table["contact_mass_1"],
        mass_2=table["contact_mass_2"],
        gap=table["gap"],
        restitution=table["restitution"],
        azimuth=np.full(6, 60.0),
        **sides,
    )
    assert (exact.impact_velocity > 0).all()
    np.testing.assert_allclose(found["impact_velocity"], exact.impact_velocity, **CHAOS)
    # pairs are followed at contact height, rows by their oscillators
    for side, i in (("left", 1), ("right", 2)):
        at_contact = table[f"participation_{i}"] * found[f"displacement_{side}"]
        np.testing.assert_allclose(at_contact, exact.displacement_maxima[i - 1], **CHAOS)


def test_a_row_of_two_alone_is_itself():
    found = outcomes(contacts(3), first=[0, 1, 2, 3])
    for name in ("impacts", "impact_velocity"):
        np.testing.assert_array_equal(found[name], found[f"{name}_alone"])
    np.testing.assert_array_equal(found["amplification_left"], found["amplification_alone_left"])


def test_the_pair_alone_has_no_other_neighbours():
    table = contacts(4)
    row = outcomes(table)
    pairs = outcomes(table, first=np.arange(5))
    for name in ("impacts", "impact_velocity"):
        np.testing.assert_array_equal(row[f"{name}_alone"], pairs[name])
    for side in ("left", "right"):
        alone = row[f"amplification_alone_{side}"]
        np.testing.assert_array_equal(alone, pairs[f"amplification_{side}"])
    # in a row of five with narrow gaps they matter
    assert not np.allclose(row["impact_velocity"], row["impact_velocity_alone"], rtol=1e-3)


def test_a_pair_that_meets_others_alone_is_that_of_the_risk_table():
    # three touching buildings and two; then the same without the history of the first pair
    table = with_one_turned(contacts(4, gap=np.array([0.0, 0.0, 5.0, 0.0])))
    computed = outcomes(table)
    history = {"impacts_alone": 7.0, "impact_velocity_alone": 0.5}
    history |= {"amplification_alone_1": 1.1, "amplification_alone_2": 1.2}
    found = outcomes(table | {name: np.full(4, value) for name, value in history.items()})
    rest = outcomes(table | {name: np.append(np.nan, [v] * 3) for name, v in history.items()})
    expected = {"impacts": [7] * 2, "impact_velocity": [0.5] * 2}
    expected |= {"amplification_left": [1.1, 1.2], "amplification_right": [1.2, 1.1]}
    for name in OUTCOMES[:-1]:
        stem = name.replace("_alone", "")
        # the others of the row have no effect on the last pair
        own = computed[name] if stem == name else [*expected[stem], *computed[name][2:]]
        np.testing.assert_array_equal(found[name], own)
        own = computed[name] if stem == name else [computed[name][0], *own[1:]]
        np.testing.assert_array_equal(rest[name], own)
    assert computed["impacts_alone"][3] == computed["impacts"][3] > 0


def test_a_mirrored_row_does_the_same():
    table = contacts(3)
    found, other = outcomes(table), outcomes(turned(table), azimuth=240.0)
    np.testing.assert_allclose(other["impact_velocity"][::-1], found["impact_velocity"], **CHAOS)
    left, right = other["amplification_left"], found["amplification_right"]
    np.testing.assert_allclose(left[::-1], right, **CHAOS)


def with_one_turned(table):
    """Return a table of which buildings 1 and 2 of the second pair are exchanged."""
    pairs = {name: column.copy() for name, column in table.items()}
    for name in list(pairs):
        if name.endswith("_1"):
            other = f"{name[:-1]}2"
            pairs[name][1], pairs[other][1] = table[other][1], table[name][1]
    pairs["turned"][1] = True
    return pairs


def test_a_turned_pair_is_the_same_pair():
    table = contacts(3)
    expected, found = outcomes(table), outcomes(with_one_turned(table))
    for name in OUTCOMES:
        np.testing.assert_array_equal(found[name], expected[name])


def test_equal_buildings_in_touch_never_hit_each_other():
    table = contacts(4, gap=np.zeros(4))
    for name in ("period", "contact_mass", "participation"):
        table[f"{name}_1"] = table[f"{name}_2"] = np.full(4, table[f"{name}_1"][0])
    found = outcomes(table)
    assert (found["impact_velocity"] == 0).all()
    # the radius with and without contact come from two programs
    np.testing.assert_allclose(found["amplification_left"], 1.0, rtol=1e-9)


def test_a_row_depends_twice_as_much_on_the_contact_as_a_pair():
    table = contacts(4)
    row, pairs = outcomes(table), outcomes(table, first=np.arange(5))
    # lognormal with mean 1: deviations 0.2 and 0.1; 0.99446 is the 84 % point of a normal variable
    for found, deviation in ((row, 0.2), (pairs, 0.1)):
        ratio = found["impact_velocity_84"] / found["impact_velocity"]
        expected = np.exp(deviation * 0.99446 - deviation**2 / 2)
        np.testing.assert_allclose(ratio, [expected, 1.0, expected, 1.0], rtol=1e-5)


def test_wide_gaps_keep_a_row_apart():
    found = outcomes(contacts(4, gap=np.full(4, 5.0)))
    assert (found["impacts"] == 0).all()
    # the radius with and without contact come from two programs
    np.testing.assert_allclose(found["amplification_right"], 1.0, rtol=1e-9)


def test_a_row_does_not_depend_on_its_company():
    table = contacts(5)
    together = outcomes(table, first=[0, 3, 5])
    alone = outcomes({name: column[3:] for name, column in table.items()})
    for name in OUTCOMES:
        np.testing.assert_array_equal(together[name][3:], alone[name])


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


def test_without_a_history_everything_is_empty():
    empty = no_outcomes(2)
    assert set(empty) == set(OUTCOMES)
    assert all(np.isnan(empty[name]).all() for name in OUTCOMES if name != "reconciled")


def test_a_negative_gap_is_refused():
    with pytest.raises(ValueError, match="gap"):
        outcomes(contacts(2, gap=np.array([0.0, -0.1])))
