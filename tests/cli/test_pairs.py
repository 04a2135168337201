"""``per-obspy pairs`` and ``per-obspy catalog`` as a user meets them."""

import json
import sys

import pandas as pd
import pyogrio
import pytest
import shapely

from per_obspy.inventory.files.reading import read_pairs

HEADER = "pair_id,longitude_1,latitude_1,height_1,longitude_2,latitude_2,height_2,gap"
ROW = "a,0.3,0.0,10,0.3001,0.0,12,0.05"
BAD_ROW = "b,0.3,0.0,10,0.3001,0.0,12,50"


@pytest.fixture
def footprints(tmp_path):
    """Three houses of 11 m in a row on the equator, two 1.1 m apart; one repeats another."""
    west = [0.3, 0.3001, 0.30021, 0.3]
    boxes = [shapely.box(x, 0.0, x + 0.0001, 0.0001) for x in west]
    heights = pd.Series([9.0, 12.0, 6.0, 9.0]).to_numpy()
    path = tmp_path / "town.gpkg"
    pyogrio.raw.write(
        path,
        shapely.to_wkb(boxes),
        [heights],
        ["height"],
        geometry_type="Polygon",
        crs="EPSG:4326",
        layer="town",
    )
    return path


@pytest.fixture
def table(tmp_path):
    path = tmp_path / "pairs.csv"
    path.write_text(f"{HEADER}\n{ROW}\n{BAD_ROW}\n")
    return path


@pytest.mark.parametrize("words", [("pairs",), ("pairs", "find")])
def test_pairs_come_from_footprints(call, footprints, tmp_path, words):
    output = tmp_path / "made" / "pairs.parquet"
    code, out, _ = call(*words, footprints, "-o", output)
    assert code == 0
    assert "2 pairs, 1 of them touching, 1 rejected" in out
    assert "outlines that are no usable building: 1 repeated" in out
    pairs = read_pairs(output)
    assert pairs["gap"].tolist()[0] == 0.0
    assert 1.0 < pairs["gap"].tolist()[1] < 1.2  # 1e-5 degrees on the equator are 1.11 m
    rejected = pd.read_csv(tmp_path / "made" / "pairs.rejected.csv")
    assert rejected["reasons"].tolist() == ["the polygon repeats an earlier one"]


def test_options_may_come_first_and_json_is_for_machines(call, footprints, tmp_path):
    code, out, _ = call("pairs", "-o", tmp_path / "p.csv", "--distance", "1", "--json", footprints)
    assert code == 0
    assert json.loads(out) == {
        "output": str(tmp_path / "p.csv"),
        "buildings": str(tmp_path / "p.buildings.parquet"),
        "pairs": 1,
        "touching": 1,
        "rejected": 1,
        "neighbours": 1,
        "left_out": {},
    }


@pytest.mark.parametrize("missing", ["pyogrio", "pyproj", "shapely"])
def test_a_missing_extra_is_one_line_that_names_it(call, monkeypatch, footprints, missing):
    monkeypatch.setitem(sys.modules, missing, None)
    code, _, err = call("pairs", footprints)
    assert code == 2
    assert err == f"per-obspy: {missing} not installed: pip install 'per_obspy[gis]'\n"


def test_the_deviation_that_is_assumed_is_said(call, footprints, tmp_path):
    output = tmp_path / "p.parquet"
    _, out, _ = call("pairs", footprints, "-o", output)
    assert "assumed by the origin of the outlines: up to 0.1 m" in out
    assert set(read_pairs(output)["gap_std"]) == {0.1}
    _, out, _ = call("pairs", footprints, "-o", output, "--gap-std", "0.3")
    assert "assumed" not in out
    assert set(read_pairs(output)["gap_std"]) == {0.3}


def test_columns_by_name_and_all_others(call, tmp_path):
    boxes = [shapely.box(0.3 + x * 1e-4, 0.0, 0.3 + (x + 1) * 1e-4, 1e-4) for x in (0, 1)]
    columns = {
        "nr": ["7", "8"],
        "alto": ["30 ft", "6,5"],
        "pisos": ["3", "2"],
        "barrio": ["A", "B"],
    }
    columns["T1"] = ["0.3", "0.2"]
    path = tmp_path / "town.gpkg"
    fields = [pd.Series(values, dtype=object).to_numpy() for values in columns.values()]
    pyogrio.raw.write(
        path, shapely.to_wkb(boxes), fields, list(columns), geometry_type="Polygon", crs="EPSG:4326"
    )
    names = ("--id-column", "nr", "--height-column", "alto", "--storeys-column", "pisos")
    code, _, _ = call("pairs", path, "-o", tmp_path / "p.csv", *names, "--column", "period=T1")
    assert code == 0
    (pair,) = read_pairs(tmp_path / "p.csv").to_dict("records")
    assert pair["pair_id"] == "7/8"
    # 30 ft by the definition of the foot
    assert (round(pair["height_1"], 9), pair["height_2"]) == (9.144, 6.5)
    assert (pair["storeys_1"], pair["period_2"]) == (3.0, 0.2)
    assert (pair["barrio_1"], pair["barrio_2"], pair["alto_1"]) == ("A", "B", "30 ft")
    assert pd.read_parquet(tmp_path / "p.buildings.parquet")["barrio"].tolist() == ["A", "B"]


