"""
Every kind of screening has its summary, overview, layers and workbook, and its pairs are shown.

Tests of per_obspy.runs.report and of per_obspy.cli.results, through the commands.
"""

import csv
import gc
import json
import re

import numpy as np
import openpyxl
import pandas as pd
import pyarrow as pa
import pyogrio
import pytest
from pyarrow import parquet

from per_obspy.config import Totals
from per_obspy.report.files import Report, TableReader, write_lists
from per_obspy.report.results import Region, Results
from per_obspy.results.coverage import Coverage
from per_obspy.results.ranked_table import ranked_table
from per_obspy.runs.run_facts import event_of_run

from ..report.page.made_up import CLASSES, pair_table
from .small_run import page_content

SCENARIO = "[scenario]\nstations = 1\nmagnitude = 6.5\ndt = 0.02\n[pairs]\ncount = 4\n"
SPECTRA = "[spectra]\ncount = 12\ndampings = [0.05]\nazimuth_step = 30\n"
WANTED = "geopackage = true\nspreadsheet = true\n"
LAYERS = ("gpkg", "qgz", "geoparquet", "kml", "xlsx")
NOWHERE = pd.DataFrame({"longitude": [], "latitude": []}, dtype="float64")
HOSTILE = ["<script>x</script>", '=HYPERLINK("x")', "\u202eevil", "x" * 300]


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """Results of a run, of a design spectrum and of an ensemble, by their stems."""
    from typer.testing import CliRunner

    from per_obspy.cli.application import app

    folder = tmp_path_factory.mktemp("every")
    (folder / "scenario.toml").write_text(SCENARIO)
    head = 'name = "small"\noutput = "run"\nworkers = 1\nsimulation = "scenario.toml"\n'
    run = f"{head}{WANTED}{SPECTRA}"
    (folder / "run.toml").write_text(run)
    result = CliRunner().invoke(app, ["run", str(folder / "run.toml")])
    assert result.exit_code == 0, result.output
    # The same pairs with names that nobody should trust
    pairs = pd.read_csv(folder / "run" / "pairs.csv").assign(pair_id=HOSTILE)
    pairs.to_parquet(folder / "pairs.parquet")
    (folder / "code.csv").write_text(
        "period,damping,sd\n0.01,0.001,0.001\n20.0,0.001,2\n0.01,0.5,0.001\n20.0,0.5,1\n"
    )
    design = f'spectrum = "code.csv"\npairs = "pairs.parquet"\noutput = "design"\n{WANTED}'
    (folder / "design.toml").write_text(design)
    member = '[[scenario]]\nname = "one"\nrun = "run.toml"\nrate = 0.01\n'
    both = f'name = "both"\noutput = "ensemble"\n{WANTED}{member}'
    (folder / "ensemble.toml").write_text(both)
    for name in ("design.toml", "ensemble.toml"):
        result = CliRunner().invoke(app, ["screen", str(folder / name)])
        assert result.exit_code == 0, result.output
    return {"risk": folder / "run", "design": folder / "design", "ensemble": folder / "ensemble"}


@pytest.mark.parametrize("stem", ["risk", "design", "ensemble"])
def test_every_screening_has_everything(done, stem):
    folder = done[stem]
    names = {f"{stem}.{suffix}" for suffix in LAYERS} | {"summary.txt", "summary.pdf"}
    names |= {"report.html"}
    assert names <= {file.name for file in folder.iterdir()}
    assert (folder / "figures" / "overview.png").exists()
    text = (folder / "summary.txt").read_text()
    assert "All rows of the pair table are screened: 4." in text
    # simulated motion is never taken for an earthquake
    assert ("SIMULATED" in text) == (stem != "design")
    assert pyogrio.read_info(folder / f"{stem}.gpkg", layer="pairs")["features"] == 4
    assert parquet.read_metadata(folder / f"{stem}.geoparquet").num_rows == 4
    pairs = openpyxl.load_workbook(folder / f"{stem}.xlsx")["pairs"]
    assert pairs.max_row == 6
    assert "All 4 pairs." in (folder / f"{stem}.kml").read_text()
    assert "f" not in {cell.data_type for row in pairs.iter_rows() for cell in row}


def test_the_page_of_an_ensemble_knows_buildings_stations_and_histories(done):
    ensemble = page_content(done["ensemble"] / "report.html")
    run = page_content(done["risk"] / "report.html")
    assert [row[0] for row in ensemble["stations"]["rows"]] == ["XX.S001 (one)"]
    assert [row[1:] for row in ensemble["stations"]["rows"]] == [
        row[1:] for row in run["stations"]["rows"]
    ]
    assert ensemble["areas"]["rows"]
    # the only scenario is the worst of every pair, so that the histories are those of its run
    assert sorted(map(str, ensemble["histories"].values())) == sorted(
        map(str, run["histories"].values())
    )
    assert ensemble["histories"]
    columns = {column["name"] for column in ensemble["tables"][0]["columns"]}
    assert {"building_id_1", "longitude_2", "height_1", "area", "derived"} <= columns
    layers = dict(pyogrio.list_layers(done["ensemble"] / "ensemble.gpkg"))
    assert layers["pairs"] == "LineString"
    assert {"buildings", "stations", "areas"} <= set(layers)


