"""
The page of a run, from its results.

Tests of per_obspy.runs.report and per_obspy.runs.worst_pairs.
"""

import json
import re
import shutil

import pandas as pd
import pytest

from per_obspy.constants import STANDARD_GRAVITY
from per_obspy.report import files as report_files
from per_obspy.runs.run import report

from .small_run import page_content, write_configuration

pytestmark = pytest.mark.usefixtures("plain_figures")


@pytest.fixture(scope="module")
def folder(small_run, tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    shutil.copytree(small_run, folder, dirs_exist_ok=True)
    assert "report.html" in json.loads((folder / "out" / "run.json").read_text())["outputs"]
    return folder


@pytest.fixture
def copied(folder, tmp_path):
    shutil.copytree(folder, tmp_path, dirs_exist_ok=True)
    return tmp_path


@pytest.fixture(scope="module")
def content(folder):
    return page_content(folder / "out" / "report.html")


@pytest.fixture(scope="module")
def risk(folder):
    return pd.read_parquet(folder / "out" / "risk.parquet")


def test_page_states_what_the_run_found(content, risk):
    assert content["simulated"] is True
    assert content["pair_count"] == len(risk)
    counts = {state["name"]: state["count"] for state in content["states"]}
    assert counts["yes"] == (risk["state"] == "yes").sum()
    assert content["coverage_bar"][0][1] == len(risk)
    assert content["expected"] == ("3 stations expected; 3 used: XX.S001, XX.S002, XX.S003.")
    assert content["revision"] == ""
    assert [row[0] for row in content["stations"]["rows"]] == ["XX.S001", "XX.S002", "XX.S003"]


def test_histories_have_the_impacts_of_the_risk_table(content, risk):
    """Both follow the pair exactly, by kernels that share no code."""
    histories = content["histories"]
    assert len(histories) >= 40
    by_rank = risk.set_index("rank")
    compared = 0
    for rank, history in histories.items():
        pair = by_rank.loc[int(rank)]
        fastest = max((speed for _, speed in history["impacts"]), default=0.0)
        # After some ten impacts the order of rounding decides; fewer are followed alike
        if pair["impacts"] <= 10:
            assert len(history["impacts"]) == pair["impacts"]
            # Velocities are written in mm/s
            assert fastest == pytest.approx(pair["impact_velocity_exact"], abs=6e-4)
            compared += 1
    assert compared >= 5


def test_radius_of_a_station_is_at_least_its_displacement(content):
    heads = content["stations"]["heads"]
    per, sd = heads.index("PER (1 s), cm"), heads.index("SD (1 s), cm")
    for row in content["stations"]["rows"]:
        assert row[per] >= row[sd] > 0


def test_stations_are_drawn_with_their_peaks_and_spectra(content):
    """The peaks and the radius at 1 s are those of the table, which is made elsewhere."""
    heads = content["stations"]["heads"]
    for row in content["stations"]["rows"]:
        drawn = content["station_drawings"][row[0]]
        peaks = [max(map(abs, drawn[name])) for name in ("north", "east")]
        # Three digits
        assert max(peaks) == pytest.approx(row[heads.index("PGA, g")] * STANDARD_GRAVITY, rel=5e-3)
        at_one = min(range(12), key=lambda i: abs(drawn["period"][i] - 1.0))
        assert drawn["per"][at_one] == pytest.approx(row[heads.index("PER (1 s), cm")], rel=5e-3)


def test_sensitivities_surround_the_probability(content, risk):
    """A monotonic chance at both ends of one input lies on both sides of the mean over it."""
    by_rank = risk.set_index("rank")
    assert content["sensitivity_counts"] == [60, 0]
    rows = [(int(rank), row) for rank, found in content["sensitivity"].items() for row in found]
    assert len(rows) > 50
    uncertain = {"period_1", "period_2", "period_correlation", "damping_1", "damping_2", "gap"}
    uncertain |= {"yield_displacement_1", "yield_displacement_2"}
    assert {row[0] for _, row in rows} <= uncertain
    near = 0
    for rank, (name, low, high, *chances, _, _) in rows:
        assert low < high, name
        chance = by_rank.loc[rank, "probability"]
        near += min(chances) - 0.1 <= chance <= max(chances) + 0.1
    # A chance that has its peak at the median is on neither side
    assert near > 0.8 * len(rows)


def test_areas_of_the_page_are_those_of_the_totals(folder, content):
    totals = pd.read_csv(folder / "out" / "totals.csv")
    (area,) = (column for column in content["tables"][0]["columns"] if column["name"] == "area")
    assert set(area["texts"]) == set(totals["area"])


def test_report_writes_the_page_in_the_language_of_the_configuration(copied):
    configuration = write_configuration(copied, '[report]\nlanguage = "es"\n')
    report(configuration, copied / "out")
    assert page_content(copied / "out" / "report.html")["texts"]["close"] == "cerrar"


def test_revision_of_the_run_is_on_the_page(copied):
    """Its number is that of the configuration; its time the beginning of the run."""
    configuration = write_configuration(copied, "[report]\nrevision = 3\n")
    report(configuration, copied / "out")
    shown = page_content(copied / "out" / "report.html")["revision"]
    assert re.fullmatch(r"Revision 3(, [-\d]{10} \d\d:\d\d UTC)?", shown)


def test_all_buildings_that_a_neighbour_can_hit_are_counted(copied, monkeypatch):
    # catches: those counted that the page shows
    monkeypatch.setattr(report_files, "PAGE_PAIRS", 3)
    report(copied / "run.toml")
    buildings = pd.read_parquet(copied / "out" / "buildings.parquet")
    hit = int((buildings["neighbours_that_can_hit"] > 0).sum())
    assert hit > 3
    number, meaning = page_content(copied / "out" / "report.html")["numbers"][2]
    assert (number, meaning) == (str(hit), "buildings that a neighbour can hit")


def test_rejections_are_counted_and_their_beginning_shown(content):
    assert content["rejected"]["rows"] == []
    assert content["rejected"]["note"] == "No input was rejected."


def test_language_on_the_command_line(copied, call):
    code, _, error = call("report", copied / "run.toml", "-o", copied / "out", "--language", "es")
    assert (code, error) == (0, error)
    assert page_content(copied / "out" / "report.html")["language"] == "es"
