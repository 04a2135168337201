"""Peaks against neighbours and the earthquake: laws, errors of units, robustness."""

import numpy as np
import pytest

from per_obspy.screening.amplitudes import (
    FLAGGED,
    REJECTED,
    Earthquake,
    Peaks,
    ln_median,
    peak_deviations,
    peak_sentence,
)
from per_obspy.screening.motion_field import great_circle

SOURCE = Earthquake(30.0, 40.0, 10_000.0, 6.5)


def network(size=20, seed=3, spread=0.5, bias=0.0, source=SOURCE):
    """Return stations within 1.5 degrees whose peaks scatter about the model."""
    random = np.random.default_rng(seed)
    longitude = source.longitude + random.uniform(-1.5, 1.5, size)
    latitude = source.latitude + random.uniform(-1.5, 1.5, size)
    vs30 = np.full(size, 400.0)
    distance = great_circle(source.longitude, source.latitude, longitude, latitude)
    scatter = random.normal(scale=spread, size=size) + bias
    pga, pgv = (
        np.exp(ln_median(name, source.magnitude, distance, vs30) + scatter)
        for name in ("pga", "pgv")
    )
    return Peaks(longitude, latitude, vs30, np.full(size, "", dtype=object), pga, pgv)


def times(peaks, station, factor):
    """Return the peaks with those of some stations times a factor."""
    pga, pgv = peaks.pga.copy(), peaks.pgv.copy()
    pga[station] *= factor
    pgv[station] *= factor
    return peaks._replace(pga=pga, pgv=pgv)


def largest(peaks, source):
    """Return the deviation of each station that is the larger one of both measures."""
    both = np.array([peak_deviations(name, peaks, source).deviations for name in ("pga", "pgv")])
    return both[np.abs(both).argmax(axis=0), np.arange(both.shape[1])]


UNKNOWN = SOURCE._replace(magnitude=np.nan)


@pytest.mark.parametrize("source", [SOURCE, UNKNOWN, Earthquake()])
@pytest.mark.parametrize("bias", [-0.7, 0.0, 0.7])
def test_good_stations_are_not_flagged(source, bias):
    # two deviations between earthquakes are 0.7; 20 networks of 20 stations: 400 times two peaks
    # would exceed 4 deviations of a normal distribution 0.05 times
    for seed in range(20):
        assert np.abs(largest(network(seed=seed, bias=bias), source)).max() < FLAGGED


@pytest.mark.parametrize("factor", [100.0, 981.0, 0.01, 1 / 981.0])
@pytest.mark.parametrize("source", [SOURCE, UNKNOWN])
def test_a_station_of_wrong_units_is_flagged_and_accuses_nobody(factor, source):
    good = network()
    for station in range(good.pga.size):
        found = largest(times(good, station, factor), source)
        assert np.sign(found[station]) == np.sign(np.log(factor))
        assert abs(found[station]) > FLAGGED
        assert np.abs(np.delete(found, station)).max() < FLAGGED
        # ln 981 is 6.9, at 0.6 to 0.7 of deviation
        assert abs(found[station]) > REJECTED or abs(np.log(factor)) < 5.0


def test_three_wrong_neighbours_of_eight_hide_nobody_and_accuse_nobody():
    wrong = [2, 5, 11]
    found = largest(times(network(), wrong, 981.0), SOURCE)
    assert (found[wrong] > FLAGGED).all()
    assert np.abs(np.delete(found, wrong)).max() < FLAGGED


def test_most_stations_wrong_do_not_accuse_the_others():
    # would catch: 15 of 20 stations in wrong units, and the five good ones rejected for it
    wrong = np.arange(15)
    found = largest(times(network(), wrong, 0.01), SOURCE)
    assert np.abs(found[15:]).max() < FLAGGED


@pytest.mark.parametrize("size", [1, 2, 5])
def test_few_stations_are_compared_with_the_model_only(size):
    good = network(size, spread=0.0)
    np.testing.assert_allclose(largest(good, SOURCE), 0.0, atol=1e-9)
    assert not largest(times(good, 0, 1e4), UNKNOWN).any()
    found = peak_deviations("pga", times(good, 0, 1e4), SOURCE)
    assert found.deviations[0] > REJECTED
    assert found.neighbours[0] == 0
    assert not found.deviations[1:].any()


