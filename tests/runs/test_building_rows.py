"""Rows of buildings in a run: the same bytes however it is cut, resumed, or shared by processes."""

import json
import shutil

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from per_obspy.buildings.columns import BUILDINGS, ROWS
from per_obspy.results.table_files import rounded
from per_obspy.runs.run import report, screen

from .small_run import InProcess, write_configuration

pytestmark = pytest.mark.usefixtures("plain_reports")

TABLES = ("rows.parquet", "buildings.parquet", "buildings.csv", "totals.csv", "rejected.csv")


@pytest.fixture(scope="module")
def finished(small_run):
    """A run of sixty pairs in rows."""
    return small_run, json.loads((small_run / "out" / "run.json").read_text())


@pytest.fixture
def copied(finished, tmp_path):
    shutil.copytree(finished[0], tmp_path, dirs_exist_ok=True)
    return tmp_path


def content(folder):
    return {name: (folder / "out" / name).read_bytes() for name in TABLES}


def screened(folder, text="", executor=None):
    """Screen again, with further settings, and return the counts."""
    file = write_configuration(folder, text)
    return screen(file, executor=executor or InProcess()).record["counts"]


def table(folder, name):
    return pd.read_parquet(folder / "out" / f"{name}.parquet")


def test_buildings_of_unknown_gaps_stand_before_those_that_hit_nobody(copied):
    # would catch: whatever is to be measured comes after hundreds of buildings of severity 0
    pairs = pd.read_csv(copied / "out" / "pairs.csv", dtype=str)
    pairs.loc[::4, "gap"] = ""
    pairs.to_csv(copied / "pairs.csv", index=False)
    screened(copied, '[pairs]\nfile = "pairs.csv"\n')
    buildings, risk = table(copied, "buildings"), table(copied, "risk")
    unknown = risk.loc[risk["gap"].isna(), ["building_id_1", "building_id_2"]]
    beside = buildings["building_id"].isin(unknown.to_numpy().ravel())
    spared = buildings[(buildings["severity"] == 0.0) & ~beside]
    to_measure = buildings[buildings["severity"].isna()]
    assert len(spared) > 2
    assert len(to_measure) > 2
    assert to_measure["rank"].max() < spared["rank"].min()


def test_every_pair_is_one_interface_and_every_building_one_row(finished):
    folder, record = finished
    pairs, rows, buildings = (table(folder, name) for name in ("risk", "rows", "buildings"))
    assert sorted(rows["pair_id"]) == sorted(pairs["pair_id"])
    names = set(pairs["building_id_1"]) | set(pairs["building_id_2"])
    assert set(buildings["building_id"]) == names
    assert buildings["building_id"].is_unique
    assert buildings["rank"].tolist() == list(range(1, len(names) + 1))
    assert record["counts"]["buildings"] == len(names)
    assert record["counts"]["rows"] == rows["row_id"].nunique() < len(pairs)
    # every row has its interfaces, one after the other, and one building more
    for _, row in rows.groupby("row_id"):
        assert row["interface"].tolist() == list(range(1, len(row) + 1))
        assert (row["buildings"] == len(row) + 1).all()
        right = row["building_id_right"].iloc[:-1].tolist()
        assert row["building_id_left"].iloc[1:].tolist() == right


def test_tables_have_the_columns_that_are_explained(finished):
    folder, _ = finished
    for name, columns in (("rows", ROWS), ("buildings", BUILDINGS)):
        names = [column.name for column in columns]
        assert pq.read_schema(folder / "out" / f"{name}.parquet").names == names
        explained = pd.read_csv(folder / "out" / f"{name}.columns.csv")["name"]
        assert explained.head(len(names)).tolist() == names
        metadata = pq.read_schema(folder / "out" / f"{name}.parquet").metadata
        assert json.loads(metadata[b"per_obspy"])["simulated"] == "true"
    text = pd.read_csv(folder / "out" / "buildings.csv")
    assert text["building_id"].tolist() == table(folder, "buildings")["building_id"].tolist()


