"""
Texts of page, summary and figures: one catalogue of gettext per language, in ``languages/``.

A further language is one further file. Catalogues are read as their translators write them
(``.po``), so that a checkout needs no step before it runs.
"""

import gettext
import json
import re
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable
from io import BytesIO
from struct import pack

from per_obspy.screening.meanings import DEMAND_RULES, FLAGS

#: Texts of these kinds of results replace the general ones; a plan is no earthquake.
ENDINGS = {"risk": (), "design": ("_plan", "_design"), "ensemble": ("_plan", "_ensemble")}

#: Words that may be part of a name: translated only where a sentence begins.
BEGINNINGS = ("up to ", "or ")

#: Field of a catalogue with the first line of its text, or a further line of it.
_LINE = re.compile(r'(?:(msgctxt|msgid|msgid_plural|msgstr(?:\[\d\])?) )?(".*")')

_CATALOGUES: dict[str, Traversable] = {
    file.name.removesuffix(".po"): file
    for file in (files("per_obspy.report") / "languages").iterdir()
    if file.name.endswith(".po")
}


def _entries(language: str) -> list[dict[str, str]]:
    """Return the entries of a catalogue: text by the name of its field."""
    entries, name = [dict[str, str]()], ""
    for line in _CATALOGUES[language].read_text(encoding="utf-8").splitlines():
        part = _LINE.fullmatch(line)
        if part is None:
            # A blank line or a comment ends an entry
            entries.append({})
            continue
        name = part[1] or name
        # Texts are escaped as in JSON
        entries[-1][name] = entries[-1].get(name, "") + json.loads(part[2])
    return [entry for entry in entries if entry]


def _compiled(entries: list[dict[str, str]]) -> BytesIO:
    """Return entries as a compiled catalogue (``.mo``)."""
    texts = {}
    for entry in entries:
        # Context, identifier and plural; then the forms in their order
        key = "\x04".join(entry[name] for name in ("msgctxt", "msgid") if name in entry)
        key += f"\0{entry['msgid_plural']}" if "msgid_plural" in entry else ""
        forms = [entry[name] for name in sorted(entry) if name.startswith("msgstr")]
        texts[key.encode()] = "\0".join(forms).encode()
    # Lengths and places of all keys, then of all texts, then the bytes of both
    parts = [*sorted(texts), *(texts[key] for key in sorted(texts))]
    start, table, body = 28 + 8 * len(parts), b"", b""
    for part in parts:
        table += pack("<II", len(part), start + len(body))
        body += part + b"\0"
    head = pack("<7I", 0x950412DE, 0, len(texts), 28, 28 + 4 * len(parts), 0, start)
    return BytesIO(head + table + body)


@cache
def _catalogue(language: str) -> gettext.GNUTranslations:
    """Return the catalogue of a language; English stands for what it lacks."""
    catalogue = gettext.GNUTranslations(_compiled(_entries(language)))
    if language != "en":
        catalogue.add_fallback(_catalogue("en"))
    return catalogue


def _texts(language: str) -> dict[str, str]:
    """Return all texts of a language by their keys; those for one thing end in ``_one``."""
    # Names of the package's columns are English already
    texts = {f"flag_{name}": meaning for name, meaning in FLAGS.items()}
    texts |= {f"flagname_{name}": name.replace("_", " ") for name in FLAGS}
    texts |= {f"rule_{name}": words for name, words in DEMAND_RULES.items()}
    for name in dict.fromkeys(("en", language)):
        # A further language replaces the texts that it has
        keys = [entry for entry in _entries(name) if "msgctxt" not in entry]
        texts |= {entry["msgid"]: entry["msgstr"] for entry in keys if "msgstr" in entry}
        several = [entry["msgid"] for entry in keys if "msgid_plural" in entry]
        for number, ending in ((1, "_one"), (1_000, "")):
            forms = {key: _catalogue(name).ngettext(key, key, number) for key in several}
            texts |= {f"{key}{ending}": text for key, text in forms.items()}
    return texts


#: Texts by their keys, of every language.
LANGUAGES: Mapping[str, Mapping[str, str]] = {name: _texts(name) for name in _CATALOGUES}


@cache
def texts_of(language: str, stem: str) -> Mapping[str, str]:
    """
    Return the texts about results of a kind.

    Parameters
    ----------
    language : str
        Name of a catalogue, such as ``en``.
    stem : {'risk', 'design', 'ensemble'}
        Kind of the results.

    Examples
    --------
    >>> texts_of("en", "risk")["prevention"], texts_of("en", "design")["prevention"]
    ('What would have prevented it', 'What would prevent it')
    """
    texts = dict(LANGUAGES[language])
    for ending in ENDINGS[stem]:
        own = [key for key in LANGUAGES[language] if key.endswith(ending)]
        texts |= {key.removesuffix(ending): texts[key] for key in own}
    return texts


def written(value: float, digits: int, language: str) -> str:
    """
    Return a number with its digits as a language writes it.

    Examples
    --------
    >>> written(12345.678, 1, "en"), written(12345.678, 1, "es")
    ('12,345.7', '12.345,7')
    """
    return f"{value:,.{digits}f}".translate(marks(language))


def marks(language: str) -> dict[int, int]:
    """Return the separator of thousands and the decimal point of a language for ``translate``."""
    return str.maketrans(",.", LANGUAGES[language]["number_marks"])


def counted(language: str, key: str, count: float, stem: str = "risk", **values: str) -> str:
    """
    Return a text about a number of things in the grammatical form of the number.

    Parameters
    ----------
    language : str
        Of the text.
    key : str
        Of the text; where it has a form for one thing, the language decides which one is meant.
    count : float
        Number of things, written as a whole number for ``{count}``.
    stem : {'risk', 'design', 'ensemble'}
        Kind of the results.
    **values : str
        Other parts of the text.

    Examples
    --------
    >>> counted("en", "stations_expected", 1), counted("en", "stations_expected", 2000)
    ('1 station expected', '2,000 stations expected')
    """
    own = (f"{key}{ending}" for ending in reversed(ENDINGS[stem]))
    key = next((name for name in own if name in LANGUAGES[language]), key)
    text = _catalogue(language).ngettext(key, key, round(count))
    # A text without forms of its own is found by its key alone
    text = LANGUAGES[language][key] if text == key else text
    return text.format(count=written(count, 0, language), **values)


def in_context(context: str, text: str, language: str) -> str:
    """Return the translation of an English text of another module, the text itself without one."""
    return _catalogue(language).pgettext(context, text)


@cache
def _phrases(language: str) -> re.Pattern[str]:
    """Return a pattern of the phrases of a catalogue, longer ones before their parts."""
    entries = _entries(language)
    phrases = [entry["msgid"] for entry in entries if entry.get("msgctxt") == "phrase"]
    parts = [
        f"(?:^|(?<=; )){re.escape(phrase)}" if phrase in BEGINNINGS else re.escape(phrase)
        for phrase in sorted(phrases, key=len, reverse=True)
    ]
    return re.compile("|".join(parts) or "(?!)")


def fixed_phrases(text: str, language: str) -> str:
    """
    Translate the fixed phrases of other modules in a text; numbers, names and other words stay.

    Examples
    --------
    >>> fixed_phrases("HNZ: duration, s: 3, needs 10", "es")
    'HNZ: duración, s: 3, necesita 10'
    """
    return _phrases(language).sub(lambda part: in_context("phrase", part[0], language), text)
