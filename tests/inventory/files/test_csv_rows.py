"""Files of pairs in chunks: the same rows, lines and reasons as in one piece."""

from zlib import crc32

import numpy as np
import pandas as pd
import pytest
from pandas.testing import assert_frame_equal

from per_obspy.errors import CatalogError
from per_obspy.inventory.files import text_lines
from per_obspy.inventory.files.reading import PairInventory, checked_chunk, read_pairs

HEADER = "pair_id,gap,longitude_1,latitude_1,height_1,longitude_2,latitude_2,height_2,note,zone"


def _row(name, gap="0.05", note="shop", zone=3):
    # Every name has a place of its own, as no pair is given twice
    east = -60.0 - crc32(name.strip().encode()) % 90_000 / 1e4
    return f"{name},{gap},{east:.4f},-20.35,12,{east - 1e-4:.4f},-20.35,9.5,{note},{zone}"


ROWS = [
    _row("a"),
    _row("b", gap="five"),
    "",
    _row("c"),
    "broken,1",
    _row("a"),
    _row("d", gap="-1"),
    _row(" c "),
    _row("e", note='"x, y"'),
    "broken too",
]


@pytest.fixture
def csv(tmp_path):
    path = tmp_path / "pairs.csv"
    path.write_text("\n".join([HEADER, *ROWS]) + "\n")
    return path


def _in_chunks(paths, size):
    tables = [checked_chunk(chunk) for chunk in PairInventory(paths).chunks(size)]
    rejected = [rejection for table in tables for rejection in table.attrs["rejected"]]
    for table in tables:
        table.attrs = {}
    return pd.concat([table for table in tables if len(table)], ignore_index=True), rejected


@pytest.mark.parametrize("size", [1, 2, 3, 4, 100])
def test_chunks_hold_what_the_whole_file_holds(csv, size):
    # would catch lines counted within a chunk, names that are only unique within one, types that
    # depend on one
    whole = read_pairs(csv)
    rejected = list(whole.attrs["rejected"])
    whole.attrs = {}
    table, left_out = _in_chunks([csv], size)
    # Chunks without a note have no column of notes
    notes = table["cell_notes"].fillna("")
    assert_frame_equal(table.assign(cell_notes=notes)[whole.columns], whole, check_dtype=False)
    assert left_out == rejected
    assert whole["cell_notes"].tolist() == ["", "gap = 'five' is not a number", "", ""]
    assert [(rejection.name, rejection.row) for rejection in left_out] == [
        ("broken", 6), ("a", 7), ("d", 8), ("c", 9), ("broken too", 11),
    ]  # fmt: skip


OPEN = "a quotation mark is not closed"


@pytest.mark.parametrize("size", [1, 2, 100])
def test_a_quotation_mark_that_is_not_closed_loses_its_own_row_only(tmp_path, size):
    # would catch every row up to the next mark, or to the end, taken for one cell
    path = tmp_path / "pairs.csv"
    rows = [
        _row("a"),
        "short,1",
        _row("b", note='"it says'),
        _row("c"),
        _row("d", note='so"'),
        "short too",
        _row("e"),
    ]
    path.write_text("\n".join([HEADER, *rows, _row("f", zone='"3'), _row("g"), ""]))
    table, rejected = _in_chunks([path], size)
    assert table["pair_id"].tolist() == ["a", "c", "d", "e", "g"]
    assert [(rejection.name, rejection.row, *rejection.reasons) for rejection in rejected] == [
        ("short", 3, "2 columns, the header has 10"),
        ("b", 4, OPEN),
        ("short too", 7, "1 columns, the header has 10"),
        ("f", 9, OPEN),
    ]


@pytest.mark.parametrize("position", [0, 5000, 19_000])
def test_a_quotation_mark_among_many_rows_loses_its_own_row_only(tmp_path, position):
    # blocks have 1 MB: would catch the 3 997 rows that one mark took away
    rows = [_row(f"p{i}", note="x" * 100) for i in range(20_000)]
    path = tmp_path / "pairs.csv"
    text = [HEADER, *rows[:position], _row("open", note='"x'), *rows[position:], ""]
    path.write_text("\n".join(text))
    table, rejected = _in_chunks([path], 7000)
    assert table["pair_id"].tolist() == [f"p{i}" for i in range(20_000)]
    line = position + 2
    assert [(rejection.name, rejection.row) for rejection in rejected] == [("open", line)]


