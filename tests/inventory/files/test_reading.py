"""Files of pairs: rows that are read, whole or in chunks, files that are wrong, written tables."""

from zlib import crc32

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest
from pandas.testing import assert_frame_equal

from per_obspy import read_pairs
from per_obspy.config import TableForm
from per_obspy.errors import CatalogError
from per_obspy.inventory.files import text_lines
from per_obspy.inventory.files.raw_rows import name_hashes, stripped
from per_obspy.inventory.files.reading import PairInventory, checked_chunk
from per_obspy.inventory.files.writing import write_pairs
from per_obspy.simulation.buildings import simulated_pairs

HEADER = "pair_id,gap,longitude_1,latitude_1,height_1,longitude_2,latitude_2,height_2,note"
GOOD = "007,0.05,-67.95,-20.35,12,-67.9501,-20.35,9.5,corner shop"


@pytest.fixture
def write(tmp_path):
    def write(content: str | bytes, name: str = "pairs.csv"):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


def test_a_good_row(write):
    pairs = read_pairs(write(f"{HEADER}\n{GOOD}\n"))
    assert pairs.loc[0, "pair_id"] == "007"  # an identifier is text, whatever it looks like
    assert pairs.loc[0, ["gap", "height_1", "height_2"]].tolist() == [0.05, 12.0, 9.5]
    assert pairs.loc[0, "note"] == "corner shop"
    assert pairs.attrs["rejected"] == ()


def test_a_table_in_memory_is_checked_like_a_file(tmp_path):
    # would catch: rows that are numbered by the index of the table
    row = {"pair_id": "a", "gap": 0.1}
    for i in (1, 2):
        row |= {f"longitude_{i}": 0.3, f"latitude_{i}": 0.0, f"height_{i}": 10.0 + i}
    table = pd.DataFrame([row, row | {"pair_id": "b", "gap": -1.0}], index=[7, 9])
    table.to_csv(tmp_path / "pairs.csv", index=False)
    pairs, from_file = read_pairs(table), read_pairs(tmp_path / "pairs.csv")
    pd.testing.assert_frame_equal(pairs, from_file)
    (rejected,) = pairs.attrs["rejected"]
    (known,) = from_file.attrs["rejected"]
    assert rejected == known._replace(source="table")


@pytest.mark.parametrize(
    ("wrong", "message"),
    [(pd.DataFrame({"pair_id": ["a"]}), "longitude_1"), (pd.DataFrame(), "table")],
)
def test_a_table_in_memory_that_is_wrong_as_a_whole(wrong, message):
    with pytest.raises(CatalogError, match=message):
        read_pairs(wrong)


def test_what_is_neither_path_nor_table_is_named_with_its_type():
    with pytest.raises(TypeError, match="got list"):
        read_pairs([1, 2])


@pytest.mark.parametrize("ending", ["\n", "\r\n"])
def test_byte_order_mark_line_endings_blank_lines_and_spaces(write, ending):
    content = ending.join(
        ["\ufeff" + HEADER.replace("gap", " gap"), "", GOOD.replace("0.05", " 0.05 "), "", ""]
    )
    pairs = read_pairs(write(content))
    assert len(pairs) == 1
    assert pairs.loc[0, "gap"] == 0.05


def test_a_row_names_its_line_also_after_blank_and_broken_lines(write):
    # would catch line numbers counted from the rows that were read
    negative = GOOD.replace("0.05", "-1").replace("007", "009")
    pairs = read_pairs(write(f"{HEADER}\n\n{GOOD}\n008,0.1\n{negative}\n"))
    assert len(pairs) == 1
    assert [(rejection.name, rejection.row) for rejection in pairs.attrs["rejected"]] == [
        ("008", 4),
        ("009", 5),
    ]
    assert pairs.attrs["rejected"][0].reasons == ("2 columns, the header has 9",)
    assert pairs.attrs["rejected"][1].reasons == ("gap = -1 m is outside 0 to 10 m",)


