"""Contacts between numbered buildings: names, repeated contacts, identifiers of several places."""

import numpy as np
import pytest

from per_obspy.inventory.building_rows.contacts import contacts_of

from .street import street


def test_a_name_is_one_building():
    found = contacts_of(street(("x", "y", 90, 0.1), ("z", "y", 270, 0.2)), 30.0)
    assert found.names[found.buildings].tolist() == [["x", "y"], ["z", "y"]]
    assert found.named.all()
    assert found.rejected == ()


def test_pairs_without_identifiers_have_two_buildings_of_their_own():
    found = contacts_of(street(("", "", 90, 0.1), ("a", "", 0, 0.2)), 30.0)
    assert found.names[found.buildings].tolist() == [["p0#1", "p0#2"], ["a", "p1#2"]]
    assert found.named[found.buildings].tolist() == [[False, False], [True, False]]


def test_a_table_without_identifiers_has_only_such_pairs():
    table = street(("a", "b", 90, 0.1), ("b", "c", 90, 0.1))
    found = contacts_of(table.drop(columns=["building_id_1", "building_id_2"]), 30.0)
    assert np.unique(found.buildings).size == 4


def test_the_narrower_of_two_descriptions_of_a_contact_is_taken():
    # listed a second time, from the other building, with another gap
    table = street(("a", "b", 90, 0.3), ("b", "a", 271, 0.1), ("b", "c", 90, 0.0))
    found = contacts_of(table, 30.0)
    assert found.repeated.tolist() == [True, False, False]
    (rejection,) = found.rejected
    assert (rejection.kind, rejection.name) == ("row", "p0")
    assert rejection.reasons == (
        "it repeats the contact of pair 'p1' between the same buildings: "
        "rows take the gap of 0.1 m instead of 0.3 m",
    )


def test_two_contacts_around_a_courtyard_are_two():
    found = contacts_of(street(("a", "b", 90, 0.3), ("a", "b", 0, 0.1)), 30.0)
    assert not found.repeated.any()


def test_of_three_descriptions_each_axis_keeps_one():
    table = street(("a", "b", 90, 0.3), ("a", "b", 0, 0.1), ("a", "b", 180, 0.2))
    assert contacts_of(table, 30.0).repeated.tolist() == [False, False, True]


def test_one_name_at_two_places_is_no_building():
    table = street(("a", "b", 90, 0.1), ("a", "c", 270, 0.1))
    # 0.01 degrees of latitude are 1.1 km
    table.loc[1, ["latitude_1", "latitude_2"]] += 0.01
    found = contacts_of(table, 30.0)
    assert np.unique(found.buildings).size == 4
    assert found.ambiguous.tolist() == [True, True]
    (rejection,) = found.rejected
    assert (rejection.kind, rejection.name) == ("building", "a")
    assert "up to 1112 m apart" in rejection.reasons[0]


def test_a_building_on_the_date_line_is_at_one_place():
    table = street(("a", "b", 90, 0.1), ("a", "c", 270, 0.1))
    table["longitude_1"] = [179.9999, -179.9999]
    assert contacts_of(table, 30.0).rejected == ()


@pytest.mark.parametrize("order", [[0, 1, 2], [2, 0, 1]])
def test_numbers_do_not_depend_on_the_order_of_the_table(order):
    table = street(("c", "b", 90, 0.1), ("b", "a", 90, 0.1), ("", "", 90, 0.1))
    found = contacts_of(table.iloc[order].reset_index(drop=True), 30.0)
    assert found.names[:3].tolist() == ["a", "b", "c"]
    assert found.pair_id[np.argsort(found.order)].tolist() == ["p0", "p1", "p2"]


def test_a_known_gap_goes_before_an_unknown_one():
    found = contacts_of(street(("a", "b", 90, np.nan), ("b", "a", 270, 0.4)), 30.0)
    assert found.repeated.tolist() == [True, False]
    assert "rows take the gap of 0.4 m instead of unknown width" in found.rejected[0].reasons[0]
