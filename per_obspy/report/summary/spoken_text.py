"""``summary.txt``: plain lines that can be read aloud over the radio."""

import re
from pathlib import Path
from textwrap import wrap
from unicodedata import category, normalize

from per_obspy.files import written_whole
from per_obspy.report.coverage import coverage_sentences
from per_obspy.report.results import Results
from per_obspy.report.statements import (
    LISTED,
    alert,
    alert_line,
    building_sentence,
    first_steps,
    key_numbers,
    made_sentence,
    pair_sentence,
    revision_line,
    station_sentences,
    sureness,
)
from per_obspy.report.texts import LANGUAGES

#: Longest line, characters.
WIDTH = 72

#: ASCII characters that are neither spoken nor a pause, and become a blank.
_UNSPOKEN = re.compile(r"[^A-Za-z0-9 .,:;()'/\x80-\U0010ffff-]")

#: Accents that stand by themselves: those of other scripts are parts of their words.
_ACCENTS = range(0x300, 0x370)

#: Symbols with a word, and the keys of the words.
_WORDS = {
    "m/s": "spoken_speed", "%": "spoken_percent", "°": "spoken_degrees", "&": "spoken_and",
    "+": "spoken_plus", "–": "spoken_to", "≥": "spoken_from",
}  # fmt: skip


def spoken(text: str, language: str = "en") -> str:
    """
    Return a text as letters and digits: no accents, symbols as words or blanks.

    Letters without a plain form stay: a name that lacks some would be another one.

    Examples
    --------
    >>> spoken("Añasco_1 <script>"), spoken("84 %"), spoken("Yıldız, חיפה")
    ('Anasco 1 script', '84 percent', 'Yıldız, חיפה')
    """
    for symbol, key in _WORDS.items():
        text = text.replace(symbol, f" {LANGUAGES[language][key]} ")
    letters = "".join(map(_plain, normalize("NFKC", text)))
    # A word that replaces a symbol stands right before what follows it
    return re.sub(r" (?=[.,:;)])", "", " ".join(_UNSPOKEN.sub(" ", letters).split()))


def _plain(letter: str) -> str:
    """Return a letter without accents, or as it is; a blank for a sign."""
    if plain := normalize("NFKD", letter).encode("ascii", "ignore").decode():
        return plain
    if category(letter)[0] in "LMN":
        return "" if ord(letter) in _ACCENTS else letter
    return " "


def summary_lines(results: Results) -> list[str]:
    """Return the lines of a summary, none longer than ``WIDTH`` characters."""
    lines = list[str]()
    for title, sentences in _sections(results).items():
        if sentences:
            lines += ["", spoken(title, results.language).upper()] if title else []
            plain = (spoken(sentence, results.language) for sentence in sentences)
            lines += [line for sentence in plain for line in wrap(sentence, WIDTH)]
    return lines


def _sections(results: Results) -> dict[str, list[str]]:
    """Return the sentences of each section by its title; the first title is empty."""
    texts, language = results.texts, results.language
    # Pairs and buildings with their places in the ranking
    worst, hit = (table.head(LISTED).iterrows() for table in (results.listed, results.buildings))
    pairs = [pair_sentence(dict(row), language) for _, row in worst]
    buildings = [building_sentence(dict(row), language) for _, row in hit]
    # In the order of their weight for a listener
    return {
        "": _head(results),
        texts["numbers"]: [f"{value} {meaning}." for value, meaning in key_numbers(results)],
        texts["do_first"]: first_steps(results),
        texts["worst_pairs"]: _numbered(pairs),
        texts["worst_buildings"]: _numbered(buildings),
        texts["how_sure"]: sureness(results),
        texts["made_by"]: [made_sentence(results)],
    }


def _head(results: Results) -> list[str]:
    """Return title, alert, coverage, earthquake and stations."""
    texts, language, revision = results.texts, results.language, results.revision
    line = revision_line(revision, language)
    # Whatever has no verdict comes before the earthquake, and before the title if it is much
    account = coverage_sentences(results.coverage, language)
    warned = int(results.coverage.lacks_many)
    return [
        *account[:warned],
        results.region.title[:200],
        *([texts["simulated_spoken"]] if results.region.simulated else []),
        *([f"{line}."] if line else []),
        alert_line(results),
        alert(results).status,
        *account[warned:],
        *results.source,
        *station_sentences(results.stations, language),
    ]


def _numbered(sentences: list[str]) -> list[str]:
    """Return sentences with their numbers."""
    return [f"{place}. {sentence}" for place, sentence in enumerate(sentences, start=1)]


def write_text(results: Results, path: Path) -> None:
    """Write the summary as text, whole or not at all."""
    with written_whole(path) as part:
        part.write_text("\n".join([*summary_lines(results), ""]), encoding="utf-8")
