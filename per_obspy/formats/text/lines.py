"""
Text files of samples: lines, numbers and blocks of numbers.

Every fault is reported with its file, line and field.
"""

import re
from pathlib import Path
from typing import BinaryIO, NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.errors import RecordRejected

WaveformFile = str | Path | BinaryIO

#: characters of a decimal number; NumPy would also take "nan", "inf" and "1_000"
_NUMBER_LETTERS = b"0123456789+-.eE \n"

#: what may follow the last line
_PADDING = b"\x00\x1a\r\n "

#: largest numbers of characters of a line and a number; damaged files may have millions
LONGEST_LINE, LONGEST_NUMBER = 2000, 40

#: characters of a line that a message quotes
_QUOTED = 80

#: last lines whose numbers are compared with the last one; numbers of different forms from which on
#: the shortest of all is taken for a part of one; lines that end alike from which on they do so by
#: their format, not by chance (reasoned)
_COMPARED, _MANY, _FEW = 1001, 100, 20

#: a decimal number in a regular expression, and the same as a group; longer runs of digits are none
NUMBER = r"-?(?>\d{1,20}(?:\.\d{0,30})?|\.\d{1,30})(?!\d)"
DECIMAL = f"({NUMBER})"

#: a whole word that is a number, perhaps with an exponent
_WORD = re.compile(r" *+[-+]?+(?:\d++\.?+\d*+|\.\d++)(?:[eE][-+]?+\d++)?+ *+", re.ASCII)


class Text(NamedTuple):
    """
    A file as lines without their ends.

    Line numbers count from 0 in the code and from 1 in messages. A file may have been cut inside
    its last number, which its form then shows, the more so where its last line has no end.
    """

    name: str
    lines: list[str]
    is_ended: bool = True


def head(file: WaveformFile, size: int) -> bytes:
    """Return the first bytes of a file, fewer or none where they cannot be read; never raise."""
    try:
        if hasattr(file, "read"):
            start = file.read(size)
        else:
            with Path(file).open("rb") as opened:
                start = opened.read(size)
    except (OSError, ValueError, TypeError):
        return b""
    return start if isinstance(start, bytes) else b""


def head_lines(file: WaveformFile, size: int) -> list[str]:
    """Return the first lines of a file as text; the last one may be cut short."""
    return _lines(head(file, size))


def named_content(file: WaveformFile) -> tuple[str, bytes]:
    """Return the name of a file, which may be open, and its content."""
    if hasattr(file, "read"):
        return str(getattr(file, "name", "open file")), file.read()
    return str(file), Path(file).read_bytes()


def write_content(file: WaveformFile, content: bytes) -> None:
    """Write the content of a file, which may be open."""
    if hasattr(file, "write"):
        file.write(content)
    else:
        Path(file).write_bytes(content)


def read_text(file: WaveformFile) -> Text:
    """
    Read a file as lines.

    Any line end is understood. The encoding is Latin-1, which every byte is. Padding after the last
    line is dropped. A line of more than ``LONGEST_LINE`` characters is refused.
    """
    name, content = named_content(file)
    # A byte ends the last word of a whole file; zeros may fill a place that was never cut
    padding = content[len(content.rstrip(_PADDING)) :]
    text = Text(name, _lines(content), bool(padding.strip(b"\x00")))
    # Searching and padding take time and memory that grow with the longest line
    for line, row in enumerate(text.lines):
        if len(row) > LONGEST_LINE:
            refuse(text, line, "line", f"{len(row)} characters, at most {LONGEST_LINE}")
    return text


def _lines(content: bytes) -> list[str]:
    text = content.rstrip(_PADDING).decode("latin-1")
    return text.replace("\r\r\n", "\n").replace("\r\n", "\n").replace("\r", "\n").split("\n")


def refuse(text: Text, line: int, field: str, problem: str) -> NoReturn:
    """Raise the error of a field; it is cut where it quotes too much of the file."""
    raise RecordRejected(text.name, f"line {line + 1}, {field}: {problem}")


def line_at(text: Text, line: int, field: str) -> str:
    """Return a line that must be there."""
    if line >= len(text.lines):
        refuse(text, line, field, f"missing, the file ends after {len(text.lines)} lines")
    return text.lines[line]


def quote(text: Text, line: int) -> str:
    """Return the beginning of a line in quotes for a message, without blanks around it."""
    return repr(text.lines[line].strip()[:_QUOTED])


def match_line(
    text: Text, line: int, field: str, pattern: re.Pattern[str], problem: str = "{} gives none"
) -> re.Match[str]:
    """Return what a pattern finds on a line; ``{}`` in the problem is the line in quotes."""
    match = pattern.search(line_at(text, line, field))
    if match is None:
        refuse(text, line, field, problem.format(quote(text, line)))
    return match


