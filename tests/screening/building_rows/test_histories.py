"""Exact histories of rows: a row of two is the pair, mirrored rows, effect of neighbours."""

import numpy as np
import pytest

from per_obspy.pounding.pair_histories import pounding_histories
from per_obspy.screening.building_rows.histories import OUTCOMES, no_outcomes, row_outcomes

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


def test_a_mirrored_row_does_the_same():
    table = contacts(3)
    found, other = outcomes(table), outcomes(turned(table), azimuth=240.0)
    np.testing.assert_allclose(other["impact_velocity"][::-1], found["impact_velocity"], **CHAOS)
    left, right = other["amplification_left"], found["amplification_right"]
    np.testing.assert_allclose(left[::-1], right, **CHAOS)


def test_a_turned_pair_is_the_same_pair():
    table = contacts(3)
    pairs = {name: column.copy() for name, column in table.items()}
    for name in list(pairs):
        if name.endswith("_1"):
            other = f"{name[:-1]}2"
            pairs[name][1], pairs[other][1] = table[other][1], table[name][1]
    pairs["turned"] = np.array([False, True, False])
    expected, found = outcomes(table), outcomes(pairs)
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


def test_without_a_history_everything_is_empty():
    empty = no_outcomes(2)
    assert set(empty) == set(OUTCOMES)
    assert all(np.isnan(empty[name]).all() for name in OUTCOMES if name != "reconciled")


def test_a_negative_gap_is_refused():
    with pytest.raises(ValueError, match="gap"):
        outcomes(contacts(2, gap=np.array([0.0, -0.1])))
