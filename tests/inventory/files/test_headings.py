"""Headings of several languages and forms, and meanings that they never have."""

import pytest

from per_obspy.config import TableForm
from per_obspy.errors import CatalogError
from per_obspy.inventory.files.headings import meaning, meanings_of, recognised
from per_obspy.inventory.files.words import word_rows
from per_obspy.inventory.schema import COLUMNS

#: heading -> column and unit
MEANT = {
    "GAP": ("gap", None),
    "Gap [mm]": ("gap", "mm"),
    "gap_cm": ("gap", "cm"),
    "Separación entre edificios (cm)": ("gap", "cm"),
    "Derz boşluğu": ("gap", None),
    "Joint sismique (m)": ("gap", "m"),
    "N° piani 1": ("storeys_1", None),
    "Kat Adedi 2": ("storeys_2", None),
    "Nombre de niveaux 1": ("storeys_1", None),
    "número de pisos - edificio 2": ("storeys_2", None),
    "建物2階数": ("storeys_2", None),
    "高さ１（m）": ("height_1", "m"),
    "height_ft_1": ("height_1", "ft"),
    "height 2 (ft)": ("height_2", "ft"),
    "İkinci": None,
    "BİNA 1 YÜKSEKLİĞİ": ("height_1", None),
    "Latitud (2)": ("latitude_2", None),
    "lon1": ("longitude_1", None),
    "MASS_1_t": ("mass_1", "t"),
    "Peso 1 (kN)": ("mass_1", "kN"),
    "vs30 (m/s)": ("vs30", "m/s"),
    "Building 2 ID": ("building_id_2", None),
    # nothing, or nothing that is sure
    "ward": None,
    "height": None,
    "gap 1": None,
    "height_1 (storeys)": None,
    "gap (kg)": None,
    "mass_1 (ton)": None,
    "height 1 2": None,
    "": None,
}

#: Words that are proposed but never taken.
ASKED = ["distance", "étages 1", "T1", "H 2", "peso 1", "andares 2", "x 1", "mesafe"]


@pytest.mark.parametrize("heading", MEANT)
def test_what_a_heading_means(heading):
    found, expected = meaning(heading), MEANT[heading]
    if expected is None:
        assert found is None
    else:
        assert found is not None
        assert (found.column, found.unit and found.unit.name) == expected


@pytest.mark.parametrize("heading", ASKED)
def test_words_that_may_mean_something_else_are_not_taken(heading):
    found = meaning(heading)
    assert found is not None
    assert not found.is_sure
    assert recognised([heading], {}) == {}


def test_every_word_of_the_table_means_its_column():
    # would catch a word that a filler or the word for a building takes away
    bare = {name.removesuffix("_1").removesuffix("_2") for name in COLUMNS}
    rows = [row for row in word_rows() if row["meaning"] in bare]
    assert {row["language"] for row in rows} == {"en", "es", "tr", "it", "fr", "pt", "ja"}
    for row in rows:
        is_pairs = row["meaning"] in COLUMNS
        found = meaning(row["word"] if is_pairs else f"{row['word']} 1")
        assert found is not None, row
        assert found.column == (row["meaning"] if is_pairs else f"{row['meaning']}_1"), row


def test_a_whole_table_by_its_own_names_is_left_as_it_is():
    # would catch a carried column that becomes a known one in a table that was plain
    own = [name for name, column in COLUMNS.items() if column.required]
    own += ["height_1", "height_2", "Pisos 1", "GAP_STD"]
    assert set(recognised(own, {})) == set(range(len(own) - 2))


def test_two_headings_of_one_meaning_are_none():
    found = recognised(["pair", "Separación", "Junta sísmica"], {})
    assert [means.column for means in found.values()] == ["pair_id"]


def test_names_and_units_that_are_given():
    names = ("pair", "Abstand", "ward")
    found = meanings_of(names, TableForm(columns={"gap": "abstand"}, units={"gap": "cm"}), "t")
    assert found.names == ["pair_id", "gap", "ward"]
    assert found.units["gap"].name == "cm"
    assert found.sentence() == "pair_id = 'pair', gap = 'Abstand' in cm"


@pytest.mark.parametrize(
    ("form", "message"),
    [
        ({"columns": {"gapp": "Abstand"}}, r"\[pairs.columns\] gapp: .* did you mean gap\?"),
        ({"columns": {"gap": "Abstandd"}}, "no such heading, did you mean Abstand"),
        ({"columns": {"gap": "ward"}}, "the table has more than one of it"),
        ({"units": {"pair_id": "cm"}}, "pair_id is text and has no unit"),
        ({"units": {"gap": "kg"}}, "'kg' is no unit of gap, expected one of m, mm, cm"),
        ({"units": {"gapp": "cm"}}, "no column 'gapp', did you mean gap"),
        ({"units": {"mass_1": "t"}}, "mass_1: the table has no such column"),
    ],
)
def test_names_and_units_that_are_wrong(form, message):
    with pytest.raises(CatalogError, match=message):
        meanings_of(("pair", "Abstand", "ward", "ward"), TableForm(**form), "pairs.csv")
