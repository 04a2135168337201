"""Words of headings and cells in several languages, from the one table ``words.csv``."""

import csv
from collections import defaultdict
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from unicodedata import combining, normalize


def plain_word(text: str) -> str:
    """
    Return a text in lower case, without accents and surrounding blanks, as words are compared.

    Examples
    --------
    >>> plain_word(" SEPARACIÓN "), plain_word("kat sayısı"), plain_word("BİTİŞİK")
    ('separacion', 'kat sayisi', 'bitisik')
    """
    decomposed = normalize("NFKD", normalize("NFKC", text).casefold())
    letters = "".join(letter for letter in decomposed if not combining(letter))
    return " ".join(letters.replace("ı", "i").split())


@cache
def word_rows() -> tuple[dict[str, str], ...]:
    """Return a row for each word of the table: ``meaning``, ``language``, ``sure``, ``word``."""
    text = files(__package__).joinpath("words.csv").read_text(encoding="utf-8")
    rows = csv.DictReader(line for line in text.splitlines() if not line.startswith("#"))
    return tuple({**row, "word": word} for row in rows for word in row.pop("words").split("|"))


@cache
def words(meaning: str) -> Mapping[str, frozenset[str]]:
    """
    Return the plain words of one meaning, longest first, each with its languages.

    Examples
    --------
    >>> "bitisik" in words("touching"), sorted(words("basement")["b"])
    (True, ['en', 'tr'])
    """
    languages = defaultdict[str, set[str]](set)
    for row in word_rows():
        if row["meaning"] == meaning:
            languages[plain_word(row["word"])].add(row["language"])
    return {word: frozenset(languages[word]) for word in sorted(languages, key=len, reverse=True)}


@cache
def named(kind: str) -> Mapping[str, str]:
    """
    Return plain word -> NAME, for all meanings ``kind.NAME``.

    Examples
    --------
    >>> named("system")["betonarme"], named("unit")["santimetre"]
    ('concrete_mrf', 'cm')
    """
    found = [row for row in word_rows() if row["meaning"].startswith(f"{kind}.")]
    return {plain_word(row["word"]): row["meaning"].partition(".")[2] for row in found}
