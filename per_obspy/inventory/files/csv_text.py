"""Checks that a file is a UTF-8, comma-separated table, with clearer messages than the reader's."""

import codecs
from pathlib import Path

from per_obspy.errors import CatalogError
from per_obspy.files import looks_like

#: Bytes read at once.
BLOCK = 1 << 20

#: Separators other than the comma, as messages name them.
OTHER_SEPARATORS = {";": "semicolons", "\t": "tabulators", "|": "vertical bars"}


def check_text(file: Path) -> int:
    """
    Check that a file is text in UTF-8 and return the number of its lines.

    Raises
    ------
    CatalogError
        If it is of another kind, contains a zero byte or is not UTF-8, naming the line.
    """
    if kind := looks_like(file):
        raise CatalogError(str(file), f"not a CSV table: it is {kind}")
    # Decode block by block, so that a file of any size fits
    decoder, lines, last = codecs.getincrementaldecoder("utf-8")(), 0, b""
    try:
        with file.open("rb") as stream:
            while block := stream.read(BLOCK):
                decoder.decode(block)
                lines, last = lines + _line_ends(block, last), block[-1:]
                if b"\0" in block:
                    problem = "not a CSV table: it holds zero bytes, as no text does"
                    raise CatalogError(str(file), problem)
        decoder.decode(b"", final=True)
    except UnicodeDecodeError as error:
        raise CatalogError(str(file), _undecodable(file)) from error
    # The last line may lack its end
    return lines + (last not in (b"\n", b"\r"))


def _line_ends(block: bytes, before: bytes) -> int:
    """Return the number of line ends of any kind in a block; ``before`` is the byte before it."""
    pairs = block.count(b"\r\n") + (before == b"\r" and block.startswith(b"\n"))
    return block.count(b"\n") + block.count(b"\r") - pairs


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
