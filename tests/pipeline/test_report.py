"""The report: again from the risk table of a run, layers, and the rows of the table it shows."""

import json
import shutil

import pandas as pd
import pyogrio
import pytest
from pyarrow import parquet

from per_obspy.config import Run, load
from per_obspy.errors import CatalogError
from per_obspy.pipeline import report as report_stage
from per_obspy.pipeline.report import _summary
from per_obspy.pipeline.run import report, run
from per_obspy.tables import risk

from .small_run import InProcess, write_configuration

PAIRS = '[pairs]\nfile = "pairs.csv"\n'


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A run of a given inventory in which some pairs were observed."""
    folder = tmp_path_factory.mktemp("report")
    run(write_configuration(folder), executor=InProcess())
    pairs = pd.read_csv(folder / "out" / "pairs.csv", dtype=str)
    # Pounding, no pounding, and not looked at
    pairs["observed"] = ["1", "0", ""] * 20
    pairs.to_csv(folder / "pairs.csv", index=False)
    write_configuration(folder, PAIRS)
    return folder, run(folder / "run.toml", executor=InProcess())


@pytest.fixture
def copied(finished, tmp_path):
    shutil.copytree(finished[0], tmp_path, dirs_exist_ok=True)
    return tmp_path


def test_a_report_alone_makes_its_files_again(copied):
    (copied / "out" / "figures" / "overview.png").unlink()
    (copied / "out" / "totals.csv").unlink()
    before = json.loads((copied / "out" / "run.json").read_text())
    report(copied / "run.toml")
    assert json.loads((copied / "out" / "run.json").read_text()) == before
    assert run(copied / "run.toml", executor=InProcess()).did_nothing


def test_a_report_needs_a_finished_run(copied):
    (copied / "out" / "risk.parquet").write_bytes(b"nothing")
    with pytest.raises(CatalogError, match=r"risk\.parquet: not as the run left it"):
        report(copied / "run.toml")
    (copied / "out" / "run.json").unlink()
    with pytest.raises(CatalogError, match="no finished run here"):
        report(copied / "run.toml")


def summary(folder):
    return _summary(load(folder / "run.toml", Run), folder / "out" / "risk.parquet", folder, {})


@pytest.mark.parametrize("size", [1, 7, 1000])
def test_pieces_change_nothing_of_the_report(copied, monkeypatch, size):
    # would catch rows lost between pieces, and a worst pair of a later piece
    monkeypatch.setattr(risk, "ROWS", size)
    found = summary(copied)
    table = pd.read_parquet(copied / "out" / "risk.parquet")
    named = table[table["station"] != ""].iloc[0]
    assert found.worst["pair_id"] == named["pair_id"]
    assert found.worst.index.tolist() == table.columns.tolist()
    # every pair of a small table is shown, and every observed one counts
    pd.testing.assert_frame_equal(found.shown, table[report_stage.SHOWN_COLUMNS])
    observed = table.loc[table["observed"].notna(), report_stage.OBSERVED_COLUMNS]
    pd.testing.assert_frame_equal(found.observed, observed.reset_index(drop=True))
    assert found.totals.table["pairs"].sum() == len(table)


def test_a_large_table_is_shown_in_equal_steps(copied, monkeypatch):
    monkeypatch.setattr(report_stage, "SHOWN", 20)
    monkeypatch.setattr(risk, "ROWS", 7)
    count = parquet.read_metadata(copied / "out" / "risk.parquet").num_rows
    step = -(-count // 20)
    assert summary(copied).shown["rank"].tolist() == list(range(1, count + 1, step))


KINDS = [("", "Polygon"), ("[totals]\nh3 = 6\n", "Polygon")]
KINDS += [('[totals]\narea = "position"\n', "Point")]


@pytest.mark.parametrize(("kind", "shape"), KINDS)
def test_totals_are_a_layer_too(copied, kind, shape):
    write_configuration(copied, f"geopackage = true\n{PAIRS}{kind}")
    result = run(copied / "run.toml", executor=InProcess())
    assert {"risk.gpkg", "totals.gpkg", "totals.csv"} <= set(result.record["outputs"])
    information = pyogrio.read_info(copied / "out" / "totals.gpkg")
    # one row per area, in both forms
    table = pd.read_csv(copied / "out" / "totals.csv", dtype={"area": str})
    assert (information["features"], information["geometry_type"]) == (len(table), shape)
    assert list(information["fields"]) == list(table)
    assert table["pairs"].sum() == result.record["counts"]["pairs"]
    if "h3" in kind:
        assert table["area"].str.fullmatch("86[0-9a-f]{7}f{6}").all()  # an H3 index of resolution 6


def test_the_layer_of_the_pairs_holds_the_whole_table(copied):
    # would catch a layer that has only the columns which totals need
    write_configuration(copied, f"geopackage = true\n{PAIRS}")
    run(copied / "run.toml", executor=InProcess())
    table = pd.read_parquet(copied / "out" / "risk.parquet")
    information = pyogrio.read_info(copied / "out" / "risk.gpkg", layer="pairs")
    assert information["features"] == len(table)
    assert list(information["fields"]) == list(table)
