"""Demand of spectral displacements: by hand at contact height, derived periods, and states."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from screening_samples import make_pairs

from per_obspy.config import Building, Screening
from per_obspy.inventory.completion import completed_pairs
from per_obspy.pounding.correlation import ddc_correlation
from per_obspy.pounding.critical_gap import critical_gap
from per_obspy.pounding.single_hit import single_hit
from per_obspy.screening.by_spectrum.demand import (
    spectral_columns,
    spectral_demand,
    spectral_radius,
)
from per_obspy.screening.uncertainty.population import COLUMNS
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


def _population(probability):
    """Return the population of both pairs with a probability."""
    numbers = (probability, 0.3, 0.4, 1.2)
    return {name: np.full(2, number) for name, number in zip(COLUMNS, numbers, strict=True)}


def test_the_single_hit_is_at_the_demand(pairs):
    # would catch: radii of the oscillators, or the gap by correlation for derived periods
    demand = spectral_demand(pairs, SD)
    table = spectral_columns(pairs, SD, demand, _population(0.0), Screening())
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


def test_state_and_class_are_those_of_the_population_whatever_was_derived(pairs):
    # would catch: a derived period that is never a no, or a yes by the demand alone
    demand, states = spectral_demand(pairs.assign(gap=0.0), SD), Screening().states
    for probability, name in ((0.0, "no"), (states.unlikely, "unlikely"), (states.yes, "yes")):
        table = spectral_columns(pairs, SD, demand, _population(probability), Screening())
        assert set(table["state"]) == {name}
        assert set(table["risk_class"]) == {"high"}


def test_the_radius_of_the_population_has_no_bias(pairs):
    demand = spectral_demand(pairs, SD)
    radius = spectral_radius(pairs, demand, 2)
    assert_allclose(radius.radius, demand.radii[1] / 0.97, rtol=1e-12)
    assert_array_equal(radius.period, pairs["period_2"])
    assert not radius.ln_ratio.any()
