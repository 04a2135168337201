"""Lines behind the map, of archives and layers that are made here."""

import numpy as np
import pytest

from per_obspy.errors import CatalogError
from per_obspy.report.page import background
from per_obspy.report.page.background import UNIT, read_background, require_background

pytest.importorskip("pyogrio")
import pyproj
import shapely
from pyogrio.raw import write

from per_obspy.inventory.footprints import layers

#: A street to the north-east, and a park of 300 m around a place, which lies across edges of tiles.
PLACE = np.array([-90.513, 14.647])
STREET = PLACE + np.linspace(-0.01, 0.01, 50)[:, None] * [1.0, 1.0]
RADIUS = 0.003
PLACES = PLACE[:1], PLACE[1:]
DRIVERS = {".gpkg": "GPKG", ".mbtiles": "MBTiles", ".pmtiles": "PMTiles"}

#: Half a step of a tile of level 14 across, and of the page, degrees: 0.6 m and 1 m.
STEP = 360.0 / 2**14 / 4096 + UNIT


def layer(path, shapes, name="roads", kind="LineString"):
    """Write shapes (degrees) as a layer of a new file."""
    levels = {}
    if path.suffix != ".gpkg":
        projection = pyproj.Transformer.from_crs("OGC:CRS84", "EPSG:3857", always_xy=True)
        shapes = shapely.transform(shapes, lambda xy: np.c_[projection.transform(*xy.T)])
        levels = {"MINZOOM": "0", "MAXZOOM": "14"}
    # GDAL writes no file of such a name as some have here
    plain = path.with_stem("plain")
    write(
        plain,
        shapely.to_wkb(np.array(shapes, dtype=object)),
        [np.arange(len(shapes))],
        np.array(["number"]),
        layer=name,
        driver=DRIVERS[path.suffix],
        geometry_type=kind,
        crs="EPSG:3857" if levels else "EPSG:4326",
        **levels,
    )
    return plain.rename(path)


def corners(found):
    """Return the corners of all lines, degrees."""
    steps = [np.reshape(line, (-1, 2)) for line in found.lines]
    return UNIT * np.concatenate([np.cumsum(line, axis=0) for line in steps])


@pytest.mark.parametrize("suffix", DRIVERS)
def test_streets_are_at_their_places(tmp_path, suffix):
    path = layer(tmp_path / f"a!b{suffix}", [shapely.LineString(STREET)])
    require_background(path)
    found = corners(read_background(path, (), *PLACES))
    # On the street, and from one end to the other
    east, north = (found - PLACE).T
    assert np.abs(east - north).max() < 2.0 * STEP
    assert [east.min(), east.max()] == pytest.approx([-0.01, 0.01], abs=STEP)


@pytest.mark.parametrize("suffix", DRIVERS)
def test_outlines_have_no_edges_of_tiles(tmp_path, suffix):
    park = shapely.Point(PLACE).buffer(RADIUS, quad_segs=32)
    path = layer(tmp_path / f"parks{suffix}", [park], "parks", "Polygon")
    found = corners(read_background(path, ("parks",), *PLACES))
    assert len(found) > 50
    # A chord of 128 lies within 0.0003 of the radius
    assert np.hypot(*(found - PLACE).T) == pytest.approx(RADIUS, rel=0.001, abs=2.0 * STEP)


def test_many_lines_are_simplified_until_they_fit(tmp_path, monkeypatch):
    wave = STREET + np.linspace(0.0, 1e-4, 50)[:, None] * np.sin(np.arange(50))[:, None]
    path = layer(
        tmp_path / "roads.gpkg",
        [shapely.LineString(np.add(wave, [0.0, 1e-4 * i])) for i in range(20)],
    )
    monkeypatch.setattr(background, "MOST_CORNERS", 100)
    found = corners(read_background(path, (), *PLACES))
    assert 40 <= len(found) <= 100
    # From end to end
    assert np.ptp(found[:, 0]) > 0.019


@pytest.mark.parametrize("suffix", DRIVERS)
def test_lines_across_the_date_line_are_whole(tmp_path, suffix):
    sides = [shapely.LineString([[x, -16.8], [x + 0.01, -16.8]]) for x in (179.99, -180.0)]
    path = layer(tmp_path / f"roads{suffix}", sides)
    found = corners(read_background(path, (), np.array([179.99, 180.01]), np.array([-16.8, -16.8])))
    ends = [found[:, 0].min(), found[:, 0].max()]
    assert ends == pytest.approx([179.99, 180.01], abs=STEP)


def test_of_a_layer_only_the_surroundings_are_read(tmp_path, monkeypatch):
    """A layer of a country would not fit into memory."""
    read = []
    streets = [shapely.LineString(np.add(STREET, [x, 0.0])) for x in (-36.0, 0.0, 1.0)]
    path = layer(tmp_path / "roads.gpkg", streets)
    polygons = layers.polygons
    monkeypatch.setattr(layers, "polygons", lambda wkb: read.append(len(wkb)) or polygons(wkb))
    found = corners(read_background(path, (), *PLACES))
    assert read == [1]
    assert np.abs(found - PLACE).max() < 0.011


@pytest.mark.parametrize(
    ("name", "content", "fault"),
    [
        ("a.pmtiles", b"hello", "begins with 'hello'"),
        ("a.mbtiles", b"", "empty"),
        ("a.pmtiles", b"PMTiles\x03" + 92 * b"\xff", "cut short"),
        ("a.txt", b"hello", r"unknown suffix '.txt', expected .*\.pmtiles"),
    ],
)
def test_wrong_files_are_found_before_the_work(tmp_path, name, content, fault):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(CatalogError, match=fault):
        require_background(tmp_path / name)
    with pytest.raises(CatalogError, match="no such file"):
        require_background(tmp_path / f"no{name}")


def test_damaged_and_distant_archives_end_in_one_line(tmp_path):
    whole = layer(tmp_path / "roads.pmtiles", [shapely.LineString(STREET)])
    with pytest.raises(CatalogError, match="no line or outline near the pairs"):
        read_background(whole, (), np.array([10.0]), np.array([50.0]))
    with pytest.raises(CatalogError, match=r"no layer 'rivers'.*roads"):
        read_background(whole, ("rivers",), *PLACES)
    content, broken = whole.read_bytes(), tmp_path / "broken.pmtiles"
    # Its directories, then some tiles, without which the page would have streets with holes
    for kept in (200, len(content) - 60):
        broken.write_bytes(content[:kept] + bytes(len(content) - kept))
        with pytest.raises(CatalogError, match=r"broken\.pmtiles: cannot be read as [^\n]+$"):
            read_background(broken, (), *PLACES)
