"""Measures against pounding: limits, monotony, scaling, and a comparison with the record itself."""

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.interpolate import RegularGridInterpolator
from screening_samples import make_station, table_of

import per_obspy
from per_obspy.screening.columns import RESULTS
from per_obspy.screening.estimates import linearized_columns
from per_obspy.screening.exact import least_exact_damping
from per_obspy.screening.flags import period_is_derived
from per_obspy.screening.mitigation import LARGEST_DAMPING, mitigation_columns
from per_obspy.screening.station_motion import station_motion
from per_obspy.screening.values import at_contact, both, values

TARGET = 1.25


def with_demand(station, rows, share=0.7):
    """Return pairs whose demand is that of PER and eq. (16), and whose gap is a share of it."""
    table = table_of(station, rows)
    table = table.assign(demand=table["critical_gap_per"], demand_rule="per_white_noise")
    table = table.assign(gap=share * table["demand"])
    return table.assign(**linearized_columns(station_motion(station), table))


@pytest.fixture(scope="module")
def table(station):
    periods = [(0.5, 0.8), (1.0, 0.6), (1.3, 1.5), (2.0, 0.9)]
    rows = [{"period_1": first, "period_2": second, "azimuth": 40.0} for first, second in periods]
    return with_demand(station, rows)


def test_every_column_is_described(record, table):
    assert set(mitigation_columns(record, table, TARGET)) <= set(RESULTS)


def test_nothing_is_asked_of_a_pair_whose_gap_is_enough(record, table):
    # catches: the estimate alone decides, although the exact demand is below the gap
    for enough in (
        table.assign(gap=table["demand"]),
        table.assign(demand=0.9 * table["gap"], demand_rule="exact"),
    ):
        found = mitigation_columns(record, enough, TARGET)
        assert_array_equal(found["missing_gap"], 0.0)
        assert_array_equal(found["supplemental_damping"], 0.0)
        assert_array_equal(found["bumper_restitution"], 1.0)


def test_touching_pairs_lack_their_whole_demand_and_no_damping_helps(record, table):
    found = mitigation_columns(record, table.assign(gap=0.0), TARGET)
    assert_array_equal(found["missing_gap"], table["demand"])
    assert np.isnan(found["supplemental_damping"]).all()


def test_a_wider_gap_needs_less(record, table):
    damping, missing = [], []
    for share in np.linspace(0.3, 1.0, 15):
        found = mitigation_columns(record, table.assign(gap=share * table["demand"]), TARGET)
        damping.append(found["supplemental_damping"])
        missing.append(found["missing_gap"])
    # not enough is more than any
    damping = np.nan_to_num(damping, nan=1.0)
    assert np.all(np.diff(damping, axis=0) <= 0.0)
    assert np.all(damping[0] > 0.1)
    assert np.all(np.diff(missing, axis=0) < 0.0)


def _stored_per(station):
    """Return ln PER of the stored spectra at 40 degrees, by ln damping and ln period."""
    axes = np.log(station["damping"].to_numpy()), np.log(station["period"].to_numpy())
    per = station["per_azimuthal"].sel(azimuth=40.0).to_numpy().astype(float)
    return RegularGridInterpolator(axes, np.log(per))


def test_the_added_damping_brings_the_critical_gap_to_the_gap(station, record, table):
    # catches: damping added to one building only, the correlation of the dampings before, a radius
    # not at contact
    table = table.assign(gap=0.95 * table["demand"])
    damping = 0.05 + mitigation_columns(record, table, TARGET)["supplemental_damping"]
    # within the stored dampings
    assert np.all(damping < 0.1)
    stored, before = _stored_per(station), np.full(4, np.log(0.05))
    radii = []
    for i, radius in enumerate(at_contact(table, "per"), start=1):
        period = np.log(values(table, f"period_{i}"))
        change = stored((np.log(damping), period)) - stored((before, period))
        radii.append(radius * np.exp(change))
    period_1, period_2 = both(table, "period")
    correlation = per_obspy.ddc_correlation(period_1, damping, period_2, damping)
    # halved until the step is 0.02 / 2**20
    assert_allclose(per_obspy.critical_gap(*radii, correlation), table["gap"], rtol=1e-5)


def test_against_the_record_itself(record, table):
    # catches: the spectrum of another azimuth or building
    table = table.assign(gap=0.85 * table["demand"])
    added = mitigation_columns(record, table, TARGET)["supplemental_damping"]
    along = record.records[0].north * np.cos(np.radians(40.0)) + record.records[0].east * np.sin(
        np.radians(40.0)
    )
    for damping, row in zip(0.05 + added, table.to_dict("records"), strict=True):
        periods = row["period_1"], row["period_2"]
        # the record drives each building with its participation
        per_1, per_2 = per_obspy.per_spectrum(along, record.records[0].dt, periods, damping)
        radii = row["participation_1"] * per_1, row["participation_2"] * per_2
        correlation = per_obspy.ddc_correlation(periods[0], damping, periods[1], damping)
        # three dampings and 60 periods are stored, interpolated linearly on logarithmic axes
        assert_allclose(per_obspy.critical_gap(*radii, correlation), row["gap"], rtol=0.08)


def test_scaling_ground_and_gap_changes_no_ratio():
    rows = [{"period_1": 0.6, "period_2": 1.5}, {"period_1": 1.0, "period_2": 1.2}]
    station, stronger = make_station(), make_station(scale=2.0)
    found = mitigation_columns(station_motion(station), with_demand(station, rows), TARGET)
    scaled = mitigation_columns(station_motion(stronger), with_demand(stronger, rows), TARGET)
    assert_allclose(scaled["missing_gap"], 2.0 * found["missing_gap"], rtol=1e-9)
    # spectra are stored as float32
    damping = "supplemental_damping"
    assert_allclose(scaled[damping], found[damping], rtol=1e-4)
    assert_allclose(scaled["bumper_restitution"], found["bumper_restitution"], rtol=1e-6)


