"""
Foreign column names: recognised and unknown ones.

Covers per_obspy.inventory.importers.importer.
"""

import numpy as np
import pandas as pd
import pytest

from per_obspy.errors import CatalogError
from per_obspy.inventory.importers.recognition import IMPORTERS, imported
from per_obspy.inventory.schema import COLUMNS, SYSTEMS

SURVEY = {
    "id": [7.0, np.nan],
    "n_storeys": [3.0, 2.0],
    "height": [9.0, 6.0],
    "floor_height": [28.0, 3.0],
    "touches_left": ["True", None],
    "touches_right": [None, "False"],
    "structural_system": ["CR", "M"],
    "llrs": ["LFM", "LWAL"],
}


def test_a_survey_of_seismic_building_exposure():
    # would catch names counted from the rows: the features between were rejected
    table = imported(pd.DataFrame(SURVEY, index=[2, 5]), "town.gpkg")
    assert table["building_id"].tolist() == ["7", "feature 5"]
    assert table["storeys"].tolist() == [3.0, 2.0]
    assert table["system"].tolist() == ["concrete_mrf", "other"]
    assert table["touches_left"].tolist()[0] == "True"  # carried along
    assert "floor_height" not in table  # decimetres in one city


def test_unknown_systems_stay_empty():
    survey = SURVEY | {"structural_system": ["X", None]}
    assert imported(pd.DataFrame(survey), "town.gpkg")["system"].tolist() == ["", ""]


def test_openstreetmap():
    table = imported(
        pd.DataFrame({"osm_id": [12, 13], "building:levels": ["3", None], "building": ["yes"] * 2}),
        "a",
    )
    assert table["building_id"].tolist() == ["12", "13"]
    assert table["storeys"].tolist()[0] == 3.0


def test_our_own_names_with_a_system():
    table = imported(pd.DataFrame({"height": [3.0, 4.0], "system": ["other", None]}), "a")
    assert table["system"].tolist() == ["other", ""]


def test_nothing_that_tells_a_height():
    with pytest.raises(
        CatalogError,
        match=r"town.gpkg: no column height, storeys or period .*columns found: colour",
    ):
        imported(pd.DataFrame({"colour": ["red"]}), "town.gpkg")


@pytest.mark.parametrize("importer", IMPORTERS, ids=lambda importer: importer.name)
def test_importers_speak_the_words_of_the_schema(importer):
    known = {name.removesuffix("_1") for name in COLUMNS if name.endswith("_1")} | {"storey_height"}
    assert set(importer.columns) <= known
    assert set(importer.systems.values()) <= set(SYSTEMS)