def test_the_expected_peak_is_the_median_of_the_neighbours_at_the_distance_of_the_station():
    # peaks without scatter, all twice the model: expected at each place are these peaks themselves
    source = SOURCE._replace(magnitude=6.0, depth=0.0)
    peaks = network(spread=0.0, bias=np.log(2.0), source=source)
    found = peak_deviations("pga", peaks, source._replace(magnitude=np.nan))
    assert (found.neighbours == 8).all()
    # the model is taken half a rupture nearer (6 km): 10 % at 60 km with a slope of -1, less beyond
    far = great_circle(30.0, 40.0, peaks.longitude, peaks.latitude) > 60e3
    np.testing.assert_allclose(np.log(found.expected / peaks.pga)[far], 0.0, atol=0.1)
    assert far.sum() > 10


def test_a_long_rupture_may_come_near_to_a_station_far_from_the_epicentre():
    # magnitude 8: 190 km of rupture; a station 150 km from the epicentre may stand on it
    source = SOURCE._replace(magnitude=8.0)
    here = np.array([31.76]), np.array([40.0])
    at_fault = np.exp(ln_median("pga", 8.0, np.zeros(1), np.full(1, 400.0)))
    peaks = Peaks(*here, np.full(1, 400.0), np.array([""], dtype=object), at_fault, at_fault)
    assert not peak_deviations("pga", peaks, source).deviations.any()
    assert peak_deviations("pga", peaks, source._replace(magnitude=5.0)).deviations[0] > FLAGGED


def test_beyond_its_distances_the_model_is_too_low_to_judge():
    peaks = network(1)._replace(longitude=np.array([60.0]), pga=np.array([0.05]))
    assert not peak_deviations("pga", peaks, SOURCE).deviations.any()


def test_stations_on_the_same_ground_are_neighbours_first():
    # soft stations, seven times as strong, among twice as many on rock: nobody is implausible
    peaks = network(24, spread=0.1)
    soft = np.arange(8)
    classes = np.where(np.arange(24) < 8, "lake", "rock").astype(object)
    peaks = times(peaks, soft, 7.0)
    found = peak_deviations("pgv", peaks._replace(site_class=classes), UNKNOWN)
    assert np.abs(found.deviations).max() < 1.0
    # without classes they differ by 1.9 at a spread that the soft ones widen to 1.3
    assert np.abs(peak_deviations("pgv", peaks, UNKNOWN).deviations[soft]).min() > 1.2


def test_stations_without_place_or_motion_are_left_out():
    peaks = network()
    peaks.longitude[0], peaks.pga[1], peaks.pga[2] = np.nan, 0.0, np.nan
    found = peak_deviations("pga", peaks, SOURCE)
    assert not found.deviations[:3].any()
    assert np.isnan(found.expected[:3]).all()
    assert np.isfinite(found.expected[3:]).all()
    assert peak_deviations("pga", network(0), SOURCE).deviations.size == 0


@pytest.mark.parametrize(
    ("factor", "unit"),
    [
        (9.81**4, ""),
        (11.0, "m/s2 taken for g"),
        (100.0, "cm/s2 taken for m/s2"),
        (981.0, "cm/s2 taken for g"),
        (1 / 9.81, "g taken for m/s2"),
        (0.01, "m/s2 taken for cm/s2"),
        (1 / 981.0, "g taken for cm/s2"),
    ],
)
def test_a_wrong_unit_is_named(factor, unit):
    peaks = times(network(spread=0.1), 4, factor)
    found = peak_deviations("pga", peaks, SOURCE)
    text = peak_sentence("pga", peaks.pga[4], found, 4, SOURCE)
    assert text.startswith(f"peak ground acceleration {peaks.pga[4]:.3g} m/s2, expected ")
    assert "median of 8 neighbours within" in text
    assert text.endswith(f"deviations, as by a wrong unit ({unit})" if unit else "deviations")
