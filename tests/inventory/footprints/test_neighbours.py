"""Neighbouring polygons: plane geometry with known answers, invariance, and brute force."""

import numpy as np
import pandas as pd
import pytest
import shapely
from numpy.testing import assert_allclose, assert_array_equal
from shapely import affinity

from per_obspy.inventory.footprints import neighbours as module
from per_obspy.inventory.footprints.neighbours import Outlines, neighbours


def _neighbours(polygons, distance):
    return neighbours(Outlines(shapely.bounds(polygons), polygons.__getitem__), distance)


def _found(*polygons, distance=3.0):
    return _neighbours(np.array(polygons), distance)


HOUSE = shapely.box(0, 0, 10, 12)


@pytest.mark.parametrize("gap", [0.0, 0.07, 2.9])
def test_two_houses_side_by_side(gap):
    near = _found(HOUSE, shapely.box(10 + gap, 0, 20 + gap, 12))
    assert_allclose(
        [near["gap"][0], near["azimuth"][0], near["facing_length"][0]],
        [gap, 90.0, 12.0],
        atol=1e-12,
    )
    assert near["overlap"][0] == 0.0


@pytest.mark.parametrize("angle", [17.0, 90.0, 205.0])
def test_turning_the_town_turns_the_axis_only(angle):
    # would catch the mathematical angle in place of the azimuth, and walls taken along the
    # coordinate axes
    houses = np.array([HOUSE, shapely.box(10.3, 4, 20, 16)])
    straight = _neighbours(houses, 3.0)
    # shapely turns anticlockwise, azimuths count clockwise
    turned = _neighbours(
        np.array([affinity.rotate(house, angle, origin=(0, 0)) for house in houses]), 3.0
    )
    assert_allclose(turned.azimuth, (straight.azimuth - angle) % 360.0, atol=1e-9)
    assert_allclose(
        [turned.gap, turned.facing_length], [straight.gap, straight.facing_length], rtol=1e-11
    )


def test_facing_length_is_what_both_walls_share():
    near = _found(HOUSE, shapely.box(10.2, 7, 20, 30))
    assert_allclose(near["facing_length"], 5.0, rtol=1e-12)


def test_a_wall_that_stands_back_does_not_face():
    # an L: 4 m of its wall at 0.1 m, the other 8 m set back by 3 m
    corner = shapely.Polygon([(10.1, 0), (20, 0), (20, 12), (13.1, 12), (13.1, 4), (10.1, 4)])
    near = _found(HOUSE, corner)
    assert_allclose(near["facing_length"], 4.0, rtol=1e-12)
    assert_allclose(near["azimuth"], 90.0, atol=1e-9)


def test_the_far_side_and_the_inside_of_walls_do_not_face():
    # would catch a missing test of direction: a thin house has two walls within reach
    near = _found(HOUSE, shapely.box(10.05, 0, 10.15, 12))
    assert_allclose(near["facing_length"], 12.0, rtol=1e-12)


def test_corners_that_meet_have_no_facing_wall_but_an_axis():
    near = _found(HOUSE, shapely.box(11, 13, 20, 20))
    measured = [near["gap"][0], near["facing_length"][0], near["azimuth"][0]]
    assert_allclose(measured, [np.sqrt(2), 0.0, 45.0], atol=1e-12)
    # corners that touch: the axis joins the centres
    touching = _found(shapely.box(0, 0, 10, 10), shapely.box(10, 10, 20, 20))
    assert_allclose([touching.gap[0], touching.azimuth[0]], [0.0, 45.0], atol=1e-12)


def test_a_house_in_a_corner_lies_along_the_mean_normal():
    # walls of 4 m to the east and 4 m to the north: the resultant points north-east
    around = shapely.Polygon([(0, 6), (10, 6), (10, 0), (16, 0), (16, 12), (0, 12)])
    near = _found(shapely.box(6, 2, 10, 6), around)
    assert_allclose([near["azimuth"][0], near["facing_length"][0]], [45.0, 8.0], atol=1e-9)


