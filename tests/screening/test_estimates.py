"""Demand of a record: the governing estimate, round-off, and the velocity that ranks pairs."""

import numpy as np
from numpy.testing import assert_array_equal
from screening_samples import make_pairs, table_of

import per_obspy
from per_obspy.config import Building
from per_obspy.inventory.completion import completed_pairs
from per_obspy.screening.columns import RESULTS
from per_obspy.screening.estimates import demand_columns, linearized_columns
from per_obspy.screening.exact import EXACT_COLUMNS
from per_obspy.screening.risk import INTERMEDIATE
from per_obspy.screening.station_motion import motion_along_every_azimuth
from per_obspy.screening.values import at_contact, both, values


def _estimated(record, rows):
    """Return the columns of pairs of unknown azimuth without the exact outcome."""
    pairs = completed_pairs(make_pairs(rows), Building())
    motion = motion_along_every_azimuth(record, pairs)
    return demand_columns(record, pairs, motion, "worst", exact=False)


def _at_azimuth(motion, degrees):
    """Return the motion along a single azimuth."""
    # arrays are (n_pairs, n_azimuths)
    column = slice(degrees, degrees + 1)
    (per_1, per_2), (sd_1, sd_2) = motion.per, motion.sd
    return motion._replace(
        azimuth=motion.azimuth[:, column],
        per=(per_1[:, column], per_2[:, column]),
        sd=(sd_1[:, column], sd_2[:, column]),
        correlation=motion.correlation[:, column],
    )


def test_every_column_is_described(station):
    table = table_of(station, [{}])
    pairs = completed_pairs(make_pairs([{}]), Building())
    assert {*table} - {*pairs} <= {*RESULTS, *INTERMEDIATE}


def test_without_the_exact_outcome_the_estimate_is_the_demand(record):
    table = _estimated(record, [{}, {"period_2": 1.7}])
    assert_array_equal(table["demand"], table["demand_estimated"])
    assert_array_equal(table["demand_rule"], table["estimate_rule"])
    for name in (*EXACT_COLUMNS, "estimate_over_exact"):
        assert np.isnan(table[name]).all(), name


def test_the_worst_azimuth_is_that_of_the_largest_demand(record):
    # would catch: the azimuth of the largest radius, or one per estimate
    pairs = completed_pairs(make_pairs([{}]), Building())
    every = motion_along_every_azimuth(record, pairs)
    worst = _estimated(record, [{}])
    # the same pair along single azimuths
    demands = []
    for column in range(0, 180, 10):
        along = _at_azimuth(every, column)
        demands.append(demand_columns(record, pairs, along, "given", exact=False)["demand"][0])
    assert worst["demand"][0] >= max(demands)
    # all columns are those of one azimuth
    azimuth = int(worst["azimuth_used"][0])
    assert worst["per_1"][0] == every.per[0][0, azimuth]
    assert worst["correlation_record"][0] == every.correlation[0, azimuth]


def test_the_larger_of_elastic_and_linearized_demand_is_the_estimate(station, record):
    # would catch: the linearized demand wherever a building yields
    weak = {"period_1": 0.2, "period_2": 0.3, "yield_displacement_1": 2e-4}
    strong = {"yield_displacement_1": 9.0}
    table = table_of(station, [weak, strong])
    elastic = np.maximum(table["critical_gap_per"], table["critical_gap_record"])
    linearized = linearized_columns(record, table)["critical_gap_linearized"]
    assert_array_equal(table["demand_estimated"], np.maximum(elastic, linearized))
    assert table["estimate_rule"].iloc[0] == "linearized"
    assert table["estimate_rule"].iloc[1] != "linearized"


def test_the_single_hit_is_that_of_the_model_whose_gap_governs(station):
    # recomputed from the row's own columns; would catch equivalent radii with an elastic gap
    rows = [
        {"period_1": 0.45, "period_2": 1.23, "yield_displacement_1": 0.104},
        {"period_1": 0.44, "period_2": 0.62, "yield_displacement_2": 0.272},
        {"period_1": 0.2, "period_2": 0.3, "yield_displacement_1": 2e-4},
    ]
    table = table_of(station, rows)
    linearized = table["estimate_rule"] == "linearized"
    assert linearized.tolist() == [False, False, True]
    # a building yields in every row
    assert (table[["ductility_1", "ductility_2"]].max(axis=1) > 1.0).all()
    for kind, prefix in ((linearized, "equivalent_"), (~linearized, "")):
        part = table[kind]
        hit = per_obspy.single_hit(
            *at_contact(part, f"{prefix}per"),
            *both(part, f"{prefix}period"),
            *both(part, "contact_mass"),
            part["restitution"],
            part["demand_estimated"],
            part["gap"],
        )
        assert_array_equal(hit.status, part["single_hit_status"])
        assert_array_equal(hit.impact_velocity, part["impact_velocity"])


def test_equal_buildings_have_a_demand_of_zero(station):
    # the root of a difference of equal squares is 1e-9 of the radii, not 0
    equal = {"period_2": 1.0, "height_2": 30.0, "storeys_2": 10.0}
    table = table_of(station, [equal])
    assert table["demand"].iloc[0] == 0.0
    assert np.isnan(table["estimate_over_exact"].iloc[0])


def test_round_off_is_relative_to_the_radii(station):
    # a thousandth of the usual gap is a demand, not round-off
    near = {"period_2": 1.001, "height_2": 30.0, "storeys_2": 10.0}
    table = table_of(station, [near])
    assert 0.0 < table["demand"].iloc[0] < 0.05 * table["absolute_gap"].iloc[0]
    assert values(table, "estimate_over_exact")[0] > 0.0
