"""Inspections: the layer of a run, filled as QGIS fills it, and what is read back."""

import json
import shutil
import sqlite3
from pathlib import Path

import numpy as np
import pandas as pd
import pyogrio
import pytest

from per_obspy import read_pairs
from per_obspy.errors import CatalogError
from per_obspy.runs.inspections import SAME_GAP
from per_obspy.runs.observed import TAPE, observe
from per_obspy.runs.run import run

from .small_run import InProcess, plain_reports, write_configuration


@pytest.fixture(scope="module")
def results(tmp_path_factory) -> Path:
    """Return the results of a run with layers."""
    folder = tmp_path_factory.mktemp("observed")
    file = write_configuration(folder)
    file.write_text("geopackage = true\n" + file.read_text())
    with plain_reports():
        run(file, executor=InProcess())
    return folder / "out"


@pytest.fixture
def forms(results, tmp_path) -> Path:
    return Path(shutil.copy(results / "risk.gpkg", tmp_path / "seen.gpkg"))


def fill(forms: Path, rank: int, **answers: object) -> str:
    """Answer the form of a rank as QGIS does, by SQL, and return its pair."""
    with sqlite3.connect(forms) as package:
        # triggers of the spatial index need functions of a program of maps
        names = [
            row[0] for row in package.execute("SELECT name FROM sqlite_master WHERE type='trigger'")
        ]
        for name in names:
            package.execute(f'DROP TRIGGER "{name}"')
        words = ", ".join(f'"{name}" = ?' for name in answers)
        package.execute(f"UPDATE inspections SET {words} WHERE rank = ?", [*answers.values(), rank])
        (pair,) = package.execute(
            "SELECT pair_id FROM inspections WHERE rank = ?", [rank]
        ).fetchone()
    return str(pair)


def add(forms: Path, pair: str, **answers: object) -> None:
    """Add a form, as a second team does."""
    with sqlite3.connect(forms) as package:
        names, marks = ", ".join(answers), ", ".join("?" * len(answers))
        query = f"INSERT INTO inspections (pair_id, {names}) VALUES (?, {marks})"
        package.execute(query, [pair, *answers.values()])


def test_every_pair_has_an_empty_form_with_typed_fields(results):
    info = pyogrio.read_info(results / "risk.gpkg", layer="inspections")
    types = dict(zip(info["fields"], info["dtypes"], strict=True))
    assert info["features"] == 60
    assert types["gap"] == "float64"
    assert types["inspected_at"].startswith("datetime64")
    assert {types[name] for name in ("contact", "damage", "photo", "note")} == {"object"}


def test_answers_become_observations_and_measured_gaps_of_the_next_run(results, forms, tmp_path):
    hit = fill(forms, 1, contact="yes", damage="local", gap=0.043)
    missed = fill(forms, 2, contact="No")
    unsure = fill(forms, 3, contact="unsure")
    found = observe(results, forms, tmp_path / "seen")
    assert found.rejected == ()
    assert found.empty == 57
    before = read_pairs(results / "pairs.csv").set_index("pair_id")
    after = read_pairs(tmp_path / "seen" / "pairs.parquet").set_index("pair_id")
    assert list(after.index) == list(before.index)
    assert after.loc[[hit, missed], "observed"].tolist() == [1.0, 0.0]
    assert after["observed"].notna().sum() == 2
    assert np.isnan(after.loc[unsure, "observed"])
    assert after.loc[hit, ["gap", "gap_std"]].tolist() == [0.043, TAPE]
    others = before.index != hit
    pd.testing.assert_series_equal(after.loc[others, "gap"], before.loc[others, "gap"])