def test_the_page_of_a_spectrum_says_what_it_leaves_out(done):
    content = page_content(done["design"] / "report.html")
    assert content["histories"] == {}
    assert content["stations"]["rows"] == []
    assert content["areas"]["rows"]
    assert "neither stations nor displacement histories" in content["provenance"][-1][1]
    assert "areas" in dict(pyogrio.list_layers(done["design"] / "design.gpkg"))


def test_every_pair_of_a_spectrum_knows_the_gap_it_lacks(done):
    """Catch a page that says of every pair of a spectrum that it needs no measure."""
    table = pd.read_parquet(done["design"] / "design.parquet")
    assert (table["missing_gap"] == (table["demand"] - table["gap"]).clip(lower=0.0)).all()
    content = page_content(done["design"] / "report.html")
    kinds = {column["name"]: column.get("texts") for column in content["tables"][0]["columns"]}
    assert set(kinds["prevention_kind"]) <= {"gap", "in_doubt", "nothing"}
    assert ("gap" in kinds["prevention_kind"]) == (table["missing_gap"] > 0).any()
    assert "event" not in content["texts"]["says_probability"]
    assert "event" not in content["texts"]["prevents_nothing"]


def test_an_ensemble_computes_no_measure_and_says_so(done):
    content = page_content(done["ensemble"] / "report.html")
    kinds = {column["name"]: column.get("texts") for column in content["tables"][0]["columns"]}
    assert kinds["prevention_kind"] == ["not_computed"]
    assert kinds["worst_scenario"] == ["one"]


@pytest.mark.parametrize("stem", ["design", "ensemble"])
def test_every_screening_speaks_spanish(done, call, stem, tmp_path):
    configuration = done[stem].parent / f"{stem}.toml"
    code, _, errors = call("screen", configuration, "-o", tmp_path / "es", "--language", "es")
    assert code == 0, errors
    content = page_content(tmp_path / "es" / "report.html")
    assert content["texts"]["close"] == "cerrar"
    text = (tmp_path / "es" / "summary.txt").read_text()
    assert "Se evaluan todas las filas de la tabla de pares: 4." in text
    assert not re.search(r"\b(the|pairs|with|of)\b", text.split("\n\n", 1)[1])


#: Digits that a number of a CSV file needs at most; coordinates have seven decimals.
MOST_DIGITS = 5


@pytest.mark.parametrize("stem", ["risk", "design", "ensemble"])
def test_numbers_of_every_csv_file_are_rounded(done, stem):
    checked = 0
    for path in done[stem].glob("*.csv"):
        # as simulated: an input of the run, with all its digits
        with path.open(encoding="utf-8", newline="") as file:
            rows = [] if path.name == "pairs.csv" else list(csv.DictReader(file))
        for row in rows:
            for name, text in row.items():
                number = re.fullmatch(r"-?(\d+\.\d*)(e[-+]\d+)?", text)
                if number and not name.startswith(("longitude", "latitude")):
                    digits = number[1].replace(".", "").strip("0")
                    assert len(digits) <= MOST_DIGITS, (path.name, name, text)
                    checked += 1
    # a file of every kind has numbers
    assert checked > 20


def test_the_summary_of_a_run_has_its_earthquake_and_stations(done):
    text = (done["risk"] / "summary.txt").read_text()
    assert "Earthquake of 2000-01-01 00:00:00 UTC." in text
    assert "Magnitude 6.5." in text
    assert "1 station expected; 1 used: XX.S001." in text
    layers = dict(pyogrio.list_layers(done["risk"] / "risk.gpkg"))
    assert {"pairs": "LineString", "stations": "Point", "areas": "MultiPolygon"}.items() <= (
        layers.items()
    )


@pytest.mark.parametrize("name", ["#1", "P0000002"])
def test_a_pair_is_shown_in_words_and_as_a_figure(done, call, tmp_path, name):
    code, output, _ = call("show", name, done["risk"], "-o", tmp_path / "pair.png")
    assert code == 0
    assert output.startswith("The ground motion is SIMULATED.\nPair P000000")
    assert (tmp_path / "pair.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("name", HOSTILE)
def test_a_pair_of_a_spectrum_is_shown_whatever_its_name(done, call, tmp_path, name):
    code, output, _ = call("show", name, done["design"], "-o", tmp_path / "pair.png")
    assert code == 0
    assert not {"\x1b", "\u202e"} & set(output)
    assert "Spectrum: " in output
    assert (tmp_path / "pair.png").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("nope", "risk"), "no pair 'nope': name a pair_id of the table, or a rank as #1"),
        (("' OR 1=1 --", "risk"), "no pair"),
        (("#1", "ensemble", "-o", "x.png"), "an ensemble has no radii"),
        (("#1", "risk", "-o", "x.pdf"), "unknown suffix '.pdf', expected .png"),
    ],
)
def test_a_pair_that_cannot_be_shown_is_one_line(done, call, arguments, message):
    pair, stem, *rest = arguments
    code, _, errors = call("show", pair, done[stem], *rest)
    assert (code, errors.count("\n")) == (2, 1)
    assert message in errors


