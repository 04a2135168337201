"""Catalogues of all languages: per_obspy.report.texts."""

import re
from importlib.resources import files
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import per_obspy
from per_obspy.buildings.sides import ELSEWHERE, MEASURE, NOTHING, measures_sentence
from per_obspy.config import Building, Screening
from per_obspy.inventory.checking import checked_pairs
from per_obspy.inventory.completion import completed_pairs
from per_obspy.report.texts import LANGUAGES, _entries, counted, fixed_phrases, texts_of
from per_obspy.results.coverage import _FAULTS, _KINDS, OTHERS
from per_obspy.screening.meanings import DEMAND_RULES, FLAGS
from per_obspy.screening.ranking import EVERY_STATE, UNKNOWN_CLASS
from per_obspy.watch import groups

ROOT = Path(per_obspy.__file__).parent
ASSETS = files("per_obspy.report.page") / "assets"
PLACES = re.compile(r"\{\w+\}")

TRANSLATED = sorted(set(LANGUAGES) - {"en"})


def catalogue(language):
    """Return the forms of each text of a catalogue by its context and key."""
    return {
        (entry.get("msgctxt"), entry["msgid"]): [
            text for name, text in entry.items() if name.startswith("msgstr")
        ]
        for entry in _entries(language)
    }


@pytest.mark.parametrize("language", TRANSLATED)
def test_every_text_is_translated_with_its_places_for_values(language):
    english, translated = catalogue("en"), catalogue(language)
    messages = (groups.FIRST, groups.CHANGED, groups.BELOW, groups.PAIRS, groups.NOTE)
    assert {("message", text) for text in messages} <= set(translated)
    # Names of flags and rules are English in the package
    names = {(None, key) for key in LANGUAGES["en"] if key.startswith(("flag", "rule_"))}
    keys = {key for key in translated if key[0] is None}
    assert keys >= set(english) | names
    assert keys <= set(english) | names
    for key, forms in translated.items():
        assert all(forms), key
        # The key of a text of another module is its English
        expected = english.get(key, [LANGUAGES["en"].get(key[1], key[1])])
        places = {frozenset(PLACES.findall(text)) for text in expected}
        assert {frozenset(PLACES.findall(text)) for text in forms} <= places, key


@pytest.mark.parametrize("language", LANGUAGES)
def test_no_text_is_written_twice(language):
    keys = [(entry.get("msgctxt"), entry["msgid"]) for entry in _entries(language)]
    assert len(keys) == len(set(keys))


def test_every_flag_and_state_has_a_text():
    for texts in LANGUAGES.values():
        assert {f"flag_{name}" for name in FLAGS} <= set(texts)
        assert {f"flagname_{name}" for name in FLAGS} <= set(texts)
        assert {f"rule_{name}" for name in ("", *DEMAND_RULES)} <= set(texts)
        assert {f"class_{name}" for name in [*Screening().classes, UNKNOWN_CLASS]} <= set(texts)
        assert {f"state_{name}" for name in EVERY_STATE} <= set(texts)


def test_script_and_skeleton_use_texts_that_exist():
    script = "".join(
        (ASSETS / name).read_text("utf-8")
        for name in ("page.html", "list.js", "details.js", "map.js", "stations.js", "page.js")
    )
    used = set(re.findall(r"""\bt\("(\w+)"|data-(?:text|label)="(\w+)\"""", script))
    used = {name for names in used for name in names if name}
    assert len(used) > 50
    assert used <= set(LANGUAGES["en"])


def test_derived_inputs_have_names():
    """Names of columns that a completion may derive, as the risk table lists them."""
    columns = {"longitude": 20.0, "latitude": 10.0, "storeys": 5.0}
    row = {f"{name}_{side}": value for name, value in columns.items() for side in (1, 2)}
    pairs = checked_pairs(pd.DataFrame([{"pair_id": "P", "gap": np.nan, **row}]), "pairs.csv")
    (derived,) = completed_pairs(pairs, Building(gap=0.1))["derived"]
    stems = {name.removesuffix("_1").removesuffix("_2") for name in derived.split()}
    assert {"period", "damping", "mass"} <= stems
    for texts in LANGUAGES.values():
        assert {f"input_{name}" for name in stems} <= set(texts)


def test_one_thing_is_in_the_singular():
    assert counted("en", "sure_far", 1) == "1 pair uses a station that is far away."
    assert counted("en", "sure_far", 2) == "2 pairs use a station that is far away."
    assert counted("es", "stations_expected", 1) == "1 estación esperada"
    assert counted("es", "stations_expected", 3000) == "3.000 estaciones esperadas"


def test_every_text_with_a_count_of_pairs_has_a_singular():
    """Catch a new sentence with "1 pairs"."""
    plural = re.compile(r"\{count\} (pairs|gaps|stations|impacts|times|joints)")
    texts = catalogue("en").items()
    lacking = {key for key, forms in texts if plural.search(forms[-1]) and len(forms) == 1}
    assert lacking == set()


def test_a_plan_has_words_of_its_own():
    """A design spectrum or an ensemble is no event: nothing is inspected, nothing has happened."""
    event = re.compile(r"\binspect |in this event|would have|\bhappened", re.IGNORECASE)
    for stem in ("design", "ensemble"):
        said = [key for key, text in texts_of("en", stem).items() if event.search(text)]
        # That a scenario happened is a condition, that a simulated one did not is a warning
        assert [key for key in said if not key.startswith(("alert_hit", "simulated"))] == []


@pytest.fixture(scope="module")
def sources():
    """Return all modules as one text, with joined literals."""
    texts = [path.read_text("utf-8") for path in ROOT.rglob("*.py")]
    # Literals that follow each other are one; placeholders stay
    return re.sub(r'"\s*\n?\s*f?"', "", "\n".join(texts))


@pytest.mark.parametrize("language", TRANSLATED)
def test_every_phrase_is_written_by_a_module(sources, language):
    """Catch a phrase whose English was changed, which would stay English on the page."""
    phrases = [phrase for context, phrase in catalogue(language) if context == "phrase"]
    assert [phrase for phrase in phrases if phrase not in sources] == []


@pytest.mark.parametrize("language", TRANSLATED)
def test_every_kind_of_reason_is_translated(language):
    kinds = {kind for _, kind in _KINDS} | set(_FAULTS.values()) | {OTHERS}
    assert kinds <= {kind for context, kind in catalogue(language) if context == "reason"}


@pytest.mark.parametrize(
    "text", [NOTHING, ELSEWHERE, MEASURE, measures_sentence(0.1, 0.2, 0.3, "B7")]
)
def test_prevention_of_a_building_is_wholly_spanish(text):
    english = re.compile(r"\b(the|of|to|in|or|up|more|less|gap|gaps|first|its|by|are|not|and)\b")
    assert english.search(text)
    assert not english.search(fixed_phrases(text, "es"))


def test_numbers_and_names_stay():
    said = fixed_phrases(measures_sentence(0.123, 0.0, 1.0, "Torre or less"), "es")
    assert "0.123 m" in said
    assert "Torre" in said


def test_short_words_are_translated_only_where_a_sentence_begins():
    said = fixed_phrases("or 0.1; or 0.2 for a sensor or two", "es")
    assert said == "o 0.1; o 0.2 for a sensor or two"
