"""
Summary of a screening as text and as a page.

Tests of per_obspy.report.statements and per_obspy.report.summary.one_page too.
"""

import re
from dataclasses import replace
from itertools import combinations

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from per_obspy.report.results import Region, Results
from per_obspy.report.statements import alert, event_sentences
from per_obspy.report.summary.one_page import write_page
from per_obspy.report.summary.spoken_text import WIDTH, spoken, summary_lines, write_text
from per_obspy.report.tally import PairTally
from per_obspy.results.coverage import Coverage, Search

COVERAGE = Coverage(20, 16, {"no station within reach": 4})

HOSTILE = ["<script>alert(1)</script>", "=HYPERLINK(1)", "\u202eevil", "x" * 10_000, "$a_{b"]
EVENT = {
    "time": "2019-07-06T03:19:53",
    "magnitude": 7.1,
    "longitude": -117.6,
    "latitude": 35.77,
    "depth": 8000.0,
}


def make_facts(names=("P1", "P2"), simulated=True, buildings=False):
    """Return the facts of a summary whose pairs have these names."""
    worst = pd.DataFrame(
        {
            "pair_id": names,
            "risk_class": "severe",
            "probability": 0.9999,
            "expected_impact_velocity": np.linspace(0.6, 0.5, len(names)),
            "gap": 0.0,
            "demand": 0.1,
            "latitude": -20.3,
            "longitude": -68.1,
        }
    )
    listed = worst.rename(columns={"pair_id": "building_id"}).assign(severity=0.6)
    stations = pd.DataFrame(
        {"station": ["XX.A", "XX.B", "XX.C"], "state": ["used", "rejected", "used"]}
    )
    places = pd.DataFrame({"longitude": [-68.0], "latitude": [-20.0]})
    tally = PairTally(["severe", "low"])
    tally.states.update({"yes": 3, "likely": 2, "possible": 4, "unknown": 7})
    tally.classes["severe"], tally.expected, tally.derived = 5, 5.4, 6
    tally.pairs, tally.hard, tally.columns, tally.expected_by_class["severe"] = 16, 4.2, 1.6, 4.2
    tally.flags["derived_inputs"] = 6
    return Results(
        "risk",
        Region("old town", ["severe", "low"], simulated, places, (-68.2, -20.2)),
        COVERAGE,
        source=event_sentences(EVENT),
        tally=tally,
        listed=worst,
        shown=worst,
        buildings=listed if buildings else pd.DataFrame(),
        stations=stations,
    )


@pytest.fixture
def page_text(tmp_path):
    """Return a function that writes the page, and its texts as they were drawn."""

    def page_text(facts, monkeypatch):
        figures = []
        with monkeypatch.context() as patch:
            save = Figure.savefig

            def noted(figure, *arguments, **options):
                figures.append(figure)
                save(figure, *arguments, **options)

            patch.setattr(Figure, "savefig", noted)
            write_page(facts, tmp_path / "summary.pdf")
        return figures[0], tmp_path / "summary.pdf"

    return page_text


def test_the_summary_says_what_where_and_how_sure():
    text = " ".join(summary_lines(make_facts()))
    for expected in (
        "Earthquake of 2019-07-06 03:19:53 UTC. Magnitude 7.1.",
        "Epicentre 35.770 north, 117.600 west, depth 8 km.",
        "SIMULATED. THIS IS NOT AN EARTHQUAKE.",
        "Level: severe. About 5 of 9 screened pairs (56 percent) hit each other; 4 hard enough to "
        "damage floors or columns; 2 of them with floors that meet columns.",
        "Automatic, elastic, not reviewed: a later issue or an inspection replaces it.",
        "3 stations expected; 2 used: XX.A, XX.C; 1 missing or rejected: XX.B.",
        "16 of 20 rows of the pair table are screened; left out: 4 (4 no station within reach).",
        "5 (3 to 9) pairs hit each other (from the sure ones to the possible ones).",
        "4 of them hit hard, from 0.2 metres per second.",
        "0.6 metres per second fastest expected impact.",
        "Measure 7 gaps that are unknown: there is no verdict without them.",
        "1. P1: severe, impact 0.6 metres per second, contact in over 99 of 100, at 20.30000",
        "6 of 16 pairs have inputs that are derived, not measured.",
    ):
        assert expected in text
    assert "SIMULATED" not in " ".join(summary_lines(make_facts(simulated=False)))


@pytest.mark.parametrize("name", HOSTILE)
def test_every_line_can_be_read_aloud(tmp_path, name):
    facts = make_facts([name] * 10, buildings=True)
    facts = replace(facts, region=facts.region._replace(title=name))
    write_text(facts, tmp_path / "summary.txt")
    lines = (tmp_path / "summary.txt").read_text(encoding="utf-8").splitlines()
    assert max(map(len, lines)) <= WIDTH
    assert all(re.fullmatch(r"[A-Za-z0-9 .,:;()'/-]*", line) for line in lines)
    assert "THE WORST BUILDINGS" in lines
    # one page of radio, whatever the names are
    assert len(lines) < 120


def test_accents_and_signs_become_letters_and_words():
    assert spoken("Ciudad Juárez & 5 %") == "Ciudad Juarez and 5 percent"
    # Names that would be others without their letters
    for name in ("Yıldız", "Straße 5", "מגדל חיפה 12", "برج الخليفة ٣", "塔 7", "दिल्ली"):
        assert spoken(name) == name