def test_crossing_party_walls_overlap():
    near = _found(HOUSE, shapely.box(9.9, 0, 20, 12))
    assert_allclose(
        [near["gap"][0], near["overlap"][0], near["azimuth"][0]], [0.0, 1.2, 90.0], atol=1e-9
    )


def test_round_off_is_no_gap():
    assert _found(HOUSE, shapely.box(10 + 1e-6, 0, 20, 12)).gap[0] == 0.0
    assert _found(HOUSE, shapely.box(10 + 2e-3, 0, 20, 12)).gap[0] > 0.0


def test_a_building_of_two_parts_and_a_courtyard():
    parts = shapely.MultiPolygon([shapely.box(0, 0, 4, 12), shapely.box(6, 0, 10, 12)])
    assert_allclose(_found(parts, shapely.box(10.5, 0, 20, 12)).facing_length, 12.0, rtol=1e-12)
    # a house inside a courtyard faces four walls of 9 m
    yard = shapely.box(0, 0, 30, 30).difference(shapely.box(10, 10, 20, 20))
    near = _found(yard, shapely.box(10.5, 10.5, 19.5, 19.5))
    assert_allclose([near["gap"][0], near["facing_length"][0]], [0.5, 36.0], rtol=1e-12)


def test_the_order_of_points_does_not_matter():
    clockwise = shapely.box(0, 0, 10, 12, ccw=False)
    assert _found(clockwise, shapely.box(10.5, 0, 20, 12)).azimuth[0] == pytest.approx(90.0)


def test_ends_and_insides_of_a_row():
    # would catch neighbours on the same side taken for a continued row
    row = [shapely.box(10 * i, 0, 10 * i + 9.8, 12) for i in range(4)]
    near = _found(*row)
    assert near["first"].tolist() == [0, 1, 2]
    assert near["inside_1"].tolist() == [False, True, True]
    assert near["inside_2"].tolist() == [True, True, False]
    # a neighbour behind does not continue the row
    behind = _found(row[0], row[1], shapely.box(0, 12, 9.8, 24), shapely.box(10, 12, 19.8, 24))
    assert not behind.inside_1.any()
    assert not behind.inside_2.any()


def test_all_pairs_of_a_random_town_by_brute_force():
    generator = np.random.default_rng(7)
    centres = generator.uniform(0, 120, (150, 2))
    town = np.array([
        affinity.rotate(shapely.box(x, y, x + 6, y + 4), angle)
        for (x, y), angle in zip(centres, generator.uniform(0, 180, 150), strict=True)
    ])  # fmt: skip
    near = _neighbours(town, 2.0)
    brute = shapely.distance(town[:, None], town[None, :])
    first, second = np.nonzero(np.triu(brute <= 2.0, k=1))
    assert_array_equal(near["first"], first)
    assert_array_equal(near["second"], second)
    assert_allclose(near["gap"], brute[first, second], atol=module.TOUCHING)


def test_a_wide_building_among_many_small_ones(monkeypatch):
    # a wall of 300 m along thirty houses: would catch pairs that are lost where a block ends
    monkeypatch.setattr(module, "CHUNK", 7)
    houses = [shapely.box(10.0 * i, 0, 10.0 * i + 9.5, 12) for i in range(30)]
    near = _found(shapely.box(0, 12.5, 300, 20), *houses, distance=1.0)
    assert near["first"][:30].tolist() == [0] * 30
    assert near["second"][:30].tolist() == list(range(1, 31))
    assert_allclose(near["gap"], 0.5, atol=1e-12)
    assert len(near["gap"]) == 30 + 29


def test_chunks_do_not_change_a_bit(monkeypatch):
    row = np.array([shapely.box(10.1 * i, 0, 10.1 * i + 10, 12) for i in range(30)])
    whole = _neighbours(row, 1.0)
    monkeypatch.setattr(module, "CHUNK", 4)
    pd.testing.assert_frame_equal(_neighbours(row, 1.0), whole, check_exact=True)