def test_cells_with_line_breaks_are_read_and_every_line_is_counted(tmp_path):
    # as spreadsheets write headings of two lines; a bad row after them has its own line
    path = tmp_path / "pares.csv"
    path.write_text(
        '"Nombre\ndel par","Separación\n(cm)",Longitud 1,Latitud 1,Altura 1,'
        "Longitud 2,Latitud 2,Altura 2,Notas\n"
        '"a\nb",5,1,1,9,1,1,9,"two\nlines"\n'
        'c,"3\n-5 cm",1,1,9,1,1,9,x\n'
        "d,5,east,1,9,1,1,9,x\n"
    )
    pairs = read_pairs(path, TableForm(columns={"pair_id": "Nombre del par"}))
    assert pairs["pair_id"].tolist() == ["a b", "c"]
    assert pairs["gap"].tolist() == pytest.approx([0.05, 0.04])
    assert pairs["Notas"].tolist() == ["two lines", "x"]
    assert [(row.row, row.name) for row in pairs.attrs["rejected"]] == [(9, "d")]


def test_text_in_a_column_of_numbers_is_named_with_its_row(write):
    bad = GOOD.replace("0.05", "five").replace("007", "008")
    pairs = read_pairs(write(f"{HEADER}\n{GOOD}\n{bad}\n"))
    assert pairs["cell_notes"].tolist() == ["", "gap = 'five' is not a number"]
    # A place is needed, a gap is not
    place = pairs["longitude_1"][0]
    bad = GOOD.replace(f",{place:g},", ",east,").replace("007", "008")
    (rejection,) = read_pairs(write(f"{HEADER}\n{GOOD}\n{bad}\n")).attrs["rejected"]
    assert rejection[:4] == ("pair", "008", str(rejection.source), 3)
    assert rejection.reasons == ("longitude_1 = 'east' is not a number",)


ROW = f"{HEADER}\n{GOOD}\n"
PDF = b"%PDF-1.4\n"

#: content, and message, of a CSV file that is no pair table
WRONG_CSV = [
    (b"", "not a CSV table: it is an empty file"),
    (f"{HEADER}\n", "the table has no rows"),
    (f"{HEADER}\n\n\n", "the table has no rows"),
    (ROW.replace("gap,", "").replace("0.05,", ""), "missing column gap "),
    (ROW.replace("height_2", "hoehe_2"), "missing column height_2 or storeys_2 or period_2 "),
    (f"{HEADER},gap\n{GOOD},0.1\n", "column gap occurs more than once"),
    (
        ROW.replace("shop", "caf").encode() + b"\xe9 \xc3\xa9\n",
        "line 3 is not UTF-8 .byte 0xe9 at position 1",
    ),
    (f"{HEADER}\n{GOOD}".encode() + b"\xc3", "line 2 is not UTF-8"),
    (PDF + b"%\xe2\xe3\n", "not a CSV table: it is a PDF document"),
    (b"PK\x03\x04" + bytes(range(256)), "it is a ZIP archive, as Excel workbooks are"),
    (bytes(100), "not a CSV table: it holds zero bytes"),
]


@pytest.mark.parametrize(("content", "message"), WRONG_CSV)
def test_files_that_are_wrong_as_a_whole(write, content, message):
    path = write(content)
    with pytest.raises(CatalogError, match=message) as error:
        read_pairs(path)
    assert str(error.value).startswith(f"{path}: ")
    assert "\n" not in str(error.value)


def test_names_that_are_no_text(write, tmp_path):
    table = read_pairs(write(f"{HEADER}\n{GOOD}\n"))
    table.assign(pair_id=[[1]]).to_parquet(tmp_path / "lists.parquet")
    with pytest.raises(CatalogError, match=r"lists\.parquet: .*[Uu]nsupported cast from list"):
        PairInventory([tmp_path / "lists.parquet"])


def test_a_table_of_broken_lines_alone_says_so_line_by_line(write):
    pairs = read_pairs(write(f"{HEADER}\n{GOOD.replace('corner', chr(34) + 'corner')}\n008,0.1\n"))
    assert pairs.empty
    assert [rejection.row for rejection in pairs.attrs["rejected"]] == [2, 3]


def test_missing_file_and_folder(tmp_path):
    with pytest.raises(CatalogError, match="no such file"):
        read_pairs(tmp_path / "nowhere.csv")
    (tmp_path / "folder.csv").mkdir()
    with pytest.raises(CatalogError, match="no such file"):
        read_pairs(tmp_path / "folder.csv")