def test_a_folder_without_results_is_one_line(call, tmp_path):
    code, _, errors = call("show", "P1", tmp_path)
    assert code == 2
    assert "no results here" in errors


def test_a_pair_of_an_ensemble_is_shown_in_words(done, call):
    code, output, _ = call("show", "#1", done["ensemble"])
    assert code == 0
    assert "Probability of contact in a year: 0.0" in output


def test_files_of_the_worst_pairs_say_so(tmp_path, monkeypatch):
    module = "per_obspy.report.files"
    monkeypatch.setattr(f"{module}.KML_ROWS", 2)
    monkeypatch.setattr("per_obspy.report.layers.kml.ROWS", 2)
    monkeypatch.setattr(f"{module}.SHEET_ROWS", 3)
    table = pair_table(5)
    reader = TableReader(CLASSES, Totals(), 5)
    reader.add(table)
    report, region = Report([], []), Region("x", list(CLASSES), False, NOWHERE)
    results = Results(
        "risk", region, Coverage(5, 5), tally=reader.tally, listed=reader.listed, shown=reader.shown
    )
    write_lists(results, tmp_path, True, report)
    assert report.faults == []
    kml = (tmp_path / "risk.kml").read_text()
    assert "The worst 2 of 5 pairs; all of them are in risk.parquet." in kml
    assert kml.count("<Placemark>") == 2
    contents = openpyxl.load_workbook(tmp_path / "risk.xlsx")["contents"]
    assert contents["B3"].value == "The worst 3 of 5 pairs; all of them are in risk.parquet."


def test_pieces_leave_no_memory_behind(tmp_path):
    # would catch views: one column of a piece that keeps all others, and files read ahead
    more = pd.DataFrame(np.full((4000, 100), 0.5), columns=[f"more_{i}" for i in range(100)])
    table = pd.concat([pair_table(4000), more], axis=1)
    parquet.write_table(pa.Table.from_pandas(table), tmp_path / "risk.parquet")
    reader, before = TableReader(CLASSES, Totals(), 16_000, is_whole=False), []
    for number in range(4):
        with ranked_table([tmp_path / "risk.parquet"]) as file:
            for piece in file.pieces():
                piece["rank"] += number * len(table)
                reader.add(piece)
        del piece
        gc.collect()
        before.append(pa.total_allocated_bytes())
    # 4000 rows of 100 numbers are 3 MB
    assert before[3] - before[0] < 2e6


def test_notes_do_not_depend_on_pieces():
    table = pd.DataFrame(
        {
            "rank": [1, 2, 3],
            "state": ["yes", "unknown", "no"],
            "risk_class": ["severe", "gap unknown", "low"],
            "probability": [0.9, np.nan, 0.1],
            "flags": ["far_station touching", "", "not_far_station_"],
            "derived": ["mass_1", "", ""],
            "pair_id": ["a", "b", "c"],
            "expected_impact_velocity": [1.0, np.nan, 0.0],
            "longitude": [0.0, 0.0, 0.0],
            "latitude": [0.0, 0.0, 0.0],
        }
    )
    for pieces in ([table], [table[:1], table[1:]], [table[1:], table[:1]]):
        reader = TableReader(["severe"], Totals(), 3)
        for piece in pieces:
            reader.add(piece)
        tally = reader.tally
        # an unknown gap adds nothing to what is expected, and is counted
        assert tally.expected == pytest.approx(1.0)
        assert (tally.pairs, tally.derived, tally.flags["far_station"]) == (3, 1, 1)
        pd.testing.assert_frame_equal(reader.listed, table)


def test_headers_tell_the_earthquake_where_no_file_does(tmp_path):
    headers = {"time": "1985-09-19T13:17:47", "magnitude": 8.1, "depth": None}
    groups = [{"screened": False}, {"screened": True, "start": "1985", "headers": headers}]
    record = {"key": "", "outputs": {}, "earthquakes": groups}
    (tmp_path / "run.json").write_text(json.dumps(record))
    places = pd.DataFrame({"longitude": [], "latitude": []})
    region = Region("x", ["low"], False, places, (-102.5, 18.2))
    facts = event_of_run(tmp_path / "run.json", region)
    assert (facts["time"], facts["magnitude"]) == ("1985-09-19T13:17:47", 8.1)
    assert (facts["longitude"], facts["latitude"]) == (-102.5, 18.2)
