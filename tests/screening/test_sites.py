"""Places with their ground: one value for all, and places that cannot be."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from per_obspy.screening.assignment import sites


def test_one_value_holds_for_all_places():
    places = sites([1.0, 2.0, 3.0], [4.0, 5.0, 6.0], "rock", 9e3)
    assert places.site_class.tolist() == ["rock"] * 3
    assert_array_equal(places.source_distance, [9e3] * 3)
    assert np.isnan(places.vs30).all()


def test_rows_keep_their_values_together():
    # would catch a column that is left behind
    places = sites(
        [1.0, 2.0, 3.0], [4.0, 5.0, 6.0], ["a", "b", ""], [7.0, 8.0, 9.0], [1.5, 2.5, 3.5]
    )
    for rows in (np.array([2, 0]), np.array([True, False, True])):
        chosen = places.at(rows)
        for whole, part in zip(places, chosen, strict=True):
            assert_array_equal(part, whole[rows])


def test_numbers_are_contiguous():
    # functions of NumPy may differ in the last bit between strides
    columns = np.arange(12.0).reshape(3, 4)
    places = sites(columns[:, 0], columns[:, 1], "", columns[:, 2], columns[:, 3])
    for name in ("longitude", "latitude", "source_distance", "vs30"):
        assert getattr(places, name).flags.c_contiguous


@pytest.mark.parametrize(
    ("place", "message"),
    [
        (([0.0], [95.0]), "latitude must be between -90 and 90, got 95"),
        (([200.0], [0.0]), "longitude must be between -180 and 180, got 200"),
        (([np.nan], [0.0]), "longitude must be finite, got nan"),
    ],
)
def test_places_off_the_earth_are_named(place, message):
    with pytest.raises(ValueError, match=message):
        sites(*place)
