"""Columns as bytes, read here without the code that writes them."""

import json
import struct
import zlib
from base64 import b64decode

import numpy as np
import pandas as pd
import pytest

from per_obspy.report.page.packing import LONGEST_TEXT, encoded, pack_table
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


def test_numbers_keep_four_digits_and_places_a_tenth_of_a_metre(table):
    packed = pack_table(table, KINDS)
    _, data = decoded(encoded({"tables": [packed.description]}, [packed]))
    speed = plane_values(data[:16], 4, "f")
    # Half a unit of 13 bits is 6e-5 of the value
    assert speed[0] == pytest.approx(1.23456789, rel=6.2e-5)
    assert np.isnan(speed[1])
    assert speed[2:] == [np.inf, 0.0]
    assert plane_values(data[16:32], 4, "i") == [-117123456, 180000000, -(2**31), 0]


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
