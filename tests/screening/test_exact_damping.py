"""Least damping by exact displacements: enough, least, scaling, worst azimuth, yielding, limits."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from screening_samples import make_station, table_of

import per_obspy
from per_obspy.pounding.relative import yielding_relative_displacement
from per_obspy.screening.exact import (
    HALVINGS,
    SCAN_STEP,
    least_exact_damping,
)
from per_obspy.screening.station_motion import station_motion

LARGEST = 0.4
RESOLUTION = SCAN_STEP / 2**HALVINGS
PERIODS = [(0.5, 0.8), (1.0, 0.6), (1.3, 1.5), (2.0, 0.9), (0.7, 2.2), (0.45, 2.6)]


def _table(station, share=0.75, **columns):
    rows = [{"period_1": first, "period_2": second, "azimuth": 40.0} for first, second in PERIODS]
    table = table_of(station, [row | columns for row in rows])
    return table.assign(gap=share * _demands(station_motion(station), table))


def _demands(record, table, added=0.0, azimuth=40.0):
    """Return the largest u1 - u2 at contact level of each pair along an azimuth, by row, m."""
    angle = np.radians(azimuth)
    along = record.records[0].north * np.cos(angle) + record.records[0].east * np.sin(angle)
    shares = table["participation_1"], table["participation_2"]
    dampings = table["damping_1"] + added, table["damping_2"] + added
    oscillators = table["period_1"], dampings[0], table["period_2"], dampings[1]
    return per_obspy.relative_displacement(
        along, record.records[0].dt, *oscillators, *shares
    ).one_before_two


@pytest.mark.parametrize("share", [0.9, 0.75, 0.65])
def test_it_is_enough_and_the_first_that_is(station, record, share):
    # catches: the estimate in place of the record, damping of one building, a step skipped
    table = _table(station, share)
    found = least_exact_damping(record, table, LARGEST)
    helped = np.isfinite(found)
    # all dampings by steps of 0.005, apart from the scan
    grid = np.arange(0.005, LARGEST + 1e-9, 0.005)
    enough = np.array([_demands(record, table, added) for added in grid]) <= table["gap"].to_numpy()
    assert_array_equal(helped, enough.any(axis=0))
    assert helped.any()
    first = grid[enough.argmax(axis=0)]
    # between the last step that fails and the first that fits
    assert np.all(found[helped] <= first[helped] + RESOLUTION)
    assert np.all(found[helped] > first[helped] - 0.005 - RESOLUTION)
    within = _demands(record, table, np.where(helped, found, LARGEST))
    # the same arithmetic along the azimuth up to the order of sums
    assert np.all(within[helped] <= table["gap"][helped] * (1 + 1e-9))
    less = _demands(record, table, np.where(helped, found - 2 * RESOLUTION, LARGEST))
    assert np.all(less > table["gap"])


def test_no_damping_is_enough_for_a_small_gap(station, record):
    assert np.isnan(least_exact_damping(record, _table(station, 0.01), LARGEST)).all()


def test_a_wider_gap_needs_less(station, record):
    shares = np.linspace(0.4, 0.99, 8)
    found = [least_exact_damping(record, _table(station, share), LARGEST) for share in shares]
    # not enough is more than any; equal damping of both never widened the demand of these
    assert np.all(np.diff(np.nan_to_num(found, nan=1.0), axis=0) <= RESOLUTION)


def test_scaling_ground_and_gap_changes_nothing(station, record):
    stronger = make_station(scale=2.0)
    found = least_exact_damping(record, _table(station), LARGEST)
    scaled = least_exact_damping(station_motion(stronger), _table(stronger), LARGEST)
    # samples are stored as float32
    assert_allclose(scaled, found, atol=2 * RESOLUTION)


def test_an_unknown_azimuth_takes_the_worst_at_every_damping(station, record):
    # catches: the azimuth that was worst without damping kept
    known = _table(station, 0.95)
    unknown = known.assign(azimuth=np.nan)
    angles = np.arange(0.0, 360.0, 10.0)
    worst = np.max([_demands(record, known, 0.0, angle) for angle in angles], axis=0)
    unknown = unknown.assign(gap=0.8 * worst)
    found = least_exact_damping(record, unknown, LARGEST)
    helped = np.isfinite(found)
    assert helped.any()
    added = np.where(helped, found, LARGEST)
    demands = np.max([_demands(record, unknown, added, angle) for angle in angles], axis=0)
    # the worst azimuth is that of the samples: peaks between them may be 1e-3 larger elsewhere
    assert np.all(demands[helped] <= unknown["gap"][helped] * 1.001)
    along = least_exact_damping(record, known.assign(gap=unknown["gap"]), LARGEST)
    along = np.where(_demands(record, known) <= unknown["gap"], 0.0, along)
    assert np.all(np.nan_to_num(along) <= np.nan_to_num(found, nan=1.0) + 0.01)


def test_a_strong_yielding_building_is_a_linear_one(station, record):
    table = _table(station)
    strong = table.assign(yield_displacement_1=1e3, hardening_1=0.05)
    linear = least_exact_damping(record, table, LARGEST)
    assert_allclose(least_exact_damping(record, strong, LARGEST), linear, atol=RESOLUTION)


def test_a_weak_building_is_followed_beyond_its_yield(station, record):
    # catches: the linear demand of a building that yields
    weak = {"yield_displacement_1": 0.02, "hardening_1": 0.05}
    table = table_of(station, [{"period_1": 1.0, "period_2": 0.6, "azimuth": 40.0} | weak])
    angle = np.radians(40.0)
    along = record.records[0].north * np.cos(angle) + record.records[0].east * np.sin(angle)

    shares = float(table["participation_1"][0]), float(table["participation_2"][0])
    strength = {"yield_displacement_1": 0.02 * shares[0], "hardening_1": 0.05}

    def demand(added):
        motion = np.stack([along, np.zeros_like(along)])
        oscillators = 1.0, 0.05 + added, 0.6, 0.05 + added, 0.0
        found = yielding_relative_displacement(
            motion,
            record.records[0].dt,
            *oscillators,
            *shares,
            **strength,
            yield_displacement_2=np.inf,
        )
        return float(found.one_before_two)

    table = table.assign(gap=0.8 * demand(0.0))
    (found,) = least_exact_damping(record, table, LARGEST)
    # the same arithmetic along the azimuth up to the order of sums
    assert demand(found) <= table["gap"][0] * (1 + 1e-9)
    assert demand(found - 2 * RESOLUTION) > table["gap"][0]


def test_a_building_stays_below_critical(station, record):
    heavy = _table(station, damping_1=0.9).assign(gap=1e-3)
    # 0.09 is all that can be added
    assert np.isnan(least_exact_damping(record, heavy, LARGEST)).all()


def test_a_row_does_not_depend_on_the_others(station, record):
    table = _table(station)
    whole = least_exact_damping(record, table, LARGEST)
    for index in range(len(table)):
        alone = least_exact_damping(record, table.iloc[index : index + 1], LARGEST)
        assert_array_equal(alone, whole[index : index + 1])