def test_a_row_of_two_is_the_pair_of_the_risk_table(finished):
    folder, _ = finished
    rows = table(folder, "rows").merge(table(folder, "risk"), on="pair_id", suffixes=("", "_pair"))
    two = rows[rows["buildings"] == 2]
    assert (two["impact_velocity"] > 0).any()
    # the same physics by two programs; rounding grows from impact to impact, by some 1e-9 here
    np.testing.assert_allclose(
        two["impact_velocity"], two["impact_velocity_exact"], rtol=1e-6, atol=1e-12
    )
    # buildings carry the largest quantile of both sides
    sides = pd.concat(
        [rows.set_index(f"building_id_{side}")["impact_velocity_84"] for side in ("left", "right")]
    )
    quantiles = table(folder, "buildings").set_index("building_id")["impact_velocity_84"]
    largest = sides.groupby(level=0).max().loc[quantiles.index]
    np.testing.assert_array_equal(quantiles, largest)


def test_totals_count_every_building_once(finished):
    folder, _ = finished
    totals, buildings = pd.read_csv(folder / "out" / "totals.csv"), table(folder, "buildings")
    assert totals["buildings"].sum() == len(buildings)
    assert totals["buildings_hit"].sum() == (buildings["impacts"] > 0).sum()
    by_area = totals[totals["buildings"] > 0].set_index("area")
    for end in ("common", "independent"):
        expected = buildings.groupby("area")[f"probability_{end}"].sum()
        # each area has five digits in the text, and is otherwise the sum of its buildings
        found = by_area.loc[expected.index, f"expected_buildings_{end}"]
        assert found.tolist() == rounded(expected.to_numpy()).tolist()
    worst = buildings.drop_duplicates("area").set_index("area")["building_id"]
    found = totals[totals["buildings"] > 0].set_index("area")["worst_building"]
    assert found.to_dict() == worst.to_dict()


@pytest.mark.parametrize("size", [7])
def test_results_do_not_depend_on_chunks(copied, monkeypatch, size):
    before = content(copied)
    shutil.rmtree(copied / "out" / "rows")
    for name in ("search.PIECE", "search.CHUNK", "search.BATCH", "search.SORTED", "tables.SIDES"):
        monkeypatch.setattr(f"per_obspy.buildings.{name}", size)
    assert screened(copied)["row_chunks"] > 3
    assert content(copied) == before


def test_only_a_chunk_that_is_missing_or_damaged_is_done_again(copied):
    before = content(copied)
    for name in ("000000.parquet", "000001.json"):
        (copied / "out" / "rows" / name).write_bytes(b"cut off")
    (copied / "out" / "rows" / "000099.parquet").write_bytes(b"of an earlier table")
    counts = screened(copied)
    assert counts["row_chunks"] - counts["row_chunks_resumed"] == 2
    assert content(copied) == before
    assert not (copied / "out" / "rows" / "000099.parquet").exists()


def test_a_row_that_cannot_be_followed_costs_only_itself(copied, monkeypatch):
    from per_obspy.runs.tasks import building_rows as job

    before = table(copied, "rows")
    shutil.rmtree(copied / "out" / "rows")
    computed = job.row_outcomes

    def failing(motion, contacts, first, azimuth):
        if before["row_id"].iloc[0] in contacts["row_id"]:
            raise RuntimeError("no end of events")
        return computed(motion, contacts, first, azimuth)

    monkeypatch.setattr(job, "row_outcomes", failing)
    assert screened(copied)["rejected_row"] == 1
    after = table(copied, "rows")
    failed = (before["row_id"] == before["row_id"].iloc[0]).to_numpy()
    assert after.loc[failed, "flags"].str.contains("no_history").all()
    assert after.loc[failed, "impact_velocity"].isna().all()
    # whole numbers become floats where some are empty
    pd.testing.assert_frame_equal(after[~failed], before[~failed], check_dtype=False)
    rejected = pd.read_csv(copied / "out" / "rejected.csv")
    assert rejected[["kind", "reasons"]].to_numpy().tolist() == [["row", "no end of events"]]