def test_an_exact_demand_is_followed_by_exact_displacements(record, table):
    # catches: the estimate where the record itself decides, and rows of both kinds exchanged
    exact = table.assign(demand=table["demand_exact"], demand_rule="exact")
    exact = exact.assign(gap=0.8 * exact["demand"])
    expected = least_exact_damping(record, exact, LARGEST_DAMPING)
    mixed = pd.concat([table, exact], ignore_index=True)
    found = mitigation_columns(record, mixed, TARGET)["supplemental_damping"]
    assert_array_equal(found[len(table) :], expected)
    usual = mitigation_columns(record, table, TARGET)["supplemental_damping"]
    assert_array_equal(found[: len(table)], usual)


def test_another_demand_is_followed_in_proportion(record, table):
    # catches: the estimate compared with the gap, whatever the demand that decides
    usual = mitigation_columns(record, table, TARGET)["supplemental_damping"]
    halves = {"demand": 0.5 * table["demand"], "gap": 0.5 * table["gap"]}
    smaller = mitigation_columns(record, table.assign(**halves, demand_rule="sd"), TARGET)
    assert_allclose(smaller["supplemental_damping"], usual, rtol=1e-9)


def test_equal_derived_buildings_are_uncorrelated(station, record):
    # catches: a correlation of 1, at which no damping is needed
    derived = {"period_1": np.nan, "period_2": np.nan, "height_1": 18.0, "storeys_1": 6.0}
    pair = table_of(station, [derived])
    assert period_is_derived(pair).all()
    assert (pair["demand_rule"] == "srss").all()
    pair = pair.assign(gap=0.95 * pair["demand"])
    pair = pair.assign(**linearized_columns(record, pair))
    found = mitigation_columns(record, pair, TARGET)["supplemental_damping"]
    assert 0.0 < found[0] < 0.4


def test_a_yielding_pair_is_followed_as_its_equivalent_one(record, table):
    # catches: elastic periods and dampings of buildings that yield
    weak = table.assign(yield_displacement_1=table["sd_1"] / 1.5, hardening_1=0.05)
    weak = weak.assign(**linearized_columns(record, weak))
    linearized = weak["critical_gap_linearized"]
    # the equivalent buildings govern
    weak = weak.assign(demand=linearized, gap=0.8 * linearized, estimate_rule="linearized")
    found = mitigation_columns(record, weak, TARGET)["supplemental_damping"]
    elastic = weak.drop(columns=["yield_displacement_1"]).assign(yield_displacement_1=np.inf)
    elastic = elastic.assign(**linearized_columns(record, elastic))
    other = mitigation_columns(record, elastic, TARGET)["supplemental_damping"]
    assert np.all(found != other)


def test_the_bumper_keeps_the_single_hit_within_the_target(record, table):
    # catches: a restitution for one of the buildings only, plain periods with radii of another
    # demand
    table = table.assign(gap=0.9 * table["demand"])
    found = mitigation_columns(record, table, 1.5)["bumper_restitution"]
    critical = np.maximum(table["critical_gap_per"], table["critical_gap_record"])
    within = np.isfinite(found) & (found < 0.98)
    assert within.any()

    def amplification(restitution):
        pair = (*at_contact(table, "per"), *both(table, "period"), *both(table, "contact_mass"))
        hit = per_obspy.single_hit(*pair, restitution, critical, table["gap"])
        return np.maximum(hit.amplification_1, hit.amplification_2)

    usual = np.where(within, found, 0.5)
    assert_allclose(amplification(usual)[within], 1.5, rtol=1e-9)
    assert np.all(amplification(np.minimum(usual + 0.01, 1.0))[within] > 1.5)


def test_where_the_elastic_gap_governs_elastic_buildings_do(station, record):
    # catches: equivalent linear buildings with the critical gap of the elastic ones
    strong = {"period_1": 0.45, "period_2": 1.23}
    weak = {**strong, "yield_displacement_1": 0.104}
    pairs = table_of(station, [strong, weak])
    elastic, yielding = (pairs.iloc[[i]].reset_index(drop=True) for i in (0, 1))
    assert yielding["estimate_rule"][0] != "linearized"
    assert yielding["ductility_1"][0] > 1.0
    # the same demand and gap: only the buildings could differ
    demand = float(elastic["demand_estimated"][0])
    same = {"demand": demand, "gap": 0.97 * demand, "demand_rule": elastic["estimate_rule"]}
    expected = mitigation_columns(record, elastic.assign(**same), TARGET)
    # neither measure is trivial
    assert expected["supplemental_damping"][0] > 0.0
    assert expected["bumper_restitution"][0] < 1.0
    found = mitigation_columns(record, yielding.assign(**same), TARGET)
    for name, column in expected.items():
        assert_array_equal(found[name], column, err_msg=name)


def test_a_row_does_not_depend_on_the_others(record, table):
    whole = mitigation_columns(record, table, TARGET)
    for index in range(len(table)):
        alone = mitigation_columns(record, table.iloc[index : index + 1], TARGET)
        for name, column in whole.items():
            assert_array_equal(alone[name], column[index : index + 1], err_msg=name)


def test_a_target_below_one_is_refused(record, table):
    with pytest.raises(ValueError, match="target must be at least 1"):
        mitigation_columns(record, table, 0.9)
