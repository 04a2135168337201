"""Pairs of unknown gap: only values that hold for any gap are filled."""

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose
from scipy.stats import norm
from screening_samples import make_pairs, make_station
from shakemap_samples import make_map

import per_obspy
from per_obspy.config import Building, Codes, Screening
from per_obspy.inventory.completion import completed_pairs
from per_obspy.screening.assignment import assigned, stations_of
from per_obspy.screening.columns import DEMAND_SHARES
from per_obspy.screening.design import DesignSpectrum, design_table
from per_obspy.screening.population import gap_dispersion, median_gap
from per_obspy.screening.ranking import NUMBERS, TEXTS, UNKNOWN_CLASS, in_order, kept_apart
from per_obspy.screening.shakemap import shakemap_rows

#: Pairs that differ in how their demand is found, and one of everything that codes ask for.
KINDS = [
    {},
    {"azimuth": np.nan},
    {"period_1": np.nan, "period_2": np.nan},
    {"yield_displacement_1": 0.01},
    {"floor_offset": 1.0, "position": "end", "period_1": 0.8, "height_1": 18.0, "storeys_1": 6.0},
]

#: Columns from as many nodes as the verdict needs, or from the estimate where none is near the gap.
QUANTILES = {*DEMAND_SHARES}

#: Columns that name the gap's consequences in words, or count rows.
WORDS = {"rank", "state", "risk_class", "flags", "gap_suffices"}


@pytest.fixture(scope="module")
def station():
    """Return a station with strong motion."""
    return make_station(scale=0.3)


def risk(station, gap, exact=True, building=None):
    """Return the risk table of all kinds of pairs with one gap, by pair."""
    screening = Screening(exact=exact, codes=Codes(rules=["asce7-16", "gem"]))
    pairs = make_pairs([{**kind, "gap": gap} for kind in KINDS])
    table = per_obspy.risk_table(station, pairs, building or Building(), screening)
    return table.set_index("pair_id").sort_index()


@pytest.mark.parametrize("exact", [True, False])
def test_every_column_that_depends_on_the_gap_is_empty(station, exact):
    near, far = risk(station, 0.001, exact), risk(station, 3.0, exact)
    unknown = risk(station, np.nan, exact)
    differs = {name for name in near if not near[name].equals(far[name])}
    assert differs <= {*NUMBERS, *TEXTS, *WORDS, *QUANTILES}
    # Probability and hits depend on it, or the comparison would mean nothing
    assert {"probability", "expected_impact_velocity", "missing_gap"} <= differs
    for name in set(NUMBERS) & set(unknown):
        assert unknown[name].isna().all(), name
    for name in set(TEXTS) & set(unknown):
        assert (unknown[name] == "").all(), name


@pytest.mark.parametrize("exact", [True, False])
def test_everything_else_is_that_of_any_gap(station, exact):
    known, unknown = risk(station, 0.05, exact), risk(station, np.nan, exact)
    same = [name for name in known if name not in {*NUMBERS, *TEXTS, *WORDS, *QUANTILES}]
    pd.testing.assert_frame_equal(unknown[same], known[same], check_exact=True)
    # 32 nodes instead of 128, and estimates, which are larger here; a gap for them is no smaller
    assert (unknown[[*QUANTILES]] > 0.92 * known[[*QUANTILES]]).all(axis=None)
    assert (unknown["demand"] > 0).all()


def test_state_class_and_flag_name_the_reason(station):
    unknown = risk(station, np.nan)
    assert set(unknown["state"]) == {"unknown"}
    assert set(unknown["risk_class"]) == {UNKNOWN_CLASS}
    assert unknown["flags"].str.split().map(lambda names: "unknown_gap" in names).all()
    assert not unknown["flags"].str.contains("touching|suffices|single_hit").any()


