"""Contacts between numbered buildings: names, repeated contacts, identifiers of several places."""

import numpy as np
import pandas as pd
import pytest

from per_obspy.buildings.contacts import PROPERTIES, Derived, contacts_of, given_values

from .street import street, table_of


def found_in(pairs):
    """Return the contacts of a pair table."""
    return contacts_of(table_of(pairs), 30.0)


def names_of(contacts):
    """Return the identifiers of both buildings of each pair."""
    return [
        list(names) for names in zip(*(side.to_pylist() for side in contacts.names), strict=True)
    ]


def test_a_name_is_one_building():
    found = found_in(street(("x", "y", 90, 0.1), ("z", "y", 270, 0.2)))
    assert names_of(found) == [["x", "y"], ["z", "y"]]
    assert (found.codes >= 0).all()
    assert found.rejected == []


def test_pairs_without_identifiers_have_two_buildings_of_their_own():
    found = found_in(street(("", "", 90, 0.1), ("a", "", 0, 0.2)))
    assert names_of(found) == [["p0#1", "p0#2"], ["a", "p1#2"]]
    assert (found.codes >= 0).tolist() == [[False, False], [True, False]]


def test_a_table_without_identifiers_has_only_such_pairs():
    table = street(("a", "b", 90, 0.1), ("b", "c", 90, 0.1))
    found = found_in(table.drop(columns=["building_id_1", "building_id_2"]))
    assert np.unique(found.buildings).size == 4


def test_the_narrower_of_two_descriptions_of_a_contact_is_taken():
    # listed a second time, from the other building, with another gap
    table = street(("a", "b", 90, 0.3), ("b", "a", 271, 0.1), ("b", "c", 90, 0.0))
    found = found_in(table)
    assert found.repeated.tolist() == [True, False, False]
    ((_, rejection),) = found.rejected
    assert (rejection.kind, rejection.name) == ("row", "p0")
    assert rejection.reasons == (
        "it repeats the contact of pair 'p1' between the same buildings: "
        "rows take the gap of 0.1 m instead of 0.3 m",
    )


def test_two_contacts_around_a_courtyard_are_two():
    found = found_in(street(("a", "b", 90, 0.3), ("a", "b", 0, 0.1)))
    assert not found.repeated.any()


def test_of_three_descriptions_each_axis_keeps_one():
    table = street(("a", "b", 90, 0.3), ("a", "b", 0, 0.1), ("a", "b", 180, 0.2))
    assert found_in(table).repeated.tolist() == [False, False, True]


def test_one_name_at_two_places_is_no_building():
    table = street(("a", "b", 90, 0.1), ("a", "c", 270, 0.1))
    # 0.01 degrees of latitude are 1.1 km
    table.loc[1, ["latitude_1", "latitude_2"]] += 0.01
    found = found_in(table)
    assert np.unique(found.buildings).size == 4
    assert found.ambiguous.tolist() == [True, True]
    ((_, rejection),) = found.rejected
    assert (rejection.kind, rejection.name) == ("building", "a")
    assert "up to 1112 m apart" in rejection.reasons[0]


def test_a_building_on_the_date_line_is_at_one_place():
    table = street(("a", "b", 90, 0.1), ("a", "c", 270, 0.1))
    table["longitude_1"] = [179.9999, -179.9999]
    assert found_in(table).rejected == []


@pytest.mark.parametrize("order", [[0, 1, 2], [2, 0, 1]])
def test_numbers_do_not_depend_on_the_order_of_the_table(order):
    table = street(("c", "b", 90, 0.1), ("b", "a", 90, 0.1), ("", "", 90, 0.1))
    found = found_in(table.iloc[order].reset_index(drop=True))
    names = np.array(names_of(found)).ravel()
    _, ends = np.unique(found.buildings, return_index=True)
    assert names[ends[:3]].tolist() == ["a", "b", "c"]
    assert found.pair_id.take(np.argsort(found.order)).to_pylist() == ["p0", "p1", "p2"]


def test_a_known_gap_goes_before_an_unknown_one():
    found = found_in(street(("a", "b", 90, np.nan), ("b", "a", 270, 0.4)))
    assert found.repeated.tolist() == [True, False]
    assert "rows take the gap of 0.4 m instead of unknown width" in found.rejected[0][1].reasons[0]


def test_whole_names_count():
    derived = pd.Series(["period_1 mass_2", "period_11", ""])
    assert Derived(derived).has("period_1").tolist() == [True, False, False]


def test_derived_infinite_and_absent_values_are_not_given():
    table = pd.DataFrame(
        {
            "derived": ["", "period_1"],
            "period_1": [0.5, 0.6],
            "period_2": [0.7, 0.8],
            "yield_displacement_1": [np.inf, 0.1],
            "hardening_1": [0.0, 0.02],
        }
    )
    given = {
        name: given_values(table_of(table), Derived(table["derived"]), name) for name in PROPERTIES
    }
    np.testing.assert_array_equal(given["period"], [[0.5, 0.7], [np.nan, 0.8]])
    np.testing.assert_array_equal(given["yield_displacement"][:, 0], [np.nan, 0.1])
    # the hardening of a building that does not yield means nothing
    np.testing.assert_array_equal(given["hardening"][:, 0], [np.nan, 0.02])
    assert np.isnan(given["mass"]).all()
