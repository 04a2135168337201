"""Coverage in sentences, in both languages."""

import pytest

from per_obspy.report.coverage import coverage_sentences, kind_text
from per_obspy.results.coverage import Coverage, Search

SEARCH = Search(449, {"no height, storeys or period": 1469}, {"no outline": 3})


def test_a_table_that_is_screened_wholly_is_one_sentence():
    assert coverage_sentences(Coverage(160, 160)) == [
        "All rows of the pair table are screened: 160."
    ]


def test_what_has_no_verdict_is_said_first():
    lost = {"no station within reach": 60, "no height, storeys or period": 23}
    first, second = coverage_sentences(Coverage(160, 77, lost, [("Desert", 60)]))
    assert first.startswith("83 of 160 neighbouring pairs (52 %) have NO VERDICT")
    assert second == (
        "77 of 160 rows of the pair table are screened; left out: 83 (60 no station within reach, "
        "23 no height, storeys or period; areas most affected: Desert: 60)."
    )


def test_the_search_before_is_part_of_it():
    first, second, third = coverage_sentences(Coverage(449, 449, search=SEARCH), "es")
    assert first.startswith("1.469 de 1.918 pares vecinos (77 %) NO TIENEN VEREDICTO")
    assert "1.469 sin altura, pisos ni período" in second
    assert "3 sin contorno" in second
    assert third == "Se evalúan todas las filas de la tabla de pares: 449."


@pytest.mark.parametrize(("screened", "share"), [(0, "100"), (1, "99"), (666, "33"), (660, "34")])
def test_a_share_is_all_only_if_it_is_all(screened, share):
    (warning, *_) = coverage_sentences(Coverage(1000, screened, {"repeated": 1000 - screened}))
    assert f"({share} %)" in warning


def test_many_kinds_are_four_and_the_rest():
    kinds = {f"kind {i}": 10 - i for i in range(7)}
    assert kind_text(kinds, "en") == "10 kind 0, 9 kind 1, 8 kind 2, 7 kind 3, 15 other reasons"
    assert (
        kind_text({"gap: empty": 2, "ward: empty": 1}, "es") == "2 separación: vacío, 1 ward: vacío"
    )