def test_scores_are_those_of_the_definition(results, forms, tmp_path):
    pairs = [fill(forms, rank, contact=word) for rank, word in ((1, "yes"), (2, "yes"), (3, "no"))]
    observe(results, forms, tmp_path / "seen")
    said = json.loads((tmp_path / "seen" / "evaluation.json").read_text())
    risk = pd.read_parquet(results / "risk.parquet").set_index("pair_id").loc[pairs]
    # Brier (1950): the mean of the squared errors
    expected = np.mean((risk["probability"].to_numpy() - [1, 1, 0]) ** 2)
    # rounding of a mean of three
    assert said["brier_score"] == pytest.approx(expected, rel=1e-12)
    warned = risk["state"].isin(["yes", "likely"]).to_numpy()
    assert said["hit_rate"] == warned[:2].mean()
    assert said["false_alarm_rate"] == float(warned[2])


@pytest.mark.parametrize(
    ("second", "reason"),
    [
        ({"contact": "no", "inspector": "Team B"}, "contact: yes (Team A), no (Team B)"),
        ({"contact": "yes", "gap": 0.04 + 1.5 * SAME_GAP}, "gap: 0.04 to 0.07 m"),
    ],
)
def test_forms_that_disagree_are_named_and_change_nothing(results, forms, tmp_path, second, reason):
    pair = fill(forms, 1, contact="yes", gap=0.04, inspector="Team A")
    add(forms, pair, **second)
    found = observe(results, forms, tmp_path / "seen")
    (rejection,) = found.rejected
    assert (rejection.name, rejection.reasons[0]) == (pair, reason)
    assert found.pairs.empty
    after = read_pairs(tmp_path / "seen" / "pairs.parquet")
    assert after["observed"].isna().all()


def test_two_teams_that_agree_are_one_observation(results, forms, tmp_path):
    pair = fill(forms, 1, contact="yes", damage="none", gap=0.04)
    add(forms, pair, contact="unsure", damage="severe", gap=0.05)
    found = observe(results, forms, tmp_path / "seen")
    (row,) = found.pairs.to_dict("records")
    assert (row["observed"], row["damage"], row["inspections"]) == (1.0, "severe", 2)
    assert row["gap"] == pytest.approx(0.045, abs=1e-15)  # rounding of a mean


def test_wrong_answers_are_rejected_with_field_and_value(results, forms, tmp_path):
    fill(forms, 1, contact="perhaps", gap=450.0)
    add(forms, "no such pair", contact="yes")
    found = observe(results, forms, tmp_path / "seen")
    reasons = [reason for rejection in found.rejected for reason in rejection.reasons]
    assert reasons == [
        "contact: 'perhaps', expected one of yes, no, unsure",
        "gap: 450.0, expected 0 to 10 m",
        "pair_id: 'no such pair' is not in the results",
    ]
    rows = (tmp_path / "seen" / "rejected.csv").read_text().splitlines()
    assert len(rows) == 1 + len(found.rejected)


def test_files_that_are_no_forms_are_refused_before_anything_is_written(results, tmp_path):
    other = tmp_path / "other.gpkg"
    shutil.copy(results / "risk.gpkg", other)
    with sqlite3.connect(other) as package:
        package.execute(
            "UPDATE gpkg_contents SET table_name = 'x' WHERE table_name = 'inspections'"
        )
    table = tmp_path / "table.csv"
    table.write_text("pair_id,contact,gap\n")
    with pytest.raises(CatalogError, match=r"unknown suffix '.csv', expected one of .gpkg"):
        observe(results, table, tmp_path / "seen")
    for file in (other, tmp_path / "missing.gpkg"):
        with pytest.raises(CatalogError, match=file.name):
            observe(results, file, tmp_path / "seen")
    with pytest.raises(CatalogError, match="no results of a run"):
        observe(tmp_path, results / "risk.gpkg", tmp_path / "seen")
    assert not (tmp_path / "seen").exists()


def test_the_command_prints_counts_rates_and_files(results, forms, tmp_path, call):
    fill(forms, 1, contact="yes")
    code, out, _ = call("observed", results, forms, "-o", tmp_path / "seen")
    assert code == 0
    assert out.startswith("1 pair seen: 1 hit each other, 0 did not")
    assert "59 forms empty" in out
    assert "chosen for a visit" in out
