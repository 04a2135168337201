"""The report: again from the risk table of a run, layers, and the rows of the table it shows."""

import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import pandas as pd
import pyarrow as pa
import pyogrio
import pytest
from pyarrow import parquet

from per_obspy.config import Run, load
from per_obspy.errors import CatalogError
from per_obspy.report import files as report_files
from per_obspy.report.files import PairTable, Report, TableReader, read_table
from per_obspy.report.results import Results
from per_obspy.report.tally import HARD
from per_obspy.results import ranked_table
from per_obspy.results.coverage import Coverage
from per_obspy.runs.report import run_region
from per_obspy.runs.run import report, run

from .small_run import InProcess, real_reports, write_configuration

pytestmark = pytest.mark.usefixtures("plain_reports")

PAIRS = '[pairs]\nfile = "pairs.csv"\n'


@pytest.fixture(scope="module")
def finished(small_run, tmp_path_factory):
    """A run of a given inventory in which some pairs were observed."""
    folder = tmp_path_factory.mktemp("report")
    shutil.copytree(small_run, folder, dirs_exist_ok=True)
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


def test_a_report_alone_makes_its_files_again(copied, monkeypatch):
    (copied / "out" / "figures" / "overview.png").unlink()
    (copied / "out" / "totals.csv").unlink()
    # What explains the worst pairs belongs to the run: a report that computes it again fails here
    monkeypatch.setattr("per_obspy.runs.report.page_drawings", None)
    before = json.loads((copied / "out" / "run.json").read_text())
    report(copied / "run.toml")
    assert json.loads((copied / "out" / "run.json").read_text()) == before
    assert run(copied / "run.toml", executor=InProcess()).did_nothing


def test_a_report_needs_a_finished_run(copied):
    for name in ("worst_pairs.json", "risk.parquet"):
        (copied / "out" / name).write_bytes(b"nothing")
        with pytest.raises(CatalogError, match=f"{name}: has changed since the run wrote it"):
            report(copied / "run.toml")
    (copied / "out" / "run.json").unlink()
    with pytest.raises(CatalogError, match="no finished run here"):
        report(copied / "run.toml")


def read(folder):
    """Return the results, and what was read of all rows."""
    settings, out = load(folder / "run.toml", Run), folder / "out"
    results = Results("risk", run_region(settings, True, None), Coverage(60, 60))
    with ranked_table.ranked_table([out / "risk.parquet"]) as table:
        given = settings.totals, None, settings.report, False, False
        pairs = PairTable(table.pieces(), table.pairs, *given)
        reader = TableReader(results.region.classes, pairs.totals, pairs.pairs, is_whole=False)
        return read_table(results, reader, pairs, out, Report([], [])), reader


@pytest.mark.parametrize("size", [1, 7, 1000])
def test_pieces_change_nothing_of_the_report(copied, monkeypatch, size):
    # would catch rows lost between pieces
    monkeypatch.setattr(ranked_table, "ROWS", size)
    results, reader = read(copied)
    table = pd.read_parquet(copied / "out" / "risk.parquet")
    # The alert is that of all rows
    hard = table["expected_impact_velocity"] >= HARD
    assert results.tally.expected == pytest.approx(table["probability"].sum())
    assert results.tally.hard == pytest.approx(table.loc[hard, "probability"].sum())
    by_class = table.groupby("risk_class")["probability"].sum()
    assert dict(results.tally.expected_by_class) == pytest.approx(by_class.to_dict())
    # every pair of a small table is shown, and every observed one counts
    pd.testing.assert_frame_equal(results.shown, table[report_files.SHOWN_COLUMNS])
    observed = table.loc[table["observed"].notna(), report_files.OBSERVED_COLUMNS]
    pd.testing.assert_frame_equal(reader.observed, observed.reset_index(drop=True))
    assert results.areas["pairs"].sum() == len(table)


