"""Totals: every pair counts once, expected numbers are those of dice, cells hold their places."""

import itertools

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from per_obspy.constants import EARTH_RADIUS
from per_obspy.screening.ranking import STATES
from per_obspy.screening.totals import (
    TOTALS,
    expected_count,
    grid_cells,
    joined_totals,
    partial_totals,
)

TABLE = pd.DataFrame(
    {
        "rank": [4, 2, 1, 3],
        "pair_id": ["d", "b", "a", "c"],
        "state": ["no", "yes", "likely", "possible"],
        "risk_class": ["low", "severe", "high", "low"],
        "expected_impact_velocity": [0.0, 0.6, 0.7, 0.02],
        "probability": [0.0, 0.5, 1.0, 0.5],
        "longitude": [0.1, 179.9, -179.9, 0.3],
        "latitude": [10.0, 0.0, 0.0, 10.0],
    }
)


def totals(table, area):
    """Return the totals of a table in one piece."""
    return joined_totals([partial_totals(table, area, table["risk_class"].unique())])


def test_totals_by_hand():
    north, south = totals(TABLE, ["north", "south", "south", "north"]).to_dict("records")
    states = ["pairs", "yes", "likely", "possible", "unlikely", "no"]
    assert [north[name] for name in states] == [2, 0, 0, 1, 0, 1]
    assert [south[name] for name in states] == [2, 1, 1, 0, 0, 0]
    classes = ["class_severe", "class_high", "class_low"]
    assert [south[name] for name in classes] == [1, 1, 0]

    # the smallest rank of each area
    assert (north["area"], north["worst_pair"]) == ("north", "c")
    assert (south["worst_pair"], south["worst_state"]) == ("a", "likely")
    assert south["worst_expected_impact_velocity"] == 0.7
    assert south["expected_pounding"] == 1.5
    assert south["expected_pounding_std_independent"] == 0.5
    assert abs(south["longitude"]) == pytest.approx(
        180.0
    )  # not in Africa, where the mean of 179.9 and -179.9 lies
    assert north["longitude"] == pytest.approx(0.2)


@pytest.fixture(scope="module")
def city():
    """500 random pairs."""
    random, count = np.random.default_rng(1), 500
    return pd.DataFrame(
        {
            "rank": random.permutation(count) + 1,
            "pair_id": [f"p{i}" for i in range(count)],
            "state": random.choice(STATES, count),
            "risk_class": random.choice(["severe", "low"], count),
            # numbers that decide nothing here
            "expected_impact_velocity": random.uniform(0, 2, count),
            "probability": random.uniform(0, 1, count),
            "longitude": random.uniform(-180, 180, count),
            "latitude": random.uniform(-90, 90, count),
        }
    )


@pytest.fixture(scope="module")
def areas(city):
    return np.random.default_rng(2).choice(["a", "b", ""], len(city))


def test_every_column_is_described_and_every_pair_counted_once(city, areas):
    found = totals(city, areas)
    assert set(found) - {"class_severe", "class_low"} == set(TOTALS)
    assert found["pairs"].sum() == found[list(STATES)].sum().sum() == len(city)
    assert found[["class_severe", "class_low"]].sum().sum() == len(city)
    assert_allclose(found["expected_pounding"].sum(), city["probability"].sum())
    # would catch a first row taken for the worst
    assert city.set_index("rank").loc[1, "pair_id"] in set(found["worst_pair"])


def test_pieces_of_a_table_have_its_totals(city, areas):
    # to the last bit but for sums in another order; would catch an area or a class that a piece
    # lacks
    classes = ["severe", "low"]
    pieces = [slice(0, 1), slice(1, 120), slice(120, None)]
    parts = [partial_totals(city.iloc[rows], areas[rows], classes) for rows in pieces]
    joined, whole = joined_totals(parts), totals(city, areas)
    pd.testing.assert_frame_equal(joined[whole.columns], whole, rtol=1e-12)


