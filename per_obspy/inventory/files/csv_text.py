"""What makes a file no CSV table and a line no row, where the reader itself would keep silent or say too little."""

import codecs
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from per_obspy.errors import CatalogError
from per_obspy.files import looks_like

BLOCK = 1 << 20

#: What stands between columns where commas are expected.
OTHER_SEPARATORS = {";": "semicolons", "\t": "tabulators", "|": "vertical bars"}


def check_text(file: Path) -> bool:
    """
    Check that a file is text in UTF-8, and return whether it has quotation marks.

    Raises
    ------
    CatalogError
        If it is of another kind, holds a zero byte or is not UTF-8, naming the line.
    """
    if kind := looks_like(file):
        raise CatalogError(str(file), f"not a CSV table: it is {kind}")
    decoder, quoted = codecs.getincrementaldecoder("utf-8")(), False
    try:
        with file.open("rb") as stream:
            while block := stream.read(BLOCK):
                decoder.decode(block)
                quoted = quoted or b'"' in block
                if b"\0" in block:
                    raise CatalogError(
                        str(file), "not a CSV table: it holds zero bytes, as no text does"
                    )
        decoder.decode(b"", final=True)
    except UnicodeDecodeError as error:
        raise CatalogError(str(file), _undecodable(file)) from error
    return quoted


def _undecodable(file: Path) -> str:
    """Return where the file is not UTF-8."""
    with file.open("rb") as text:
        for number, line in enumerate(text, start=1):
            try:
                line.decode("utf-8")
            except UnicodeDecodeError as error:
                return f"line {number} is not UTF-8 (byte 0x{line[error.start]:02x} at position {error.start + 1})"
    return "the end is not UTF-8"


def open_quotation(file: Path) -> str:
    """Return which line has a cell whose quotation mark is not closed on it, as the reader needs; empty if none."""
    with file.open(encoding="utf-8") as text:
        for number, line in enumerate(text, start=1):
            if line.count('"') % 2 and (line.startswith('"') or ',"' in line):
                return f"line {number} has a quotation mark that is not closed on it"
    return ""


def check_separator(file: Path, names: list[str]) -> None:
    """
    Check that the header has commas.

    Raises
    ------
    CatalogError
        If other separators stand there instead.
    """
    found = [
        kind for sign, kind in OTHER_SEPARATORS.items() if len(names) == 1 and sign in names[0]
    ]
    if found:
        raise CatalogError(str(file), f"columns are separated by {found[0]}, commas are expected")


def line_breaks(table: pa.Table) -> NDArray[np.int64]:
    """Return how many line breaks stand inside the cells of each row: a quotation mark swallows what follows."""
    breaks = np.zeros(len(table), dtype=np.int64)
    for column in table.columns:
        breaks += np.asarray(pc.count_substring(column, "\n"), dtype=np.int64)
    return breaks