def test_without_exact_histories_buildings_are_listed_by_their_pairs(copied, monkeypatch):
    # one in five buildings has no identifier
    pairs = pd.read_csv(copied / "out" / "pairs.csv", dtype=str)
    pairs.loc[::5, "building_id_1"] = pairs.loc[::7, "building_id_2"] = ""
    pairs.to_csv(copied / "pairs.csv", index=False)
    settings = '[pairs]\nfile = "pairs.csv"\n[screening]\nexact = false\n'
    counts = screened(copied, settings)
    rows, buildings = table(copied, "rows"), table(copied, "buildings")
    # numbers are those of the names, then of unnamed buildings by rank and side of their pair
    risk = table(copied, "risk")
    ids = risk[["building_id_1", "building_id_2"]].fillna("").to_numpy()
    places = rows.set_index("pair_id").loc[risk["pair_id"]]
    ends = places[["building_number_left", "building_number_right"]].to_numpy()
    ends = np.where(places[["turned"]], ends[:, ::-1], ends)
    named = np.unique(ids[ids != ""])
    assert (ends[ids != ""] == np.searchsorted(named, ids[ids != ""])).all()
    assert ends[ids == ""].tolist() == list(range(named.size, counts["buildings"]))
    # however many pieces there are, in however many passes they are merged
    before = content(copied)
    monkeypatch.setattr("per_obspy.buildings.search.PIECE", 7)
    monkeypatch.setattr("per_obspy.results.parts.MOST_PARTS", 2)
    screened(copied, settings)
    assert content(copied) == before
    assert counts["buildings"] == len(buildings)
    assert rows["impacts"].isna().all()
    assert buildings["amplification_row"].isna().all()
    assert buildings["probability_common"].notna().all()


def test_rows_may_be_followed_where_pairs_are_not(copied):
    screened(copied, "[screening]\nexact = false\n[rows]\nexact = true\n")
    assert table(copied, "rows")["impacts"].notna().all()


def test_rows_that_are_not_wanted_leave_nothing_behind(copied):
    counts = screened(copied, "[rows]\nenabled = false\n")
    assert "rows" not in counts
    left = {path.name for path in (copied / "out").iterdir()}
    assert not left & {"rows.parquet", "rows.columns.csv", "buildings.parquet", "buildings.csv"}
    assert "buildings" not in pd.read_csv(copied / "out" / "totals.csv")


@pytest.fixture
def edited(copied):
    """Return a function that screens a changed pair table."""
    pairs = pd.read_csv(copied / "out" / "pairs.csv")

    def screen_edited(change, text=""):
        change(pairs).to_csv(copied / "pairs.csv", index=False)
        return screened(copied, f'{text}[pairs]\nfile = "pairs.csv"\n')

    return screen_edited


def test_a_table_without_identifiers_has_rows_only_where_they_are_wanted(edited, copied):
    def without(pairs):
        return pairs.drop(columns=["building_id_1", "building_id_2"])

    assert "rows" not in edited(without)
    assert edited(without, "[rows]\nenabled = true\n")["buildings"] == 120
    buildings = table(copied, "buildings")
    assert (buildings["position"] == "single").all()
    assert buildings["flags"].str.contains("no_building_id").all()
    assert set(buildings["building_id"].head(2).str[-2:]) == {"#1", "#2"}


def test_contradictions_are_left_out_with_a_reason(edited, copied):
    def contradictory(pairs):
        follows = np.flatnonzero(pairs["position"] == "inside")[0]
        changed = pairs.assign(period_1=pairs["period_1"].astype(float))
        changed.loc[follows - 1, "period_2"], changed.loc[follows, "period_1"] = 0.4, 0.8
        return changed

    counts = edited(contradictory)
    assert counts["rejected_row"] == 1
    reasons = pd.read_csv(copied / "out" / "rejected.csv")["reasons"]
    assert reasons.str.contains("period = 0.4 in pair").tolist() == [True]
    flagged = table(copied, "rows")["flags"].str.contains("contradictory")
    assert flagged.any()
    assert not flagged.all()


def test_a_repeated_contact_is_left_out_of_the_rows(edited, copied):
    counts = edited(lambda pairs: pd.concat([pairs, pairs.iloc[[3]].assign(pair_id="again")]))
    assert (counts["pairs"], counts["rejected_row"]) == (61, 1)
    assert len(table(copied, "rows")) == 60


def test_a_report_counts_the_buildings_again(copied):
    before = (copied / "out" / "totals.csv").read_bytes()
    (copied / "out" / "totals.csv").unlink()
    report(copied / "run.toml")
    assert (copied / "out" / "totals.csv").read_bytes() == before
