"""Cells of H3 and their outlines: published indices, places inside, across the date line."""

import numpy as np
import pytest
import shapely

from per_obspy.screening.totals import box_outlines, grid_cells, hexagon_outlines, hexagons


def test_indices_are_the_published_ones():
    # examples of the documentation of H3: longitude and latitude exchanged would give others
    assert hexagons([-122.0553238], [37.3615593], 7).tolist() == ["87283472bffffff"]
    assert hexagons([-122.388903], [37.769377], 9).tolist() == ["89283082e73ffff"]


@pytest.mark.parametrize("resolution", [0, 5, 8, 15])
def test_places_lie_in_their_hexagon(resolution):
    random = np.random.default_rng(resolution)
    longitude, latitude = random.uniform(-180, 180, 50), random.uniform(-60, 60, 50)
    corners = hexagon_outlines(hexagons(longitude, latitude, resolution))
    for east, north, outline in zip(longitude, latitude, corners, strict=True):
        polygon = shapely.Polygon(outline)
        # edges are great circles, drawn as straight lines in degrees: a place may be outside by
        # their bulge, which is below 2 % of the width where cells are small and 15 % where they are
        # continents
        near = polygon.buffer((0.15 if resolution == 0 else 0.02) * np.sqrt(polygon.area))
        turns = (shapely.Point(east + turn, north) for turn in (-360.0, 0.0, 360.0))
        assert any(near.contains(point) for point in turns)


def test_a_hexagon_across_the_date_line_is_in_one_piece():
    # would catch a polygon around the whole earth
    (outline,) = hexagon_outlines(hexagons([180.0], [10.0], 3))
    assert np.ptp(outline[:, 0]) < 3.0
    assert outline[:, 0].min() < 180.0 < outline[:, 0].max()


def test_boxes_are_the_cells_of_the_grid():
    random = np.random.default_rng(8)
    longitude, latitude = random.uniform(-170, 170, 50), random.uniform(-80, 80, 50)
    cells = grid_cells(longitude, latitude, 50e3)
    # would catch corners in an order that crosses
    outlines = dict(zip(cells.boxes.index, box_outlines(cells.boxes), strict=True))
    for name, east, north in zip(cells.cell, longitude, latitude, strict=True):
        assert shapely.Polygon(outlines[name]).contains(shapely.Point(east, north))


def test_places_off_the_earth_are_named():
    with pytest.raises(ValueError, match=r"latitude must be between -90 and 90, got 95"):
        hexagons([0.0], [95.0], 8)
