"""Columns of buildings: given names, everything kept, names that are needed otherwise."""

import numpy as np
import pandas as pd
import pytest
from screening_samples import make_pairs, make_station

import per_obspy
from per_obspy.errors import CatalogError
from per_obspy.inventory.footprints.building_columns import (
    ENOUGH,
    FROM_OUTLINES,
    GIVEN,
    RESULTS,
    building_columns,
    schema_columns,
    with_class_heights,
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
    table = schema_columns(pd.DataFrame(SURVEY, index=[2, 5]), "town.gpkg")
    assert table["building_id"].tolist() == ["7", "feature 5"]
    assert table["storeys"].tolist() == [3.0, 2.0]
    assert table["system"].tolist() == ["concrete_mrf", "masonry"]
    # reinforced walls are known by their material
    material = SURVEY | {"llrs_material": ["CR", "MCF/RS"]}
    table = schema_columns(pd.DataFrame(material, index=[2, 5]), "town.gpkg")
    assert table["system"].tolist() == ["concrete_mrf", "reinforced_masonry"]
    assert table["touches_left"].tolist()[0] == "True"  # carried along
    assert "floor_height" not in table  # decimetres in one city


def test_unknown_systems_stay_empty():
    survey = SURVEY | {"structural_system": ["X", None]}
    assert schema_columns(pd.DataFrame(survey), "town.gpkg")["system"].tolist() == ["", ""]


def test_our_own_names_with_a_system():
    table = schema_columns(pd.DataFrame({"height": [3.0, 4.0], "system": ["other", None]}), "a")
    assert table["system"].tolist() == ["other", ""]


def _town(count=400, seed=3):
    # two classes of known medians and deviations
    rng = np.random.default_rng(seed)
    low = 6.0 * np.exp(rng.normal(0, 0.2, count))
    high = 30.0 * np.exp(rng.normal(0, 0.5, count))
    table = pd.DataFrame({"height": np.concatenate([low, high]), "storeys": np.nan})
    return table, pd.Series(["house"] * count + ["tower"] * count)


def test_a_missing_height_has_median_and_deviation_of_its_class():
    table, classes = _town()
    table.loc[[0, 400], "height"] = np.nan
    filled = with_class_heights(table, classes)
    # 400 values: the median is off by 1.25 s / 20, the deviation by s / sqrt(800), three times that
    assert filled.loc[0, "height"] == pytest.approx(6.0, rel=0.04)
    assert filled.loc[400, "height"] == pytest.approx(30.0, rel=0.10)
    assert filled.loc[0, "height_log_std"] == pytest.approx(0.2, abs=0.021)
    assert filled.loc[400, "height_log_std"] == pytest.approx(0.5, abs=0.053)
    known = filled.index.difference([0, 400])
    assert filled.loc[known, "height"].tolist() == table.loc[known, "height"].tolist()
    assert filled.loc[known, "height_log_std"].isna().all()


def test_too_few_known_buildings_give_no_estimate():
    # one below the limit, and one at it
    for known, is_filled in ((ENOUGH - 1, False), (ENOUGH, True)):
        table = pd.DataFrame({"height": [np.nan, *([9.0] * known)]})
        filled = with_class_heights(table, pd.Series(["house"] * (known + 1)))
        assert pd.notna(filled.loc[0, "height"]) == is_filled
        # equal heights: a smallest deviation keeps the mark
        if is_filled:
            assert filled.loc[0, "height_log_std"] > 0.0


def test_storeys_are_estimated_where_a_class_has_no_heights():
    table = pd.DataFrame({"height": [np.nan] * 41, "storeys": [np.nan, *([2.0, 4.0] * 20)]})
    filled = with_class_heights(table, pd.Series(["yes"] * 41))
    assert filled["height"].isna().all()
    assert filled.loc[0, "storeys"] == pytest.approx(np.sqrt(8.0))
    assert filled.loc[0, "height_log_std"] == pytest.approx(np.log(2.0) / 2.0, rel=0.02)


def test_storeys_or_cells_that_are_not_understood_are_not_replaced():
    table = pd.DataFrame(
        {"height": [np.nan, np.nan, *([9.0] * 30)], "storeys": [3.0] + [np.nan] * 31}
    )
    is_understood = np.arange(32) != 1
    filled = with_class_heights(table, pd.Series([""] * 32), is_understood)
    assert filled["height"].isna().tolist()[:3] == [True, True, False]


def test_layers_of_surveys_are_left_as_they_are():
    # a survey's empty cell may be an empty lot
    survey = {"n_storeys": [None, *([2.0] * 30)], "touches_left": None, "touches_right": None}
    table = schema_columns(
        pd.DataFrame(survey | {"llrs": "LFM", "structural_system": "CR"}), "town"
    )
    assert np.isnan(table["storeys"].tolist()[0])
    assert "height_log_std" not in table


def test_the_deviation_of_a_height_reaches_the_probability():
    # one pair whose gap is well above its demand: uncertain heights make pounding likelier
    probability = []
    for deviation in (0.0, 0.6):
        pairs = make_pairs([{"gap": 0.4, "period_1": np.nan, "period_2": np.nan}])
        pairs = pairs.assign(height_log_std_1=deviation, height_log_std_2=deviation)
        risk = per_obspy.risk_table([make_station()], pairs)
        probability.append(float(risk["probability"].iloc[0]))
        assert ("height_1" in risk["derived"].iloc[0].split()) == (deviation > 0.0)
    assert probability[1] > 1.2 * probability[0] > 0.0


def test_openstreetmap():
    table = schema_columns(
        pd.DataFrame({"osm_id": [12, 13], "building:levels": ["3", None], "building": ["yes"] * 2}),
        "a",
    )
    assert table["building_id"].tolist() == ["12", "13"]
    assert table["storeys"].tolist()[0] == 3.0


def test_nothing_that_tells_a_height():
    with pytest.raises(
        CatalogError,
        match=r"town.gpkg: no column height, storeys or period .*columns found: colour",
    ):
        schema_columns(pd.DataFrame({"colour": ["red"]}), "town.gpkg")
