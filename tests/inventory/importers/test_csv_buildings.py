"""
CSV of buildings: outlines as WKT, points, broken and hostile rows.

Covers per_obspy.inventory.importers.sources.google and
per_obspy.inventory.importers.sources.national_structures.
"""

import pandas as pd
import pytest
from building_samples import google, nsi, small_town

from per_obspy.errors import CatalogError
from per_obspy.inventory.footprints.footprint_pairs import pairs_from_footprints
from per_obspy.inventory.footprints.layer_files import read_raw_layer
from per_obspy.inventory.importers import csv_buildings
from per_obspy.inventory.importers.csv_buildings import read_csv_buildings, read_csv_points
from per_obspy.inventory.importers.recognition import imported


@pytest.mark.parametrize(
    ("cell", "reason"),
    [
        ("POLYGON ((20 10, 20.1 10", "not WKT"),
        ("POLYGON ((20 10, 20.1 10, 20 1e999, 20 10))", "not WKT|outside|invalid"),
        ("POINT (20 10)", "is a Point"),
        ("GEOMETRYCOLLECTION (" * 3000, "not WKT"),
        ("", "no geometry"),
        ("x" * ((1 << 20) + 1), "more than 1048576 characters"),
        ("POLYGON ((2000000 10, 2000010 10, 2000010 20, 2000000 10))", "outside"),
    ],
)
def test_a_broken_outline_loses_its_own_building(tmp_path, cell, reason):
    path = google(tmp_path, small_town())
    table = pd.read_csv(path)
    table.loc[3, "geometry"] = cell
    table.to_csv(path, index=False)
    pairs = pairs_from_footprints(path)
    assert len(pairs) == 2
    (rejected,) = pairs.attrs["rejected"]
    assert (rejected.row, rejected.kind) == (4, "building")
    assert any(word in rejected.reasons[0] for word in reason.split("|")), rejected


def test_rows_with_another_number_of_cells_come_last(tmp_path):
    path = google(tmp_path, small_town())
    lines = path.read_text().splitlines()
    path.write_text("\n".join([lines[0], "1,2,3", *lines[1:]]))
    pairs = pairs_from_footprints(path)
    assert len(pairs) == 2
    (rejected,) = pairs.attrs["rejected"]
    assert "3 cells instead of 7: 1,2,3" in rejected.reasons[0]


def test_outlines_without_heights_say_what_to_add(tmp_path):
    path = google(tmp_path, small_town())
    pd.read_csv(path).drop(columns="building_height").to_csv(path, index=False)
    with pytest.raises(CatalogError, match=r"no column height.*Google Open Buildings.*add one"):
        pairs_from_footprints(path)


@pytest.mark.parametrize(
    "content",
    [
        b"area_in_meters,confidence,full_plus_code,geometry\n",
        b"area_in_meters,confidence,full_plus_code,geometry\n1,1,\xff\xfe,POINT (1 1)\n",
        b"geometry,geometry\na,b\n",
        b'geometry,a\n"POINT (1 1),2\n',
        b"geometry,a\n\x00\x00,2\n",
    ],
)
def test_damaged_files_end_in_one_line(tmp_path, content):
    path = tmp_path / "a.csv"
    path.write_bytes(content)
    with pytest.raises(CatalogError) as error:
        pairs_from_footprints(path)
    assert "\n" not in str(error.value)


def test_tables_without_outlines_and_known_source_are_for_another_reader(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("pair_id,gap,longitude_1\n1,0,20\n")
    assert read_csv_buildings(path, "a") is None
    path.write_text("longitude,latitude,colour\n20,10,red\n")
    assert read_csv_buildings(path, "a") is None


def test_too_many_rows_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(csv_buildings, "MOST_ROWS", 3)
    with pytest.raises(CatalogError, match="more than 3 rows"):
        read_csv_buildings(google(tmp_path, small_town()), "a")


@pytest.mark.real_data
def test_points_of_berkeley(real_data):
    raw = read_csv_points(real_data / "inventories" / "BerkeleyBuildings_full.csv", "a")
    table = imported(raw.attributes, "Berkeley")
    assert table["storeys"].tolist()[:2] == [2.0, 1.0]
    assert table["system"].tolist()[0] == "other"  # W1, wood
    assert {geometry.geom_type for geometry in raw.geometries} == {"Point"}
    assert raw.geometries[0].x == pytest.approx(-122.2842009)


def test_people_at_night_of_the_national_inventory(tmp_path):
    raw = read_raw_layer(nsi(tmp_path, small_town()), None)
    table = imported(raw.attributes.to_pandas(), "nsi")
    assert table["occupants"].tolist() == [3, 3, 3, 3]
    assert table["storeys"].tolist() == [4, 3, 2, 3]
    # the height of the first floor above ground is not that of the building
    assert "height" not in table
