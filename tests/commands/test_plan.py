"""``per-obspy plan`` on a run with buildings: files, printed lines, wrong input."""

import json

import pandas as pd
import pytest

from per_obspy.screening.building_rows.row_columns import BUILDINGS


@pytest.fixture
def results(tmp_path):
    """Return the folder of a finished run with three buildings, one of which cannot be hit."""
    kinds = {"str": "", "float64": 0.1, "int64": 1, "bool": False}
    plain = {column.name: kinds[column.dtype] for column in BUILDINGS}
    rows = [
        plain | {"rank": rank, "building_id": name, "longitude": 20.0, "latitude": latitude}
        for rank, (name, latitude) in enumerate([("a", 40.0), ("b", 40.001), ("c", 40.0)], start=1)
    ]
    table = pd.DataFrame(rows)
    table["neighbours_that_can_hit"] = [1, 2, 0]
    folder = tmp_path / "run"
    folder.mkdir()
    table.to_parquet(folder / "buildings.parquet", index=False)
    record = {"name": "town", "state": "complete", "simulated": True, "key": "", "outputs": {}}
    (folder / "run.json").write_text(json.dumps(record), encoding="utf-8")
    return folder


def test_a_plan_has_every_building_that_can_be_hit(call, results, tmp_path):
    code, out, _ = call("plan", results, "--start=20,40", "-o", tmp_path / "plan", "--geopackage")
    assert code == 0
    assert "The ground motion is SIMULATED." in out
    assert "2 visits of 1 teams; 0 buildings" in out
    assert pd.read_csv(tmp_path / "plan" / "plan.csv")["building_id"].tolist() == ["a", "b"]
    layers = ["plan.columns.csv", "plan.csv", "plan.gpkg", "plan.gpx"]
    assert sorted(path.name for path in (tmp_path / "plan").iterdir()) == layers


def test_layers_are_points_and_lines(call, results, tmp_path):
    import pyogrio

    call("plan", results, "--start=20,40", "-o", tmp_path, "--geopackage")
    found = dict(pyogrio.list_layers(tmp_path / "plan.gpkg").tolist())
    assert found == {"visits": "Point", "routes": "LineString"}


def test_json_is_for_machines(call, results):
    code, out, _ = call("plan", results, "--start=20,40", "--json")
    said = json.loads(out)
    assert (code, said["visits"], said["buildings"], said["simulated"]) == (0, 2, 2, "true")


@pytest.mark.parametrize(
    ("start", "reason"),
    [
        (["--start=40,20"], "from the nearest building"),
        (["--start=20"], "is not LONGITUDE,LATITUDE"),
        (["--start=20,95"], "outside 180 and 90"),
        (["--start=20,40", "--start=20,40", "--teams", "3"], "2 starts of 3 teams"),
    ],
)
def test_a_wrong_start_is_one_line(call, results, start, reason):
    code, _, err = call("plan", results, *start)
    assert code == 2
    assert reason in " ".join(err.split())


def test_an_unfinished_run_or_none_is_refused(call, results, tmp_path):
    code, _, err = call("plan", tmp_path, "--start=20,40")
    assert (code, "no finished run here" in err) == (2, True)
    record = {"state": "unfinished", "key": "", "outputs": {}}
    (results / "run.json").write_text(json.dumps(record), encoding="utf-8")
    code, _, err = call("plan", results, "--start=20,40")
    assert (code, "unfinished" in err) == (2, True)


def test_a_damaged_table_is_named(call, results):
    (results / "buildings.parquet").write_bytes(b"PAR1 no table PAR1")
    code, _, err = call("plan", results, "--start=20,40")
    assert code == 2
    assert "buildings.parquet" in err


def test_no_building_that_can_be_hit_leaves_nothing(call, results):
    table = pd.read_parquet(results / "buildings.parquet").assign(neighbours_that_can_hit=0)
    table.to_parquet(results / "buildings.parquet", index=False)
    code, _, err = call("plan", results, "--start=20,40")
    assert code == 3
    assert "no neighbour can hit any building" in err
