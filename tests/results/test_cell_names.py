"""Names of cells: their corner, one cell for pairs without a place, numbers only."""

import numpy as np
import pytest

from per_obspy.results.ranked_cells import NO_PLACE, cell_names

#: Places on edges of cells, around zero, and at the ends of the coordinates.
PLACES = [(0.0, 0.0), (-1e-9, 0.0), (179.99, 89.99), (-180.0, -90.0), (12.3, -45.6)]


@pytest.mark.parametrize("size", [0.1, 0.7, 10.0])
def test_a_cell_holds_its_places_and_no_two_cells_share_a_name(size):
    # would catch two cells in one file, and -0 as another cell than 0
    east, north = np.meshgrid(np.arange(-180, 180.1, 7.3), np.arange(-90, 90.1, 3.7))
    names = cell_names(east.ravel(), north.ravel(), size)
    cells = np.floor(np.stack([east.ravel(), north.ravel()]) / size).T
    pairs = {(*map(float, cell), name) for cell, name in zip(cells.tolist(), names, strict=True)}
    assert len(pairs) == len({cell[:2] for cell in pairs}) == len({cell[2] for cell in pairs})
    for name, longitude in zip(names, east.ravel(), strict=True):
        corner = float(name.split("_lon")[1])
        # names have six digits: corners differ from the exact ones by 0.0005 at most
        assert corner - 5e-4 <= longitude <= corner + size + 5e-4


def test_places_on_edges_belong_to_one_cell():
    names = cell_names(*np.array(PLACES).T, 1.0).tolist()
    assert names == ["lat0_lon0", "lat0_lon-1", "lat89_lon179", "lat-90_lon-180", "lat-46_lon12"]


def test_pairs_without_a_place_have_a_cell_of_their_own():
    east, north = np.array([np.nan, 1.0, np.inf, 1.0]), np.array([1.0, np.nan, 1.0, 1.0])
    assert cell_names(east, north, 1.0).tolist() == [NO_PLACE] * 3 + ["lat1_lon1"]
    assert cell_names(np.array([]), np.array([]), 1.0).tolist() == []
