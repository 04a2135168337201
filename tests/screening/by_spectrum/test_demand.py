"""Demand of spectral displacements: by hand at contact height, derived periods, and states."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from screening_samples import make_pairs

from per_obspy.config import Building, Screening
from per_obspy.inventory.completion import completed_pairs
from per_obspy.pounding.correlation.white_noise import ddc_correlation
from per_obspy.pounding.critical_gap import critical_gap
from per_obspy.pounding.single_hit import single_hit
from per_obspy.screening.by_spectrum.demand import spectral_columns, spectral_demand
from per_obspy.screening.values import both

#: SD of both oscillators, m.
SD = np.full(2, 0.1), np.full(2, 0.2)
SHARES = {"participation_1": 1.5, "participation_2": 0.5}


@pytest.fixture(scope="module")
def pairs():
    """Two pairs of the same buildings: periods given, and derived."""
    derived = {"period_1": np.nan, "period_2": np.nan}
    return completed_pairs(make_pairs([SHARES, {**SHARES, **derived}]), Building())


def test_radii_are_at_contact_height(pairs):
    # SD of 0.1 and 0.2 m times participations of 1.5 and 0.5
    demand = spectral_demand(pairs, SD)
    assert_allclose(demand.radii[0], 0.15, rtol=1e-12)
    assert_allclose(demand.radii[1], 0.1, rtol=1e-12)
    assert_allclose(demand.by_squares, np.hypot(0.15, 0.1), rtol=1e-12)
    correlation = ddc_correlation(1.0, pairs["damping_1"], 0.6, pairs["damping_2"])
    assert_allclose(demand.correlation[0], correlation[0], rtol=1e-12)
    assert_allclose(demand.by_correlation[0], critical_gap(0.15, 0.1, correlation[0]), rtol=1e-12)


def test_derived_periods_ask_for_the_root_of_the_sum_of_squares(pairs):
    demand = spectral_demand(pairs, SD)
    assert demand.squares_decide.tolist() == [False, True]
    assert demand.demand[0] == demand.by_correlation[0]
    assert demand.demand[1] == demand.by_squares[1] > demand.by_correlation[1]


def test_the_single_hit_is_at_the_demand(pairs):
    # would catch: radii of the oscillators, or the gap by correlation for derived periods
    demand = spectral_demand(pairs, SD)
    table = spectral_columns(pairs, SD, demand, np.zeros(2), Screening())
    hit = single_hit(
        *demand.radii,
        *both(pairs, "period"),
        *both(pairs, "contact_mass"),
        pairs["restitution"],
        demand.demand,
        pairs["gap"],
    )
    assert_array_equal(table["impact_velocity"], hit.impact_velocity)
    assert_array_equal(table["amplification_2"], hit.amplification_2)
    assert_array_equal(table["sd_1"], SD[0])


def test_a_gap_above_the_demand_is_possible_where_it_is_likely_or_periods_are_derived(pairs):
    # would catch: a derived period that is a plain no, or a yes by probability alone
    wide, likely = pairs.assign(gap=1.0), Screening().possible_from
    demand = spectral_demand(wide, SD)
    states = [
        spectral_columns(wide, SD, demand, np.full(2, probability), Screening())["state"].tolist()
        for probability in (0.0, likely)
    ]
    assert states == [["no", "possible"], ["possible", "possible"]]
    table = spectral_columns(pairs.assign(gap=0.0), SD, demand, np.zeros(2), Screening())
    assert set(table["state"]) == {"yes"}
