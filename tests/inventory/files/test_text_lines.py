"""
Text tables: encodings, separators, headers, side files, and lines joined to rows.

Also of per_obspy.inventory.files.side_file, per_obspy.inventory.suspicions and
per_obspy.config.pairs.
"""

import random

import pytest
from messy_tables import NAMES, ROWS, plain, readable, text_of
from pandas.testing import assert_frame_equal

from per_obspy import read_pairs
from per_obspy.config import Pairs, TableForm, checked
from per_obspy.errors import CatalogError
from per_obspy.inventory.files import text_lines
from per_obspy.inventory.files.reading import PairInventory, checked_chunk
from per_obspy.inventory.files.side_file import form_of, side_file, write_form
from per_obspy.inventory.files.text_lines import (
    AFTER,
    OPEN,
    check_separator,
    check_text,
    possible_encodings,
    row_lines,
    text_form,
)


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


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"a,b\n1,\xe9\n", r"line 2 is not UTF-8 \(byte 0xe9 at position 3\)$"),
        (b"a,b\n1,\xc3", r"line 2 is not UTF-8"),
        (b"a,b\n1,\0\n", "not a CSV table: it holds zero bytes, as no text does$"),
        (b"", "not a CSV table: it is an empty file$"),
    ],
)
@pytest.mark.parametrize("block", [1, 1 << 20])
def test_bytes_that_are_no_text(write, monkeypatch, content, message, block):
    monkeypatch.setattr(text_lines, "BLOCK", block)
    with pytest.raises(CatalogError, match=message):
        check_text(write(content))


@pytest.mark.parametrize(
    ("sign", "kind"), [(";", "semicolons"), ("\t", "tabulators"), ("|", "vertical bars")]
)
def test_other_separators(tmp_path, sign, kind):
    message = f"columns are separated by {kind}, commas are expected"
    with pytest.raises(CatalogError, match=message):
        check_separator(tmp_path / "pairs.csv", [f"pair_id{sign}gap"])
    # a name may contain the sign where commas separate
    check_separator(tmp_path / "pairs.csv", [f"pair{sign}id", "gap"])
    check_separator(tmp_path / "pairs.csv", ["pair_id"])


@pytest.mark.parametrize("block", [1, 2, 1 << 20])
@pytest.mark.parametrize(
    ("text", "lines"),
    [("a", 1), ("a\n", 1), ("a\r\nb\rc\n\nd", 5), ("a\r", 1), ("a\r\n\r\n", 2), ("a\n\r", 2)],
)
def test_lines_of_any_ending_are_counted(write, monkeypatch, text, lines, block):
    monkeypatch.setattr(text_lines, "BLOCK", block)
    assert check_text(write(text.encode())) == lines


@pytest.fixture
def read(tmp_path):
    """Return a function that reads rows: their text, their lines, and the broken lines."""

    def read(text):
        path = tmp_path / "pairs.csv"
        path.write_bytes(("pair_id,gap,note\n" + text).encode())
        blocks = list(row_lines(path, text_form(path, TableForm())))
        rows = "".join(block.text for block in blocks).splitlines()
        numbers = [int(line) for block in blocks for line in block.numbers]
        broken = [(line.row, *line.reasons) for block in blocks for line in block.broken]
        return rows, numbers, broken

    return read


