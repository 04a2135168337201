"""Names of places: columns in many languages, hostile names, and the way from the nearest town."""

import re

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose
from obspy.geodetics import gps2dist_azimuth

from per_obspy.inventory.places import (
    LONGEST,
    near_towns,
    place_columns,
    place_names,
    with_towns,
)
from per_obspy.inventory.schema import COLUMNS, COMPLETED
from per_obspy.results.totals import named_cells
from per_obspy.screening.columns import RESULTS


@pytest.mark.parametrize(
    ("heading", "kind"),
    [
        ("Mahalle", ("neighbourhood", 0)),
        ("barrio 2", ("neighbourhood", 2)),
        ("SOKAK_1", ("street", 1)),
        ("Bina Adı B", ("name", 2)),
        ("Dirección 1", ("address", 1)),
        ("numero civico 2", ("number", 2)),
        ("町丁目", ("neighbourhood", 0)),
        ("addr:housenumber_1", ("number", 1)),
        ("addr:suburb_2", ("neighbourhood", 2)),
        ("house no A", ("number", 1)),
    ],
)
def test_columns_of_places_in_several_languages(heading, kind):
    assert place_columns([heading]) == {heading: kind}


def test_no_column_of_the_package_is_a_place_but_the_names():
    # would catch a storey or a station that becomes the name of a street
    assert set(place_columns([*COLUMNS, *COMPLETED, *RESULTS])) == {"name_1", "name_2"}
    assert place_columns(["street_width_1", "ward_boss", "numbers", "", "1", "x" * 5000]) == {}


def test_the_place_of_a_pair_is_neighbourhood_and_street():
    table = pd.DataFrame(
        {
            "Mahalle": ["Cumhuriyet", "", None, " "],
            "addr:street_1": ["14. Sokak", None, "", np.nan],
            "addr:street_2": ["Atatürk Caddesi", "Atatürk Caddesi", "", ""],
            "addr:city_1": ["Türkoğlu", "Türkoğlu", "Türkoğlu", "nan"],
            "addr:housenumber_1": [5.0, 7.0, 9.0, np.nan],
            "name_2": ["Ece Apt.", "", None, ""],
        }
    )
    names = place_names(table)
    # A city alone names nothing that one can walk to
    expected = ["Cumhuriyet, 14. Sokak", "Türkoğlu, Atatürk Caddesi", "", ""]
    assert names["place"].tolist() == expected
    assert names["name_1"].tolist() == ["14. Sokak 5", "7", "9", ""]
    assert names["name_2"].tolist() == ["Ece Apt.", "", "", ""]


def test_a_table_without_names_has_an_empty_place_and_no_further_column():
    names = place_names(pd.DataFrame({"pair_id": ["a", "b"], "gap": 0.1}))
    assert {name: texts.tolist() for name, texts in names.items()} == {"place": ["", ""]}
    assert place_names(pd.DataFrame({"street_1": []}))["place"].size == 0


def test_the_place_of_an_earlier_table_stays():
    table = pd.DataFrame({"place": ["Old Town", ""], "street_1": ["High Street", "High Street"]})
    assert place_names(table)["place"].tolist() == ["Old Town", "High Street"]


@pytest.mark.parametrize(
    "name",
    [
        "<script>alert(1)</script>",
        "x" * 300,
        "شارع الملك",
        "a\u202eb\nc\0",
        "=1+1",
        "🏠" * 300,
        "NA",
    ],
)
def test_hostile_names_are_one_printable_line(name):
    # would catch a name that turns the text around it, breaks a line or fills the page
    (text,) = place_names(pd.DataFrame({"street_1": [name]}))["place"]
    assert text.isprintable()
    assert len(text) <= LONGEST


def test_the_way_from_a_town_is_that_on_the_earth():
    # 40 places around the world; GeoNames places Kahramanmaraş at 37.5847 N, 36.92641 E
    (text,) = near_towns([36.93], [37.60])
    assert text.startswith("Kahramanmaraş (")
    north, east = map(float, re.findall(r"(\d+\.\d) km", text))
    meridian = gps2dist_azimuth(37.5847, 36.92641, 37.60, 36.92641)[0] / 1000
    parallel = gps2dist_azimuth(37.60, 36.92641, 37.60, 36.93)[0] / 1000
    # a tenth of a kilometre is the last digit; the sphere differs from the ellipsoid by 0.3 %
    assert_allclose([north, east], [meridian, parallel], atol=0.06)
    assert "N" in text
    assert "E" in text
    # across the date line, at a pole and in an ocean there is a name too
    names = near_towns([180.0, -180.0, 0.0, -150.0], [-16.8, -16.8, 90.0, 10.0]).tolist()
    assert names[2:] == ["90.000 N, 0.000 E", "10.000 N, 150.000 W"]
    assert all(names)


@pytest.mark.parametrize("size", [30.0, 250.0, 1000.0, 5000.0])
def test_no_two_cells_share_a_name(size):
    # would catch two areas counted as one
    east, north = np.meshgrid(np.arange(40) * 1e-5, np.arange(40) * 1e-5)
    cells = named_cells(36.9 + size * east.ravel(), 37.5 + size * north.ravel(), size)
    assert cells.boxes.index.is_unique
    assert len(cells.boxes) > 400
    assert set(cells.cell) == set(cells.boxes.index)


def test_only_empty_places_are_filled():
    filled = with_towns(["14. Sokak", "", None, ""], [36.9, 36.9, 36.9, np.nan], [37.6] * 4)
    assert filled[0] == "14. Sokak"
    assert filled[1] == filled[2] != ""
    assert filled[3] == ""
