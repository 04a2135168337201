"""``summary.txt``: plain lines that can be read aloud over the radio."""

import re
from pathlib import Path
from textwrap import wrap
from unicodedata import normalize

from per_obspy.files import written_whole
from per_obspy.report.summary.statements import (
    SummaryFacts,
    building_sentence,
    first_steps,
    five_numbers,
    pair_sentence,
    station_sentences,
    sureness,
)

#: Longest line, characters.
WIDTH = 72

#: Characters that are spoken, or a pause; anything else becomes a blank.
_UNSPOKEN = re.compile(r"[^A-Za-z0-9 .,:;()'/-]")

#: Symbols with a word.
_WORDS = {
    "cm/s": "cm per second",
    "%": " percent",
    "°": " degrees",
    "&": " and ",
    "_": " underscore ",
    "+": " plus ",
}


def spoken(text: str) -> str:
    """
    Return a text of plain letters and numbers; accents are dropped, symbols are words or blanks.

    Examples
    --------
    >>> spoken("Añasco_1 <script>"), spoken("84 %")
    ('Anasco underscore 1 script', '84 percent')
    """
    for symbol, word in _WORDS.items():
        text = text.replace(symbol, word)
    letters = normalize("NFKD", text).encode("ascii", "ignore").decode()
    return " ".join(_UNSPOKEN.sub(" ", letters).split())


def summary_lines(facts: SummaryFacts) -> list[str]:
    """Return the lines of a summary, none longer than ``WIDTH`` characters."""
    simulated = ["SIMULATED. THIS IS NOT AN EARTHQUAKE."] if facts.region.simulated else []
    head = [facts.region.title[:200], *simulated, *facts.source, *station_sentences(facts)]
    numbers = [f"{value} {meaning}." for value, meaning in five_numbers(facts)]
    pairs = map(pair_sentence, facts.worst.to_dict("records"))  # type: ignore[arg-type]
    buildings = map(building_sentence, facts.buildings.to_dict("records"))  # type: ignore[arg-type]
    sections = {
        "": head,
        "FIVE NUMBERS": numbers,
        "WHAT TO DO FIRST": first_steps(facts),
        "WORST PAIRS": _numbered(pairs),
        "WORST BUILDINGS": _numbered(buildings),
        "HOW SURE": sureness(facts),
        "SOURCE": [facts.made],
    }
    lines = list[str]()
    for title, sentences in sections.items():
        if sentences:
            lines += ["", title] if title else []
            lines += [line for sentence in sentences for line in wrap(spoken(sentence), WIDTH)]
    return lines


def _numbered(sentences: "map[str]") -> list[str]:
    """Return sentences with their numbers."""
    return [f"{place}. {sentence}" for place, sentence in enumerate(sentences, start=1)]


def write_text(facts: SummaryFacts, path: Path) -> None:
    """Write the summary as text, whole or not at all."""
    with written_whole(path) as part:
        part.write_text("\n".join([*summary_lines(facts), ""]), encoding="ascii")
