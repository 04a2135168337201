"""Texts of all languages: per_obspy.report.page.texts, per_obspy.report.page.languages.spanish."""

import re
from importlib.resources import files

import numpy as np
import pandas as pd

from per_obspy.config import Building, Screening
from per_obspy.inventory.checking import checked_pairs
from per_obspy.inventory.completion import completed_pairs
from per_obspy.report.page.languages.spanish import SPANISH
from per_obspy.report.page.texts import ENGLISH, LANGUAGES, counted
from per_obspy.screening.columns import DEMAND_RULES, FLAGS
from per_obspy.screening.ranking import EVERY_STATE
from per_obspy.screening.unknown_gaps import UNKNOWN_CLASS

ASSETS = files("per_obspy.report.page") / "assets"


def test_languages_have_the_same_texts_with_the_same_places_for_values():
    assert set(SPANISH) == set(ENGLISH)
    places = re.compile(r"\{\w+\}")
    for key, text in ENGLISH.items():
        assert set(places.findall(SPANISH[key])) == set(places.findall(text)), key


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
    assert used <= set(ENGLISH)


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
    plural = re.compile(r"\{count\} (pairs|gaps|stations|impacts|times)")
    lacking = {
        key for key, text in ENGLISH.items() if plural.search(text) and f"{key}_one" not in ENGLISH
    }
    assert lacking == set()
