"""Station of each row, and chunks of whole rows."""

import numpy as np
import pandas as pd
import pytest

from per_obspy.inventory.building_rows.chains import Chains
from per_obspy.screening.building_rows.placed import ChunkNumbers, placed_rows


def chains(sizes, azimuth=None):
    """Return rows of so many contacts, in the order of the pairs."""
    first = np.concatenate([[0], np.cumsum(sizes)])
    axes = np.full(len(sizes), 10.0) if azimuth is None else np.array(azimuth)
    return Chains(np.arange(first[-1]), np.zeros(first[-1], dtype=bool), first, axes, {})


def pairs(stations, distance=1.0, azimuth_used=10.0):
    return pd.DataFrame({"station": stations, "distance": distance, "azimuth_used": azimuth_used})


def test_the_station_of_most_pairs_serves_the_row():
    found = placed_rows(chains([3, 1]), pairs(["B", "A", "B", "A"]))
    assert found.contacts["station"].tolist() == ["A", "B", "B", "B"]
    # rows in the order of their stations
    assert found.order.tolist() == [1, 0]
    assert found.several_stations.tolist() == [False, True]


@pytest.mark.parametrize(("distance", "expected"), [([1.0, 2.0], "B"), ([2.0, 1.0], "A")])
def test_of_equally_many_the_nearer_serves(distance, expected):
    found = placed_rows(chains([2]), pairs(["B", "A"], distance))
    assert found.contacts["station"].tolist() == [expected] * 2


def test_pairs_of_a_map_have_no_station():
    found = placed_rows(chains([2, 1]), pairs(["", "", "A"], [np.nan, np.nan, 1.0]))
    assert found.contacts["station"].tolist() == ["", "", "A"]


def test_contacts_are_numbered_within_their_rows():
    found = placed_rows(chains([2, 3]), pairs(["A"] * 5))
    assert found.contacts["row"].tolist() == [0, 0, 1, 1, 1]
    assert found.contacts["interface"].tolist() == [1, 2, 1, 2, 3]
    assert found.contacts["buildings"].tolist() == [3] * 2 + [4] * 3


@pytest.mark.parametrize("cut", [1, 3])
def test_chunks_hold_whole_rows_of_one_station(cut):
    sizes, stations, numbers = [2, 2, 3, 2], ["A", "A", "A", "B"], ChunkNumbers(4)
    # however the rows arrive
    found = [*numbers.add(sizes[:cut], stations[:cut]), *numbers.add(sizes[cut:], stations[cut:])]
    assert found == [0, 0, 1, 2]


def test_a_row_longer_than_a_chunk_is_a_chunk():
    assert ChunkNumbers(4).add([1, 9, 1], ["A"] * 3).tolist() == [0, 1, 2]


def test_the_worst_axis_takes_the_place_of_an_unknown_one():
    found = placed_rows(chains([1, 2], [np.nan, 10.0]), pairs(["A"] * 3, 1.0, 200.0))
    assert found.contacts["azimuth"].tolist() == [200.0, 10.0, 10.0]
