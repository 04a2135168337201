"""Encodings of a text: UTF-8, UTF-16 by its mark, or a code page of spreadsheet programs."""

import codecs
import re
from pathlib import Path

from per_obspy.errors import CatalogError, did_you_mean
from per_obspy.inventory.recognition.csv_text import BLOCK, UTF_8, check_text

#: Code pages that are tried where a text is not UTF-8: of western Europe, Turkey and Japan.
CODE_PAGES = ("cp1252", "cp1254", "cp932")

#: Pages for which headings have to decide, because other text can be in them as well.
TURKISH_PAGE, JAPANESE = CODE_PAGES[1:]

#: Encodings that a configuration may name: those of texts, none of which is a program.
NAMED = (
    *(UTF_8, "utf-16", "utf-16-le", "utf-16-be", "ascii", "latin-1", "iso8859-9", "iso8859-15"),
    *(f"cp125{number}" for number in range(9)),
    *("cp437", "cp850", "cp852", "cp857", "cp932", "shift_jis", "euc_jp", "gb18030", "big5"),
    *("euc_kr", "mac-roman"),
)

#: Letters of the western code page whose bytes are other letters in the Turkish one.
TURKISH = "ÐÝÞðýþ"

#: A letter of several bytes as UTF-8 has it.
_UTF_8_LETTER = re.compile(
    rb"[\xc2-\xdf][\x80-\xbf]|[\xe1-\xec\xee\xef][\x80-\xbf]{2}|[\xf1-\xf3][\x80-\xbf]{3}"
)

_MARKS = {codecs.BOM_UTF8: UTF_8, codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16"}

_MEND = 'save it as "CSV UTF-8", or give encoding = "cp1254" or the like in [pairs]'


def possible_encodings(file: Path, given: str | None = None) -> dict[str, int | None]:
    """
    Return the encodings in which the whole of a text can be, the most usual first.

    Each has the number of lines, None where they have not been counted.

    Parameters
    ----------
    file : Path
        Text.
    given : str, optional
        The encoding, if it is known.

    Raises
    ------
    CatalogError
        If it is in none, or not in the configured one.
    """
    if given is not None:
        name = _named(file, given)
        return {name: check_text(file, name)}
    with file.open("rb") as stream:
        start = stream.read(4)
    marked = next((name for mark, name in _MARKS.items() if start.startswith(mark)), None)
    if marked:
        return {marked: check_text(file, marked)}
    # A fault that is none of the encoding is raised as it is
    try:
        return {UTF_8: check_text(file)}
    except CatalogError as error:
        pages = () if "UTF-8" not in error.problem else _code_pages(file)
        if not pages:
            mend = f"; {_MEND}" if "UTF-8" in error.problem else ""
            raise CatalogError(str(file), error.problem + mend) from error
        return dict.fromkeys(pages)


def _named(file: Path, given: str) -> str:
    """Return the encoding for a configured name."""
    try:
        name = codecs.lookup(given).name
    except (LookupError, ValueError):
        name = ""
    # Any spelling of a name that Python knows
    known = {codecs.lookup(encoding).name: encoding for encoding in NAMED}
    if name not in known:
        meant = did_you_mean(given, NAMED)
        problem = f"encoding = {given!r:.40} is not known{meant}; known are {', '.join(NAMED)}"
        raise CatalogError(str(file), problem)
    return known[name]


def _code_pages(file: Path) -> tuple[str, ...]:
    """Return the code pages in which a text can be; a text of UTF-8 letters is no western one."""
    possible = {name: codecs.getincrementaldecoder(name)() for name in CODE_PAGES}
    plain, last = {UTF_8: codecs.getincrementaldecoder(UTF_8)()}, b""
    with file.open("rb") as stream:
        while block := stream.read(BLOCK):
            possible, plain = _decoding(possible, block), _decoding(plain, block)
            # Damaged UTF-8: its letters are hardly ever text of a code page
            if _UTF_8_LETTER.search(last + block):
                possible = {name: possible[name] for name in possible if name == JAPANESE}
            last = block[-3:]
    # UTF-8 to the last letter, which was cut
    return () if plain else tuple(_decoding(possible, b"", final=True))


def _decoding(
    decoders: dict[str, codecs.IncrementalDecoder], block: bytes, final: bool = False
) -> dict[str, codecs.IncrementalDecoder]:
    """Return the decoders that can decode a block."""
    found = {}
    for name, decoder in decoders.items():
        try:
            decoder.decode(block, final)
        except UnicodeDecodeError:
            continue
        found[name] = decoder
    return found


def two_pages(name: str, text: str) -> str:
    """Return a message on uncertain letters of a text in a Western code page, and the remedy."""
    turkish = text.encode("cp1252").decode("cp1254")
    reason = f"{name} = {text!r:.40} in cp1252, {turkish!r:.40} in cp1254"
    return f'{reason}, and no heading decides: give encoding = "cp1252" or "cp1254" in [pairs]'
