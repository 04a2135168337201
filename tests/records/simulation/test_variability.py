"""Variability between places and frequencies: a normal field with the stated correlation."""

import numpy as np
from numpy.testing import assert_allclose

from per_obspy.records.simulation.variability import FREQUENCY_LENGTH, log_variation

REACH = 20_000.0
FREQUENCIES = np.array([0.2, 1.0, 1.0 * np.exp(FREQUENCY_LENGTH), 20.0])

#: Fields of a test.
FIELDS = 500

#: Standard error of a standard deviation, and of a correlation near 0, from so many fields is
#: 0.032 and 0.045: four times the larger.
TOLERANCE = 0.18


def fields(east: float, north: float = 0.0) -> np.ndarray:
    values = [
        log_variation(np.random.default_rng(seed), (east, north), REACH, FREQUENCIES)
        for seed in range(FIELDS)
    ]
    return np.array(values)


def test_mean_and_deviation_are_those_of_a_standard_normal_variable():
    values = fields(3e6)  # far from the origin of the field, which is no special place
    assert_allclose(values.mean(axis=0), 0.0, atol=TOLERANCE)
    assert_allclose(values.std(axis=0), 1.0, atol=TOLERANCE)
    # a share of 0.954 lies within two deviations; standard error 0.009 for each frequency
    assert_allclose((np.abs(values) < 2.0).mean(axis=0), 0.954, atol=0.04)


def test_correlation_decays_with_distance_in_every_direction():
    origin = fields(0.0)
    for east, north in ((5e3, 0.0), (0.0, 5e3), (-3e3, 4e3)):
        products = (origin * fields(east, north)).mean(axis=0)
        assert_allclose(products, np.exp(-3.0 * 5e3 / REACH), atol=TOLERANCE)
    # exp(-15) at five times the reach
    assert_allclose((origin * fields(1e5)).mean(axis=0), 0.0, atol=TOLERANCE)


def test_correlation_decays_with_the_ratio_of_frequencies():
    values = fields(0.0)
    expected = np.exp(-np.abs(np.subtract.outer(*[np.log(FREQUENCIES)] * 2)) / FREQUENCY_LENGTH)
    assert_allclose(values.T @ values / FIELDS, expected, atol=TOLERANCE)


def test_a_place_knows_its_own_value_only_by_its_coordinates():
    alone = log_variation(np.random.default_rng(7), (10.0, 20.0), REACH, FREQUENCIES[:2])
    among = log_variation(np.random.default_rng(7), (10.0, 20.0), REACH, FREQUENCIES)
    assert_allclose(alone, among[:2], rtol=1e-15)


def test_the_field_is_constant_beyond_its_frequencies():
    low = log_variation(np.random.default_rng(7), (0.0, 0.0), REACH, np.array([0.0, 1e-3, 1e-2]))
    assert_allclose(low, low[-1], rtol=1e-15)
