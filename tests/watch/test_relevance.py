"""Earthquakes that matter: magnitude by distance, never too far, anywhere on the Earth."""

import numpy as np
import pytest
from obspy.geodetics import locations2degrees

from per_obspy.config import Pairs, Reach, Records, Run, Watch
from per_obspy.constants import EARTH_RADIUS, METRES_PER_DEGREE
from per_obspy.errors import CatalogError
from per_obspy.watch.relevance import (
    CELL,
    PLACES,
    Places,
    circle_around,
    distances,
    inventory_places,
    matters,
)

HEADER = "pair_id,gap,longitude_1,latitude_1,height_1,longitude_2,latitude_2,height_2\n"


def settings(folder, **watch) -> Run:
    section = Watch(service="USGS", **watch)
    pairs = Pairs(file=folder / "pairs.csv")
    return Run(name="x", output=folder, records=Records(folder=folder), pairs=pairs, watch=section)


def write_table(folder, places):
    rows = [f"P{number},0.05,{x},{y},12,{x},{y},15\n" for number, (x, y) in enumerate(places)]
    (folder / "pairs.csv").write_text(HEADER + "".join(rows))


@pytest.mark.parametrize("centre", [(0.0, 0.0), (179.99, 10.0), (-60.0, 89.9), (120.0, -45.0)])
def test_distances_are_those_of_the_sphere(centre):
    # ObsPy's great circles are an implementation of their own
    places = Places(np.array([centre[0]]), np.array([centre[1]]), 0.0)
    random = np.random.default_rng(1)
    longitude, latitude = random.uniform(-180, 180, 50), random.uniform(-90, 90, 50)
    degrees = locations2degrees(latitude, longitude, centre[1], centre[0])
    expected = np.deg2rad(degrees) * EARTH_RADIUS
    # 1 m: both lose digits where places are nearly opposite
    np.testing.assert_allclose(distances(places, longitude, latitude), expected, atol=1.0)


def test_no_pair_is_nearer_than_the_distance(tmp_path):
    random = np.random.default_rng(2)
    pairs = np.column_stack([random.uniform(-90.6, -90.3, 40), random.uniform(14.4, 14.8, 40)])
    write_table(tmp_path, pairs)
    places = inventory_places(settings(tmp_path), tmp_path)
    epicentre = (-91.0, 14.0)
    found = distances(places, np.array([epicentre[0]]), np.array([epicentre[1]]))[0]
    exact = locations2degrees(pairs[:, 1], pairs[:, 0], epicentre[1], epicentre[0]).min()
    exact *= METRES_PER_DEGREE
    # Cells make a distance too small by their diagonal at most
    assert exact - 1.5 * CELL * METRES_PER_DEGREE <= found <= exact


def test_every_earthquake_in_reach_is_in_the_circle_of_the_query():
    random = np.random.default_rng(3)
    places = Places(random.uniform(170, 190, 20), random.uniform(-20, 10, 20), 4000.0)
    circle = circle_around(places, 200_000.0)
    longitude, latitude = random.uniform(160, 200, 4000), random.uniform(-30, 20, 4000)
    near = distances(places, longitude, latitude) <= 200_000.0
    angle = locations2degrees(latitude, longitude, circle.latitude, circle.longitude)
    assert near.sum() > 100
    assert (angle[near] <= circle.radius).all()


def test_places_are_kept_until_the_table_changes(tmp_path):
    write_table(tmp_path, [(-90.5, 14.6)])
    first = inventory_places(settings(tmp_path), tmp_path)
    kept = (tmp_path / PLACES).stat().st_mtime_ns
    again = inventory_places(settings(tmp_path), tmp_path)
    assert (tmp_path / PLACES).stat().st_mtime_ns == kept
    np.testing.assert_array_equal(first.longitude, again.longitude)
    write_table(tmp_path, [(-90.5, 14.6), (-91.5, 14.6)])
    assert len(inventory_places(settings(tmp_path), tmp_path).longitude) == 2


def test_a_damaged_file_of_places_is_made_again(tmp_path):
    write_table(tmp_path, [(-90.5, 14.6)])
    (tmp_path / PLACES).write_text('{"key": 3')
    assert len(inventory_places(settings(tmp_path), tmp_path).longitude) == 1


def test_a_region_stands_for_the_inventory(tmp_path):
    region = {"latitude": 14.6, "longitude": -90.5, "radius": 50_000.0}
    places = inventory_places(settings(tmp_path, region=region), tmp_path)
    assert distances(places, np.array([-90.5]), np.array([14.6]))[0] == 0.0


def test_pairs_without_places_need_a_region(tmp_path):
    pairs = Pairs(simulated={"count": 5})
    run = settings(tmp_path).model_copy(update={"pairs": pairs})
    with pytest.raises(CatalogError, match=r"give watch\.region"):
        inventory_places(run, tmp_path)


def test_beyond_the_largest_distance_no_magnitude_matters():
    reaches = [Reach(distance=50e3, magnitude=5.0), Reach(distance=200e3, magnitude=6.5)]
    assert not matters(reaches, 201e3, 9.5)
    assert not matters(reaches, 0.0, 4.9)
    assert matters(reaches, 0.0, 9.5)
