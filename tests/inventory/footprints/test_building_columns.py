"""Columns of buildings: given names, everything kept, names that are needed otherwise."""

import numpy as np
import pandas as pd
import pytest

from per_obspy.errors import CatalogError
from per_obspy.inventory.footprints.building_columns import (
    FROM_OUTLINES,
    GIVEN,
    RESULTS,
    building_columns,
)
from per_obspy.inventory.schema import COLUMNS
from per_obspy.screening import columns as result_columns

LAYER = {
    "height": [9.0, 6.0],
    "ward": ["east", None],
    "pisos": ["3", "2,5"],
    "altura": ["30 ft", "x"],
}


def _columns(layer, **names):
    return building_columns(pd.DataFrame(layer, index=[2, 5]), names, "town.gpkg")


def test_every_column_is_kept():
    table = _columns(LAYER | {"id": ["a", "b"]})
    assert table["ward"].fillna("").tolist() == ["east", ""]
    assert table["id"].tolist() == ["a", "b"]
    assert {"pisos", "altura"} <= set(table)


def test_columns_by_the_names_that_are_given():
    table = _columns(
        LAYER | {"nr": [7.0, np.nan]}, height="altura", storeys="pisos", building_id="nr"
    )
    # 30 ft by the definition of the foot
    assert table["height"].round(9).tolist()[0] == 9.144
    assert np.isnan(table["height"].iloc[1])
    # 2,5 may be a list of floors, as 3;4 is
    assert table["storeys"].tolist()[0] == 3.0
    assert table["cell_notes"].tolist() == [
        "",
        "height = 'x' is not a number; storeys = '2,5' is not a number",
    ]
    assert table["building_id"].tolist() == ["7", "feature 5"]
    # the column that was not meant is kept under another name
    assert table["layer_height"].tolist() == [9.0, 6.0]


def test_given_names_beat_those_of_a_known_source():
    survey = {"n_storeys": [3, 2], "touches_left": ["", ""], "touches_right": ["", ""]}
    survey |= {"llrs": ["LFM", "LWAL"], "height": [9.0, 6.0], "measured": [9.5, 6.5]}
    assert _columns(survey)["height"].tolist() == [9.0, 6.0]
    table = _columns(survey, height="measured")
    assert table["height"].tolist() == [9.5, 6.5]
    assert table["layer_height"].tolist() == [9.0, 6.0]


def test_names_that_are_needed_otherwise_have_a_prefix():
    layer = {"height": [9.0, 6.0], "latitude": ["?", "?"], "Area": [1, 2], "per": [1, 2]}
    layer |= {"period": ["", ""], "layer_per": [3, 4], "line\nbreak": [5, 6], "x" * 300: [7, 8]}
    table = _columns(layer)
    assert table["layer_latitude"].tolist() == ["?", "?"]
    assert table["layer_Area"].tolist() == [1, 2]
    # which of both is first does not matter, but both are there
    assert sorted(table[["layer_per", "layer_layer_per"]].iloc[0]) == [1, 3]
    assert table["line break"].tolist() == [5, 6]
    assert table["x" * 190].tolist() == [7, 8]


def test_names_of_results_are_those_of_the_risk_table():
    # would catch a result that replaces a carried column
    results = {name.removesuffix("_1") for name in result_columns.RESULTS if name.endswith("_1")}
    schema = {name.removesuffix("_1") for name in COLUMNS if name.endswith("_1")}
    assert results <= {*RESULTS, *schema, *FROM_OUTLINES}
    assert set(GIVEN) <= schema | {"storey_height"}


def test_a_column_that_is_not_there():
    with pytest.raises(CatalogError, match=r"no column 'altur' for height .*did you mean altura\?"):
        _columns(LAYER, height="altur")
    with pytest.raises(ValueError, match="hight is no column of a building, did you mean height"):
        _columns(LAYER, hight="altura")