def test_an_assumed_gap_has_the_lognormal_distribution_of_the_configuration(station):
    # would catch an assumed gap that is taken for a measured one, whose error is normal
    median, spread = 0.05, 0.5
    building = Building(gap=median, gap_log_std=spread)
    pairs = make_pairs([{**kind, "gap": np.nan} for kind in KINDS])
    complete = kept_apart(completed_pairs(pairs, building))
    # round-off of mean and deviation, through which it passes
    np.testing.assert_allclose(median_gap(complete), median, rtol=1e-12)
    np.testing.assert_allclose(gap_dispersion(complete), spread, rtol=1e-12)
    # where nothing else is in doubt, a certain demand exceeds the gap with the textbook's chance
    assumed = risk(station, np.nan, building=building.model_copy(update={"damping_log_std": 0.0}))
    first = assumed.iloc[0]
    chance = norm.cdf(np.log(first["demand"] / median) / spread)
    # the station is not at the site: hardly more doubt; a normal error would make it less by 0.006
    assert first["probability"] == pytest.approx(chance, abs=1e-3)
    assert assumed["derived"].str.split().map(lambda names: "gap" in names).all()
    assert set(assumed["risk_class"]) == {UNKNOWN_CLASS}
    assert "unknown" not in set(assumed["state"])
    assert assumed["flags"].str.contains("unknown_gap").all()


def test_a_given_gap_is_kept_whatever_is_assumed(station):
    table = risk(station, 0.05, building=Building(gap=1.0))
    pd.testing.assert_frame_equal(table, risk(station, 0.05))


def test_an_unknown_gap_is_ranked_by_what_it_needs_beside_the_others(station):
    # would catch pairs that nobody has measured behind those that do not hit each other
    gaps = [{"gap": gap, "period_1": period} for gap in (np.nan, 0.0, 9.0) for period in (0.6, 2.0)]
    table = per_obspy.risk_table(station, make_pairs(gaps)).set_index(["pair_id"])
    unknown, safe = table[table["state"] == "unknown"], table[table["state"] == "no"]
    assert len(unknown) == len(safe) == 2
    assert unknown["rank"].max() < safe["rank"].min()
    # A velocity is a length times a frequency: twice the demand at the same periods, twice as much
    order = in_order(unknown.reset_index().assign(demand=2 * unknown["demand"].to_numpy()))
    before = in_order(unknown.reset_index())
    assert_allclose(order["order_velocity"], 2 * before["order_velocity"])
    # Not below its twin that touches by more than two deviations of the median, exp(-2 0.42)
    touching = table[table["gap"] == 0.0].sort_values("period_1")
    same = before.sort_values("period_1")
    ratio = -same["order_velocity"].to_numpy() / touching["expected_impact_velocity"].to_numpy()
    assert (np.log(ratio) > -0.84).all()


def test_no_pair_of_known_gap_moves_because_of_unknown_ones(station):
    known = [{"gap": gap, "period_1": 0.7} for gap in (0.0, 0.02, 0.05, 9.0)]
    alone = per_obspy.risk_table(station, make_pairs(known))
    both = per_obspy.risk_table(station, make_pairs([*known, {"gap": np.nan, "period_1": 0.9}]))
    assert both[both["state"] != "unknown"]["pair_id"].tolist() == alone["pair_id"].tolist()


def test_a_design_spectrum_gives_the_gap_needed():
    periods = np.geomspace(0.05, 5.0, 30)
    sd = 0.05 * np.tile(periods, (1, 1))
    spectrum = DesignSpectrum("straight", periods, np.array([0.05]), sd)
    tables = [
        design_table(spectrum, make_pairs([{"gap": gap}]), Building(), Screening()).iloc[0]
        for gap in (0.05, np.nan)
    ]
    assert tables[1]["demand"] == tables[0]["demand"]
    assert (tables[1]["state"], tables[1]["risk_class"]) == ("unknown", UNKNOWN_CLASS)
    assert np.isnan(tables[1]["probability"])


def test_a_shakemap_raises_the_flag(station):
    far = {"longitude_1": 20.4, "longitude_2": 20.4001, "gap": np.nan}
    complete = kept_apart(completed_pairs(make_pairs([far]), Building()))
    stations, _ = stations_of([station])
    _, unreached = assigned(complete, stations, 1000.0)
    rows, rejected = shakemap_rows(make_map(), complete, Screening(), unreached)
    assert rejected == ()
    assert "unknown_gap" in rows["flags"].iloc[0].split()
