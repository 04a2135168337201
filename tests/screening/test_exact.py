"""Exact outcome of pairs: where it decides, the worst axis, and buildings that yield."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from screening_samples import make_pairs, make_station, table_of

import per_obspy
from per_obspy.config import Building
from per_obspy.inventory.completion import completed_pairs
from per_obspy.pounding.relative import yielding_relative_displacement
from per_obspy.screening import exact
from per_obspy.screening.columns import RESULTS
from per_obspy.screening.exact import (
    EXACT_COLUMNS,
    exact_decides,
    exact_outcome,
    furthest_azimuth,
    no_outcome,
    pounding_maxima,
)
from per_obspy.screening.station_motion import station_motion
from per_obspy.screening.values import values


def _completed(rows):
    return completed_pairs(make_pairs(rows), Building())


class TestWhereItDecides:
    def test_needs_given_periods_in_the_usable_range(self, record):
        # the usable range ends at 9 s; equal heights do not make a derived period a given one
        rows = [{}, {"period_1": 9.5}, {"period_2": 0.04}, {"period_1": np.nan}]
        assert exact_decides(record, _completed(rows)).tolist() == [True, False, False, False]

    def test_needs_both_horizontals(self):
        single = station_motion(make_station(channels=("HNN",)))
        assert not exact_decides(single, _completed([{}])).any()


def test_no_axis_demands_more_than_the_furthest_one(record):
    # would catch: the axis from 2 to 1, or the larger radius in place of the larger demand
    pairs = _completed([{"azimuth": np.nan}] * 37)
    furthest = furthest_azimuth(record, pairs)
    assert len(set(furthest.tolist())) == 1
    azimuth = furthest + np.arange(37) * 10.0
    radii = {"per_1": 1.0, "per_2": 1.0, "sd_1": 1.0, "sd_2": 1.0}
    table = pairs.assign(**radii, azimuth=azimuth, azimuth_used=azimuth)
    demand = exact_outcome(record, table, azimuth)["demand_exact"]
    # samples choose the direction: up to (omega dt)² / 8 = 0.2 % at 0.6 s below the exact maximum
    assert demand[0] >= demand.max() * (1.0 - 2e-3)
    assert demand[0] > 1.05 * demand[9]


def test_columns_are_described_and_the_same_without_outcome(station, record):
    table = table_of(station, [{}, {"gap": 0.0}])
    outcome = exact_outcome(record, table, values(table, "azimuth_used"))
    # the outcome may turn an unknown azimuth
    assert tuple(no_outcome(2)) == EXACT_COLUMNS
    assert tuple(outcome) == ("azimuth_used", *EXACT_COLUMNS)
    assert set(EXACT_COLUMNS) <= set(RESULTS)
    assert all(np.isnan(column).all() for column in no_outcome(2).values())


def test_without_impacts_radii_are_not_amplified(station, record):
    table = table_of(station, [{"gap": 9.0}])
    outcome = exact_outcome(record, table, values(table, "azimuth_used"))
    assert outcome["impacts"][0] == 0
    # the history and the spectra locate peaks to 1e-9 each
    assert_allclose(outcome["amplification_exact_1"], 1.0, rtol=1e-8)
    assert_allclose(outcome["amplification_exact_2"], 1.0, rtol=1e-8)


class TestPairsThatStayApart:
    #: Linear and yielding pairs, with gaps around their demands and far from them.
    ROWS = ({}, {"period_1": 0.31}, {"yield_displacement_1": 0.01, "hardening_1": 0.05})

    def _at_gaps(self, station, record, shares):
        table = table_of(station, self.ROWS * len(shares))
        azimuth = values(table, "azimuth_used")
        demand = exact_outcome(record, table, azimuth)["demand_exact"]
        table = dict(table) | {"gap": np.repeat(shares, len(self.ROWS)) * demand}
        return table, azimuth

    def test_have_the_outcome_of_their_histories(self, station, record):
        # catches: a margin in the wrong direction, and pairs whose columns are mixed up
        shares = (0.0, 0.5, 0.999, 1.0 - 1e-9, 1.0, 1.0 + 1e-9, 1.0 + 2e-6, 1.5, 9.0)
        table, azimuth = self._at_gaps(station, record, shares)
        outcome = exact_outcome(record, table, azimuth)
        history = pounding_maxima(record, table, azimuth)
        assert_array_equal(outcome["impacts"], history.impacts)
        assert_array_equal(outcome["impact_velocity_exact"], history.impact_velocity)
        free = pounding_maxima(record, dict(table) | {"gap": np.full(azimuth.size, 99.0)}, azimuth)
        ratios = np.stack([outcome["amplification_exact_1"], outcome["amplification_exact_2"]])
        assert_allclose(ratios, history.per / free.per, rtol=1e-8)
        assert ratios.max() > 1.01

    def test_need_no_history(self, station, record, monkeypatch):
        table, azimuth = self._at_gaps(station, record, (0.5, 1.5))
        pairs = []

        def counted(station, table, azimuth):
            pairs.append(azimuth.size)
            return pounding_maxima(station, table, azimuth)

        monkeypatch.setattr(exact, "pounding_maxima", counted)
        exact_outcome(record, table, azimuth)
        assert pairs == [len(self.ROWS)]


def test_both_sides_demand_at_least_as_much_as_one(station, record):
    table = table_of(station, [{"azimuth": azimuth} for azimuth in (0.0, 50.0, 180.0)])
    outcome = exact_outcome(record, table, values(table, "azimuth_used"))
    assert np.all(outcome["demand_two_sided"] >= outcome["demand_exact"])
    # the opposite axis exchanges the sides
    towards, either_way = outcome["demand_exact"][[0, 2]], outcome["demand_two_sided"]
    assert_allclose(towards.max(), either_way[0], rtol=1e-9)


#: Yields several times under the weaker motion of the tests below.
ROW = {
    "yield_displacement_1": 0.01,
    "yield_displacement_2": 0.005,
    "hardening_1": 0.05,
    "hardening_2": 0.0,
}


@pytest.fixture(scope="module")
def weaker():
    return make_station(scale=0.1)


class TestYieldingPairs:
    def test_exact_demand_is_that_of_the_bilinear_pair(self, weaker):
        # catches: the linear relative displacement of a pair that yields
        row = per_obspy.risk_table(weaker, make_pairs([ROW])).iloc[0]
        assert row["demand_rule"] == "exact"
        motion = station_motion(weaker)
        share_1, share_2 = row["participation_1"], row["participation_2"]
        # oscillators at contact level along 30 degrees
        free = yielding_relative_displacement(
            motion.records[0].horizontal,
            motion.records[0].dt,
            row["period_1"],
            row["damping_1"],
            row["period_2"],
            row["damping_2"],
            30.0,
            share_1,
            share_2,
            yield_displacement_1=0.01 * share_1,
            hardening_1=0.05,
            yield_displacement_2=0.005 * share_2,
            hardening_2=0.0,
        )
        assert_allclose(row["demand"], free.one_before_two, rtol=1e-12)
        assert_allclose(row["demand_two_sided"], free.largest, rtol=1e-12)
        # yielding matters
        linear = per_obspy.risk_table(weaker, make_pairs([{}])).iloc[0]["demand"]
        assert abs(row["demand"] / linear - 1.0) > 0.05

    def test_a_building_yields_from_its_largest_elastic_displacement_on(self, weaker, monkeypatch):
        # catches: a yield displacement at the other height, and that of one building for both
        linear = per_obspy.risk_table(weaker, make_pairs([{}])).iloc[0]
        limits = [
            {f"yield_displacement_{i}": share * linear[f"sd_{i}"], "hardening_1": 0.05}
            for i in (1, 2)
            for share in (1.001, 0.98)
        ]
        run = []

        def counted(*arguments, **strengths):
            run.append(arguments[2].size)
            return yielding_relative_displacement(*arguments, **strengths)

        monkeypatch.setattr(exact, "yielding_relative_displacement", counted)
        table = per_obspy.risk_table(weaker, make_pairs(limits)).sort_values("pair_id")
        assert run == [2]
        # elastic ones are linear; the others come to rest elsewhere
        assert_allclose(table["demand_exact"].iloc[[0, 2]], linear["demand_exact"], rtol=1e-12)
        rests = table[["residual_1", "residual_2"]].to_numpy()
        assert_array_equal(rests != 0.0, [[0, 0], [1, 0], [0, 0], [0, 1]])

    def test_is_the_gap_from_which_the_history_has_no_impact(self, weaker):
        demand = per_obspy.risk_table(weaker, make_pairs([ROW])).iloc[0]["demand"]
        gaps = [{**ROW, "gap": share * demand} for share in (1.0 - 1e-9, 1.0 + 1e-9)]
        table = per_obspy.risk_table(weaker, make_pairs(gaps)).sort_values("pair_id")
        assert_array_equal(table["impact_velocity_exact"] > 0.0, [True, False])
        # without an impact the radii are those without contact: the yielding ones
        amplification = table[["amplification_exact_1", "amplification_exact_2"]]
        assert_allclose(amplification.iloc[1], 1.0, rtol=1e-9)

    def test_decides_along_the_worst_axis_where_the_azimuth_is_unknown(self, weaker):
        # catches: the worst axis of linear buildings, or one of a half circle
        axes = [{**ROW, "azimuth": azimuth} for azimuth in (np.nan, *np.arange(3.0, 360.0, 7.0))]
        table = per_obspy.risk_table(weaker, make_pairs(axes)).sort_values("pair_id")
        assert set(table["demand_rule"]) == {"exact"}
        unknown, *others = table["demand"]
        # 6 degrees off: 0.5 % of a linear demand; yielding bends it further
        assert 0.98 * max(others) < unknown
