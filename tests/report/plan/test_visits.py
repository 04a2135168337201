"""Order of visits: laws of any plan, then small cases that have one answer."""

import numpy as np
import pandas as pd
import pytest

from per_obspy.report.plan.visits import Teams, largest_number, planned_visits

#: One degree along a meridian of the sphere of the package, m.
DEGREE = np.pi / 180.0 * 6_371_000.0


def teams(count=2, **changes):
    """Return teams that start at 20 E, 40 N: half an hour a building, 1 m/s, straight ways."""
    plain = Teams([(20.0, 40.0)] * count, 8 * 3600.0, 1800.0, 1.0, 1.0, 4)
    return plain._replace(**changes)


def city(count=60, seed=1, spread=0.005):
    """Return buildings around the start, worst first."""
    random = np.random.default_rng(seed)
    return pd.DataFrame(
        {
            "severity": np.sort(random.gamma(1.0, 0.2, count))[::-1],
            "longitude": 20.0 + random.normal(0.0, spread, count),
            "latitude": 40.0 + random.normal(0.0, spread, count),
        }
    )


def street(order):
    """Return buildings along a meridian, the i-th worst at the place ``order[i]`` of the street."""
    places = 40.0 + np.array(order) * 100.0 / DEGREE
    return pd.DataFrame({"severity": 1.0, "longitude": 20.0, "latitude": places})


def test_no_building_is_visited_twice_and_no_team_stays_longer_than_its_shift():
    plan = planned_visits(city(), teams(3))
    assert plan["building"].is_unique
    assert plan["departure"].max() <= 8 * 3600.0
    assert (plan["departure"] - plan["arrival"]).to_numpy() == pytest.approx(1800.0)


def test_times_add_up_to_ways_and_inspections():
    plan = planned_visits(city(), teams(2))
    for _, visits in plan.groupby("team"):
        ways = visits["way"].cumsum().to_numpy()
        hours = 1800.0 * np.arange(1, len(visits) + 1)
        # at 1 m/s a metre is a second
        np.testing.assert_allclose(visits["departure"], ways + hours, rtol=1e-12)
        assert visits["visit"].tolist() == list(range(1, len(visits) + 1))


def test_ways_are_those_between_the_places():
    buildings = city()
    [first] = planned_visits(buildings, teams(1)).query("visit == 1").to_dict("records")
    place = buildings.iloc[int(first["building"])]
    east = (place["longitude"] - 20.0) * np.cos(np.radians(40.0)) * DEGREE
    north = (place["latitude"] - 40.0) * DEGREE
    # whole metres, and a plane instead of the sphere over some hundreds of metres
    assert first["way"] == pytest.approx(np.hypot(east, north), abs=1.0)


def test_blocks_follow_the_rank():
    # 8 visits a block of two teams: each team's first four are among the eight worst
    plan = planned_visits(city(), teams(2))
    first = plan[plan["visit"] <= 4]
    assert sorted(first["building"]) == list(range(8))


def test_one_visit_a_block_is_the_order_of_the_rank():
    plan = planned_visits(street([3, 0, 2, 1]), teams(1, block=1))
    assert plan["building"].tolist() == [0, 1, 2, 3]


def test_within_a_block_the_way_is_the_shortest():
    # along a street from its end: in the order of the places
    plan = planned_visits(street([4, 1, 3, 2]), teams(1))
    assert plan["building"].tolist() == [1, 3, 2, 0]
    assert plan["way"].sum() == pytest.approx(400.0, abs=4)  # whole metres, four ways


def test_less_walking_than_strictly_by_rank():
    near, strict = (planned_visits(city(), teams(1, block=n))["way"].head(8) for n in (8, 1))
    assert near.sum() < strict.sum()


def test_without_time_for_all_the_worse_is_visited():
    # two places at the same distance to either side, time for one
    buildings = pd.DataFrame(
        {"severity": [0.9, 0.1], "longitude": 20.0, "latitude": [40.001, 39.999]}
    )
    plan = planned_visits(buildings, teams(1, shift=2400.0))
    assert plan["building"].tolist() == [0]


def test_more_teams_never_visit_fewer():
    counts = [len(planned_visits(city(), teams(count))) for count in (1, 2, 4)]
    assert counts == sorted(counts)
    assert counts[-1] <= largest_number(teams(4))


def test_the_plan_is_the_same_every_time():
    pd.testing.assert_frame_equal(*(planned_visits(city(), teams(2)) for _ in range(2)))


def test_buildings_without_a_place_and_no_time_at_all():
    buildings = city(3)
    buildings.loc[0, "longitude"] = np.nan
    assert sorted(planned_visits(buildings, teams(1))["building"]) == [1, 2]
    assert planned_visits(buildings, teams(1, shift=1000.0)).empty
