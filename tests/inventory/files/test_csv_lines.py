"""Lines of CSV files joined to rows: closed quotations, and permitted contents of a row."""

import random

import pytest

from per_obspy.errors import CatalogError
from per_obspy.inventory.files import csv_lines
from per_obspy.inventory.files.csv_lines import AFTER, OPEN, Layout, header_names, row_lines
from per_obspy.inventory.recognition import csv_text
from per_obspy.inventory.recognition.csv_text import check_text

NAMES = ["pair_id", "gap", "note"]


@pytest.fixture
def read(tmp_path):
    """Return a function that reads rows: their text, their lines, and the broken lines."""

    def read(text):
        path = tmp_path / "pairs.csv"
        path.write_bytes(("pair_id,gap,note\n" + text).encode())
        blocks = list(row_lines(path, NAMES, Layout(check_text(path))))
        rows = b"".join(block.text for block in blocks).decode().splitlines()
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
    longest = csv_lines.LONGEST_ROW
    note = "\n".join(["x"] * longest)
    assert read(f'a,1,"{note}"\n')[1:] == ([2], [])
    # the lines of a longer one are broken rows, which the reader of cells rejects
    _, numbers, broken = read(f'a,1,"{note}\nx"\n')
    assert broken == [(2, OPEN)]
    assert numbers == list(range(3, 3 + longest))


def test_a_line_without_end_is_refused(read, monkeypatch):
    # would catch memory for a file that is one line
    monkeypatch.setattr(csv_lines, "LONGEST_LINE", 2 << 20)
    with pytest.raises(CatalogError, match="a line is longer than 2 MB"):
        read("a,1," + "x" * (4 << 20))


@pytest.mark.parametrize(("header", "problem"), [('a,"b', OPEN), ('"a"b,c', AFTER)])
def test_a_header_with_wrong_quotations(tmp_path, header, problem):
    path = tmp_path / "pairs.csv"
    path.write_text(header + "\n")
    with pytest.raises(CatalogError, match=f"line 1: {problem}"):
        header_names(path, Layout(1))
    path.write_text('"a, b",c\r1,2')
    assert header_names(path, Layout(1)) == ["a, b", "c"]


def test_no_line_of_random_text_is_lost(read, monkeypatch):
    # every row has a mark that is no quotation: its line must come back, whatever stands around it
    drawn = random.Random(1)
    for block in (5, 50, 1 << 20):
        monkeypatch.setattr(csv_text, "BLOCK", block)
        for _ in range(100):
            pieces = ["".join(drawn.choices('ab",\n\r', k=12)) for _ in range(6)]
            text = "".join(f"{piece}\ngood{i},1,x\n" for i, piece in enumerate(pieces))
            found, _, _ = read(text)
            assert [row for row in found if row.startswith("good")] == [
                f"good{i},1,x" for i in range(6)
            ]
