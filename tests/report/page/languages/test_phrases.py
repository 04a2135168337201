"""Phrases of other modules in Spanish: per_obspy.report.page.languages.phrases."""

import re
from pathlib import Path

import pytest

import per_obspy
from per_obspy.buildings.sides import ELSEWHERE, MEASURE, NOTHING, measures_sentence
from per_obspy.report.page.languages.phrases import SPANISH_PHRASES, in_spanish

ROOT = Path(per_obspy.__file__).parent


@pytest.fixture(scope="module")
def sources():
    """Return all modules but the translations as one text, with joined literals."""
    texts = [
        path.read_text("utf-8") for path in ROOT.rglob("*.py") if "languages" not in path.parts
    ]
    # Literals that follow each other are one; placeholders stay
    return re.sub(r'"\s*\n?\s*f?"', "", "\n".join(texts))


def test_every_phrase_is_written_by_a_module(sources):
    """Catch a phrase whose English was changed, which would stay English on the page."""
    assert [phrase for phrase in SPANISH_PHRASES if phrase not in sources] == []


@pytest.mark.parametrize(
    "text", [NOTHING, ELSEWHERE, MEASURE, measures_sentence(0.1, 0.2, 0.3, "B7")]
)
def test_prevention_of_a_building_is_wholly_spanish(text):
    english = re.compile(r"\b(the|of|to|in|or|up|more|less|gap|gaps|first|its|by|are|not|and)\b")
    assert english.search(text)
    assert not english.search(in_spanish(text))


def test_numbers_and_names_stay():
    said = in_spanish(measures_sentence(0.123, 0.0, 1.0, "Torre or less"))
    assert "0.123 m" in said
    assert "Torre" in said


def test_short_words_are_translated_only_where_a_sentence_begins():
    assert in_spanish("or 0.1; or 0.2 for a sensor or two") == "o 0.1; o 0.2 for a sensor or two"
