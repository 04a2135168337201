"""Outlines from the table of buildings that footprints write with their pairs."""

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from per_obspy.report.page.map_lines import MOST_RING_CORNERS, read_outlines

shapely = pytest.importorskip("shapely")


def write(path, shapes):
    """Write buildings named 1, 2, ... with these shapes."""
    table = {"building_id": [str(i + 1) for i in range(len(shapes))], "geometry": shapes}
    pq.write_table(pa.table(table), path)
    return path


def test_wanted_buildings_have_their_corners(tmp_path):
    square = shapely.to_wkb(shapely.box(13.0, 43.0, 13.001, 43.002))
    file = write(tmp_path / "b.parquet", [square, square])
    ((name, corners),) = read_outlines(file, ["2", "9"])
    assert name == "2"
    assert set(zip(corners[::2], corners[1::2], strict=True)) == {
        (13.0, 43.0), (13.0, 43.002), (13.001, 43.002), (13.001, 43.0)
    }  # fmt: skip


def test_of_several_parts_the_largest_is_drawn(tmp_path):
    parts = [shapely.box(0, 0, 1, 1), shapely.box(5, 5, 8, 8)]
    file = write(tmp_path / "b.parquet", [shapely.to_wkb(shapely.MultiPolygon(parts))])
    ((_, corners),) = read_outlines(file, ["1"])
    assert min(corners) == 5.0


def test_an_outline_of_many_corners_is_simplified(tmp_path):
    circle = shapely.Point(13.0, 43.0).buffer(0.001, quad_segs=500)
    file = write(tmp_path / "b.parquet", [shapely.to_wkb(circle)])
    ((_, corners),) = read_outlines(file, ["1"])
    assert 8 < len(corners) // 2 <= MOST_RING_CORNERS


@pytest.mark.parametrize("shape", [None, b"", b"not a shape", shapely.to_wkb(shapely.Polygon())])
def test_a_shape_that_is_none_is_left_out(tmp_path, shape):
    assert read_outlines(write(tmp_path / "b.parquet", [shape]), ["1"]) == []


def test_without_the_table_or_its_columns_there_are_no_outlines(tmp_path):
    assert read_outlines(tmp_path / "absent.parquet", ["1"]) == []
    pq.write_table(pa.table({"x": [1]}), tmp_path / "other.parquet")
    assert read_outlines(tmp_path / "other.parquet", ["1"]) == []
