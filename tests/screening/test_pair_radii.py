"""Radii and correlation of pairs: along one azimuth, along all, and of a single horizontal."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from screening_samples import make_station

import per_obspy
from per_obspy.screening.station_motion import (
    EVERY_AZIMUTH,
    motion_along_azimuths,
    motion_along_every_azimuth,
    motion_of_one_horizontal,
    station_motion,
)
from per_obspy.screening.values import chosen

#: The second and the fourth pair share an oscillator with another pair.
PAIRS = {
    "period_1": np.array([1.0, 0.4, 2.1, 1.0]),
    "period_2": np.array([0.7, 0.9, 1.5, 0.7]),
    "damping_1": np.array([0.05, 0.02, 0.05, 0.05]),
    "damping_2": np.array([0.05, 0.05, 0.03, 0.02]),
    "azimuth": np.array([0.0, 30.0, 90.0, 179.0]),
}


@pytest.fixture(scope="module")
def along(record):
    return motion_along_azimuths(record, PAIRS, PAIRS["azimuth"])


def test_radii_are_those_of_the_turned_record(record, along):
    # would catch: buildings, dampings or the sense of the azimuth exchanged
    for index, azimuth in enumerate(np.radians(PAIRS["azimuth"])):
        turned = record.records[0].north * np.cos(azimuth) + record.records[0].east * np.sin(
            azimuth
        )
        for i in (1, 2):
            period, damping = PAIRS[f"period_{i}"][index], PAIRS[f"damping_{i}"][index]
            spectra = per_obspy.response_spectra(turned, record.records[0].dt, [period], damping)
            # the contract of the spectra
            assert_allclose(along.per[i - 1][index], spectra.per, rtol=1e-9)
            assert_allclose(along.sd[i - 1][index], spectra.sd, rtol=1e-9)


def test_every_azimuth_holds_the_given_one(record, along):
    # would catch: rows of equal oscillators in the order of their periods
    every = motion_along_every_azimuth(record, PAIRS)
    assert_array_equal(every.azimuth, np.broadcast_to(EVERY_AZIMUTH, (4, 180)))
    column = PAIRS["azimuth"].astype(int)
    place = np.arange(4), column
    for i in (0, 1):
        # peaks between samples are located to 1e-9
        assert_allclose(every.per[i][place], along.per[i][:, 0], rtol=1e-8)
        assert_allclose(every.sd[i][place], along.sd[i][:, 0], rtol=1e-8)
    assert_allclose(every.correlation[place], along.correlation[:, 0], rtol=1e-9)


def test_equal_oscillators_are_fully_correlated(record):
    equal = PAIRS | {"period_2": PAIRS["period_1"], "damping_2": PAIRS["damping_1"]}
    motion = motion_along_every_azimuth(record, equal)
    assert_allclose(motion.correlation, 1.0, rtol=1e-12)
    assert_array_equal(motion.per[0], motion.per[1])


def test_a_pair_does_not_depend_on_the_others(record):
    # to the bit; would catch equal oscillators computed with those of another pair
    together = motion_along_every_azimuth(record, PAIRS)
    for index in range(4):
        alone = motion_along_every_azimuth(record, chosen(PAIRS, np.array([index])))
        for name in ("per", "sd"):
            whole, part = getattr(together, name), getattr(alone, name)
            assert_array_equal(part[0][0], whole[0][index])
            assert_array_equal(part[1][0], whole[1][index])


def test_a_single_horizontal_serves_along_its_own_azimuth():
    record = station_motion(make_station(channels=("HNE",)))
    motion = motion_of_one_horizontal(record, PAIRS)
    assert_array_equal(motion.azimuth, np.full((4, 1), 90.0))
    spectra = per_obspy.response_spectra(record.records[0].north, record.records[0].dt, [0.4], 0.02)
    assert_allclose(motion.per[0][1], spectra.per, rtol=1e-9)