def finite_number(text: Text, line: int, field: str, word: str) -> float:
    """Return a word of a line as a finite number."""
    # A word of millions of digits takes long to convert
    length = len(word.strip())
    if length > LONGEST_NUMBER:
        refuse(text, line, field, f"{length} characters, a number has at most {LONGEST_NUMBER}")
    if not _WORD.fullmatch(word):
        refuse(text, line, field, f"{word!r} is not a number")
    number = float(word)
    if not np.isfinite(number):
        refuse(text, line, field, f"{word!r} is not a finite number")
    return number


def count(text: Text, line: int, field: str, word: str) -> int:
    """Return a number of samples, lines or channels: a positive integer."""
    number = finite_number(text, line, field, word)
    if number < 1 or number != int(number):
        refuse(text, line, field, f"must be a positive whole number, got {word.strip()!r}")
    return int(number)


def interval(text: Text, line: int, field: str, value: str | float) -> float:
    """Return a sampling interval, s, or a sampling rate, Hz: from 1e-5 to 1e5."""
    number = finite_number(text, line, field, value) if isinstance(value, str) else value
    if not 1e-5 <= number <= 1e5:
        refuse(text, line, field, f"must be positive and plausible, got {str(value).strip()!r}")
    return number


def block_lines(samples: int, per_line: int) -> int:
    """Return the number of lines of a block."""
    return -(-samples // per_line)


def no_more(text: Text, line: int, samples: int) -> None:
    """Refuse lines after the last sample."""
    if line < len(text.lines):
        problem = f"more lines than the {samples} samples that the header promises take"
        refuse(text, line, "samples", problem)


def fixed_block(text: Text, start: int, samples: int, width: int, per_line: int) -> FloatArray:
    """
    Read a block of numbers in columns of fixed width, which may touch each other.

    Parameters
    ----------
    text, start
        The file, and the line of the first number.
    samples : int
        Numbers of the block, dimensionless.
    width, per_line : int
        Characters of a number, numbers of a full line.
    """
    full = width * per_line
    if width > LONGEST_NUMBER or full > LONGEST_LINE:
        refuse(text, start - 1, "format", f"{per_line} numbers of {width} characters a line")
    rows = _block_rows(text, start, samples, per_line, full)
    # A line that is not full lacks a number; padding many of them would fill the memory
    values = None
    if all(len(row) > full - width for row in rows[:-1]):
        if start + len(rows) == len(text.lines):
            _refuse_short_column(text, rows, width)
        values = _columns(rows, samples, width, full)
    # Search for the wrong number only when there is one
    if values is None:
        _refuse_fixed(text, start, rows, samples, width, per_line)
    return values


def _block_rows(text: Text, start: int, samples: int, per_line: int, full: int) -> list[str]:
    """Return the lines of a block without trailing blanks, none longer than a full one."""
    lines = block_lines(samples, per_line)
    rows = [row.rstrip() for row in text.lines[start : start + lines]]
    if len(rows) < lines:
        promise = f"the header promises {samples} on {lines} lines"
        problem = f"{promise}, the file ends after {len(rows)} of them"
        refuse(text, len(text.lines), "samples", problem)
    # Longer lines belong to another format
    if max(map(len, rows)) > full:
        index, row = next((index, row) for index, row in enumerate(rows) if len(row) > full)
        refuse(text, start + index, "samples", f"{len(row)} characters, the format has {full}")
    return rows


def _columns(rows: list[str], samples: int, width: int, full: int) -> FloatArray | None:
    """Return the numbers of a block in columns; None if there is anything else."""
    # Pad every line to its full length, so that number i begins at character i * width
    block = "".join([row.ljust(full) for row in rows]).encode("latin-1")
    # Only blanks may follow the last number, and only letters of numbers may occur anywhere
    if block[samples * width :].strip() or block.translate(None, _NUMBER_LETTERS):
        return None
    return _floats(np.frombuffer(block, dtype=f"S{width}")[:samples])


def _floats(words: NDArray[np.bytes_]) -> FloatArray | None:
    """Return words as finite numbers; None if one is not."""
    try:
        values = words.astype(np.float64)
    except ValueError:
        return None
    return values if np.isfinite(values).all() else None


def _refuse_fixed(
    text: Text, start: int, rows: list[str], samples: int, width: int, per_line: int
) -> NoReturn:
    """Refuse the first line of a block in columns that does not hold its share of numbers."""
    for index, row in enumerate(rows):
        words = [row[first : first + width] for first in range(0, len(row), width)]
        # Name the first word that is no number by its place in the whole block
        for sample, word in enumerate(words, index * per_line + 1):
            finite_number(text, start + index, f"sample {sample}", word)
        # Every line is full but the last, which holds the rest
        expected = min(per_line, samples - index * per_line)
        if len(words) != expected:
            problem = f"{len(words)} numbers instead of {expected} of the {samples}"
            refuse(text, start + index, "samples", problem)
    refuse(text, start, "samples", "not a block of numbers")


def free_block(text: Text, start: int, samples: int) -> FloatArray:
    """
    Read numbers separated by white space from a line to the end of the file.

    There must be as many as the header promises.
    """
    rows = text.lines[start:]
    content = "\n".join(rows).encode("latin-1")
    words = content.split()
    values = None
    # An array of words takes the memory of the longest one for each of them
    longest = max(map(len, words), default=0)
    if 0 < longest <= LONGEST_NUMBER and not content.translate(None, _NUMBER_LETTERS):
        values = _floats(np.array(words))
    # Search for the wrong word only when there is one
    if values is None:
        for index, row in enumerate(rows):
            for word in row.split():
                finite_number(text, start + index, "samples", word)
        refuse(text, start, "samples", "none")
    _refuse_another_form(text, rows)
    if len(values) != samples:
        problem = f"the header promises {samples}, the file holds {len(values)}"
        refuse(text, start + len(rows) - 1, "samples", problem)
    return values


def _refuse_short_column(text: Text, rows: list[str], width: int) -> None:
    """Refuse a last number that ends at another place of its column than the others."""
    *cells, last = [
        row[first : first + width].rstrip()
        for row in rows[-_COMPARED:]
        for first in range(0, len(row), width)
    ]
    # Numbers at the right of their columns all end at one place; at the left, their forms tell
    ends = {len(cell) for cell in cells}
    is_early = not text.is_ended and (len(rows[-1]) - len(rows[0][:width].rstrip())) % width
    if is_early or (len(ends) == 1 and len(last) < min(ends)) or _is_short(last, cells):
        _refuse_cut(text, f"{last!r} ends before its column")


def _refuse_another_form(text: Text, rows: list[str]) -> None:
    """Refuse a last number that is not written like those above it, or like those before it."""
    filled = [row for row in rows if row.strip()]
    endings = [row.split()[-1] for row in filled]
    forms = {_form(word) for word in endings}
    # Whole numbers have no form that shows their end
    is_doubtful = not text.is_ended and (len(forms) > 1 or forms == {(-1, 0)})
    # Numbers of the same place in their lines
    place = len(filled[-1].split()) - 1
    above = [row for row in filled[-_COMPARED:-1] if len(row.split()) > place]
    others = [row.split()[place] for row in above] or filled[-1].split()[:-1]
    is_doubtful |= _ends_early(filled[-1], above, place)
    if is_doubtful or _is_short(endings[-1], others):
        _refuse_cut(text, f"{endings[-1]!r} may be a part of one")


def _is_short(word: str, others: list[str]) -> bool:
    """
    Check whether a number has fewer decimals or a shorter exponent than every other.

    Where the others have different forms, one of them is the shortest, and may be the last by
    chance: of ``_MANY`` in a hundredth of the files.

    >>> _is_short("1.2", ["0.25", "1.50"]), _is_short("1.20", ["0.25", "1.50"])
    (True, False)
    """
    forms = {_form(other) for other in others}
    if len(others) < 2 or (len(forms) > 1 and len(others) < _MANY):
        return False
    decimals, exponent = _form(word)
    fewest, shortest = map(min, zip(*forms, strict=True))
    return bool(decimals < fewest or exponent < shortest)


def _ends_early(row: str, above: list[str], place: int) -> bool:
    """Check whether the last word of a line ends before the end that all above it share."""
    words = [[*re.finditer(r"\S+", other)][place] for other in above]
    # Words of several lengths with one end are in a column
    ends = {word.end() for word in words}
    starts = {word.start() for word in words}
    is_column = len(above) >= _FEW and len(ends) == 1 < len(starts)
    return is_column and len(row.rstrip()) < min(ends)


def _form(word: str) -> tuple[int, int]:
    """
    Return the numbers of decimals, -1 where there is no point, and of characters of the exponent.

    >>> _form("-1.250E-03"), _form("12."), _form("7")
    ((3, 3), (0, 0), (-1, 0))
    """
    mantissa, _, exponent = word.strip().upper().partition("E")
    _, point, decimals = mantissa.partition(".")
    return len(decimals) if point else -1, len(exponent)


def _refuse_cut(text: Text, problem: str) -> NoReturn:
    """Refuse a file that may have been cut inside its last number."""
    if text.is_ended:
        problem = f"{problem}, unlike the numbers above it: get the file again"
    else:
        mend = "get the file again, or end its last line if it is whole"
        problem = f"{problem}, without an end of line after it: {mend}"
    refuse(text, len(text.lines) - 1, "last number", problem)
