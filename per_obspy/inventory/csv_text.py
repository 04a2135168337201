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


def check_text(file: Path) -> None:
    """
    Check that a file is text in UTF-8.

    Raises
    ------
    CatalogError
        If it is of another kind, holds a zero byte or is not UTF-8, naming the line.
    """
    if kind := looks_like(file):
        raise CatalogError(str(file), f"not a CSV table: it is {kind}")
    decoder = codecs.getincrementaldecoder("utf-8")()
    try:
        with file.open("rb") as stream:
            while block := stream.read(BLOCK):
                decoder.decode(block)
                if b"\0" in block:
                    raise CatalogError(str(file), "not a CSV table: it holds zero bytes, as no text does")
        decoder.decode(b"", final=True)
    except UnicodeDecodeError as error:
        raise CatalogError(str(file), _undecodable(file)) from error


def _undecodable(file: Path) -> str:
    """Return where the file is not UTF-8."""
    with file.open("rb") as text:
        for number, line in enumerate(text, start=1):
            try:
                line.decode("utf-8")
            except UnicodeDecodeError as error:
                return f"line {number} is not UTF-8 (byte 0x{line[error.start]:02x} at position {error.start + 1})"
    return "the end is not UTF-8"


def check_separator(file: Path, names: list[str]) -> None:
    """
    Check that the header has commas.

    Raises
    ------
    CatalogError
        If other separators stand there instead.
    """
    found = [kind for sign, kind in OTHER_SEPARATORS.items() if len(names) == 1 and sign in names[0]]
    if found:
        raise CatalogError(str(file), f"columns are separated by {found[0]}, commas are expected")


def line_breaks(table: pa.Table) -> NDArray[np.int64]:
    """Return how many line breaks stand inside the cells of each row: a quotation mark swallows what follows."""
    breaks = np.zeros(len(table), dtype=np.int64)
    for column in table.columns:
        breaks += np.asarray(pc.count_substring(column, "\n"), dtype=np.int64)
    return breaks
