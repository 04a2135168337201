"""Demand of spectral displacements: by hand at contact height, derived periods, and states."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from screening_samples import make_pairs

from per_obspy.config import Building, Screening
from per_obspy.inventory.completion import completed_pairs
from per_obspy.pounding.correlation import ddc_correlation
from per_obspy.pounding.critical_gap import critical_gap
from per_obspy.pounding.reliability import sd_error
from per_obspy.pounding.single_hit import single_hit
from per_obspy.screening.spectral_demand import (
    SpectralMotion,
    spectral_rows,
    spectral_uncertainty,
)
from per_obspy.screening.station_motion import LogSpectra
from per_obspy.screening.uncertain_motion import likely_oscillators
from per_obspy.screening.values import both, oscillators

#: SD of both oscillators, m, without deviation, whatever period and damping.
SD = np.full(2, 0.1), np.full(2, 0.2)
FLAT = LogSpectra(np.zeros(1), np.zeros(1), np.zeros((1, 1, 1)))
MOTION = SpectralMotion(SD, (np.zeros(2), np.zeros(2)), FLAT, np.zeros(2, dtype=np.intp))
SHARES = {"participation_1": 1.5, "participation_2": 0.5}
#: SD of 0.1 and 0.2 m times these.
RADII = 0.15, 0.1


@pytest.fixture(scope="module")
def pairs():
    """Two pairs of the same buildings: periods given, and derived."""
    derived = {"period_1": np.nan, "period_2": np.nan}
    return completed_pairs(make_pairs([SHARES, {**SHARES, **derived}]), Building())


def test_radii_are_at_contact_height_and_derived_periods_ask_for_the_root_of_squares(pairs):
    table = spectral_rows(pairs, MOTION, Screening())
    assert_allclose(table["srss_gap_sd"], np.hypot(*RADII), rtol=1e-12)
    correlation = ddc_correlation(1.0, pairs["damping_1"], 0.6, pairs["damping_2"])[0]
    assert_allclose(table["correlation"][0], correlation, rtol=1e-12)
    assert_allclose(table["critical_gap_sd"][0], critical_gap(*RADII, correlation), rtol=1e-12)
    assert table["squares_decide"].tolist() == [False, True]
    assert table["demand"][0] == table["critical_gap_sd"][0]
    assert table["demand"][1] == table["srss_gap_sd"][1] > table["critical_gap_sd"][1]


def test_the_single_hit_is_at_the_demand(pairs):
    # would catch: radii of the oscillators, or the gap by correlation for derived periods
    table = spectral_rows(pairs, MOTION, Screening())
    masses, periods = both(pairs, "contact_mass"), both(pairs, "period")
    radii = 1.5 * SD[0], 0.5 * SD[1]
    hit = single_hit(*radii, *periods, *masses, pairs["restitution"], table["demand"], pairs["gap"])
    assert_array_equal(table["impact_velocity"], hit.impact_velocity)
    assert_array_equal(table["amplification_2"], hit.amplification_2)
    assert_array_equal(table["sd_1"], SD[0])


def test_state_and_class_are_those_of_the_population_whatever_was_derived(pairs):
    # would catch: a derived period that is never a no, or a yes by the demand alone
    apart = spectral_rows(pairs.assign(gap=9.0), MOTION, Screening())
    touching = spectral_rows(pairs.assign(gap=0.0), MOTION, Screening())
    assert set(apart["state"]) == {"no"}
    assert set(apart["risk_class"]) == {"low"}
    assert set(touching["state"]) == {"yes"}
    assert (touching["probability"] == 1.0).all()


def test_the_radius_of_the_population_has_no_bias(pairs):
    table = spectral_rows(pairs, MOTION, Screening())
    motion = spectral_uncertainty(table, MOTION)
    # given periods of 1 and 0.6 s; derived ones are as far apart as their deviations make likely
    error = sd_error(*likely_oscillators(table))
    assert error.median[0] == sd_error(*oscillators(table)).median[0] > error.median[1]
    assert_allclose(motion.second.radius, RADII[1] / error.median, rtol=1e-12)
    assert_array_equal(motion.second.period, pairs["period_2"])
    assert not motion.second.ln_ratio.any()
    assert_allclose(motion.log_std, error.log_std, rtol=1e-12)
