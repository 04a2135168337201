"""Motion at a site against that of the record: equal at the station, less known away from it."""

import pickle

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose
from screening_samples import make_station

from per_obspy.config import Interpolation
from per_obspy.screening.motion_field import great_circle, spatial_correlation
from per_obspy.screening.site_motion import (
    Hypocentre,
    hypocentre_of,
    motion_at_pairs,
    prepared_field,
)

SETTINGS = Interpolation()


@pytest.fixture(scope="module")
def stations():
    """Three stations every 20 km along a meridian, the middle one with 3 x the motion."""
    return [
        make_station("ONE", latitude=10.0, seed=4),
        make_station("TWO", scale=3.0, latitude=10.18, seed=4),
        make_station("SIX", latitude=10.36, seed=6),
    ]


def _pairs(longitude, latitude, period_1=1.0, period_2=0.6, **columns):
    longitude, latitude, period_1, period_2 = np.broadcast_arrays(
        longitude, latitude, period_1, period_2
    )
    places = {"longitude": longitude.ravel(), "latitude": latitude.ravel()}
    return pd.DataFrame(
        {**places, "period_1": period_1.ravel(), "period_2": period_2.ravel(), **columns}
    )


def test_the_hypocentre_is_that_on_which_stations_agree():
    one = {"hypocentre_longitude": 20.0, "hypocentre_latitude": 10.0, "hypocentre_depth": 8e3}
    assert hypocentre_of([{}, one, {}, one]) == Hypocentre(20.0, 10.0, 8e3)
    # unknown, or of two earthquakes: no distance can be measured
    assert hypocentre_of([{}]) is None
    assert hypocentre_of([one, {**one, "hypocentre_latitude": 11.0}]) is None


def test_agencies_that_place_an_earthquake_a_little_apart_know_one_earthquake():
    # headers of three networks; the order of stations does not matter
    places = [(20.0, 10.0, 8e3), (20.05, 10.1, 12e3), (20.02, 10.02, 30e3)]
    known = [
        dict(
            zip(
                ("hypocentre_longitude", "hypocentre_latitude", "hypocentre_depth"),
                place,
                strict=True,
            )
        )
        for place in places
    ]
    middle = Hypocentre(20.02, 10.02, 12e3)
    assert hypocentre_of(known) == hypocentre_of(known[::-1]) == middle


def test_at_a_station_its_record_is_the_motion(stations):
    prepared = prepared_field(stations, SETTINGS)
    periods = np.geomspace(0.06, 8.9, 40)
    for index, latitude in enumerate((10.0, 10.18, 10.36)):
        columns = motion_at_pairs(prepared, _pairs(20.0, latitude, periods, periods[::-1]), index)
        for i in (1, 2):
            # a system of three equations, then the root of a difference of ones
            assert_allclose(columns[f"ln_per_ratio_{i}"], 0.0, atol=1e-12)
            assert_allclose(columns[f"ln_per_std_{i}"], 0.0, atol=1e-7)
        assert not columns["motion_from_other_site_class"].any()


def test_the_ratio_is_to_the_record_that_is_given(stations):
    # the same ground motion times 3 at the second station: seen from the first the ratio there is
    # ln 3, and back -ln 3
    prepared = prepared_field(stations[:2], SETTINGS)
    there = motion_at_pairs(prepared, _pairs(20.0, 10.18), 0)
    back = motion_at_pairs(prepared, _pairs(20.0, 10.0), 1)
    # PER is stored in float32
    assert_allclose([there["ln_per_ratio_1"], there["ln_per_ratio_2"]], np.log(3.0), rtol=1e-6)
    assert_allclose(back["ln_per_ratio_1"], -there["ln_per_ratio_1"], rtol=1e-6)
    assert_allclose(there["ln_per_std_1"], 0.0, atol=1e-7)


def test_the_deviation_grows_with_the_distance_and_every_period_has_its_own(stations):
    latitude = 10.0 - np.array([0.0, 0.001, 0.01, 0.03, 0.1, 0.3, 1.0])
    columns = motion_at_pairs(
        prepared_field(stations, SETTINGS), _pairs(20.0, latitude, 0.3, 3.0), 0
    )
    for i in (1, 2):
        assert (np.diff(columns[f"ln_per_std_{i}"]) > 0).all()
    # long periods agree over longer distances (Jayaram & Baker 2009)
    assert (columns["ln_per_std_2"][1:4] < columns["ln_per_std_1"][1:4]).all()


def test_one_station_has_no_slope_and_the_assumed_deviation(stations):
    # two places whose motion is uncorrelated differ by twice the variance, 0.6 sqrt(2) far away,
    # times sqrt(5 / 3) of Student's distribution of five degrees of freedom
    places = _pairs(20.0, [10.0, 10.1, 80.0])
    columns = motion_at_pairs(prepared_field(stations[:1], SETTINGS), places, 0)
    assert_allclose(columns["ln_per_ratio_1"], 0.0, atol=1e-12)
    near = float(spatial_correlation(great_circle(20.0, 10.0, 20.0, 10.1), 1.0))
    expected = 0.6 * np.sqrt(5.0 / 3.0 * np.array([0.0, 2.0 * (1.0 - near), 2.0]))
    assert_allclose(columns["ln_per_std_1"], expected, rtol=1e-9, atol=1e-7)


