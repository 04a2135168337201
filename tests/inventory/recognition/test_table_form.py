"""
The form of text tables: encodings, and side files.

Also of per_obspy.inventory.recognition.encodings, per_obspy.inventory.recognition.side_file,
per_obspy.inventory.suspicions,
per_obspy.inventory.files.workbook_rows and per_obspy.config.pairs.
"""

import pytest
from messy_tables import NAMES, ROWS, plain, readable, text_of
from pandas.testing import assert_frame_equal

from per_obspy import read_pairs
from per_obspy.config import Pairs, TableForm, checked
from per_obspy.errors import CatalogError
from per_obspy.inventory.files.reading import PairInventory, checked_chunk
from per_obspy.inventory.recognition.encodings import possible_encodings
from per_obspy.inventory.recognition.side_file import form_of, side_file, write_form


@pytest.fixture
def write(tmp_path):
    def write(content, name="pairs.csv"):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"plain\n", ["utf-8"]),
        ("caf\xe9\n".encode(), ["utf-8"]),
        ("\ufeffcaf\xe9\n".encode(), ["utf-8"]),
        ("caf\xe9\n".encode("utf-16"), ["utf-16"]),
        (b"\xfe\xff" + "x\n".encode("utf-16-be"), ["utf-16"]),
        # 0x8e and 0x9e are letters of cp1252 only
        ("\u017d caf\xe9,\n".encode("cp1252"), ["cp1252"]),
    ],
)
def test_encodings_that_a_text_can_be_in(write, content, expected):
    assert list(possible_encodings(write(content))) == expected


@pytest.mark.parametrize("content", [b"caf\xc3\xa9 \xe9\n", b"cut \xc3"])
def test_text_in_no_encoding_is_refused_with_the_line_and_the_mend(write, content):
    with pytest.raises(CatalogError, match=r"line 1 is not UTF-8 .*give encoding"):
        possible_encodings(write(content))


@pytest.mark.parametrize("name", ["rot13", "zlib", "idna", "unicode_escape", "undefined", "no\0"])
def test_encodings_that_are_none_of_text_are_refused(write, name):
    with pytest.raises(CatalogError, match="is not known"):
        read_pairs(write(plain().content), TableForm(encoding=name))


@pytest.mark.parametrize("kind", readable())
@pytest.mark.parametrize("size", [1, 2, 100])
def test_messy_tables_in_chunks_hold_what_the_whole_file_holds(tmp_path, kind, size):
    messy = readable()[kind]
    (tmp_path / messy.file).write_bytes(messy.content)
    whole = read_pairs(tmp_path / messy.file)
    chunks = PairInventory([tmp_path / messy.file]).chunks(size)
    tables = [checked_chunk(chunk) for chunk in chunks]
    assert [name for table in tables for name in table["pair_id"]] == whole["pair_id"].tolist()
    assert [gap for table in tables for gap in table["gap"]] == whole["gap"].tolist()


def test_lines_of_rejected_rows_are_those_of_the_file(write):
    # would catch lines counted from the header or from the transcribed text
    text = "Title;;\n\n" + text_of(NAMES, ROWS, ";", ",").replace("0,3022", "wide")
    for content in (text.encode(), text.encode("utf-16")):
        pairs = read_pairs(write(content))
        (rejected,) = pairs.attrs["rejected"]
        assert (rejected.row, rejected.name) == (5, "b")
        assert rejected.reasons == ("longitude_1 = 'wide' is not a number",)


def test_an_open_quotation_loses_its_own_row_only_with_semicolons(write):
    text = text_of(NAMES, ROWS, ";", ",").replace("corner", '"corner')
    pairs = read_pairs(write(text))
    assert pairs["pair_id"].tolist() == ["b", "c"]
    assert pairs.attrs["rejected"][0].row == 2


def test_a_stray_comma_in_a_plain_column_leaves_the_other_cells_alone(write):
    # would catch a column of points that becomes one of commas because of one cell
    text = text_of(NAMES, ROWS).replace("15.5", "12.345")
    pairs = read_pairs(write(text.replace(",0.125,", ',"0,125",')))
    assert pairs["gap"].tolist() == [0.05, 0.125, 0.0]
    assert pairs.attrs["recognised"] == ""
    assert "cell_notes" not in pairs


def test_the_file_beside_a_table_and_what_comes_before_it(write):
    path = write(plain().content)
    write_form(path, TableForm(decimal=",", units={"gap": "cm", "mass_1": "t"}))
    found = form_of(path, TableForm(decimal=".", units={"gap": "mm"}))
    assert (found.decimal, found.units) == (".", {"gap": "mm", "mass_1": "t"})
    side_file(path).write_text('gap = "cm"\n')
    with pytest.raises(CatalogError, match=r"pairs\.csv\.toml: gap: unknown key"):
        read_pairs(path)


def test_parquet_has_names_and_units_too(write, tmp_path):
    expected = read_pairs(write(plain().content))
    expected.attrs = {}
    other = expected.assign(gap=expected["gap"] * 100.0).rename(columns={"gap": "Derz (cm)"})
    other.to_parquet(tmp_path / "pairs.parquet")
    found = read_pairs(tmp_path / "pairs.parquet")
    assert found.attrs["recognised"] == "gap = 'Derz (cm)' in cm"
    assert_frame_equal(found[expected.columns], expected, rtol=1e-15)


def test_the_form_is_of_a_file():
    with pytest.raises(CatalogError, match="columns is of a pair table: give its file"):
        checked(Pairs, {"catalog": "c.toml", "columns": {"gap": "x"}})
    assert checked(Pairs, {"file": "p.csv", "decimal": ","}).form == TableForm(decimal=",")
