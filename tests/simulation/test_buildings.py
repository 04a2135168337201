"""Simulated inventories: valid by the reader's own checks, reproducible, well placed, varied."""

import numpy as np
import pandas as pd
import pytest
from obspy.geodetics import gps2dist_azimuth

from per_obspy import asce7_period, read_pairs
from per_obspy.inventory.checking import checked_pairs
from per_obspy.simulation.buildings import simulated_pairs

STATIONS = [-67.95, -67.80], [-20.35, -20.25]
RADIUS, TOUCHING = 2000.0, 0.5


@pytest.fixture(scope="module")
def pairs() -> pd.DataFrame:
    return simulated_pairs(*STATIONS, 4000, 20, RADIUS, TOUCHING)


def test_every_row_passes_the_checks_of_an_inventory(pairs, tmp_path):
    assert checked_pairs(pairs, "simulated").attrs["rejected"] == ()
    pairs.to_csv(tmp_path / "pairs.csv", index=False)
    pd.testing.assert_frame_equal(read_pairs(tmp_path / "pairs.csv"), pairs, check_dtype=False)


def test_the_seed_decides(pairs):
    repeated = simulated_pairs(*STATIONS, 4000, 20, RADIUS, TOUCHING)
    pd.testing.assert_frame_equal(repeated, pairs)
    assert not simulated_pairs(*STATIONS, 4000, 21, RADIUS, TOUCHING).equals(pairs)


def test_pairs_lie_within_the_radius_of_a_station():
    table = simulated_pairs([-67.95], [-20.35], 200, 1, 500.0, TOUCHING)
    rows = table[["latitude_1", "longitude_1"]].to_numpy()
    distance = [gps2dist_azimuth(-20.35, -67.95, *row)[0] for row in rows]
    assert max(distance) < 505.0  # flat geometry, off by less than 1 %
    # 200 pairs anywhere on the disc: all within 450 m with a probability of 0.81**200
    assert max(distance) > 450.0


def test_azimuth_points_from_the_first_building_to_the_second(pairs):
    # would catch the mathematical angle in place of the azimuth
    rows = pairs.head(50)[["latitude_1", "longitude_1", "latitude_2", "longitude_2"]].to_numpy()
    found = np.array([gps2dist_azimuth(*row)[1] for row in rows])
    difference = (found - pairs["azimuth"].head(50) + 180) % 360 - 180
    assert np.abs(difference).max() < 1.0  # rounded to degrees and to 1e-7 degrees of position


def test_streets_share_their_direction(pairs):
    west = pairs[pairs["longitude_1"] < -67.88]
    folded = np.exp(4j * np.deg2rad(west["azimuth"]))
    # a right-angled grid with a scatter s of 2 degrees: the mean is exp(-(4 s)**2 / 2), rounding to
    # degrees included; 7 standard deviations of that mean of 2000 pairs
    expected = np.exp(-8 * np.deg2rad(np.sqrt(2.0**2 + 1 / 12)) ** 2)
    assert abs(folded.mean()) == pytest.approx(expected, abs=0.002)


#: Pairs of a row share buildings, and neighbours their system with 0.7: the correlation from one
#: pair to the next is at most 0.82 * 0.7 = 0.57, which adds (1 + 0.57) / (1 - 0.57) = 3.7 to a
#: variance.
ALIKE = np.sqrt(3.7)


def _scatter(share: float, count: int) -> float:
    """Return four standard deviations of a share of pairs that come in rows."""
    return 4 * ALIKE * np.sqrt(share * (1 - share) / count)


@pytest.mark.parametrize(
    ("column", "value", "share"),
    [
        ("gap", 0.0, TOUCHING),
        ("position", "inside", 0.6),
        ("system_1", "steel_mrf", 0.10),
        ("system_1", "concrete_mrf", 0.50),
        ("system_1", "ebf_brbf", 0.05),
        ("system_2", "other", 0.35),
    ],
)
def test_shares_of_a_town(pairs, column, value, share):
    assert abs((pairs[column] == value).mean() - share) < _scatter(share, len(pairs))


@pytest.mark.parametrize("column", ["period_1", "period_2", "damping_1", "damping_2"])
def test_half_the_buildings_are_measured(pairs, column):
    assert abs(pairs[column].notna().mean() - 0.5) < _scatter(0.5, len(pairs))


