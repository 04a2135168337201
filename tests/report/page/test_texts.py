"""Texts of all languages: per_obspy.report.page.texts and per_obspy.report.page.spanish."""

import re
from importlib.resources import files

from per_obspy.report.page.spanish import SPANISH
from per_obspy.report.page.texts import ENGLISH, LANGUAGES
from per_obspy.screening.columns import FLAGS
from per_obspy.screening.ranking import EVERY_STATE

ASSETS = files("per_obspy.report.page") / "assets"


def test_languages_have_the_same_texts_with_the_same_places_for_values():
    assert set(SPANISH) == set(ENGLISH)
    places = re.compile(r"\{\w+\}")
    for key, text in ENGLISH.items():
        assert set(places.findall(SPANISH[key])) == set(places.findall(text)), key


def test_every_flag_and_state_has_a_text():
    for texts in LANGUAGES.values():
        assert {f"flag_{name}" for name in FLAGS} <= set(texts)
        assert {f"state_{name}" for name in EVERY_STATE} <= set(texts)


def test_script_and_skeleton_use_texts_that_exist():
    script = "".join(
        (ASSETS / name).read_text("utf-8")
        for name in ("page.html", "list.js", "details.js", "map.js", "page.js")
    )
    used = set(re.findall(r"""\bt\("(\w+)"|data-(?:text|label)="(\w+)\"""", script))
    used = {name for names in used for name in names if name}
    assert len(used) > 50
    assert used <= set(ENGLISH)
