"""Checks that a file is a UTF-8, comma-separated table, with clearer messages than the reader's."""

import codecs
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from per_obspy.errors import CatalogError
from per_obspy.files import looks_like

#: Bytes read at once.
BLOCK = 1 << 20

#: Separators other than the comma, as messages name them.
OTHER_SEPARATORS = {";": "semicolons", "\t": "tabulators", "|": "vertical bars"}


def check_text(file: Path) -> bool:
    """
    Check that a file is text in UTF-8 and return whether it contains quotation marks.

    Raises
    ------
    CatalogError
        If it is of another kind, contains a zero byte or is not UTF-8, naming the line.
    """
    if kind := looks_like(file):
        raise CatalogError(str(file), f"not a CSV table: it is {kind}")
    # Decode block by block, so that a file of any size fits
    decoder, quoted = codecs.getincrementaldecoder("utf-8")(), False
    try:
        with file.open("rb") as stream:
            while block := stream.read(BLOCK):
                decoder.decode(block)
                quoted = quoted or b'"' in block
                if b"\0" in block:
                    problem = "not a CSV table: it holds zero bytes, as no text does"
                    raise CatalogError(str(file), problem)
        decoder.decode(b"", final=True)
    except UnicodeDecodeError as error:
        raise CatalogError(str(file), _undecodable(file)) from error
    return quoted


def _undecodable(file: Path) -> str:
    """Return the line and byte at which a file is not UTF-8."""
    with file.open("rb") as text:
        for number, line in enumerate(text, start=1):
            try:
                line.decode("utf-8")
            except UnicodeDecodeError as error:
                byte, position = line[error.start], error.start + 1
                return f"line {number} is not UTF-8 (byte 0x{byte:02x} at position {position})"
    return "the end is not UTF-8"


def open_quotation(file: Path) -> str:
    """Return the first line with a quotation mark that is not closed on it; empty if none."""
    with file.open(encoding="utf-8") as text:
        for number, line in enumerate(text, start=1):
            if line.count('"') % 2 and (line.startswith('"') or ',"' in line):
                return f"line {number} has a quotation mark that is not closed on it"
    return ""


def check_separator(file: Path, names: list[str]) -> None:
    """
    Check that the columns of a header are separated by commas.

    Raises
    ------
    CatalogError
        If the header is one name that contains another separator.
    """
    for sign, kind in OTHER_SEPARATORS.items():
        if len(names) == 1 and sign in names[0]:
            raise CatalogError(str(file), f"columns are separated by {kind}, commas are expected")


def line_breaks(table: pa.Table) -> NDArray[np.int64]:
    """Return the number of line breaks inside the cells of each row, as an open quotation makes."""
    breaks = np.zeros(len(table), dtype=np.int64)
    for column in table.columns:
        breaks += np.asarray(pc.count_substring(column, "\n"), dtype=np.int64)
    return breaks
