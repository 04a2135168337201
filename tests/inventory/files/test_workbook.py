"""Workbooks of every kind; hostile and damaged ones end in one line, before they take memory."""

import datetime
import re
import sys
import tracemalloc

import pytest
from messy_tables import NAMES, ROWS, changed_parts, with_shared_texts, workbook_of
from old_workbooks import workbook_of_kind
from pandas.testing import assert_frame_equal

from per_obspy import read_pairs
from per_obspy.errors import CatalogError, MissingExtra
from per_obspy.inventory.files import workbook

SHEET, TEXTS = "xl/worksheets/sheet1.xml", "xl/sharedStrings.xml"
MAIN = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"


@pytest.fixture
def write(tmp_path):
    """Return a function that writes a workbook of one sheet, whose parts may be replaced."""

    def write(rows=(NAMES, *ROWS), **parts):
        named = {"sheet": SHEET, "texts": TEXTS, "styles": "xl/styles.xml"}
        replaced = {named[name]: change for name, change in parts.items()}

        def change(name, content):
            return replaced[name](content) if name in replaced else content

        path = tmp_path / "pairs.xlsx"
        path.write_bytes(changed_parts(with_shared_texts(workbook_of({"Pairs": rows})), change))
        return path

    return write


def _sheet(rows: bytes) -> bytes:
    """Return the XML of a sheet."""
    head = f'<worksheet xmlns="{MAIN}"><sheetData>'.encode()
    return head + rows + b"</sheetData></worksheet>"


