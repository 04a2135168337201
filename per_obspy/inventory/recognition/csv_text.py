"""Text of CSV files as UTF-8, whatever its encoding, with clearer messages than the reader's."""

import codecs
from collections.abc import Iterator
from pathlib import Path

from per_obspy.errors import CatalogError
from per_obspy.files import looks_like

#: Bytes read at once.
BLOCK = 1 << 20

#: Separators other than the comma, as messages name them.
OTHER_SEPARATORS = {";": "semicolons", "\t": "tabulators", "|": "vertical bars"}

#: The encoding of plain tables.
UTF_8 = "utf-8"


def text_blocks(file: Path, encoding: str = UTF_8) -> Iterator[bytes]:
    """
    Yield the text of a file in UTF-8, without a mark of the byte order.

    Parameters
    ----------
    file : Path
        Text.
    encoding : str
        That of the file; UTF-8 is passed on as it is, right or wrong.

    Raises
    ------
    UnicodeDecodeError
        If the file is in another encoding than UTF-8 and than this one.
    """
    mark = codecs.BOM_UTF8
    with file.open("rb") as stream:
        if encoding == UTF_8:
            if stream.read(len(mark)) != mark:
                stream.seek(0)
            while block := stream.read(BLOCK):
                yield block
            return
        # A character may lie across blocks
        decoder = codecs.getincrementaldecoder(encoding)()
        while block := stream.read(BLOCK):
            yield decoder.decode(block).encode("utf-8", "surrogatepass")
        yield decoder.decode(b"", final=True).encode("utf-8", "surrogatepass")


def check_text(file: Path, encoding: str = UTF_8) -> int:
    """
    Check that a file is text in an encoding and return the number of its lines.

    Raises
    ------
    CatalogError
        If it is of another kind, contains a zero byte or is not in this encoding, naming the line.
    """
    if kind := looks_like(file):
        raise CatalogError(str(file), f"not a CSV table: it is {kind}")
    # Decode block by block, so that a file of any size fits
    decoder, lines, last = codecs.getincrementaldecoder(UTF_8)(), 0, b""
    try:
        for block in text_blocks(file, encoding):
            decoder.decode(block)
            lines, last = lines + _line_ends(block, last), block[-1:] or last
            if b"\0" in block:
                problem = "not a CSV table: it holds zero bytes, as no text does"
                raise CatalogError(str(file), problem)
        decoder.decode(b"", final=True)
    except UnicodeDecodeError as error:
        problem = _undecodable(file) if encoding == UTF_8 else f"is no text in {encoding}: {error}"
        raise CatalogError(str(file), problem) from error
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
