"""Checks of CSV text: encoding, zero bytes, separators, number of lines."""

import pytest

from per_obspy.errors import CatalogError
from per_obspy.inventory.recognition import csv_text
from per_obspy.inventory.recognition.csv_text import check_separator, check_text


@pytest.fixture
def write(tmp_path):
    def write(content):
        (tmp_path / "pairs.csv").write_bytes(content)
        return tmp_path / "pairs.csv"

    return write


@pytest.mark.parametrize("block", [1, 2, 3, 1 << 20])
def test_a_character_may_lie_across_blocks(write, monkeypatch, block):
    # would catch blocks that are decoded by themselves
    monkeypatch.setattr(csv_text, "BLOCK", block)
    assert check_text(write("pair_id,note\na,café €\n".encode())) == 2


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
    monkeypatch.setattr(csv_text, "BLOCK", block)
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
    monkeypatch.setattr(csv_text, "BLOCK", block)
    assert check_text(write(text.encode())) == lines