@pytest.mark.parametrize(
    ("text", "rows", "broken"),
    [
        # Closed on their line
        ('a,1,"x, y"\n', {2: 'a,1,"x, y"'}, []),
        ('a,1,""\n', {2: 'a,1,""'}, []),
        ('a,1,"say ""x"""', {2: 'a,1,"say ""x"""'}, []),
        ('a,1,5" wall\nb,1,"\n', {2: 'a,1,5" wall'}, [(3, OPEN)]),
        # Closed on a later line
        ('a,1,"x\ny"\nb,1,z\n', {2: 'a,1,"x y"', 4: "b,1,z"}, []),
        ('"p\nq",1,x\nb,1,z\n', {2: '"p q",1,x', 4: "b,1,z"}, []),
        ('a,"5\ncm",x\nb,bitişik,z\n', {2: 'a,"5 cm",x', 4: "b,bitişik,z"}, []),
        ('a,"1\r\n","x\n\ny"\nb,1,z\n', {2: 'a,"1 ","x  y"', 6: "b,1,z"}, []),
        # Never closed, or closed by the mark of a later row
        ('a,1,"x\nb,1,z\n', {3: "b,1,z"}, [(2, OPEN)]),
        ('a,1,"x\nb,1,z"\n', {3: 'b,1,z"'}, [(2, OPEN)]),
        ('"a,1,x\n"b",1,z\n', {3: '"b",1,z'}, [(2, OPEN)]),
        ('a,1,"x\nb,1,"z"\n', {3: 'b,1,"z"'}, [(2, OPEN)]),
        ('a,1,"x\nb,1,""\n', {3: 'b,1,""'}, [(2, OPEN)]),
        ('a,1,"x\nb,bitişik,"y"\n', {3: 'b,bitişik,"y"'}, [(2, OPEN)]),
        ('a,1,"x\nb,3-5,"y"\n', {3: 'b,3-5,"y"'}, [(2, OPEN)]),
        # Text that no reader should join to a number
        ('a,"0.1"5,x\n', {}, [(2, AFTER)]),
        ('a,"0.1" ,x\n', {}, [(2, AFTER)]),
    ],
)
def test_quotations(read, text, rows, broken):
    found, numbers, rejected = read(text)
    assert rejected == broken
    assert dict(zip(numbers, found, strict=True)) == rows


def test_a_quotation_over_too_many_lines_is_not_closed(read):
    longest = text_lines.LONGEST_ROW
    note = "\n".join(["x"] * longest)
    assert read(f'a,1,"{note}"\n')[1:] == ([2], [])
    # the lines of a longer one are broken rows, which the reader of cells rejects
    _, numbers, broken = read(f'a,1,"{note}\nx"\n')
    assert broken == [(2, OPEN)]
    assert numbers == list(range(3, 3 + longest))


def test_a_line_without_end_is_refused(read, monkeypatch):
    # would catch memory for a file that is one line
    monkeypatch.setattr(text_lines, "LONGEST_LINE", 2 << 20)
    with pytest.raises(CatalogError, match="a line is longer than 2 MB"):
        read("a,1," + "x" * (4 << 20))


@pytest.mark.parametrize(("header", "problem"), [('a,"b', OPEN), ('"a"b,c', AFTER)])
def test_a_header_with_wrong_quotations(write, header, problem):
    with pytest.raises(CatalogError, match=f"line 1: {problem}"):
        text_form(write(header + "\n"), TableForm())
    form = text_form(write('"a, b",c\r1,2'), TableForm())
    assert form.meanings.cells == ("a, b", "c")


def test_no_line_of_random_text_is_lost(read, monkeypatch):
    # every row has a mark that is no quotation: its line must come back, whatever stands around it
    drawn = random.Random(1)
    for block in (5, 50, 1 << 20):
        monkeypatch.setattr(text_lines, "BLOCK", block)
        for _ in range(100):
            pieces = ["".join(drawn.choices('ab",\n\r', k=12)) for _ in range(6)]
            text = "".join(f"{piece}\ngood{i},1,x\n" for i, piece in enumerate(pieces))
            found, _, _ = read(text)
            assert [row for row in found if row.startswith("good")] == [
                f"good{i},1,x" for i in range(6)
            ]


def test_a_text_that_only_japanese_bytes_allow_names_the_line_that_is_not_utf_8(write):
    # 0x93 0xfa is a letter of cp932 that no heading asks for, beside one of UTF-8
    content = plain().content + "é".encode() + b"\x93\xfa\n"
    with pytest.raises(CatalogError, match=r"line 5 is not UTF-8 \(byte 0x93 at position 3\)"):
        read_pairs(write(content))


def test_an_open_quotation_loses_its_own_row_only_with_semicolons(write):
    text = text_of(NAMES, ROWS, ";", ",").replace("corner", '"corner')
    pairs = read_pairs(write(text))
    assert pairs["pair_id"].tolist() == ["b", "c"]
    assert pairs.attrs["rejected"][0].row == 2


@pytest.mark.parametrize("block", [1, 2, 3, 1 << 20])
def test_a_character_may_lie_across_blocks(write, monkeypatch, block):
    # would catch blocks that are decoded by themselves
    monkeypatch.setattr(text_lines, "BLOCK", block)
    assert check_text(write("pair_id,note\na,café €\n".encode())) == 2