@pytest.mark.parametrize("size", [1, 1000])
@pytest.mark.parametrize("ending", ["\n", "\r", "\r\n"])
@pytest.mark.parametrize("block", [7, 1 << 20])
def test_every_line_is_read_rejected_or_blank(tmp_path, monkeypatch, size, ending, block):
    # would catch rows lost at the border of a block inside a quotation, and wrong line numbers
    monkeypatch.setattr(text_lines, "BLOCK", block)
    lines = [HEADER]
    good, bad = {}, {}

    def add(name, text, is_good=True):
        (good if is_good else bad)[name] = len(lines) + 1
        lines.extend(text.split("\n"))

    for i in range(8):
        add(f"a{i}", _row(f"a{i}"))
        add(f"break{i}", _row(f"break{i}", note='"first\n\nsecond, ""third"""'))
        lines.append("")
        add(f"open{i}", _row(f"open{i}", note='"open'), is_good=False)
        add(f"after{i}", _row(f"after{i}", note='"x"y'), is_good=False)
        add(f"short{i}", f"short{i},2", is_good=False)
        add(f"inch{i}", _row(f"inch{i}", note='5" wall'))
    path = tmp_path / "pairs.csv"
    path.write_bytes(ending.join(lines).encode())
    chunks = [chunk.rows for chunk in PairInventory([path]).chunks(size)]
    names = [name for rows in chunks for name in rows.table["pair_id"].to_pylist()]
    numbers = [int(line) for rows in chunks for line in rows.lines]
    assert dict(zip(names, numbers, strict=True)) == good
    broken = [line for rows in chunks for line in rows.broken]
    assert {line.name: line.row for line in broken} == bad
    assert len(broken) == len(bad)
    notes = {note for rows in chunks for note in rows.table["note"].to_pylist()}
    assert notes == {"shop", 'first  second, "third"', '5" wall'}


def test_a_file_that_changes_while_it_is_read_is_refused(tmp_path):
    path = tmp_path / "pairs.csv"
    path.write_text("\n".join([HEADER, _row("a"), _row("b"), ""]))
    inventory = PairInventory([path])
    path.write_text("\n".join([HEADER, _row("a"), ""]))
    message = "3 lines, of which 2 were read: was the file changed meanwhile"
    with pytest.raises(CatalogError, match=message):
        list(inventory.chunks(10))


def test_a_quotation_mark_inside_a_cell_is_text(tmp_path):
    path = tmp_path / "pairs.csv"
    path.write_text("\n".join([HEADER, _row("a", note='a 5" wall'), _row("b")]))
    table, rejected = _in_chunks([path], 100)
    assert table["note"].tolist() == ['a 5" wall', "shop"]
    assert rejected == []


@pytest.mark.parametrize("size", [1, 3, 100])
def test_parquet_in_chunks(csv, tmp_path, size):
    whole = read_pairs(csv)
    whole.attrs = {}
    whole.to_parquet(tmp_path / "pairs.parquet")
    table, rejected = _in_chunks([tmp_path / "pairs.parquet"], size)
    assert_frame_equal(table, whole)
    assert rejected == []


def test_a_name_in_two_files_is_repeated_in_the_second(csv, tmp_path):
    other = tmp_path / "other.csv"
    other.write_text("\n".join([HEADER, _row("a"), _row("z")]))
    _, rejected = _in_chunks([csv, other], 2)
    assert rejected[-1].source == str(other)
    assert rejected[-1].reasons == ("pair_id = 'a' occurs in an earlier row already",)


def test_numbers_of_carried_columns_are_numbers_in_every_chunk(tmp_path):
    # would catch a type that is guessed from the first rows: one zone is no whole number, one note
    # no number
    path = tmp_path / "pairs.csv"
    rows = [_row(f"p{i}", note=i, zone=i if i != 4 else 4.5) for i in range(9)]
    path.write_text("\n".join([HEADER, *rows, _row("q", note="x", zone="NA")]))
    for size in (2, 100):
        table, _ = _in_chunks([path], size)
        assert table["zone"].dtype == np.float64
        assert table["note"].tolist() == [*map(str, range(9)), "x"]
        assert np.isnan(table["zone"].iloc[-1])


def test_an_inventory_of_many_rows_in_a_csv_file(tmp_path):
    # more than one block of the reader, 1 MB
    path = tmp_path / "pairs.csv"
    path.write_text("\n".join([HEADER, *(_row(f"p{i}", note="x" * 100) for i in range(9000))]))
    inventory = PairInventory([path])
    lines = np.concatenate([chunk.rows.lines for chunk in inventory.chunks(1000)])
    assert inventory.count == 9000
    assert lines.tolist() == list(range(2, 9002))


def test_whole_file_faults_come_before_the_first_chunk(tmp_path):
    empty = tmp_path / "empty.csv"
    empty.write_text(HEADER + "\n")
    with pytest.raises(CatalogError, match="the table has no rows"):
        PairInventory([empty])
    empty.write_text("pair_id,gap\na,1\n")
    with pytest.raises(CatalogError, match="missing column"):
        PairInventory([empty])
    with pytest.raises(CatalogError, match="no such file"):
        PairInventory([tmp_path / "nothing.csv"])


def test_columns_without_a_name_are_left_out(tmp_path):
    # spreadsheets write them after the last one
    path = tmp_path / "pairs.csv"
    path.write_text(f"{HEADER},, \n{_row('a')},,x\n{_row('b')},,\n")
    table, rejected = _in_chunks([path], 10)
    assert table.columns.tolist() == HEADER.split(",")
    assert (table["pair_id"].tolist(), rejected) == (["a", "b"], [])