#: Part that is replaced -> its content -> what the line says.
HOSTILE = {
    "a sheet of zeros": ("sheet", lambda _: bytes(8 << 20), "document type or zero bytes"),
    "a row without an end": (
        "sheet",
        lambda _: _sheet(b'<row r="1">' + b'<c r="A1"/>' * 700_000),
        "no sheet has cells",
    ),
    "too many rows": (
        "sheet",
        lambda _: _sheet(b"<row></row>" * 1_100_000),
        "no sheet has cells",
    ),
    "texts larger than any table's": (
        "texts",
        lambda _: b"<sst>" + b"<si><t>x</t></si>" * 2_100_000,
        "34 MB unpacked, .* times as much as packed: at most 200",
    ),
    "styles without end": ("styles", lambda _: b"<a/>" * 600_000, "not a readable workbook"),
    "a cell at the end of the world": (
        "sheet",
        lambda xml: xml.replace(b'r="J3"', b'r="XFD1048576"'),
        "MiB of memory",
    ),
    "entities that grow": (
        "sheet",
        lambda xml: b'<!DOCTYPE x [<!ENTITY a "aaaaaaaa">]>' + xml,
        "has a document type",
    ),
    "an entity that is a file": (
        "texts",
        lambda _: (
            b'<!DOCTYPE x [<!ENTITY a SYSTEM "file:///etc/passwd">]><sst><si><t>&a;</t></si></sst>'
        ),
        "has a document type",
    ),
    "XML that ends": ("sheet", lambda xml: xml[: len(xml) // 2], "not a readable workbook"),
    "an index of no text": (
        "sheet",
        lambda xml: xml.replace(b"<v>0</v>", b"<v>99999</v>"),
        "not a readable workbook",
    ),
    "digits without end": (
        "sheet",
        lambda xml: xml.replace(b"<v>0.05</v>", b"<v>" + b"9" * 100_000 + b"</v>"),
        "not a readable workbook",
    ),
}


@pytest.mark.parametrize("kind", HOSTILE)
def test_a_hostile_workbook_is_refused_within_memory(write, kind):
    part, change, message = HOSTILE[kind]
    path = write(**{part: change})
    tracemalloc.start()
    try:
        with pytest.raises(CatalogError, match=message) as error:
            read_pairs(path)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert "\n" not in str(error.value)
    # The largest parts have 34 MB unpacked, of which a few are kept
    assert peak < 64 << 20


def test_a_row_is_where_its_cells_are(write):
    # would catch 1e9 blank rows that are made up to the row's number, and a last row that is lost
    path = write(sheet=lambda xml: xml.replace(b'<row r="4"', b'<row r="999999999"'))
    assert read_pairs(path)["pair_id"].tolist() == ["a", "b", "c"]


def test_cut_and_foreign_files(write):
    path = write()
    whole = path.read_bytes()
    for content, message in (
        (whole[: len(whole) // 2], "not a readable workbook"),
        (whole[:200] + bytes(300) + whole[500:], "not a readable workbook"),
        (b"\xd0\xcf\x11\xe0" + bytes(99), "it is an old Excel workbook, or one with a password"),
        (b"", "it is an empty file"),
    ):
        path.write_bytes(content)
        with pytest.raises(CatalogError, match=message):
            read_pairs(path)


def test_cells_are_what_the_program_stored(write):
    day = datetime.datetime(2026, 10, 5)
    rows = [
        NAMES,
        ["date", day, *ROWS[0][2:]],
        ["truth", True, *ROWS[0][2:]],
        ["error", "#REF!", *ROWS[0][2:]],
        [7, 0.1, *ROWS[0][2:9], "two\nlines"],
        [],
        ["computed", "=1/8|0.125", *ROWS[0][2:]],
    ]
    pairs = read_pairs(write(rows))
    assert pairs["pair_id"].tolist() == ["date", "truth", "error", "7", "computed"]
    assert pairs["gap"].tolist()[3:] == [0.1, 0.125]
    assert pairs["note"].tolist()[3:] == ["two lines", "corner"]
    assert pairs["cell_notes"].tolist() == [
        "gap = '2026-10-05 00:00:00' is not a number",
        "gap = 'True' is not a number",
        "gap = '#REF!' is not a number",
        "",
        "",
    ]
    # A place that is none rejects its row, with the number that it has in the sheet
    rows[1][2] = "#REF!"
    pairs = read_pairs(write(rows))
    rejected = [(row.row, row.name, *row.reasons) for row in pairs.attrs["rejected"]]
    assert rejected == [(2, "date", f"{NAMES[2]} = '#REF!' is not a number")]
    assert {row.source.partition(", ")[2] for row in pairs.attrs["rejected"]} == {"sheet 'Pairs'"}


def test_numbers_keep_all_their_digits(write):
    # would catch a cell that passes through a short text
    rows = [[*row[:2], row[2] + 1e-13, *row[3:]] for row in ROWS]
    pairs = read_pairs(write([NAMES, *rows]))
    assert pairs["longitude_1"].tolist() == [row[2] for row in rows]


def test_too_many_sheets(write):
    sheets = {str(number): [[number]] for number in range(workbook.MOST_SHEETS + 1)}
    path = write()
    path.write_bytes(workbook_of(sheets))
    with pytest.raises(CatalogError, match="101 sheets, at most 100"):
        read_pairs(path)


def test_a_formula_of_an_empty_text_is_empty(write):
    # would catch a spreadsheet's "" taken for a formula that was never computed
    def change(xml):
        cell = rb'<c r="B4"[^>]*><v>0</v></c>'
        return re.sub(cell, b'<c r="B4" t="str"><f>""</f><v></v></c>', xml)

    pairs = read_pairs(write(sheet=change))
    assert pairs["gap"].isna().tolist() == [False, False, True]
    assert "cell_notes" not in pairs


def test_a_last_row_of_uncomputed_formulas_is_no_blank_row(write):
    rows = [NAMES, *ROWS, [f"={cell!r}" for cell in ROWS[0]]]
    with pytest.raises(CatalogError, match="row 5, pair_id: a formula without a stored value"):
        read_pairs(write(rows))


@pytest.mark.parametrize("suffix", [".ods", ".xlsb", ".xls"])
def test_other_kinds_of_workbooks(write, suffix):
    path = write().with_suffix(suffix)
    path.write_bytes(workbook_of_kind(suffix, "Pairs", [NAMES, *ROWS]))
    pairs, expected = read_pairs(path), read_pairs(write())
    assert_frame_equal(pairs, expected)
    assert pairs.attrs["recognised"] == "sheet 'Pairs'"
    # An error is an unknown gap
    path.write_bytes(workbook_of_kind(suffix, "Pairs", [NAMES, ["a", "#REF!", *ROWS[0][2:]]]))
    assert read_pairs(path)["gap"].isna().tolist() == [True]
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(CatalogError, match=r"not a (readable )?workbook \("):
        read_pairs(path)


def test_a_missing_library_is_one_line_that_names_the_extra(write, monkeypatch):
    path = write()
    monkeypatch.setitem(sys.modules, "python_calamine", None)
    with pytest.raises(MissingExtra, match=r"pip install 'per_obspy\[spreadsheet\]'"):
        read_pairs(path)
