"""Exact demand at a site: that of the record there, weighted with the field's away from it."""

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from screening_samples import make_pairs, table_of

import per_obspy
from per_obspy.config import Interpolation, Screening
from per_obspy.pounding.reliability import per_error
from per_obspy.screening.uncertain_motion import (
    demand_correlation,
    estimate_log_std,
    median_at_site,
    pair_motion,
    site_demand,
)
from per_obspy.screening.values import at_contact, both

SCREENING, SETTINGS = Screening(), Interpolation()

#: Median motion at the site over that of the record, and its deviation, of both buildings.
SITE = {"ln_per_ratio_1": 0.4, "ln_per_ratio_2": -0.2, "ln_per_std_1": 0.5, "ln_per_std_2": 0.3}

#: At the record, on the way, and far away, m.
DISTANCES = np.array([0.0, 500.0, 4000.0, 20_000.0, 1e6])


@pytest.fixture(scope="module")
def table(station):
    return table_of(station, [{"gap": 0.05} for _ in DISTANCES]).assign(distance=DISTANCES)


def _exchanged(table):
    """Return a table with buildings 1 and 2 in the other order, axis turned."""
    names = {}
    for name in table:
        if name.endswith(("_1", "_2")):
            names[name] = name[:-1] + ("2" if name.endswith("1") else "1")
    return table.rename(columns=names)


def test_at_the_record_the_demand_is_that_of_the_record(record, table):
    # no motion but the record's own: to the bit
    own = table.assign(**dict.fromkeys(SITE, 0.0))
    site = site_demand(record, own, SCREENING)
    assert site.weight[0] == 1.0
    assert site.log_std[0] == 0.0
    demand = own["demand_exact"].to_numpy()
    # the exponential of a logarithm: one unit in the last place or two
    median = median_at_site(demand, site.weight, site.ln_ratio, site.ln_field)
    assert_allclose(median[0], demand[0], rtol=1e-14)


def test_weight_falls_and_deviation_grows_until_they_are_those_of_strangers(record, table):
    site = site_demand(record, table.assign(**SITE), SCREENING)
    assert (np.diff(site.weight) < 0).all()
    assert (np.diff(site.transfer_log_std) > 0).all()
    # at 1000 km exp(-250) is left
    persistence = SETTINGS.demand_persistence
    assert_allclose(site.weight[-1], persistence, rtol=1e-12)
    expected = SETTINGS.demand_log_std * np.sqrt(1.0 - persistence**2)
    assert_allclose(site.transfer_log_std[-1], expected, rtol=1e-12)
    # parts add as squares
    assert_allclose(site.log_std**2, site.field_log_std**2 + site.transfer_log_std**2, rtol=1e-12)


def test_the_shift_of_the_record_is_that_of_the_pairs_radii(record, table):
    at_site = table.assign(**SITE)
    site = site_demand(record, at_site, SCREENING)
    ratios, stds = both(at_site, "ln_per_ratio"), both(at_site, "ln_per_std")
    expected = pair_motion(at_contact(table, "per"), ratios, stds, both(table, "period"))
    assert_array_equal(site.ln_ratio, expected[0])
    assert_array_equal(site.field_log_std, expected[1])


def test_the_field_lets_expect_the_critical_gap_of_its_radii(record, station, table):
    # at stored periods and damping, by hand: eq. (15) and (16) of RotD50 at the site over its error
    periods = station["period"].to_numpy()[[20, 40]]
    stored = table.assign(period_1=periods[0], period_2=periods[1], damping_1=0.05, damping_2=0.05)
    stored = stored.assign(**SITE, participation_1=1.0, participation_2=0.5)
    rotd50 = station["per_rotd50"].sel(damping=0.05, period=periods).to_numpy().astype(float)
    radius_1, radius_2 = rotd50[0] * np.exp(0.4), 0.5 * rotd50[1] * np.exp(-0.2)
    correlation = float(per_obspy.ddc_correlation(periods[0], 0.05, periods[1], 0.05))
    error = per_error(periods[0], 0.05, periods[1], 0.05).median
    gap = np.sqrt(radius_1**2 + radius_2**2 - 2.0 * correlation * radius_1 * radius_2)
    site = site_demand(record, stored, SCREENING)
    # spectra are stored in float32
    assert_allclose(np.exp(site.ln_field), gap / error, rtol=1e-6)
    # of an unknown azimuth the radii are those along the record's worst
    along = station["per_azimuthal"].sel(azimuth=40.0, damping=0.05, period=periods).to_numpy()
    radius_1, radius_2 = along[0] * np.exp(0.4), 0.5 * along[1] * np.exp(-0.2)
    gap = np.sqrt(radius_1**2 + radius_2**2 - 2.0 * correlation * radius_1 * radius_2)
    unknown = site_demand(record, stored.assign(azimuth=np.nan, azimuth_used=40.0), SCREENING)
    assert_allclose(np.exp(unknown.ln_field), gap / error, rtol=1e-6)


def test_known_and_unknown_azimuths_of_one_block_do_not_mix(record, table):
    # would catch a row of another azimuth, or RotD50, taken by a pair of the other kind
    known = table.assign(**SITE, azimuth_used=np.arange(20.0, 20.0 + 30.0 * len(table), 30.0))
    mixed = known.assign(azimuth=np.where(np.arange(len(known)) % 2, np.nan, 70.0))
    alone = [site_demand(record, mixed.iloc[[i]], SCREENING).ln_field for i in range(len(mixed))]
    assert_array_equal(site_demand(record, mixed, SCREENING).ln_field, np.concatenate(alone))