def test_a_large_table_is_shown_in_equal_steps(copied, monkeypatch):
    monkeypatch.setattr(report_files, "SHOWN", 20)
    monkeypatch.setattr(ranked_table, "ROWS", 7)
    count = parquet.read_metadata(copied / "out" / "risk.parquet").num_rows
    step = -(-count // 20)
    assert read(copied)[0].shown["rank"].tolist() == list(range(1, count + 1, step))


KINDS = [("", "MultiPolygon"), ("[totals]\nh3 = 6\n", "MultiPolygon")]
KINDS += [('[totals]\narea = "position"\n', "Point")]


@pytest.mark.parametrize(("kind", "shape"), KINDS)
def test_totals_are_a_layer_too(copied, kind, shape, monkeypatch):
    shown = list[Results]()
    monkeypatch.setattr(
        report_files, "write_page", lambda results, path: (shown.append(results), path.touch())
    )
    write_configuration(copied, f"geopackage = true\npmtiles = true\n{PAIRS}{kind}")
    result = report(copied / "run.toml")
    assert result.record["faults"] == []
    assert {"risk.gpkg", "risk.qgz", "risk.geoparquet", "totals.csv"} <= set(
        result.record["outputs"]
    )
    information = pyogrio.read_info(copied / "out" / "risk.gpkg", layer="areas")
    # one row per area, in both forms
    table = pd.read_csv(copied / "out" / "totals.csv", dtype={"area": str})
    assert (information["features"], information["geometry_type"]) == (len(table), shape)
    assert list(information["fields"]) == list(table)
    assert table["pairs"].sum() == result.record["counts"]["pairs"]
    if "h3" in kind:
        assert table["area"].str.fullmatch("86[0-9a-f]{7}f{6}").all()  # an H3 index of resolution 6
        # people read the nearest town or degrees, on the page and elsewhere
        names = set(shown[0].areas["area"])
        assert not names & set(table["area"])
        assert set(shown[0].worst["area"]) <= names
    # would catch a layer of pairs that has only the columns which totals need
    table = pd.read_parquet(copied / "out" / "risk.parquet")
    information = pyogrio.read_info(copied / "out" / "risk.gpkg", layer="pairs")
    assert information["features"] == len(table)
    assert list(information["fields"]) == list(table)
    # tiles of the farthest zoom have every pair as a point, where lines of some metres would vanish
    tiles = copied / "out" / "risk_pairs.pmtiles"
    assert tiles.name in result.record["outputs"]
    _, _, _, names = pyogrio.raw.read(tiles, columns=["pair_id"], ZOOM_LEVEL="8")
    assert set(names[0]) == set(table["pair_id"])


#: Names of carried columns that a layer, a database or a figure keeps for itself.
HOSTILE = [
    "fid",
    "geom",
    "GEOMETRY",
    "Gap",
    "Rank",
    "State",
    "map",
    "index",
    "rowid",
    "=a()",
    "\u202e",
]


def test_hostile_names_and_values_reach_every_file(copied, call):
    # would catch a crash of the last step: of GDAL, of mathtext, of rich, of UTF-8
    pairs = pd.read_csv(copied / "pairs.csv")
    texts = ["$x_$", "[/red]", "=1+1", "\u202egap", "\x1b[31mred", ":smile:"]
    ids = [f"{text} {number}" for number, text in enumerate(texts * 10)]
    hostile = pairs.assign(pair_id=ids, **dict.fromkeys(HOSTILE, texts * 10))
    hostile = hostile.assign(tags=[{"a": [1]}] * 60, seen=[True, None, False] * 20)
    table = pa.Table.from_pandas(hostile, preserve_index=False)
    # Text that is not UTF-8 in the last row
    notes = pa.array([b"fine"] * 59 + [b"\xff"]).view(pa.string())
    parquet.write_table(table.append_column("note", notes), copied / "hostile [1].parquet")
    text = PAIRS.replace("pairs.csv", "hostile [1].parquet") + "geopackage = true\n"
    write_configuration(copied, text)
    head = (copied / "run.toml").read_text().replace("geopackage = true\n", "")
    (copied / "run.toml").write_text("geopackage = true\n" + head)
    folder = copied / "out [2]"
    with real_reports():
        code, output, errors = call("run", copied / "run.toml", "-o", folder)
    assert code == 0, errors
    record = json.loads((folder / "run.json").read_text())
    assert (record["faults"], record["failed"]) == ([], False)
    assert record["counts"]["pairs"] == 59
    assert "note is not UTF-8" in (folder / "rejected.csv").read_text()
    risk_table = pd.read_parquet(folder / "risk.parquet")
    assert set(risk_table["pair_id"]) == set(ids[:-1])
    assert {*HOSTILE, "tags", "seen", "note"} <= set(risk_table)
    # the layer has all of them, under names of its own where GDAL needs them
    layer = pyogrio.read_info(folder / "risk.gpkg", layer="pairs")
    assert layer["features"] == 59
    assert {"fid_2", "geom_2", "Gap_2", "Rank_2", "State_2", "map"} <= set(layer["fields"])
    assert (folder / "figures" / "worst_pair.png").exists()
    # the console is literal, without characters that steer a terminal
    worst = risk_table["pair_id"].iloc[0].split()[0].lstrip("\u202e\x1b")
    assert worst[:4] in output
    assert not {"\x1b", "\u202e"} & set(output)


def test_a_background_that_cannot_be_read_leaves_the_page(copied, call):
    # would catch: no page for a damaged file, or a run of hours before a missing one is found
    text = (copied / "run.toml").read_text()
    (copied / "run.toml").write_text(f'{text}\n[report]\nbackground = "roads.pmtiles"\n')
    code, _, errors = call("run", copied / "run.toml")
    assert code == 2
    assert errors.splitlines()[-1].endswith("roads.pmtiles: no such file")
    (copied / "roads.pmtiles").write_bytes(b"PMTiles\x03" + bytes(200))
    code, _, errors = call("report", copied / "run.toml")
    assert code == 0
    (line,) = [line for line in errors.splitlines() if line.startswith("per-obspy: ")]
    assert "roads.pmtiles: " in line
    assert line.endswith("; the page has no background")
    assert (copied / "out" / "report.html").exists()


@pytest.mark.parametrize("failing", ["draw_overview", "_write_layers"])
def test_a_picture_that_fails_leaves_the_tables(copied, call, monkeypatch, failing):
    # would catch a traceback after all the work, totals of some rows, and an old picture
    text = (copied / "run.toml").read_text()
    (copied / "run.toml").write_text("geopackage = true\n" + text)
    monkeypatch.setattr(ranked_table, "ROWS", 25)
    assert call("report", copied / "run.toml")[0] == 0
    totals = (copied / "out" / "totals.csv").read_bytes()

    def fails(*arguments):
        # A layer fails amid the rows
        for argument in arguments:
            if isinstance(argument, Iterator):
                next(argument)
        raise ValueError("$x_$\nExpected\nend of text")

    with monkeypatch.context() as patch:
        patch.setattr(report_files, failing, fails)
        code, _, errors = call("report", copied / "run.toml")
    (line,) = [line for line in errors.splitlines() if line.startswith("per-obspy: ")]
    assert code == 0
    assert line.endswith("cannot be drawn: ValueError $x_$ Expected end of text")
    path = Path(line.removeprefix("per-obspy: ").partition(": cannot")[0])
    assert not path.exists()
    assert (copied / "out" / "totals.csv").read_bytes() == totals
    assert json.loads((copied / "out" / "run.json").read_text())["key"] == ""
    # made by the next report
    assert call("report", copied / "run.toml")[0] == 0
    assert path.exists()
    assert json.loads((copied / "out" / "run.json").read_text())["faults"] == []
