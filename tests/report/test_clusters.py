"""Clusters of pairs: towns apart, and frames that contain their points."""

import numpy as np
import pytest

from per_obspy.report.overview import SMALLEST, clusters, frame_of


def test_towns_are_separate_and_in_the_order_of_their_worst_pair():
    random = np.random.default_rng(3)
    # two towns of a kilometre, 50 km apart, their pairs mixed
    town = np.tile([0, 1], 30)
    longitude = 10.0 + 0.5 * town + random.uniform(0.0, 0.01, 60)
    latitude = 45.0 + random.uniform(0.0, 0.01, 60)
    first, second = clusters(longitude, latitude, frame_of(longitude, latitude))
    assert first.tolist() == np.flatnonzero(town == 0).tolist()
    assert second.tolist() == np.flatnonzero(town == 1).tolist()


@pytest.mark.parametrize("places", [([10.0], [45.0]), ([10.0, 10.0], [45.0, 45.0])])
def test_pairs_of_one_place_are_one_cluster(places):
    east, north = map(np.array, places)
    (found,) = clusters(east, north, frame_of(east, north))
    assert found.size == east.size
    # a map of one place is a street, not a point
    assert frame_of(east, north).padded(0.05).size == pytest.approx(SMALLEST)


def test_a_frame_knows_its_size():
    # a degree of latitude is 111.2 km, of longitude half as much at 60 degrees
    assert frame_of([0.0, 0.0], [59.5, 60.5]).size == pytest.approx(111_195.0)
    assert frame_of([0.0, 4.0], [60.0, 60.0]).size == pytest.approx(222_390.0)