def test_buildings_in_the_other_order_have_the_same_motion(record, table):
    at_site = table.assign(**SITE)
    site, other = (site_demand(record, some, SCREENING) for some in (at_site, _exchanged(at_site)))
    for column, turned in zip(site, other, strict=True):
        assert_allclose(turned, column, rtol=1e-12, atol=1e-15)


def test_pairs_that_move_as_one_do_so_everywhere(station, record):
    equal = {"period_1": 1.0, "period_2": 1.0, "damping_1": 0.05, "damping_2": 0.05}
    same = {**equal, "participation_1": 1.0, "participation_2": 1.0}
    table = table_of(station, [same]).assign(distance=8000.0, **SITE)
    table = table.assign(ln_per_ratio_2=0.4)
    site = site_demand(record, table, SCREENING)
    assert site.ln_field[0] == -np.inf
    assert median_at_site(np.zeros(1), site.weight, site.ln_ratio, site.ln_field) == 0.0
    # at the record the gap of 0 that the field expects counts nothing
    assert_allclose(median_at_site(np.ones(1), np.ones(1), np.zeros(1), site.ln_field), 1.0)


def test_yielding_pairs_keep_the_demand_of_their_record_and_doubt_it_more(record, table):
    yielding = table.assign(**SITE, yield_displacement_1=0.02)
    site, linear = (
        site_demand(record, some, SCREENING) for some in (yielding, table.assign(**SITE))
    )
    assert_array_equal(site.weight, 1.0)
    # difference of two demands of correlation c: 2 (1 - c)
    expected = SETTINGS.demand_log_std * np.sqrt(2.0 * (1.0 - linear.weight))
    assert_allclose(site.transfer_log_std, expected, rtol=1e-12, atol=1e-12)


def test_unknown_motion_is_that_of_the_record(record, table):
    for at_site in (table, table.assign(**dict.fromkeys(SITE, np.nan))):
        site = site_demand(record, at_site, SCREENING)
        assert_array_equal(site.weight, 1.0)
        assert not site.ln_ratio.any()
        assert not site.log_std.any()


def test_the_error_of_an_estimate_grows_to_that_of_a_demand_far_away(table):
    at_site, model = table.assign(**SITE), np.full(len(DISTANCES), 0.35)
    found = estimate_log_std(at_site, model, SETTINGS)
    assert_allclose(found[[0, -1]], [0.35, SETTINGS.demand_log_std], rtol=1e-12)
    assert (np.diff(found) > 0).all()
    # an error that is larger stays, and so does that of a table without motion at sites
    assert_array_equal(estimate_log_std(at_site, 2.0 * model, SETTINGS), 2.0 * model)
    assert_array_equal(estimate_log_std(table, model, SETTINGS), model)


def test_weight_and_deviation_are_those_of_the_best_estimate_of_a_known_truth(record, table):
    # what is special in the demands of record and site, drawn with the correlation that is
    # assumed: this is about the arithmetic, not about the world
    random, count = np.random.default_rng(3), 200_000
    at_site = table.assign(**dict.fromkeys(SITE, 0.0))
    site = site_demand(record, at_site, SCREENING)
    for row, correlation in enumerate(demand_correlation(at_site, SETTINGS)):
        shared, own = SETTINGS.demand_log_std * random.normal(size=(2, count))
        special = correlation * shared + np.sqrt(1.0 - correlation**2) * own
        # the field expects 1 m; the record has more or less than expected
        median = median_at_site(np.exp(shared), site.weight[row], np.zeros(1), np.zeros(1))
        error = special - np.log(median)
        # four standard errors of 200 000 draws of 0.55: 0.005; of a deviation 0.6 %
        assert abs(error.mean()) < 0.005
        assert_allclose(error.std(), site.transfer_log_std[row], rtol=0.007, atol=1e-12)


def test_a_pair_does_not_depend_on_its_block(record, station):
    # to the bit, in any order and stride
    random = np.random.default_rng(5)
    pairs = [{"period_1": period, "gap": 0.1} for period in np.linspace(0.2, 3.0, 37)]
    rows = table_of(station, pairs).assign(distance=random.uniform(0.0, 2e4, 37))
    drawn = pd.DataFrame(random.uniform(0.1, 0.5, (37, 4)), columns=list(SITE), index=rows.index)
    rows = rows.join(drawn)
    whole = site_demand(record, rows, SCREENING)
    for some in (slice(0, 1), slice(1, 30), slice(36, None, -1)):
        part = site_demand(record, rows.iloc[some], SCREENING)
        for column, expected in zip(part, whole, strict=True):
            assert_array_equal(column, expected[some])


def test_probability_at_a_site_is_less_certain_the_farther_the_record(station):
    # the same pair, farther and farther from the only station: narrower gaps are less certain
    rows = [
        {"gap": 0.1, "latitude_1": 10.0 + degrees, "latitude_2": 10.0 + degrees}
        for degrees in (0.0, 0.02, 0.05, 0.1)
    ]
    table = per_obspy.risk_table(station, make_pairs(rows)).sort_values("pair_id")
    chance = table["probability"].to_numpy()
    assert chance[0] > 0.99
    assert (np.diff(chance) < 0).all()
