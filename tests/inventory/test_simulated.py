"""Simulated inventories: valid by the reader's own checks, reproducible, where they should be, and varied."""

import numpy as np
import pandas as pd
import pytest
from obspy.geodetics import gps2dist_azimuth

from per_obspy import asce7_period, read_pairs
from per_obspy.inventory.checking import checked_pairs
from per_obspy.inventory.simulated import simulated_pairs

STATIONS = [-67.95, -67.80], [-20.35, -20.25]


@pytest.fixture(scope="module")
def pairs() -> pd.DataFrame:
    return simulated_pairs(*STATIONS, 4000, seed=20)


def test_every_row_passes_the_checks_of_an_inventory(pairs, tmp_path):
    assert checked_pairs(pairs, "simulated").attrs["rejected"] == ()
    pairs.to_csv(tmp_path / "pairs.csv", index=False)
    pd.testing.assert_frame_equal(read_pairs(tmp_path / "pairs.csv"), pairs, check_dtype=False)


def test_the_seed_decides(pairs):
    pd.testing.assert_frame_equal(simulated_pairs(*STATIONS, 4000, seed=20), pairs)
    assert not simulated_pairs(*STATIONS, 4000, seed=21).equals(pairs)


def test_pairs_stand_within_the_radius_of_a_station():
    table = simulated_pairs([-67.95], [-20.35], 200, seed=1, radius=500.0)
    rows = table[["latitude_1", "longitude_1"]].to_numpy()
    distance = [gps2dist_azimuth(-20.35, -67.95, *row)[0] for row in rows]
    assert max(distance) < 505.0  # flat geometry, off by less than 1 %
    assert max(distance) > 450.0  # and they use the room


def test_azimuth_points_from_the_first_building_to_the_second(pairs):
    # would catch the mathematical angle in place of the azimuth
    rows = pairs.head(50)[["latitude_1", "longitude_1", "latitude_2", "longitude_2"]].to_numpy()
    found = np.array([gps2dist_azimuth(*row)[1] for row in rows])
    difference = (found - pairs["azimuth"].head(50) + 180) % 360 - 180
    assert np.abs(difference).max() < 1.0  # rounded to degrees and to 1e-7 degrees of position


def test_streets_share_their_direction(pairs):
    west = pairs[pairs["longitude_1"] < -67.88]
    folded = np.exp(4j * np.deg2rad(west["azimuth"]))
    assert abs(folded.mean()) > 0.95  # scattered by 2 degrees about a right-angled grid


def test_it_looks_like_a_town(pairs):
    n = len(pairs)
    # shares of n rows: four standard deviations of a binomial share of one half
    scatter = 4 * 0.5 / np.sqrt(n)
    assert abs((pairs["gap"] == 0).mean() - 0.5) < scatter
    assert (pairs["height_1"] == pairs["height_2"]).mean() > 0.4
    assert pairs["system_1"].nunique() == 4
    assert pairs.loc[pairs["gap"] > 0, "gap"].between(0.01, 1.5).all()
    assert 3 <= pairs["storeys_1"].median() <= 5
    assert abs(pairs["period_1"].notna().mean() - 0.5) < scatter


def test_measured_periods_scatter_about_the_formula(pairs):
    measured = pairs[pairs["period_1"].notna()]
    residual = np.log(
        measured["period_1"] / asce7_period(measured["height_1"], measured["system_1"])
    )
    assert abs(residual.mean()) < 4 * 0.3 / np.sqrt(len(measured))
    assert abs(residual.std() - 0.3) < 0.03


def test_touching_is_a_parameter():
    assert (simulated_pairs(*STATIONS, 50, seed=3, touching=1.0)["gap"] == 0).all()
    assert (simulated_pairs(*STATIONS, 50, seed=3, touching=0.0)["gap"] > 0).all()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([], [], 5, 1), "rows of equal length"),
        (([1.0], [2.0, 3.0], 5, 1), "rows of equal length"),
        (([1.0], [99.0], 5, 1), "latitudes must be between -85 and 85, got 99"),
        (([1.0], [2.0], 0, 1), "count must be at least 1, got 0"),
        (([1.0], [2.0], 5, 1, 0.0), "radius must be positive"),
        (([1.0], [2.0], 5, 1, 10.0, 1.5), r"touching must be between 0 and 1, got 1\.5"),
    ],
)
def test_bad_arguments(arguments, message):
    with pytest.raises(ValueError, match=message):
        simulated_pairs(*arguments)
