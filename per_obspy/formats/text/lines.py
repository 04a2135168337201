"""Text files of samples: lines, fields of a header, and blocks of numbers, each fault named by file, line and field."""

from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.errors import RecordRejected

WaveformFile = str | Path | BinaryIO

#: what a decimal number is made of; NumPy would also take "nan", "inf" and "1_000"
_NUMBER_LETTERS = b"0123456789+-.eE \n"

_LONGEST_LINE = 10_000  # characters; a format that promises more is damaged

#: a decimal number in a regular expression
DECIMAL = r"(-?(?:\d+\.?\d*|\.\d+))"


class Text(NamedTuple):
    """A file as lines without their ends; line numbers in the code count from 0, in messages from 1."""

    name: str
    lines: list[str]


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


def read_text(file: WaveformFile) -> Text:
    """Return a file as lines: any line end, Latin-1 (which every byte is), without padding after the last line."""
    if hasattr(file, "read"):
        return Text(str(getattr(file, "name", "open file")), _lines(file.read()))
    return Text(str(file), _lines(Path(file).read_bytes()))


def _lines(content: bytes) -> list[str]:
    text = content.decode("latin-1").rstrip("\x00\x1a\r\n ")
    return text.replace("\r\r\n", "\n").replace("\r\n", "\n").replace("\r", "\n").split("\n")


def refuse(text: Text, line: int, field: str, problem: str) -> NoReturn:
    """Raise the error of a field."""
    raise RecordRejected(text.name, f"line {line + 1}, {field}: {problem}")


def line_at(text: Text, line: int, field: str) -> str:
    """Return a line that must be there."""
    if line >= len(text.lines):
        refuse(text, line, field, f"missing, the file ends after {len(text.lines)} lines")
    return text.lines[line]


def number(text: Text, line: int, field: str, value: str) -> float:
    """Return a finite number that was found on a line."""
    try:
        result = float(value)
    except ValueError:
        refuse(text, line, field, f"{value.strip()!r} is not a number")
    if not np.isfinite(result) or "_" in value:
        refuse(text, line, field, f"{value.strip()!r} is not a finite number")
    return result


def count(text: Text, line: int, field: str, value: str) -> int:
    """Return a number of samples, lines or channels: a positive integer."""
    result = number(text, line, field, value)
    if result < 1 or result != int(result):
        refuse(text, line, field, f"must be a positive whole number, got {value.strip()!r}")
    return int(result)


def interval(text: Text, line: int, field: str, value: str | float) -> float:
    """Return a sampling interval, s, or a sampling rate, Hz: from 1e-5 to 1e5."""
    result = number(text, line, field, value) if isinstance(value, str) else float(value)
    if not 1e-5 <= result <= 1e5:
        refuse(text, line, field, f"must be positive and plausible, got {str(value).strip()!r}")
    return result


def fixed_block(text: Text, start: int, samples: int, width: int, per_line: int) -> FloatArray:
    """
    Return numbers that stand in columns, so that neighbours may touch.

    Parameters
    ----------
    text : Text
        The file.
    start : int
        Line of the first number.
    samples : int
        How many numbers there must be, dimensionless.
    width, per_line : int
        Characters of a number, numbers of a full line.
    """
    full = width * per_line
    if full > _LONGEST_LINE:
        refuse(text, start - 1, "format", f"{per_line} numbers of {width} characters a line")
    rows = _rows(text, start, block_lines(samples, per_line), samples)
    lengths = np.fromiter(map(len, rows), dtype=np.intp, count=len(rows))
    if lengths.max() > full:
        line = int(np.argmax(lengths > full))
        refuse(text, start + line, "samples", f"{lengths[line]} characters, the format has {full}")
    block = "".join([row.ljust(full) for row in rows]).encode("latin-1")
    values = _floats(np.frombuffer(block, dtype=f"S{width}")[:samples])
    extra = block[samples * width :].strip()
    if values is None or extra or block.translate(None, _NUMBER_LETTERS):
        _refuse_fixed(text, start, rows, samples, width, per_line)
    return values


def block_lines(samples: int, per_line: int) -> int:
    """Return how many lines a block takes."""
    return -(-samples // per_line)


def no_more(text: Text, line: int, samples: int) -> None:
    """Refuse what follows the last sample."""
    if line < len(text.lines):
        refuse(
            text,
            line,
            "samples",
            f"more lines than the {samples} samples that the header promises take",
        )


def free_block(text: Text, start: int, stop: int | None, samples: int | None) -> FloatArray:
    """Return numbers separated by white space on the lines from start to stop; they must be as many as samples."""
    rows = text.lines[start:stop]
    content = "\n".join(rows).encode("latin-1")
    tokens = content.split()
    values = (
        _floats(np.array(tokens))
        if tokens and not content.translate(None, _NUMBER_LETTERS)
        else None
    )
    if values is None:
        _refuse_free(text, start, rows)
    if samples is not None and len(values) != samples:
        refuse(
            text,
            start + len(rows) - 1,
            "samples",
            f"the header promises {samples}, the file holds {len(values)}",
        )
    return values


def _rows(text: Text, start: int, lines: int, samples: int) -> list[str]:
    rows = [row.rstrip() for row in text.lines[start : start + lines]]
    if len(rows) < lines:
        refuse(
            text,
            len(text.lines),
            "samples",
            f"the header promises {samples} on {lines} lines, the file ends after {len(rows)} of them",
        )
    return rows


def _floats(fields: NDArray[np.bytes_]) -> FloatArray | None:
    try:
        values = fields.astype(np.float64)
    except ValueError:
        return None
    return values if np.isfinite(values).all() else None


def _refuse_fixed(
    text: Text, start: int, rows: list[str], samples: int, width: int, per_line: int
) -> NoReturn:
    for index, row in enumerate(rows):
        fields = [row[first : first + width] for first in range(0, len(row), width)]
        wrong = next((field for field in fields if not _is_number(field)), None)
        if wrong is not None:
            refuse(
                text,
                start + index,
                f"sample {index * per_line + fields.index(wrong) + 1}",
                f"{wrong!r} is not a number",
            )
        expected = min(per_line, samples - index * per_line)
        if len(fields) != expected:
            refuse(
                text,
                start + index,
                "samples",
                f"{len(fields)} numbers instead of {expected} of the {samples}",
            )
    refuse(text, start, "samples", "not a block of numbers")


def _refuse_free(text: Text, start: int, rows: list[str]) -> NoReturn:
    for index, token in _tokens(rows):
        if not _is_number(token):
            refuse(text, start + index, "samples", f"{token!r} is not a number")
    refuse(text, start, "samples", "none")


def _tokens(rows: list[str]) -> Iterator[tuple[int, str]]:
    return ((index, token) for index, row in enumerate(rows) for token in row.split())


def _is_number(field: str) -> bool:
    if field.encode("latin-1").translate(None, _NUMBER_LETTERS):
        return False
    return _floats(np.array([field.encode("latin-1")])) is not None