def test_a_table_without_names_is_named_by_its_rows_and_says_so(tmp_path):
    rows = (
        "Boşluk (cm),Boylam 1,Enlem 1,Kat 1,Boylam 2,Enlem 2,Kat 2,Bina 1 Adı,Taşıyıcı sistem 1\n"
    )
    rows = rows.replace("Boşluk", "Derz") + (
        "bitişik,29,41,Z+4,29,41,5,Ev,Betonarme\n3-5,29,41,3+1,29,41,5,Okul,Yığma\n"
        "?,29,41,B+Z+3,29,41,5,Cami,taş\n"
    )
    for name in ("a.csv", "b.csv"):
        (tmp_path / name).write_text(rows)
    pairs = read_pairs(tmp_path / "a.csv")
    assert "no pair_id: each pair is named by its row, as 'row 2'" in pairs.attrs["recognised"]
    assert pairs["pair_id"].tolist() == ["row 2", "row 4"]
    assert pairs["building_id_1"].tolist() == ["Ev", "Cami"]
    assert pairs["system_1"].tolist() == ["concrete_mrf", "masonry"]
    assert pairs["storeys_1"].tolist() == [5.0, 5 - 1]
    assert pairs["gap"].tolist()[0] == 0.0
    assert pairs["gap"].isna().tolist()[1]
    (lost,) = pairs.attrs["rejected"]
    assert (lost.name, lost.row) == ("row 3", 3)
    assert "storeys_1 = '3+1' is not a number" in lost.reasons[0]
    # Several files of one inventory
    chunks = PairInventory([tmp_path / "a.csv", tmp_path / "b.csv"]).chunks(2)
    tables = [checked_chunk(chunk) for chunk in chunks]
    names = [name for table in tables for name in table["pair_id"]]
    assert names == ["a row 2", "a row 4", "b row 2", "b row 4"]


ZONED = "pair_id,gap,longitude_1,latitude_1,height_1,longitude_2,latitude_2,height_2,note,zone"


def _row(name, gap="0.05", note="shop", zone=3):
    # Every name has a place of its own, as no pair is given twice
    east = -60.0 - crc32(name.strip().encode()) % 90_000 / 1e4
    return f"{name},{gap},{east:.4f},-20.35,12,{east - 1e-4:.4f},-20.35,9.5,{note},{zone}"


