"""Joints of a row: which contacts go on at a building, and where pairs contradict each other."""

import numpy as np
import pytest

from per_obspy.buildings.chains import MOST_CONTACTS, joints_of
from per_obspy.buildings.contacts import contacts_of

from .street import street, table_of


def joined_pairs(table, angle=30.0):
    """Return the pairs that are joined, by name, and all that was found."""
    pairs = table_of(table)
    contacts = contacts_of(pairs, angle)
    joints = joints_of(contacts, pairs, angle)
    ends = np.flatnonzero(joints.joined >= 0)
    names = contacts.pair_id.to_pylist()
    found = {frozenset((names[e // 2], names[joints.joined[e] // 2])) for e in ends}
    return found, joints


@pytest.mark.parametrize(
    ("azimuth", "goes_on"),
    [(90, True), (119, True), (61, True), (121, False), (0, False), (270, False)],
)
def test_a_row_goes_on_where_the_axes_agree(azimuth, goes_on):
    # a neighbour back at 270 degrees is on the side from which the row comes
    found, _ = joined_pairs(street(("a", "b", 90, 0.0), ("b", "c", azimuth, 0.0)))
    assert bool(found) == goes_on


@pytest.mark.parametrize(
    "pairs",
    [
        [("a", "b", 90), ("b", "c", 90)],
        [("b", "a", 270), ("b", "c", 90)],
        [("a", "b", 90), ("c", "b", 270)],
        [("b", "a", 270), ("c", "b", 270)],
    ],
)
def test_the_order_within_a_pair_does_not_matter(pairs):
    found, _ = joined_pairs(street(*((*pair, 0.0) for pair in pairs)))
    assert found == {frozenset({"p0", "p1"})}


def test_axes_around_north_agree():
    found, _ = joined_pairs(street(("a", "b", 359, 0.0), ("b", "c", 1, 0.0)))
    assert found


def test_a_corner_building_has_a_joint_along_each_axis():
    cross = street(("w", "x", 90, 0), ("x", "e", 90, 0), ("s", "x", 0, 0), ("x", "n", 0, 0))
    found, joints = joined_pairs(cross)
    assert found == {frozenset({"p0", "p1"}), frozenset({"p2", "p3"})}
    assert joints.forks.size == 0


def test_at_a_fork_the_narrowest_gap_goes_on():
    table = street(("a", "b", 90, 0.0), ("b", "c", 88, 0.2), ("b", "d", 95, 0.1))
    found, joints = joined_pairs(table)
    assert found == {frozenset({"p0", "p2"})}
    assert joints.forks.size == 1


def test_of_equal_gaps_the_longest_facing_walls_go_on():
    table = street(("a", "b", 90, 0.0), ("b", "c", 90, 0.0), ("b", "d", 95, 0.0))
    assert joined_pairs(table)[0] == {frozenset({"p0", "p1"})}
    assert joined_pairs(table.assign(facing_length=[9.0, 2.0, 8.0]))[0] == {frozenset({"p0", "p2"})}


def test_an_unknown_axis_joins_nothing():
    assert not joined_pairs(street(("a", "b", np.nan, 0.0), ("b", "c", 90, 0.0)))[0]


@pytest.mark.parametrize("name", ["period", "height", "mass", "damping", "yield_displacement"])
def test_pairs_that_contradict_each_other_are_not_joined(name):
    table = street(("a", "b", 90, 0.0), ("b", "c", 90, 0.0))
    table = table.assign(**{f"{name}_1": [9.0, 0.5], f"{name}_2": [0.6, 9.0]})
    found, joints = joined_pairs(table)
    assert not found
    assert joints.contradictory.size == 1
    ((_, rejection),) = joints.rejected
    assert (rejection.kind, rejection.name) == ("row", "b")
    assert rejection.reasons == (
        f"{name} = 0.6 in pair 'p0' and 0.5 in pair 'p1': the row is cut at this building",
    )


@pytest.mark.parametrize("derived", ["period_1", "height_1 period_1"])
def test_a_derived_value_contradicts_nothing(derived):
    table = street(("a", "b", 90, 0.0), ("b", "c", 90, 0.0))
    table = table.assign(period_1=[9.0, 0.5], period_2=[0.6, 9.0], derived=["", derived])
    assert joined_pairs(table)[0]


def test_rounding_is_no_contradiction():
    table = street(("a", "b", 90, 0.0), ("b", "c", 90, 0.0))
    assert joined_pairs(table.assign(period_1=[9.0, 0.604], period_2=[0.6, 9.0]))[0]


def test_a_corner_may_have_another_period_along_its_other_axis():
    table = street(("a", "b", 90, 0.0), ("b", "c", 0, 0.0))
    _, joints = joined_pairs(table.assign(period_1=[9.0, 0.5], period_2=[0.6, 9.0]))
    assert joints.rejected == []


def test_a_name_with_more_neighbours_than_a_building_has_is_not_joined():
    many = [("?", f"n{number}", 90.0, 0.0) for number in range(MOST_CONTACTS)]
    found, joints = joined_pairs(street(*many, ("w", "?", 90, 0.0)))
    assert not found
    assert joints.crowded.size == 1
    assert [rejection.name for _, rejection in joints.rejected] == ["?"]
