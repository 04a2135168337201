"""Sensitivity of pairs: rows computed again with one input at another value."""

import numpy as np
import pytest
from screening_samples import make_pairs

import per_obspy
from per_obspy.config import Building, Screening
from per_obspy.screening.assignment import stations_of
from per_obspy.screening.sensitivity import TAIL, input_sensitivity
from per_obspy.screening.site_motion import (
    RegionalMotion,
    hypocentre_of,
    prepared_field,
)

#: A pair of derived periods, one of given ones with an uncertain gap, one with nothing uncertain.
ROWS = (
    {"period_1": np.nan, "period_2": np.nan, "gap": 0.1},
    {"gap": 0.23, "gap_std": 0.03, "damping_1": 0.05, "damping_2": 0.05},
    {"damping_1": 0.05, "damping_2": 0.05},
    {"gap": 0.0, "gap_std": 0.1, "damping_1": 0.05, "damping_2": 0.05},
)


@pytest.fixture(scope="module")
def ground(station):
    stations, _ = stations_of([station])
    field = prepared_field([station], Screening().interpolation, hypocentre_of([station.attrs]))
    return RegionalMotion(stations, field, None)


@pytest.fixture(scope="module")
def table(station):
    return per_obspy.risk_table(station, make_pairs(ROWS))


@pytest.fixture(scope="module")
def found(table, ground):
    return {
        (one.pair_id, one.name): one
        for one in input_sensitivity(table, ground, Building(), Screening())
    }


def test_only_what_is_uncertain_is_varied(found):
    derived = ("period_1", "period_2", "period_correlation", "damping_1", "damping_2")
    assert set(found) == {*(("P0", name) for name in derived), ("P1", "gap"), ("P3", "gap")}


@pytest.mark.parametrize("side", ["low", "high"])
def test_a_period_at_another_value_is_that_of_an_inventory_that_gives_it(station, found, side):
    """The row of a pair table that gives the period and leaves all else open as before."""
    one = found["P0", "period_1"]
    row = {**ROWS[0], "period_1": getattr(one, side)}
    (chance,) = per_obspy.risk_table(station, make_pairs([row]))["probability"]
    assert getattr(one, f"probability_{side}") == pytest.approx(chance, abs=1e-12)


def test_ends_are_a_standard_deviation_from_the_median(table, found):
    by_name = table.set_index("pair_id")
    one = found["P0", "period_1"]
    median, deviation = by_name.loc["P0", ["period_1", "period_log_std_1"]]
    expected = np.log(median) + deviation * np.array([-1.0, 1.0])
    assert np.log([one.low, one.high]) == pytest.approx(expected)
    # A gap that is far from 0 in terms of its deviation is nearly normal: Phi(1) is 84.1 %
    gap = found["P1", "gap"]
    assert [gap.low, gap.high] == pytest.approx([0.2, 0.26], rel=0.01)


def test_alike_neighbours_hit_each_other_less(table, found):
    # two unknown systems of different storeys: halfway from 0.2 to 0.5
    one = found["P0", "period_correlation"]
    assert np.arctanh([one.low, one.high]) == pytest.approx([0.0, np.arctanh(0.35) + 0.6])
    chance = table.set_index("pair_id").loc["P0", "probability"]
    assert one.probability_low > chance > one.probability_high


def test_a_wider_gap_is_less_likely_closed(found):
    one = found["P1", "gap"]
    assert one.probability_low > one.probability_high


def test_outlines_that_touch_may_have_one_wall(found):
    one = found["P3", "gap"]
    assert TAIL < 0.5
    assert one.low == 0.0
    assert one.probability_low == pytest.approx(1.0)


def test_a_row_of_other_settings_has_no_sensitivity(table, ground):
    """Catch numbers of one configuration next to the probability of another one."""
    changed = table.assign(probability=table["probability"] - 0.1)
    assert input_sensitivity(changed, ground, Building(), Screening()) == []


def test_pairs_without_probability_have_none(table, ground):
    empty = table.assign(probability=np.nan)
    assert input_sensitivity(empty, ground, Building(), Screening()) == []