def _on(station, site_class):
    return station.assign_coords(site_class=site_class)


@pytest.fixture
def lakebed(stations):
    """The three stations on rock, lakebed and rock; four places near the lakebed's."""
    classes = ("rock", "lakebed", "rock")
    named = [_on(station, name) for station, name in zip(stations, classes, strict=True)]
    places = _pairs([20.0] * 4, [10.18] * 4, site_class=["rock", "lakebed", "hill", ""])
    return named, places


def test_motion_crosses_site_classes_as_a_fallback_only(lakebed):
    named, places = lakebed
    columns = motion_at_pairs(prepared_field(named, SETTINGS), places, 1)
    assert columns["motion_from_other_site_class"].tolist() == [False, False, True, True]
    assert_allclose([columns["ln_per_ratio_1"][1], columns["ln_per_std_1"][1]], 0.0, atol=1e-7)
    # the order of stations does not matter
    turned = motion_at_pairs(prepared_field([named[1], *named[::2]], SETTINGS), places, 0)
    assert_allclose(turned["ln_per_ratio_1"], columns["ln_per_ratio_1"], rtol=1e-12)


def test_a_pair_on_rock_next_to_the_lakebed_moves_as_the_rock_does(lakebed):
    named, places = lakebed
    columns = motion_at_pairs(prepared_field(named, SETTINGS), places, 1)
    rock = motion_at_pairs(prepared_field(named[::2], SETTINGS), places.iloc[:1], 0)
    assert_allclose(columns["ln_per_std_1"][0], rock["ln_per_std_1"][0], rtol=1e-12)
    # the rock estimate, seen from the lakebed's record, which is three times that of the first rock
    # station
    expected = rock["ln_per_ratio_1"][0] - np.log(3.0)
    assert_allclose(columns["ln_per_ratio_1"][0], expected, rtol=1e-6)
    assert columns["ln_per_std_1"][0] > 0.2


def test_louder_earthquakes_change_no_ratio(stations):
    # all records times 5: would catch a ratio to something else than a record
    louder = [station.assign(per_rotd50=station["per_rotd50"] * 5.0) for station in stations]
    places = _pairs(20.05, [9.9, 10.1, 10.2, 10.5])
    once, five = (
        motion_at_pairs(prepared_field(some, SETTINGS), places, 2) for some in (stations, louder)
    )
    for name in ("ln_per_ratio_1", "ln_per_ratio_2", "ln_per_std_1"):
        # PER is stored in float32
        assert_allclose(five[name], once[name], atol=1e-6)


def test_periods_that_no_record_supports_have_no_motion(stations):
    # usable from 0.05 to 9 s; would catch a record that is trusted beyond
    columns = motion_at_pairs(prepared_field(stations, SETTINGS), _pairs(20.1, 10.1, 8.99, 9.01), 0)
    assert np.isfinite([columns["ln_per_ratio_1"], columns["ln_per_std_1"]]).all()
    assert np.isnan([columns["ln_per_ratio_2"], columns["ln_per_std_2"]]).all()


def test_a_record_that_does_not_support_the_period_is_corrected_by_its_neighbours(stations):
    # the first record ends at 3 s; at 4 s its stored value is compared with the others' estimate of
    # the place
    short = [make_station("ONE", latitude=10.0, longest=3.0, seed=4), *stations[1:]]
    columns = motion_at_pairs(prepared_field(short, SETTINGS), _pairs(20.0, 10.0, 4.0, 2.0), 0)
    alone = motion_at_pairs(prepared_field(stations[1:], SETTINGS), _pairs(20.0, 10.0, 4.0, 2.0), 0)
    assert_allclose(columns["ln_per_std_1"], alone["ln_per_std_1"], rtol=1e-12)
    assert_allclose(columns["ln_per_std_2"], 0.0, atol=1e-7)


def test_one_horizontal_and_a_station_without_motion(stations):
    still = stations[1].assign(per_rotd50=stations[1]["per_rotd50"] * 0.0)
    single = make_station("UNO", channels=("HNN",), latitude=10.0)
    prepared = prepared_field([single, still, stations[2]], SETTINGS)
    columns = motion_at_pairs(prepared, _pairs(20.0, [10.0, 10.18]), [0, 1])
    assert_allclose(columns["ln_per_ratio_1"][0], 0.0, atol=1e-12)
    assert np.isnan(columns["ln_per_ratio_1"][1])  # the ratio to a record without motion
    assert np.isfinite(columns["ln_per_std_1"]).all()


