"""Totals: nothing is lost, expected numbers are those of dice, cells are where their places are."""

import itertools

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from per_obspy.constants import EARTH_RADIUS
from per_obspy.screening.region.totals import STATES, TOTALS, expected_count, grid_cells, totals

TABLE = pd.DataFrame(
    {
        "rank": [4, 2, 1, 3],
        "pair_id": ["d", "b", "a", "c"],
        "state": ["no", "yes", "yes", "possible"],
        "risk_class": ["low", "severe", "high", "low"],
        "demand_ratio": [2.0, 0.1, 0.0, np.nan],
        "probability": [0.0, 0.5, 1.0, 0.5],
        "longitude": [0.1, 179.9, -179.9, 0.3],
        "latitude": [10.0, 0.0, 0.0, 10.0],
    }
)


def test_totals_by_hand():
    north, south = totals(TABLE, ["north", "south", "south", "north"]).to_dict("records")
    assert (north["area"], north["pairs"], north["yes"], north["possible"], north["no"]) == (
        "north",
        2,
        0,
        1,
        1,
    )
    assert (south["yes"], south["class_severe"], south["class_high"], south["class_low"]) == (
        2,
        1,
        1,
        0,
    )
    assert (north["worst_pair"], south["worst_pair"], south["worst_demand_ratio"]) == (
        "c",
        "a",
        0.0,
    )
    assert np.isnan(north["worst_demand_ratio"])
    assert south["expected_pounding"] == 1.5
    assert south["expected_pounding_std_independent"] == 0.5
    assert abs(south["longitude"]) == pytest.approx(
        180.0
    )  # not in Africa, where the mean of 179.9 and -179.9 lies
    assert north["longitude"] == pytest.approx(0.2)


def test_every_column_is_described_and_every_pair_counted_once():
    random = np.random.default_rng(1)
    count = 500
    table = pd.DataFrame(
        {
            "rank": random.permutation(count) + 1,
            "pair_id": [f"p{i}" for i in range(count)],
            "state": random.choice(STATES, count),
            "risk_class": random.choice(["severe", "low"], count),
            "demand_ratio": random.uniform(0, 2, count),
            "probability": random.uniform(0, 1, count),
            "longitude": random.uniform(-180, 180, count),
            "latitude": random.uniform(-90, 90, count),
        }
    )
    found = totals(table, random.choice(["a", "b", ""], count))
    assert set(found) - {"class_severe", "class_low"} == set(TOTALS)
    assert found["pairs"].sum() == found[list(STATES)].sum().sum() == count
    assert found[["class_severe", "class_low"]].sum().sum() == count
    assert_allclose(found["expected_pounding"].sum(), table["probability"].sum())
    # would catch a first row taken for the worst
    assert table.set_index("rank").loc[1, "pair_id"] in set(found["worst_pair"])


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
    got = expected_count(probability)
    # variances are differences of numbers up to 36: 1e-14, and their root near 0 is 1e-7
    assert_allclose(got.mean, mean, atol=1e-12)
    assert_allclose(
        got.std_independent, np.sqrt(max(np.dot(weight, np.square(count)) - mean**2, 0)), atol=1e-6
    )
    # one cause: the count is a step function of a uniform number, integrated between the steps
    steps = np.unique([0.0, *chance, 1.0])
    happened = [(chance > (low + high) / 2).sum() for low, high in itertools.pairwise(steps)]
    second = np.dot(np.diff(steps), np.square(happened))
    assert_allclose(got.std_common, np.sqrt(max(second - mean**2, 0)), atol=1e-6)
    assert got.std_independent <= got.std_common + 1e-6


def test_cells_hold_their_places_and_have_about_the_same_area():
    random = np.random.default_rng(2)
    longitude, latitude = (
        random.uniform(-180, 180, 2000),
        np.degrees(np.arcsin(random.uniform(-1, 1, 2000))),
    )
    size = 200e3
    cell, boxes = grid_cells(longitude, latitude, size)
    own = boxes.loc[cell]
    # would catch cells that cover their neighbours' places
    assert ((longitude - own["west"]) % 360 <= own["east"] - own["west"] + 1e-9).all()
    assert ((own["south"] <= latitude) & (latitude <= own["north"])).all()
    inner = boxes[(boxes["north"].abs() < 80) & (boxes["south"].abs() < 80)]
    area = np.radians(inner["east"] - inner["west"]) * EARTH_RADIUS**2
    area = area * (np.sin(np.radians(inner["north"])) - np.sin(np.radians(inner["south"])))
    # a whole number of cells around a row: within half a cell of 34 at 80 degrees
    assert_allclose(area, size**2, rtol=0.02)


def test_cells_do_not_depend_on_the_other_places():
    many = grid_cells([10.0, 20.0, -70.1], [50.0, -10.0, -33.4], 1000.0).cell
    assert grid_cells([-70.1], [-33.4], 1000.0).cell[0] == many[2]
    assert grid_cells(180.0, 0.0, 1000.0).cell[0] == grid_cells(-180.0, 0.0, 1000.0).cell[0]


def test_bad_sizes_and_probabilities_are_named():
    with pytest.raises(ValueError, match="size must be between 1 and 1e"):
        grid_cells([0.0], [0.0], 0.0)
    with pytest.raises(ValueError, match=r"probability must be between 0 and 1, got 1\.5"):
        expected_count([1.5])
