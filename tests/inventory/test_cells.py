"""Cells as values: units, words, ranges, codes of floors, placeholders, and doubtful texts."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from per_obspy.inventory.cells import CellForm, read_columns, read_number, read_numbers, read_texts
from per_obspy.inventory.files.words import unit_of, word_rows, words
from per_obspy.inventory.schema import COLUMNS, SYSTEMS

CM = CellForm({"gap": unit_of("cm", "gap")})

#: The international foot is 0.3048 m and the inch 0.0254 m by definition (1959).
LENGTHS = {
    "6": 6.0,
    "6 m": 6.0,
    "6m": 6.0,
    " 6.50 M ": 6.5,
    "6,5": 6.5,
    "6,5 m": 6.5,
    "0,125 m": 0.125,
    "12.500": 12.5,
    "20 ft": 6.096,
    "20 feet": 6.096,
    "20'": 6.096,
    "7'4\"": 7 * 0.3048 + 4 * 0.0254,
    "7 ft 4 in": 7 * 0.3048 + 4 * 0.0254,
    "650 cm": 6.5,
    "650cm.": 6.5,
    "6500 mm": 6.5,
    "240 in": 6.096,
    "3 metros": 3.0,
    "３ｍ": 3.0,
    "1e1": 10.0,
}


@pytest.mark.parametrize("text", LENGTHS)
def test_lengths_with_units(text):
    assert read_number("height_1", text).number == pytest.approx(LENGTHS[text], rel=1e-12)


#: Text without one meaning: other units, thousands or decimals, several numbers, nothing.
WRONG = ["6 yards2", "12,500", "1,000.5", "6;7", "3-4", "6 m 7", "six", "m", "1" * 41, "6..5",
         "6 5", "٦", "0x10", "1_0", "5²", "True", "2026-05-03"]  # fmt: skip


@pytest.mark.parametrize("text", WRONG)
def test_texts_that_are_no_length(text):
    value = read_number("height_1", text)
    assert np.isnan(value.number)
    assert text[:20] in value.note


@pytest.mark.parametrize(
    ("column", "text", "number"),
    [("damping_1", "5 %", 0.05), ("damping_1", "%5", np.nan), ("period_1", "500 ms", 0.5),
     ("mass_1", "500 t", 5e5), ("azimuth", "90°", 90.0), ("yield_displacement_1", "inf", np.inf),
     ("vs30", "760 m/s", 760.0), ("observed", "Evet", 1.0), ("observed", "no", 0.0),
     ("area_1", "120 m²", 120.0)],
)  # fmt: skip
def test_other_columns_with_units_and_words(column, text, number):
    assert_allclose(read_number(column, text).number, number, rtol=1e-15)


#: Gaps in a column of cm: the text, the least and the largest gap that it allows, m.
GAPS = {
    "0": (0.0, 0.0), "bitişik": (0.0, 0.0), "BİTİŞİK": (0.0, 0.0), "Adosado": (0.0, 0.0),
    "attached": (0.0, 0.0), "pegado": (0.0, 0.0), "接": (0.0, 0.0), "party wall": (0.0, 0.0),
    "5": (0.05, 0.05), "5 cm": (0.05, 0.05), '2"': (0.0508, 0.0508), "0.05 m": (0.05, 0.05),
    "50mm": (0.05, 0.05), "5,5": (0.055, 0.055),
    "3-5": (0.03, 0.05), "3 – 5 cm": (0.03, 0.05), "3 ile 5": (0.03, 0.05), "5 a 3": (0.03, 0.05),
    "3 to 5": (0.03, 0.05), "30-50 mm": (0.03, 0.05), "3cm-5cm": (0.03, 0.05), "3〜5": (0.03, 0.05),
    "~4": (0.02, 0.06), "ca. 4": (0.02, 0.06), "yaklaşık 4 cm": (0.02, 0.06), "4?": (0.02, 0.06),
    "約4": (0.02, 0.06), "4 (approx)": (0.02, 0.06), "aprox. 40 mm": (0.02, 0.06),
    "< 2": (0.0, 0.02), "<2 cm": (0.0, 0.02), "≤ 2": (0.0, 0.02), "max. 2": (0.0, 0.02),
    "2 cm'den az": (0.0, 0.02), "2以下": (0.0, 0.02), "menos de 2": (0.0, 0.02),
}  # fmt: skip


@pytest.mark.parametrize("text", GAPS)
def test_gaps_of_every_kind(text):
    # an even distribution between both ends has their mean, and their distance over root 12
    low, high = GAPS[text]
    value = read_number("gap", text, CM)
    assert_allclose(value.number, (low + high) / 2, rtol=1e-12, atol=1e-15)
    assert_allclose(value.deviation, (high - low) / np.sqrt(12), rtol=1e-12, atol=1e-15)
    assert bool(value.note) == (low < high)


@pytest.mark.parametrize("text", ["> 5", "5+", "≥5 cm", "en az 5", "at least 5", "5以上"])
def test_a_gap_that_may_be_wider_is_the_least_it_may_be(text):
    value = read_number("gap", text, CM)
    assert (round(value.number, 12), value.deviation) == (0.05, 0.0)
    assert "the least it may be" in value.note


def test_a_gap_with_a_deviation():
    value = read_number("gap", "4 ± 1 cm")
    assert_allclose([value.number, value.deviation], [0.04, 0.01], rtol=1e-12)


@pytest.mark.parametrize(
    "text",
    ["", "?", "-", "n/a", "bilinmiyor", "Unknown", "desconocido", "不明", "s/d", "#N/A", "—"],
)
def test_an_unknown_gap_is_empty_without_a_note(text):
    value = read_number("gap", text, CM)
    assert np.isnan(value.number)
    assert value.note == ""


@pytest.mark.parametrize(
    "text", ["narrow", "5 kg", "1,234", "~5²", "3-5 (kuzey)", "5½", "2026-05-03 00:00:00", "yok"]
)
def test_a_gap_that_is_not_understood_is_quoted(text):
    value = read_number("gap", text, CM)
    assert np.isnan(value.number)
    assert value.note.startswith(f"gap = {text!r} ")


@given(st.floats(0.1, 90.0), st.sampled_from(["~{}", "< {}", "{} cm", "0-{}", "> {}", "{}?"]))
def test_no_gap_is_wider_than_it_is_said(number, form):
    # the law of safety: whatever the form, the gap is at most the number in the column's unit, or
    # within the deviation of an estimate
    value = read_number("gap", form.format(round(number, 3)), CM)
    assert 0.0 < value.number <= round(number, 3) / 100 * (1 + 1e-12)


def test_a_number_without_the_unit_of_the_others_is_in_doubt():
    # 3 is 3 cm here, or 3 m by the schema: neither is taken
    read = read_numbers("gap", pd.Series(["5 cm", "3", "0", "2-4", "~1", "30 mm", "0.05"]))
    assert_allclose(read.values, [0.05, np.nan, 0.0, np.nan, np.nan, 0.03, 0.05])
    assert read.notes[1] == "gap = '3' has no unit, as other cells have (cm)"
    assert set(read.notes) == {1, 3, 4}
    # but under a heading with a unit it is that
    assert_allclose(read_numbers("gap", pd.Series(["50 mm", "3"]), CM).values, [0.05, 0.03])


#: Floors above ground: the ground floor and those above it.
FLOORS = {
    "3": 3, "3.0": 3, "3,0": 3, "2.5": 2.5, "Z+9": 10, "zemin + 4 kat": 5, "PB+2": 3, "pb + 2": 3,
    "B+G+5": 6, "G+5": 6, "R+3": 4, "RDC+3": 4, "EG+2": 3, "R/C+4": 5, "PT+2": 3, "P+4": 5,
    "S+P+3": 4, "2B+G+7": 8, "b+z+4": 5, "5 kat": 5, "5階": 5, "地上5階": 5, "4 pisos": 4,
    "9 katlı": 9,
}  # fmt: skip


@pytest.mark.parametrize("text", FLOORS)
def test_codes_of_floors(text):
    assert read_number("storeys_1", text).number == FLOORS[text]


@pytest.mark.parametrize(
    "text", ["3+1", "1,2", "3;4", "0,1,2", "2,5", "B+3", "Z+9+Ç", "3-4", "Z", "many", "3 m", "~3"]
)
def test_floors_that_are_a_list_or_unusual(text):
    value = read_number("storeys_1", text)
    assert np.isnan(value.number)
    assert repr(text) in value.note


def test_a_code_of_two_kinds_is_read_by_the_language():
    # B is bajo in Spanish, a basement elsewhere
    assert read_number("storeys_1", "B+3", CellForm(language="es")).number == 4.0
    assert np.isnan(read_number("storeys_1", "B+3", CellForm(language="tr")).number)
    # half a storey in a table of decimal commas, and never 1.2 of them
    comma = CellForm(marks={"storeys_1": ","})
    assert read_number("storeys_1", "2,5", comma).number == 2.5
    assert np.isnan(read_number("storeys_1", "1,2", comma).number)


@pytest.mark.parametrize("lost", [0, -1, -9, -99, -999, -9999, -9999.0, 999, 9999, 99999, 3.4e38])
@pytest.mark.parametrize("kind", ["number", "text"])
def test_a_placeholder_next_to_another_size_is_empty(lost, kind):
    for name, other in (("height_1", "storeys_1"), ("storeys_1", "height_1")):
        cells = pd.Series([lost, 4.0]) if kind == "number" else pd.Series([str(lost), "4"])
        columns = {name: cells, other: pd.Series([3.0, 9.0])}
        read = read_columns(columns)
        assert np.isnan(read[name][0])
        assert read[name][1] == 4.0
        assert "cell_notes" not in read
        # without another size the number stays and is out of range, or is named
        alone = read_columns({name: cells})
        said = alone.get("cell_notes", pd.Series([""]))[0]
        is_inside = COLUMNS[name].low <= lost <= COLUMNS[name].high
        assert (said == f"{name} = {lost:g} is a placeholder, not a size") == is_inside
        assert is_inside or alone[name][0] == lost


def test_placeholders_of_other_columns_and_never_of_places_or_gaps():
    columns = {name: pd.Series([-9999.0, -1.0, 0.0]) for name in ("period_1", "azimuth", "gap")}
    columns["longitude_1"] = pd.Series([-9999.0, -1.0, 0.0])
    columns["height_1"] = pd.Series([9.0, 9.0, 9.0])
    read = read_columns(columns)
    assert read["period_1"].isna().all()
    assert_allclose(read["azimuth"], [np.nan, np.nan, 0.0])
    # a negative gap is an overlap or a mistake: the checks reject it
    assert_allclose(read["gap"], [np.nan, -1.0, 0.0])
    assert_allclose(read["longitude_1"], [-9999.0, -1.0, 0.0])


@pytest.mark.parametrize(
    ("text", "system"),
    [("Betonarme", "concrete_mrf"), ("BETONARME", "concrete_mrf"), ("Yığma", "masonry"),
     ("hormigón armado", "concrete_mrf"), ("Hormigon Armado", "concrete_mrf"),
     ("mampostería", "masonry"), ("béton armé", "concrete_mrf"), ("muratura", "masonry"),
     ("Mauerwerk", "masonry"), ("鉄筋コンクリート", "concrete_mrf"), ("RC造", "concrete_mrf"),
     ("鉄骨造", "steel_mrf"), ("Çelik", "steel_mrf"), ("perde", "concrete_wall"),
     ("Concrete_MRF", "concrete_mrf"), ("木造", "other"), ("?", ""), ("", ""),
     ("mampostería confinada", "reinforced_masonry"), ("piedra", "masonry"),
     ("cemento armato", "concrete_mrf"), ("alvenaria", "masonry"),
     ("shear walls", "concrete_wall")],
)  # fmt: skip
def test_structural_systems_in_several_languages(text, system):
    read, notes = read_texts("system_1", pd.Series([text]))
    assert (read[0], notes) == (system, {})


def test_words_that_are_none_of_the_choices():
    read, notes = read_texts("system_2", pd.Series(["paper", "other"]))
    assert read.tolist() == ["", "other"]
    assert notes[0].startswith("system_2 = 'paper' is unknown, expected steel_mrf, ")
    assert read_texts("same_property", pd.Series(["sí", "hayır"]))[0].tolist() == ["yes", "no"]


def test_columns_of_text_numbers_and_empty_cells():
    read = read_numbers("height", pd.Series(["6 m", None, "-", "six", "20 ft"]))
    assert_allclose(read.values, [6.0, np.nan, np.nan, np.nan, 6.096])
    assert list(read.notes) == [3]
    # truth values are numbers of an observation only
    assert set(read_numbers("height", pd.Series([True, False])).notes) == {0, 1}
    assert read_numbers("observed", pd.Series([True, False])).values.tolist() == [1.0, 0.0]
    assert read_numbers("height", pd.Series([6, 7])).values.tolist() == [6.0, 7.0]


def test_the_deviation_of_a_range_joins_that_of_the_column():
    columns = {"gap": pd.Series(["0.03-0.05", "0.04", "0.03-0.05"])}
    columns["gap_std"] = pd.Series([0.01, 0.01, np.nan])
    even = 0.02 / np.sqrt(12)
    read = read_columns(columns)
    assert_allclose(read["gap_std"], [np.hypot(0.01, even), 0.01, even], rtol=1e-12)
    assert read["cell_notes"].tolist()[1] == ""


def test_a_word_has_one_meaning_of_a_kind():
    # would catch a touching word that means unknown as well, or a system of two names
    gaps = [set(words(kind)) for kind in ("touching", "unknown", "about", "below", "above")]
    for first in range(len(gaps)):
        for second in range(first):
            assert gaps[first] & gaps[second] <= {"?"}
    kinds = [row["meaning"] for row in word_rows()]
    assert {kind.partition(".")[2] for kind in kinds if kind.startswith("system.")} <= set(SYSTEMS)
    assert not set(words("yes")) & set(words("no"))
    spelled = [(row["word"].casefold(), row["meaning"]) for row in word_rows()]
    for kind in ("system.", "unit."):
        meanings = {}
        for word, meaning in spelled:
            if meaning.startswith(kind):
                assert meanings.setdefault(word, meaning) == meaning, word
