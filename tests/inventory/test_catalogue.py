"""Index of stored inventories: entries come back, changes are noticed, regions are found."""

import datetime
from pathlib import Path

import numpy as np
import pytest

from per_obspy.errors import CatalogError
from per_obspy.inventory.catalogue import (
    Box,
    Origin,
    add_inventory,
    box_around,
    check_inventories,
    find_inventories,
    stored_inventories,
    touch,
    verified_file,
)
from per_obspy.simulation.buildings import simulated_pairs

CHECKOUT = Path(__file__).parents[2]
ORIGIN = Origin(
    "old town", 'a survey called "street by street"', "CC0-1.0", datetime.date(2026, 11, 20)
)


def town(longitude, latitude, count):
    """Return a small simulated inventory around a place."""
    return simulated_pairs([longitude], [latitude], count, seed=1, radius=2000.0, touching=0.5)


@pytest.fixture
def index(tmp_path):
    """Index of two inventories in a folder of their own."""
    # two places, two kinds of files
    target, folder = tmp_path / "catalog.toml", tmp_path / "data"
    folder.mkdir()
    town(-67.95, -20.35, 20).to_csv(folder / "old.csv", index=False)
    town(10.0, 50.0, 30).to_parquet(folder / "new.parquet")
    add_inventory(target, folder / "old.csv", ORIGIN)
    add_inventory(target, folder / "new.parquet", ORIGIN._replace(name="Neustadt ü"))
    return target


def test_what_goes_in_comes_out(index):
    old, new = stored_inventories(index)
    assert (old.name, old.source, old.licence, old.date) == ORIGIN
    assert (old.pairs, new.pairs) == (20, 30)
    assert old.file == index.parent / "data" / "old.csv"
    assert new.name == "Neustadt ü"
    # around the station, within its radius and half a row: 0.03 degrees are 3.1 km
    assert -67.98 < old.bounding_box.west < old.bounding_box.east < -67.92


def test_the_folder_may_move(index, tmp_path):
    # would catch absolute paths in the index
    assert str(tmp_path) not in index.read_text()
    moved = index.parent.rename(tmp_path.with_name(f"{tmp_path.name}_moved"))
    assert check_inventories(moved / "catalog.toml") == ()


def test_a_changed_and_a_missing_file_are_noticed(index):
    old, new = stored_inventories(index)
    assert check_inventories(index) == ()
    # one cell changes its length, one file disappears
    old.file.write_text(old.file.read_text().replace("inside", "end", 1))
    new.file.unlink()
    changed, missing = check_inventories(index)
    assert changed[:2] == ("file", "old town")
    assert "changed or damaged since it was stored" in changed.reasons[0]
    assert missing.reasons == ("the stored inventory 'Neustadt ü' is missing",)
    with pytest.raises(CatalogError, match=r"old.csv: changed or damaged"):
        verified_file(old)


def test_an_unchanged_file_is_given(index):
    assert verified_file(stored_inventories(index)[0]).name == "old.csv"


def test_regions_find_what_they_touch(index):
    def names(*region):
        return [entry.name for entry in find_inventories(index, Box(*region))]

    assert names(-68, -21, -67, -20) == ["old town"]
    assert names(-180, -90, 180, 90) == ["old town", "Neustadt ü"]
    assert names(9.9999, 49.9999, 10.0001, 50.0001) == ["Neustadt ü"]
    assert names(-68, 49, -67, 51) == []
    assert names(170, -90, -170, 90) == []  # across the date line
    assert names(9, 40, -60, 60) == ["Neustadt ü"]  # the long way round from 9 east to 60 west


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [
        ((0, 0, 2, 2), (1, 1, 3, 3), True),
        ((0, 0, 9, 9), (4, 4, 5, 5), True),
        ((0, 0, 1, 1), (1, 1, 2, 2), True),
        ((0, 0, 1, 1), (2, 0, 3, 1), False),
        ((0, 0, 1, 1), (0, 2, 1, 3), False),
        ((179, 0, -179, 1), (-180, 0, -179.5, 1), True),
        ((179, 0, -179, 1), (178, 0, 179.5, 1), True),
        ((179, 0, -179, 1), (0, 0, 1, 1), False),
    ],
)
def test_boxes_touch_both_ways_round(first, second, expected):
    assert touch(Box(*first), Box(*second)) is expected
    assert touch(Box(*second), Box(*first)) is expected


@pytest.mark.parametrize(
    ("longitudes", "latitudes", "box"),
    [
        ([179.9, -179.8, 179.95, -179.7], [1.0, 2.0, 1.5, 3.0], (179.9, 1.0, -179.7, 3.0)),
        ([5.0, 5.0], [1.0, 1.0], (5.0, 1.0, 5.0, 1.0)),
    ],
    ids=["date line", "one place"],
)
def test_the_smallest_box_around_places(longitudes, latitudes, box):
    assert box_around(np.array(longitudes), np.array(latitudes)) == box


def test_entries_that_cannot_be(index, tmp_path):
    # a name that is taken, an empty text, a table without a usable row
    file = tmp_path / "data" / "old.csv"
    with pytest.raises(CatalogError, match="name = 'old town' is taken"):
        add_inventory(index, file, ORIGIN)
    with pytest.raises(CatalogError, match=r"licence of the inventory .* is empty"):
        add_inventory(index, file, ORIGIN._replace(name="third", licence=" "))
    bad = tmp_path / "bad.csv"
    town(10.0, 50.0, 1).assign(gap=-1.0).to_csv(bad, index=False)
    with pytest.raises(CatalogError, match=r"bad.csv: no usable row: gap = -1 m is outside"):
        add_inventory(index, bad, ORIGIN._replace(name="third"))
    assert len(stored_inventories(index)) == 2


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('licence = "CC0-1.0"\n', "", "licence: Field required"),
        ('name = "old town"', 'name = "Neustadt ü"', "name = 'Neustadt ü' occurs more than once"),
        ("pairs = 20", "pairs = 0", r"pairs: Input should be greater than or equal to 1 \(got 0\)"),
        ("pairs = 20", "pears = 20", "pears: unknown key"),
        ("[[inventory]]", "[[inventory]", "cannot be read as TOML"),
    ],
)
def test_a_damaged_index(index, old, new, message):
    index.write_text(index.read_text().replace(old, new, 1))
    with pytest.raises(CatalogError, match=message):
        stored_inventories(index)


def test_a_region_that_is_no_box(index):
    with pytest.raises(
        ValueError, match="region must be west, south, east, north in degrees, got -99, 19, 400, 20"
    ):
        find_inventories(index, Box(-99, 19, 400, 20))
    with pytest.raises(ValueError, match="region must be"):
        find_inventories(index, Box(-99, 20, -98, 19))


def test_the_index_of_this_project_is_sound():
    assert check_inventories(CHECKOUT / "catalogs" / "catalog.toml") == ()
