"""Packed files and dispatch by suffix and content."""

import gzip

import pytest
from building_samples import google, microsoft_packed, small_town

from per_obspy.errors import CatalogError
from per_obspy.inventory.footprints.footprint_pairs import pairs_from_footprints
from per_obspy.inventory.importers import building_files


def test_packed_csv_of_google(tmp_path):
    path = google(tmp_path, small_town())
    packed = tmp_path / "0c5_buildings.csv.gz"
    packed.write_bytes(gzip.compress(path.read_bytes()))
    assert len(pairs_from_footprints(packed)) == 2


def test_a_bomb_is_refused_before_it_fills_the_disk(tmp_path, monkeypatch):
    monkeypatch.setattr(building_files, "LARGEST", 1 << 20)
    path = tmp_path / "a.csv.gz"
    path.write_bytes(gzip.compress(bytes(1 << 24)))
    with pytest.raises(CatalogError, match=r"a\.csv\.gz: it has more than .* split the file"):
        building_files.read_buildings(path)


def test_a_bomb_is_refused_by_its_ratio(tmp_path):
    path = tmp_path / "a.csv.gz"
    path.write_bytes(gzip.compress(b"wkt,height\n" + b"0" * (100 << 20)))
    with pytest.raises(CatalogError, match=r"a\.csv\.gz: it unpacks to more than 200 times"):
        pairs_from_footprints(path)


@pytest.mark.parametrize("damage", [lambda b: b[: len(b) // 2], lambda b: b"x" + b, lambda _: b""])
def test_damaged_packing(tmp_path, damage):
    path = microsoft_packed(tmp_path, small_town())
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(CatalogError, match=r"microsoft\.csv\.gz: not ") as error:
        pairs_from_footprints(path)
    assert "\n" not in str(error.value)


def test_other_packed_files_are_refused(tmp_path):
    path = tmp_path / "town.gpkg.gz"
    path.write_bytes(gzip.compress(b"text"))
    with pytest.raises(CatalogError, match=r"unknown suffix 'town\.gpkg\.gz', expected \.csv\.gz"):
        pairs_from_footprints(path)