def test_neighbours_are_often_equally_high(pairs):
    # 45 % on purpose, and of the others as many as two buildings of different rows by chance
    share = (pairs["height_1"] == pairs["height_2"]).mean()
    by_chance = (pairs["height_1"].to_numpy() == np.roll(pairs["height_2"], 100)).mean()
    expected = 0.45 + 0.55 * by_chance
    assert abs(share - expected) < _scatter(expected, len(pairs)) + _scatter(by_chance, len(pairs))


def test_sizes_of_a_town(pairs):
    # a lognormal of median 4 and deviation 0.6 is below 3.5 in 41 % and below 4.5 in 58 % of the
    # buildings: ten standard deviations of 4000 buildings from one half
    assert pairs["storeys_1"].median() == 4
    gaps = pairs.loc[pairs["gap"] > 0, "gap"]
    assert gaps.between(0.01, 1.5).all()
    # four standard errors of the median of a lognormal of deviation 0.9, and half a centimetre
    tolerance = 4 * 1.2533 * 0.9 / np.sqrt(len(gaps)) + 0.005 / 0.08
    assert abs(np.log(gaps.median() / 0.08)) < tolerance


def test_measured_periods_scatter_about_the_formula(pairs):
    measured = pairs[pairs["period_1"].notna()]
    formula = asce7_period(measured["height_1"], measured["system_1"])
    residual = np.log(measured["period_1"] / formula)
    # four standard errors of the mean and of the deviation of a normal quantity
    assert abs(residual.mean()) < 4 * 0.3 / np.sqrt(len(measured))
    assert abs(residual.std() - 0.3) < 4 * 0.3 / np.sqrt(2 * len(measured))


BUILDING = ("building_id", "longitude", "latitude", "height", "storeys", "system", "area")


def test_rows_share_their_buildings(pairs):
    # every building has one description, whichever pair gives it; each pair ends with a new one
    sides = [
        pairs[[f"{name}_{i}" for name in (*BUILDING, "period", "damping")]].set_axis(
            [*BUILDING, "period", "damping"], axis=1
        )
        for i in (1, 2)
    ]
    described = pd.concat(sides).drop_duplicates()
    assert described["building_id"].is_unique
    assert pairs["building_id_2"].is_unique
    goes_on = pairs["building_id_1"].iloc[1:].to_numpy() == pairs["building_id_2"].iloc[:-1]
    # independent of each other: binomial
    assert abs(goes_on.mean() - 0.82) < 4 * np.sqrt(0.82 * 0.18 / len(goes_on))


def test_a_pair_inside_its_row_has_a_pair_before_and_behind_on_its_axis(pairs):
    inside = np.flatnonzero(pairs["position"] == "inside")
    for other in (inside - 1, inside + 1):
        turn = pairs["azimuth"].to_numpy()[inside] - pairs["azimuth"].to_numpy()[other]
        # two scatters of 2 degrees, rounded: 6 of their standard deviations
        assert np.abs((turn + 180) % 360 - 180).max() < 6 * np.sqrt(2) * 2.1
    identifiers = pairs[["building_id_1", "building_id_2"]].to_numpy()
    assert (identifiers[inside, 0] == identifiers[inside - 1, 1]).all()
    assert (identifiers[inside, 1] == identifiers[inside + 1, 0]).all()


def test_touching_is_a_parameter():
    assert (simulated_pairs(*STATIONS, 50, 3, RADIUS, touching=1.0)["gap"] == 0).all()
    assert (simulated_pairs(*STATIONS, 50, 3, RADIUS, touching=0.0)["gap"] > 0).all()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([], [], 5, 1, 10.0, 0.5), "rows of equal length"),
        (([1.0], [2.0, 3.0], 5, 1, 10.0, 0.5), "rows of equal length"),
        (([1.0], [99.0], 5, 1, 10.0, 0.5), "latitudes must be between -85 and 85, got 99"),
        (([1.0], [2.0], 0, 1, 10.0, 0.5), "count must be at least 1, got 0"),
        (([1.0], [2.0], 5, 1, 0.0, 0.5), "radius must be positive"),
        (([1.0], [2.0], 5, 1, 10.0, 1.5), r"touching must be between 0 and 1, got 1\.5"),
    ],
)
def test_bad_arguments(arguments, message):
    with pytest.raises(ValueError, match=message):
        simulated_pairs(*arguments)
