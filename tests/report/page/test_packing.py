"""Columns as bytes, read here without the code that writes them."""

import json
import struct
import zlib
from base64 import b64decode

import numpy as np
import pandas as pd
import pytest

from per_obspy.report.page.packing import LONGEST_TEXT, addresses, encoded, pack_table
from per_obspy.screening.meanings import FLAGS

KINDS = {"speed": "number", "longitude": "place", "state": "choice", "name": "text"}


@pytest.fixture
def table():
    return pd.DataFrame(
        {
            "speed": [1.23456789, np.nan, np.inf, 0.0],
            "longitude": [-117.123456, 180.0, np.nan, 0.0],
            "state": ["yes", "no", None, "yes"],
            "name": ["a", "<b>", "\u202e", "x" * 500],
        }
    )


def decoded(text):
    """Return content and the bytes after it."""
    data = zlib.decompress(b64decode(text, validate=True))
    (length,) = struct.unpack("<I", data[:4])
    return json.loads(data[4 : 4 + length]), data[4 + length :]


def plane_values(data, count, kind):
    """Return numbers of which all first bytes come first, then all second ones, ..."""
    planes = [data[i * count : (i + 1) * count] for i in range(4)]
    return [struct.unpack(f"<{kind}", bytes(four))[0] for four in zip(*planes, strict=True)]


def number_at(place, digits):
    """Return a number from its place: 9, 90, 900 ... of each power of ten from 1e-300 on."""
    power, number = divmod(abs(place) - 1, 9 * 10 ** (digits - 1))
    number += 10 ** (digits - 1)
    return float(f"{'-' if place < 0 else ''}{number}e{power - 300 - digits + 1}") if place else 0.0


@pytest.mark.parametrize(("name", "digits"), [("gap", 4), ("expected_impact_velocity", 2)])
def test_numbers_keep_their_digits(name, digits):
    """Every number is the nearest decimal one: the contact law allows two digits."""
    given = [1.23456789, -0.0299999, 999.96, 1e-9, 1e200, 0.0, 1.0]
    packed = pack_table(pd.DataFrame({name: [*given, np.nan, np.inf]}), {name: "number"})
    *places, unknown, infinite = plane_values(packed.data, 9, "i")
    assert [number_at(place, digits) for place in places] == [
        float(f"{value:.{digits}g}") for value in given
    ]
    assert (unknown, infinite) == (-(2**31), 2**31 - 1)


def test_a_probability_near_1_is_not_1():
    table = pd.DataFrame({"probability": [0.99999, 1.0, 0.0, 1e-48]})
    places = plane_values(pack_table(table, {"probability": "chance"}).data, 4, "i")
    assert [number_at(place, 4) for place in places] == [0.9999, 1.0, 0.0, 1e-48]


def test_places_keep_a_tenth_of_a_metre():
    """Ends of a pair are steps from the middle, and from the other end mirrored at the middle."""
    table = pd.DataFrame(
        {
            "longitude": [-117.123456, 180.0, np.nan, 0.0],
            "longitude_1": [-117.123556, 179.9999, 5.0, np.nan],
            "longitude_2": [-117.123356, -179.9999, np.nan, 1.0],
        }
    )
    packed = pack_table(table, dict.fromkeys(table, "place"))
    _, data = decoded(encoded({"tables": [packed.description]}, [packed]))
    middle, one, two = (plane_values(data[16 * i :], 4, "i") for i in range(3))
    assert middle == [-117123456, 180000000, -(2**31), 0]
    # Modulo 2^32, as whole numbers of a browser are
    before = [step + start for step, start in zip(one, middle, strict=True)]
    after = [step + 2 * m - o for step, m, o in zip(two, middle, before, strict=True)]
    assert [np.int64(x).astype(np.int32) for x in before] == [
        -117123556, 179999900, 5000000, -(2**31)
    ]  # fmt: skip
    assert [np.int64(x).astype(np.int32) for x in after] == [
        -117123356, -179999900, -(2**31), 1000000
    ]  # fmt: skip
    # Of a pair around its middle nothing is left
    assert (one[0], two[0]) == (-100, 0)


def test_texts_are_stored_once_and_cut(table):
    description = pack_table(table, KINDS).description
    choice, text = description["columns"][2:]
    assert choice["texts"] == ["yes", "no", ""]
    assert text["texts"][:3] == ["a", "<b>", " "]
    assert len(text["texts"][3]) == LONGEST_TEXT


def test_whole_numbers_keep_all_digits():
    table = pd.DataFrame({"rank": [16_385, 20_000, 123_456_789]})
    packed = pack_table(table, {"rank": "whole"})
    assert plane_values(packed.data, 3, "i") == [16_385, 20_000, 123_456_789]


def test_names_of_flags_are_never_cut():
    """A flag that is cut is a flag that a filter misses."""
    names = " ".join(FLAGS)
    assert len(names) > LONGEST_TEXT
    packed = pack_table(pd.DataFrame({"flags": [names]}), {"flags": "names"})
    assert packed.description["columns"][0]["texts"] == [names]


def test_columns_that_a_table_lacks_are_left_out(table):
    description = pack_table(table[["name"]], KINDS).description
    assert [column["name"] for column in description["columns"]] == ["name"]


def test_nothing_of_the_content_can_be_markup():
    text = encoded({"name": "</script><script>alert(1)</script>"}, [])
    assert set(text) <= set("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/=")


def test_a_number_that_json_lacks_is_refused():
    with pytest.raises(ValueError, match="not JSON compliant"):
        encoded({"number": float("nan")}, [])


def test_places_of_both_buildings_are_one_text():
    table = pd.DataFrame(
        {"Street_1": ["Calle 5", None], "addr:city_1": ["Lima", " "], "city_2": ["Lima", "Callao"],
         "street_width_1": [9.0, 8.0]}
    )  # fmt: skip
    assert addresses(table).tolist() == ["Calle 5, Lima", "Callao"]
    assert addresses(table[["street_width_1"]]) is None