def _attenuated(source, latitudes, slope):
    """Return stations along a meridian whose PER is a power of the distance, and the distances."""
    plain = make_station("ONE")
    radii = plain["per_rotd50"].astype(np.float64)
    distance = _from(source, latitudes)
    stations = [
        plain.assign(per_rotd50=radii * (far / 1e5) ** slope).assign_coords(latitude=latitude)
        for latitude, far in zip(latitudes, distance, strict=True)
    ]
    return stations, distance


def _from(source, latitudes):
    """Return distances from a hypocentre at 20 degrees east, m."""
    along = great_circle(20.0, source.latitude, 20.0, np.asarray(latitudes))
    return np.hypot(along, source.depth)


def test_the_source_decides_the_attenuation():
    # eight stations on a line with the attenuation of the prior from a hypocentre 20 km deep:
    # continued beyond them, and exact between them
    source = Hypocentre(20.0, 9.0, 20_000.0)
    stations, distance = _attenuated(source, np.linspace(10.0, 11.0, 8), SETTINGS.distance_slope)
    beyond = np.array([9.5, 10.5, 12.0])
    expected = SETTINGS.distance_slope * np.log(_from(source, beyond) / distance[3])
    columns = motion_at_pairs(prepared_field(stations, SETTINGS, source), _pairs(20.0, beyond), 3)
    assert_allclose(columns["ln_per_ratio_1"], expected, atol=1e-9)
    without = motion_at_pairs(prepared_field(stations, SETTINGS), _pairs(20.0, beyond), 3)
    assert abs(without["ln_per_ratio_1"][2] - expected[2]) > 0.1


def test_stations_correct_the_expected_attenuation():
    # motion decays as 1/R: the more stations, at places that are unlike, the nearer to that
    source, far = Hypocentre(20.0, 9.0, 20_000.0), [14.0]
    errors = []
    for count in (2, 8, 40):
        stations, distance = _attenuated(source, np.linspace(9.5, 13.0, count), -1.0)
        field = prepared_field(stations, SETTINGS, source)
        found = motion_at_pairs(field, _pairs(20.0, far), 0)["ln_per_ratio_1"]
        errors.append(abs(found + np.log(_from(source, far) / distance[0])).item())
    assert errors[0] > errors[1] > errors[2]


def test_a_single_station_attenuates_as_expected_with_the_doubt_of_its_slope():
    # far from each other nothing correlates: variances of both places and of the slope
    source, places = Hypocentre(20.0, 9.0, 20_000.0), [60.0]
    stations, distance = _attenuated(source, np.array([10.0]), -1.0)
    columns = motion_at_pairs(prepared_field(stations, SETTINGS, source), _pairs(20.0, places), 0)
    away = np.log(_from(source, places) / distance[0])
    assert_allclose(columns["ln_per_ratio_1"], -1.3 * away, rtol=1e-9)
    # Student's factor of five degrees of freedom: a prior slope costs none
    expected = np.sqrt(5.0 / 3.0 * (2.0 * 0.6**2 + (0.5 * away) ** 2))
    assert_allclose(columns["ln_per_std_1"], expected, rtol=1e-9)


def test_numbers_depend_neither_on_the_block_nor_on_the_process(stations):
    # to the bit, in any order and stride; a field that was sent to another process is the same
    # field
    classes = ("rock", "rock", "hill")
    named = [_on(station, name) for station, name in zip(stations, classes, strict=True)]
    prepared = prepared_field(named, SETTINGS, Hypocentre(19.0, 10.0, 1e4))
    sent = pickle.loads(pickle.dumps(prepared))
    places, index = _random_pairs(101)
    whole = motion_at_pairs(prepared, places, index)
    for rows in (slice(0, 1), slice(1, 64), slice(100, None, -1)):
        part = motion_at_pairs(sent, places.iloc[rows], index[rows])
        for name, column in part.items():
            assert np.array_equal(column, whole[name][rows])


def _random_pairs(count):
    """Return pairs around the stations, of any period and ground, and the index of a station."""
    random = np.random.default_rng(3)
    longitude, latitude = random.uniform(19.9, 20.1, count), random.uniform(9.9, 10.5, count)
    period_1, period_2 = random.uniform(0.06, 8.0, (2, count))
    # on the classes of the stations, and of unknown class
    site_class = random.choice(["rock", "hill", ""], count)
    vs30 = random.uniform(200, 800, count)
    places = _pairs(longitude, latitude, period_1, period_2, site_class=site_class, vs30=vs30)
    return places, random.integers(0, 3, count)


def test_wrong_arguments_are_named(stations):
    with pytest.raises(ValueError, match="stations must be one at least"):
        prepared_field([], SETTINGS)
    unlocated = stations[0].assign_coords(latitude=np.nan)
    with pytest.raises(ValueError, match="latitude must be finite, got nan"):
        prepared_field([unlocated], SETTINGS)
    with pytest.raises(ValueError, match="station must be between 0 and 2, got 3"):
        motion_at_pairs(prepared_field(stations, SETTINGS), _pairs(20.0, 10.0), 3)