@pytest.mark.parametrize("buildings", [False, True])
@pytest.mark.parametrize("names", [("P1",), HOSTILE * 2])
def test_the_page_is_one_and_no_text_leaves_it(page_text, monkeypatch, names, buildings):
    figure, path = page_text(make_facts(names, buildings=buildings), monkeypatch)
    content = path.read_bytes()
    assert content.startswith(b"%PDF")
    assert content.count(b"/Type /Page ") == 1
    figure.draw_without_rendering()
    texts = [text for text in figure.texts if text.get_text()]
    boxes = [text.get_window_extent() for text in texts]
    for text, box in zip(texts, boxes, strict=True):
        assert box.x0 >= 0, text
        assert box.x1 <= figure.bbox.width, text
        assert box.y0 >= 0, text
    # nor lies on another one
    for first, one in enumerate(boxes):
        for second in boxes[first + 1 :]:
            width = min(one.x1, second.x1) - max(one.x0, second.x0)
            height = min(one.y1, second.y1) - max(one.y0, second.y0)
            # ascenders and descenders of lines may meet
            assert not (width > 1.0 and height > 0.3 * min(one.height, second.height))
    drawn = " ".join(text.get_text() for text in texts)
    assert "SIMULATED" in drawn
    assert ("The worst buildings" in drawn) == buildings


def test_a_level_of_few_pairs_is_a_least_one_or_unknown():
    # "at least none" would be read as none where most pairs have no verdict
    facts = make_facts()
    assert alert(facts).level == "Level: severe"
    few = replace(facts, coverage=Coverage(100, 16, {"no station within reach": 84}))
    assert alert(few).level == "Level: at least severe"
    few.tally.expected_by_class["severe"] = 0.0
    assert alert(few).level == "Level: unknown"
    assert alert(replace(few, coverage=COVERAGE)).level == "Level: none"


def test_a_page_in_spanish_has_no_english_class_and_no_decimal_point(page_text, monkeypatch):
    facts = make_facts(buildings=True)
    listed = facts.listed.assign(demand=[0.123, float("nan")])
    figure, _ = page_text(replace(facts, language="es", listed=listed), monkeypatch)
    drawn = [text.get_text() for text in figure.texts]
    assert {"12,3 cm", "sin dato"} <= {*drawn}
    assert any("1  P1, severa, " in text for text in drawn)


def test_many_classes_and_reasons_stay_on_the_sheet(page_text, monkeypatch):
    """Catch a legend that leaves the sheet, and an account that pushes the pairs off it."""
    names = ["life at risk", "very severe", "severe", "high", "moderate", "low", "lowest of all"]
    kinds = {f"a reason of many words, number {i}": 10**6 for i in range(12)}
    areas = [("a ward with a long name", 10**6)] * 3
    search = Search(10**6, kinds, kinds, areas)
    facts = make_facts(buildings=True)
    facts.tally.classes.update(dict.fromkeys([*names, "gap unknown"], 123_456))
    facts.tally.classes["severe"] = 123_456
    facts = replace(
        facts,
        region=facts.region._replace(classes=names),
        coverage=Coverage(10**6, 10, kinds, areas, search),
    )
    figure, _ = page_text(facts, monkeypatch)
    figure.draw_without_rendering()
    boxes = {text: text.get_window_extent() for text in figure.texts if text.get_text()}
    right = 0.93 * figure.bbox.width
    legend = [text for text in boxes if text.get_text().endswith(" 123,456")]
    assert len(legend) == 8
    assert max(boxes[text].x1 for text in legend) <= right
    assert min(box.y0 for box in boxes.values()) >= 0.0
    # The map is above its legend, which is on several lines
    (axes,) = figure.axes
    assert len({round(boxes[text].y0) for text in legend}) > 1
    assert max(boxes[text].y1 for text in legend) < axes.get_tightbbox().y0
    first = min(boxes[text].y0 for text in legend)
    (title,) = (text for text in boxes if text.get_text() == "pair")
    assert boxes[title].y1 < first
    # None of the texts lies on another one
    for one, two in combinations(boxes.values(), 2):
        width = min(one.x1, two.x1) - max(one.x0, two.x0)
        height = min(one.y1, two.y1) - max(one.y0, two.y0)
        assert not (width > 1.0 and height > 0.3 * min(one.height, two.height))


def test_the_same_facts_are_the_same_bytes(tmp_path):
    # results of a run are compared by their hashes
    for name in ("a.pdf", "b.pdf"):
        write_page(make_facts(), tmp_path / name)
    assert (tmp_path / "a.pdf").read_bytes() == (tmp_path / "b.pdf").read_bytes()


def test_the_spanish_page_keeps_its_texts_apart(page_text, monkeypatch):
    facts = replace(make_facts(buildings=True), language="es")
    facts = replace(facts, listed=facts.listed.assign(gap=[0.0042, 1.2], demand=[0.305, np.nan]))
    figure, _ = page_text(facts, monkeypatch)
    drawn = " ".join(text.get_text() for text in figure.texts)
    assert "Movimiento SIMULADO" in drawn
    assert "Los peores edificios" in drawn
    # One unit per column
    assert all(cell in drawn for cell in ("0,4 cm", "120,0 cm", "30,5 cm", "sin dato"))
    figure.draw_without_rendering()
    assert all(text.get_window_extent().x1 <= figure.bbox.width for text in figure.texts)
