"""Motion of a ShakeMap: interpolation by hand, the damping of the code, and uncertainty."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from screening_samples import make_pairs
from shakemap_samples import PERIODS, make_map

from per_obspy.config import Building, Screening
from per_obspy.inventory.completion import completed_pairs
from per_obspy.pounding.reliability import sd_error
from per_obspy.screening.shakemap import (
    DAMPINGS,
    MapMotion,
    at_period,
    damping_factor,
    map_motion,
    motion_on_map,
    seen_from,
)
from per_obspy.screening.spectral_demand import spectral_rows, spectral_uncertainty
from per_obspy.screening.station_motion import stored_log
from per_obspy.screening.uncertain_motion import likely_oscillators

#: The middle southern node: PSA is 8, 4, 1 m/s2.
NODE = np.array([20.0]), np.array([9.5])
LN_SD = np.log(np.array([8.0, 4.0, 1.0]) * (PERIODS / 2 / np.pi) ** 2)


#: An oscillator between two periods of the map.
OSCILLATOR = {"period": 0.55, "damping": 0.05}


def test_between_nodes_it_is_bilinear():
    # would catch longitude and latitude exchanged
    motion = motion_on_map(make_map(), np.array([19.75, 20.0]), np.array([9.5, 10.0]), 0.6)
    psa = np.exp(motion.ln_sd[:, 1]) * (2 * np.pi) ** 2
    assert_allclose(psa, [2.0 * 1.5, 2.0 * 2.0 * 2.0], rtol=1e-12)


def test_between_periods_it_is_a_power():
    # SD of 8 m/s2 at 0.3 s and 4 at 1 s; would catch periods on a linear axis
    motion = motion_on_map(make_map(), *NODE, 0.6)
    power = np.log(4.0 / 8.0 / 0.3**2) / np.log(1 / 0.3)
    pair = {f"{name}_{i}": np.array([one]) for name, one in OSCILLATOR.items() for i in (1, 2)}
    found, _ = map_motion(motion, pair).sd
    expected = 8.0 * (0.3 / 2 / np.pi) ** 2 * (0.55 / 0.3) ** power
    assert_allclose(found, expected, rtol=1e-12)


def test_beyond_the_periods_of_the_map_the_ends_are_kept():
    places = np.tile(LN_SD, (2, 1))
    assert_array_equal(at_period(PERIODS, places, np.array([0.01, 9.0])), LN_SD[[0, 2]])


def test_damping_is_corrected_by_the_code():
    # EN 1998-1 (3.6): sqrt(10 / 7) at 2 %, 0.55 at least
    factors = damping_factor(np.array([0.05, 0.02, 0.28, 0.6]))
    assert_allclose(factors, [1.0, np.sqrt(10 / 7), 0.55, 0.55], rtol=1e-2)


def test_a_map_without_deviations_has_the_assumed_one():
    assert set(motion_on_map(make_map(), *NODE, 0.6).log_std.ravel()) == {0.6}
    assert_allclose(motion_on_map(make_map(log_std=0.3), *NODE, 0.6).log_std, 0.3, rtol=1e-12)


def test_nodes_without_motion_are_minus_infinity():
    shakemap = make_map()
    motion = motion_on_map(shakemap.assign(psa=0.0 * shakemap["psa"]), *NODE, 0.6)
    assert np.isneginf(motion.ln_sd).all()


def test_longitudes_are_counted_as_the_map_counts_them():
    pacific = make_map((179.8, 180.0, 180.2))
    assert_allclose(seen_from(pacific, np.array([-179.9, 179.9])), [180.1, 179.9], rtol=1e-12)


@pytest.fixture(scope="module")
def uncertain():
    """Motion by spectra, and its uncertainty: periods given, derived, and given again."""
    place = {"longitude_2": 20.0, "latitude_1": 9.5, "latitude_2": 9.5}
    derived = {**place, "period_1": np.nan, "height_1": 60.0, "storeys_1": 20.0}
    given = {**place, "period_1": 0.7, "damping_log_std_1": 0.2, "damping_1": 0.05}
    pairs = completed_pairs(make_pairs([given, derived, given]), Building())
    # all on the middle southern node
    motion = motion_on_map(make_map(log_std=0.5), np.full(3, 20.0), np.full(3, 9.5), 0.6)
    by_map = map_motion(motion, pairs)
    table = spectral_rows(pairs, by_map, Screening())
    return by_map, spectral_uncertainty(table, by_map), table


def test_every_pair_has_its_own_spectrum():
    # would catch: the spectrum of another pair, which has another form here
    derived, given = {"period_1": np.nan, "height_1": 60.0, "storeys_1": 20.0}, {"period_1": 0.7}
    pairs = completed_pairs(make_pairs([derived, given, derived]), Building())
    ln_sd = np.array([[-3.0, -2.0, -1.0], [0.0, 0.0, 0.0], [-1.0, -2.0, -4.0]])
    place = MapMotion(PERIODS, ln_sd, np.full((3, 3), 0.5))
    motion = map_motion(place, pairs)
    # at 1 and 3 s, of the first and the third pair
    row, damping = motion.row[[0, 2]], np.full(2, np.log(0.05))
    at_1_s = stored_log(motion.spectra, row, np.zeros(2), damping)
    at_3_s = stored_log(motion.spectra, row, np.full(2, np.log(3.0)), damping)
    assert_allclose(at_3_s - at_1_s, [1.0, -2.0], rtol=1e-12)


def test_spectra_are_those_of_the_map(uncertain):
    motion, _, _ = uncertain
    assert motion.spectra.radii.shape == (3, DAMPINGS.size, PERIODS.size)
    assert motion.row.tolist() == [0, 1, 2]
    # interpolated between dampings 26 % apart
    row, damping = np.zeros(3, dtype=int), np.full(3, np.log(0.05))
    assert_allclose(stored_log(motion.spectra, row, np.log(PERIODS), damping), LN_SD, atol=2e-3)


def test_map_and_estimate_are_uncertain(uncertain):
    # one motion with a deviation of 0.5 at both periods, whose residuals are correlated: the gap is
    # as uncertain as either radius, or less; the estimate adds its own
    _, motion, table = uncertain
    assert_array_equal(motion.correlation, table["correlation"])
    error = sd_error(*likely_oscillators(table)).log_std
    assert np.all(motion.log_std < np.hypot(0.5, error))
    assert np.all(motion.log_std > np.hypot(0.3, error))