LINES = [
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
    path.write_text("\n".join([ZONED, *LINES]) + "\n")
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
    path.write_text("\n".join([ZONED, *rows, _row("f", zone='"3'), _row("g"), ""]))
    table, rejected = _in_chunks([path], size)
    assert table["pair_id"].tolist() == ["a", "c", "d", "e", "g"]
    assert [(rejection.name, rejection.row, *rejection.reasons) for rejection in rejected] == [
        ("short", 3, "2 columns, the header has 10"),
        ("b", 4, OPEN),
        ("short too", 7, "1 columns, the header has 10"),
        ("f", 9, OPEN),
    ]


@pytest.mark.parametrize("size", [1, 1000])
@pytest.mark.parametrize("ending", ["\n", "\r", "\r\n"])
@pytest.mark.parametrize("block", [7, 1 << 20])
def test_every_line_is_read_rejected_or_blank(tmp_path, monkeypatch, size, ending, block):
    # would catch rows lost at the border of a block inside a quotation, and wrong line numbers
    monkeypatch.setattr(text_lines, "BLOCK", block)
    lines = [ZONED]
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
    path.write_text("\n".join([ZONED, _row("a"), _row("b"), ""]))
    inventory = PairInventory([path])
    path.write_text("\n".join([ZONED, _row("a"), ""]))
    message = "3 lines, of which 2 were read: was the file changed meanwhile"
    with pytest.raises(CatalogError, match=message):
        list(inventory.chunks(10))


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
    other.write_text("\n".join([ZONED, _row("a"), _row("z")]))
    _, rejected = _in_chunks([csv, other], 2)
    assert rejected[-1].source == str(other)
    assert rejected[-1].reasons == ("pair_id = 'a' occurs in an earlier row already",)


def test_numbers_of_carried_columns_are_numbers_in_every_chunk(tmp_path):
    # would catch a type that is guessed from the first rows: one zone is no whole number, one note
    # no number
    path = tmp_path / "pairs.csv"
    rows = [_row(f"p{i}", note=i, zone=i if i != 4 else 4.5) for i in range(9)]
    path.write_text("\n".join([ZONED, *rows, _row("q", note="x", zone="NA")]))
    for size in (2, 100):
        table, _ = _in_chunks([path], size)
        assert table["zone"].dtype == np.float64
        assert table["note"].tolist() == [*map(str, range(9)), "x"]
        assert np.isnan(table["zone"].iloc[-1])


def test_whole_file_faults_come_before_the_first_chunk(tmp_path):
    empty = tmp_path / "empty.csv"
    empty.write_text(ZONED + "\n")
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
    path.write_text(f"{ZONED},, \n{_row('a')},,x\n{_row('b')},,\n")
    table, rejected = _in_chunks([path], 10)
    assert table.columns.tolist() == ZONED.split(",")
    assert (table["pair_id"].tolist(), rejected) == (["a", "b"], [])


def test_equal_identifiers_have_equal_hashes():
    # blanks around an identifier do not count, an empty cell is an empty identifier
    hashes = name_hashes(stripped(pa.array(["a", " a ", "b", None, "", "a b"])))
    assert hashes[0] == hashes[1]
    assert hashes[3] == hashes[4]
    assert len(set(hashes.tolist())) == 4


@pytest.mark.parametrize("name", ["pairs.csv", "pairs.parquet"])
def test_what_is_written_is_read_back(tmp_path, name):
    table = simulated_pairs([10.0], [50.0], 30, seed=1, radius=2000.0, touching=0.5)
    write_pairs(table, tmp_path / "made.csv")
    pairs = read_pairs(tmp_path / "made.csv")
    pairs.attrs["rejected"] = ("not part of the table",)
    write_pairs(pairs, tmp_path / name)
    again = read_pairs(tmp_path / name)
    # would catch an index column, lost digits, and rows that went with the rejected ones
    pd.testing.assert_frame_equal(again, pairs, check_exact=True)
    assert pairs.attrs["rejected"]  # the table of the caller is as it was


def test_another_suffix_is_refused_before_anything_is_written(tmp_path):
    with pytest.raises(
        CatalogError, match=r"pairs.xlsx: unknown suffix '.xlsx', expected .csv or .parquet"
    ):
        write_pairs(pd.DataFrame({"gap": [0.1]}), tmp_path / "pairs.xlsx")
    assert list(tmp_path.iterdir()) == []


def test_unknown_columns_of_numbers_stay_numbers(write):
    pairs = read_pairs(write(f"{HEADER},floor area ratio\n{GOOD},2.5\n"))
    assert pairs["floor area ratio"].dtype == np.float64


def test_parquet_gives_the_same_as_csv(write, tmp_path):
    pairs = read_pairs(write(f"{HEADER}\n{GOOD}\n{GOOD.replace('007', '008')}\n"))
    pairs.attrs.clear()
    pairs.to_parquet(tmp_path / "pairs.parquet")
    assert_frame_equal(read_pairs(tmp_path / "pairs.parquet"), pairs)


def test_a_whole_column_of_text_rejects_rows_not_the_file(tmp_path):
    table = pd.DataFrame(
        {"pair_id": ["a"], "gap": ["wide"], "longitude_1": [1.0], "latitude_1": [1.0]}
    )
    table = table.assign(longitude_2=1.0, latitude_2=1.0, height_1=3.0, height_2=3.0)
    table.to_parquet(tmp_path / "pairs.parquet")
    assert read_pairs(tmp_path / "pairs.parquet")["gap"].isna().tolist() == [True]
    table.assign(latitude_1="north").to_parquet(tmp_path / "pairs.parquet")
    pairs = read_pairs(tmp_path / "pairs.parquet")
    assert pairs.empty
    assert pairs.attrs["rejected"][0].reasons == ("latitude_1 = 'north' is not a number",)


@pytest.mark.parametrize("position", [0, 5000, 19_000])
def test_a_quotation_mark_among_many_rows_loses_its_own_row_only(tmp_path, position):
    # blocks have 1 MB: would catch the 3 997 rows that one mark took away
    rows = [_row(f"p{i}", note="x" * 100) for i in range(20_000)]
    path = tmp_path / "pairs.csv"
    text = [ZONED, *rows[:position], _row("open", note='"x'), *rows[position:], ""]
    path.write_text("\n".join(text))
    table, rejected = _in_chunks([path], 7000)
    assert table["pair_id"].tolist() == [f"p{i}" for i in range(20_000)]
    line = position + 2
    assert [(rejection.name, rejection.row) for rejection in rejected] == [("open", line)]


def test_a_hash_is_that_of_every_block():
    # would catch hashes by the order of first occurrence, which differ from block to block
    whole = name_hashes(pa.array(["a", "b", "c"]))
    assert name_hashes(pa.array(["c", "a"])).tolist() == [whole[2], whole[0]]