@pytest.mark.parametrize("option", ["period", "hight=alto"])
def test_a_column_option_that_names_no_quantity(call, footprints, option):
    code, _, err = call("pairs", footprints, "--column", option)
    assert code == 2
    assert "QUANTITY=COLUMN" in err
    assert option in err


def test_a_list_of_buildings_makes_pairs(call, tmp_path):
    rows = ["id,lon,lat,width,length,azimuth,storeys", "a,0.3,0,8,10,90,3", "b,0.3001,0,8,10,90,4"]
    (tmp_path / "list.csv").write_text("\n".join(rows))
    code, out, _ = call("pairs", tmp_path / "list.csv", "-o", tmp_path / "p.csv")
    assert code == 0
    assert "1 pair, 0 of them touching, 0 rejected" in out


def test_wrong_footprints_stop_with_one_line(call, tmp_path):
    (tmp_path / "points.csv").write_text("x,y\n0,0\n")
    wanted = "add a column wkt (outlines in degrees), or width, length, azimuth"
    for name, reason in (("points.csv", wanted), ("absent.gpkg", "no such file")):
        code, _, err = call("pairs", tmp_path / name)
        assert code == 2
        assert err.count("\n") == 1
        assert name in err
        assert reason in err


def test_check_prints_what_a_table_gives_and_what_is_wrong(call, table):
    code, out, _ = call("pairs", "check", table)
    assert code == 0
    assert "1 usable pairs, 0 of them touching, 1 rejected rows" in out
    assert "period_1 (1)" in out.partition("Derived or assumed instead (rows): ")[2]
    assert "line 3, b: gap = 50" in out
    assert "height_1" in out
    # Columns of places are not called unknown
    table.write_text(f"{HEADER},sokak_1,place,owner\n{ROW},14,old town,me\n")
    _, out, _ = call("pairs", "check", table)
    assert "Names of places, carried along unchanged: sokak_1; place\n" in out
    assert "Unknown columns, carried along unchanged: owner\n" in out


def test_many_rejected_rows_are_counted_by_fault(call, table):
    table.write_text("\n".join([HEADER, ROW, *(f"x{i}{BAD_ROW[1:]}" for i in range(12))]))
    _, out, _ = call("pairs", "check", table)
    assert "and 2 more; rows by fault: gap (12)" in out


def test_check_as_json(call, table):
    code, out, _ = call("pairs", "check", table, "--json")
    said = json.loads(out)
    assert code == 0
    assert said["pairs"] == 1
    assert said["derived"]["period_1"] == 1
    assert said["rejected"][0]["name"] == "b"
    assert {row["column"]: row["largest"] for row in said["columns"]}["height_2"] == 12.0


def test_check_of_a_table_without_a_usable_row_exits_with_3(call, table):
    table.write_text(f"{HEADER}\n{BAD_ROW}\n")
    code, _, err = call("pairs", "check", table)
    assert code == 3
    assert "no usable row" in err


def test_a_table_goes_into_the_catalogue_and_is_found_by_place(call, table, tmp_path):
    index = tmp_path / "catalog.toml"
    known = ("--index", index)
    origin = ("--name", "old town", "--source", "a survey", "--licence", "CC0-1.0")
    assert call("catalog", "add", table, *origin, *known)[0] == 0
    assert "old town" in call("catalog", "list", *known)[1]
    found = call("catalog", "find", "--bbox", "-1", "-1", "1", "1", "--json", *known)[1]
    assert [entry["name"] for entry in json.loads(found)] == ["old town"]
    assert (
        json.loads(call("catalog", "find", "--bbox", "5", "5", "6", "6", "--json", *known)[1]) == []
    )
    code, _, err = call("catalog", "add", table, *origin, *known)
    assert code == 2
    assert "'old town' is taken" in err


def test_a_changed_inventory_is_noticed(call, table, tmp_path):
    known = ("--index", tmp_path / "catalog.toml")
    call("catalog", "add", table, "--name", "a", "--source", "b", "--licence", "c", *known)
    code, out, _ = call("catalog", "check", *known)
    assert (code, out) == (0, "1 of 1 stored inventories are unchanged\n")
    table.write_text(table.read_text().replace("0.05", "0.06"))
    code, out, err = call("catalog", "check", "--json", *known)
    assert code == 2
    assert json.loads(out)["inventories"] == 1
    assert "changed or damaged" in err


def test_a_region_that_is_no_box_is_refused(call, tmp_path):
    (tmp_path / "catalog.toml").write_text("")
    code, _, err = call(
        "catalog", "find", "--bbox", "0", "95", "1", "96", "--index", tmp_path / "catalog.toml"
    )
    assert code == 2
    assert "region must be west" in err


@pytest.mark.parametrize("group", ["pairs", "catalog"])
def test_groups_say_what_they_have(call, group):
    code, out, _ = call(group, "--help")
    assert code == 0
    assert "check" in out
