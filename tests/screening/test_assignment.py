"""Assignment of stations to pairs: the nearest on a sphere, of the pair's own ground first."""

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose
from obspy.geodetics import gps2dist_azimuth
from screening_samples import make_station

from per_obspy.constants import EARTH_RADIUS
from per_obspy.screening.assignment import (
    Stations,
    assigned,
    nearest_station,
    stations_of,
)


def test_distances_agree_with_the_ellipsoid():
    random = np.random.default_rng(2)
    longitude, latitude = random.uniform(-180, 180, 50), random.uniform(-85, 85, 50)
    _, distance = nearest_station(longitude, latitude, np.array([12.0]), np.array([42.0]))
    geodesic = [
        gps2dist_azimuth(42.0, 12.0, y, x)[0] for x, y in zip(longitude, latitude, strict=True)
    ]
    assert_allclose(
        distance, geodesic, rtol=6e-3
    )  # a sphere is within 0.6 % of the WGS 84 ellipsoid


def test_the_nearest_is_found_across_the_date_line():
    # would catch: distances in degrees, where 179.9 and -179.9 are 359.8 apart
    station, distance = nearest_station(
        np.array([179.9]), np.array([0.0]), np.array([170.0, -179.9]), np.zeros(2)
    )
    assert station.tolist() == [1]
    assert_allclose(distance, EARTH_RADIUS * np.radians(0.2), rtol=1e-9)  # round-off of the chord


def test_a_place_at_a_station_is_at_no_distance():
    station, distance = nearest_station(
        np.array([5.0]), np.array([50.0]), np.array([4.0, 5.0]), np.array([50.0, 50.0])
    )
    assert station.tolist() == [1]
    assert distance[0] < 1e-6  # m


def test_stations_without_coordinates_serve_no_pair():
    # would catch a row of longitudes that is shifted against the names
    first = make_station("ONE", latitude=10.0)
    second = make_station("TWO", latitude=11.0).assign_coords(site_class="rock")
    unlocated = make_station("LOST", latitude=np.nan)
    stations, rejected = stations_of([first, unlocated, second])
    assert stations.names.tolist() == ["XX.ONE", "XX.TWO"]
    assert stations.latitude.tolist() == [10.0, 11.0]
    assert stations.site_class.tolist() == ["", "rock"]
    assert stations.read(1) is second
    assert [(rejection.kind, rejection.name) for rejection in rejected] == [("station", "XX.LOST")]


def test_without_any_station_every_pair_is_rejected():
    none, _ = stations_of([])
    names, _, rejected = _assigned(["rock", ""], none)
    assert names == []
    assert [rejection.name for rejection in rejected] == ["p0", "p1"]
    assert rejected[0].reasons == ("no station has coordinates",)


def _stations(*classes):
    return Stations(
        np.array(["NEAR", "FAR"], dtype=object),
        np.array([0.01, 0.05]),
        np.zeros(2),
        np.array(classes, dtype=object),
        *2 * (lambda _: pytest.fail("no record is needed"),),
    )


def _assigned(classes, stations, reach=20e3):
    pairs = pd.DataFrame(
        {"pair_id": [f"p{i}" for i in range(len(classes))], "longitude": 0.0, "latitude": 0.0}
    )
    table, rejected = assigned(
        pairs.assign(site_class=classes) if any(classes) else pairs, stations, reach
    )
    return table["station"].tolist(), table["other_site_class"].tolist(), rejected


def test_a_pair_is_given_the_nearest_station_of_its_own_ground():
    # would catch a rock site that is shaken like the lakebed because a lakebed station is nearer
    names, other, _ = _assigned(["rock", "lakebed", "", "clay"], _stations("lakebed", "rock"))
    assert names == ["FAR", "NEAR", "NEAR", "NEAR"]
    assert other == [False, False, False, True]


def test_unknown_ground_keeps_the_nearest_station():
    assert _assigned(["rock"], _stations("", ""))[:2] == (["NEAR"], [False])
    assert _assigned([""], _stations("lakebed", "rock"))[:2] == (["NEAR"], [False])


def test_own_ground_out_of_reach_falls_back_on_the_nearest_station():
    assert _assigned(["rock"], _stations("lakebed", "rock"), reach=3e3)[:2] == (["NEAR"], [True])
    names, _, rejected = _assigned(["rock"], _stations("lakebed", "rock"), reach=1e3)
    assert names == []
    assert "nearest station NEAR is 1112 m away" in rejected[0].reasons[0]


def test_coordinates_that_would_reach_a_station_if_exchanged_are_suspected():
    # three pairs out of reach: swapped, far anyway, and with a longitude that can be no latitude
    pairs = pd.DataFrame(
        {
            "pair_id": ["s", "f", "w"],
            "longitude": [45.07, 7.0, 145.0],
            "latitude": [7.68, 10.0, 7.68],
        }
    )
    turin = Stations(
        np.array(["NEAR"], dtype=object),
        np.array([7.68]),
        np.array([45.08]),
        np.array([""], dtype=object),
        *2 * (lambda _: None,),
    )
    table, rejected = assigned(pairs, turin, 20e3)
    assert table.empty
    swapped, far, wide = (rejection.reasons[0] for rejection in rejected)
    hint = (
        "with longitude = 45.07 and latitude = 7.68 exchanged, NEAR would be 1112 m away: "
        "are they swapped?"
    )
    assert swapped.endswith(f"beyond 20000 m; {hint}")
    assert far.endswith("beyond 20000 m")
    assert wide.endswith("beyond 20000 m")


def test_pairs_that_would_reach_a_station_with_another_sign_are_suspected():
    # a whole table without the sign of its longitudes is seen by its stations only
    places = {"longitude": [67.95, -67.95, 67.95, 10.0], "latitude": [-20.3, 20.3, 20.3, 10.0]}
    pairs = pd.DataFrame({"pair_id": list("abcd"), **places})
    uyuni = Stations(
        np.array(["NEAR"], dtype=object),
        np.array([-67.95]),
        np.array([-20.31]),
        np.array([""], dtype=object),
        *2 * (lambda _: None,),
    )
    _, rejected = assigned(pairs, uyuni, 20e3)
    reasons = [rejection.reasons[0].partition("; ")[2] for rejection in rejected]
    assert reasons == [
        "with longitude = 67.95 of the other sign, NEAR would be 1112 m away: "
        "has a sign been lost?",
        "with latitude = 20.3 of the other sign, NEAR would be 1112 m away: has a sign been lost?",
        "with longitude = 67.95 and latitude = 20.3 of the other signs, NEAR would be 1112 m away: "
        "has a sign been lost?",
        "",
    ]