def test_without_probabilities_there_is_no_expected_number():
    found = totals(TABLE.drop(columns="probability"), "whole")
    assert not [name for name in found if name.startswith("expected")]
    partly = totals(TABLE.assign(probability=[np.nan, 0.5, np.nan, 0.25]), "whole")
    assert partly["expected_pounding"].tolist() == [0.75]


@given(st.lists(st.floats(0, 1), min_size=1, max_size=6))
def test_expected_numbers_by_counting_every_outcome(probability):
    chance = np.array(probability)
    count, weight = [], []
    for outcome in itertools.product([0, 1], repeat=len(chance)):
        count.append(sum(outcome))
        weight.append(np.prod(np.where(outcome, chance, 1 - chance)))
    mean = np.dot(weight, count)
    variance = np.dot(weight, np.square(count)) - mean**2

    # variances are differences of numbers up to 36: 1e-14, and their root near 0 is 1e-7
    got = expected_count(probability)
    assert_allclose(got.mean, mean, atol=1e-12)
    assert_allclose(got.std_independent, np.sqrt(max(variance, 0)), atol=1e-6)
    assert got.std_independent <= got.std_common + 1e-6


@given(st.lists(st.floats(0, 1), min_size=1, max_size=6))
def test_one_cause_by_integrating_over_it(probability):
    # the count is a step function of a uniform number, integrated between the steps
    steps = np.unique([0.0, *probability, 1.0])
    middles = (steps[1:] + steps[:-1]) / 2
    happened = (np.array(probability)[:, None] > middles).sum(axis=0)
    mean = np.dot(np.diff(steps), happened)
    variance = np.dot(np.diff(steps), np.square(happened)) - mean**2
    # differences as above
    got = expected_count(probability)
    assert_allclose(got.mean, mean, atol=1e-12)
    assert_allclose(got.std_common, np.sqrt(max(variance, 0)), atol=1e-6)


@pytest.fixture(scope="module")
def places():
    """2000 places all over the Earth."""
    random = np.random.default_rng(2)
    latitude = np.degrees(np.arcsin(random.uniform(-1, 1, 2000)))
    return random.uniform(-180, 180, 2000), latitude


def test_cells_hold_their_places(places):
    # would catch cells that cover their neighbours' places
    longitude, latitude = places
    cell, boxes = grid_cells(longitude, latitude, 200e3)
    own = boxes.loc[cell]
    assert ((longitude - own["west"]) % 360 <= own["east"] - own["west"] + 1e-9).all()
    assert ((own["south"] <= latitude) & (latitude <= own["north"])).all()


def test_cells_have_about_the_same_area(places):
    _, boxes = grid_cells(*places, 200e3)
    inner = boxes[(boxes["north"].abs() < 80) & (boxes["south"].abs() < 80)]
    area = np.radians(inner["east"] - inner["west"]) * EARTH_RADIUS**2
    # of a zone between two latitudes
    area = area * (np.sin(np.radians(inner["north"])) - np.sin(np.radians(inner["south"])))
    # a whole number of cells around a row: within half a cell of 34 at 80 degrees
    assert_allclose(area, 200e3**2, rtol=0.02)


def test_cells_do_not_depend_on_the_other_places():
    many = grid_cells([10.0, 20.0, -70.1], [50.0, -10.0, -33.4], 1000.0).cell
    assert grid_cells([-70.1], [-33.4], 1000.0).cell[0] == many[2]
    assert grid_cells(180.0, 0.0, 1000.0).cell[0] == grid_cells(-180.0, 0.0, 1000.0).cell[0]


def test_bad_sizes_and_probabilities_are_named():
    with pytest.raises(ValueError, match="size must be between 1 and 1e"):
        grid_cells([0.0], [0.0], 0.0)
    with pytest.raises(ValueError, match=r"probability must be between 0 and 1, got 1\.5"):
        expected_count([1.5])
