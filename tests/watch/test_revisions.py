"""Revisions: whole or not there, numbers used once, and only real changes in changes.csv.

The table is that of ``per_obspy.watch.revisions``.
"""

import csv
import os

import pandas as pd
import pytest

from per_obspy.errors import CatalogError, WriteError
from per_obspy.runs.output_folder import file_hashes
from per_obspy.watch import revisions
from per_obspy.watch.revisions import (
    content_of,
    newest_revision,
    point_latest,
    publish,
    revision_facts,
    write_changes,
)


@pytest.fixture
def event(tmp_path):
    work = tmp_path / "x1" / "work"
    work.mkdir(parents=True)
    for name in ("configuration.toml", "run.json", "summary.txt"):
        (work / name).write_text(name)
    (tmp_path / "x1" / "event.xml").write_text("<event/>")
    write_tables(work, {"P1": "yes", "P2": "no"}, {"S1": "used"})
    return tmp_path / "x1"


def write_tables(folder, pairs, stations):
    table = {"pair_id": list(pairs), "state": list(pairs.values())}
    pd.DataFrame({**table, "risk_class": "low"}).to_parquet(folder / "risk.parquet")
    table = {"station": list(stations), "state": list(stations.values())}
    pd.DataFrame(table).to_csv(folder / "stations.csv", index=False)


def record_of(event):
    names = ("risk.parquet", "stations.csv", "summary.txt")
    return {"outputs": file_hashes(event / "work", [event / "work" / name for name in names])}


def changes_of(event):
    with (event / "latest" / "changes.csv").open(newline="") as file:
        return [tuple(row.values()) for row in csv.DictReader(file)]


def test_changes_of_pairs_stations_and_the_earthquake(event):
    first = {"event_id": "x1", "magnitude": 6.1, "latitude": 1.0}
    publish(event, 1, record_of(event), {"event": first})
    assert changes_of(event) == [
        ("event", "x1", "latitude", "", "1.0"),
        ("event", "x1", "magnitude", "", "6.1"),
        ("station", "S1", "state", "absent", "used"),
    ]
    write_tables(event / "work", {"P1": "likely", "P2": "no", "P3": "no"}, {"S2": "used"})
    second = {**first, "magnitude": 6.4}
    publish(event, 2, record_of(event), {"event": second, "event_before": first})
    assert changes_of(event) == [
        ("event", "x1", "magnitude", "6.1", "6.4"),
        ("station", "S1", "state", "used", "absent"),
        ("station", "S2", "state", "absent", "used"),
        ("pair", "P1", "state", "yes", "likely"),
        ("pair", "P3", "state", "absent", "no"),
        ("pair", "P3", "risk_class", "absent", "low"),
    ]


def test_changes_of_a_table_by_cell(tmp_path):
    # a table that has grown beyond one file, and pairs that are in another cell than before
    before, after = tmp_path / "before", tmp_path / "after"
    for folder, pairs in ((before, {"P1": "yes", "P2": "no"}), (after, {"P1": "no", "P2": "no"})):
        folder.mkdir()
        write_tables(folder, pairs, {})
    (after / "risk").mkdir()
    table = pd.read_parquet(after / "risk.parquet")
    for row in (0, 1):
        table.iloc[[row]].to_parquet(after / "risk" / f"lat{row}_lon0.parquet")
    (after / "risk.parquet").unlink()
    write_changes(before, after, {})
    with (after / "changes.csv").open(newline="") as file:
        assert list(csv.reader(file))[1:] == [["pair", "P1", "state", "yes", "no"]]


def test_names_are_no_formulas_to_a_spreadsheet(tmp_path):
    before, after = tmp_path / "before", tmp_path / "after"
    for folder, state in ((before, "no"), (after, "yes")):
        folder.mkdir()
        write_tables(folder, {"=HYPERLINK(1)": state}, {})
    write_changes(before, after, {})
    assert "'=HYPERLINK(1)" in (after / "changes.csv").read_text()


def test_a_number_is_never_used_twice(event):
    folder = publish(event, 1, record_of(event), {})
    before = file_hashes(folder, sorted(path for path in folder.iterdir()))
    write_tables(event / "work", {"P1": "no"}, {})
    with pytest.raises(CatalogError, match="there already"):
        publish(event, 1, record_of(event), {})
    assert file_hashes(folder, sorted(path for path in folder.iterdir())) == before


def test_results_that_changed_since_their_run_make_no_revision(event):
    record = record_of(event)
    (event / "work" / "summary.txt").write_text("written by another program")
    with pytest.raises(CatalogError, match="has changed since its run"):
        publish(event, 1, record, {})
    assert newest_revision(event) == 0
    assert list((event / "revisions").iterdir()) == []


def test_a_full_disk_leaves_no_half_revision(event, monkeypatch):
    def full(*_):
        raise OSError(28, os.strerror(28))

    with monkeypatch.context() as patch:
        patch.setattr(revisions.shutil, "copyfile", full)
        with pytest.raises(WriteError, match="No space left"):
            publish(event, 1, record_of(event), {})
    assert list((event / "revisions").iterdir()) == []
    publish(event, 1, record_of(event), {})
    assert newest_revision(event) == 1


def test_the_room_of_ten_revisions_is_that_of_what_changed(event):
    (event / "work" / "summary.txt").write_bytes(bytes(10**6))
    for number in range(1, 11):
        (event / "event.xml").write_text(f"<event number='{number}'/>")
        publish(event, number, record_of(event), {})
    sizes = {path.stat().st_ino: path.stat().st_size for path in (event / "revisions").rglob("*.*")}
    assert sum(sizes.values()) < 1.2e6


def test_where_files_cannot_be_linked_they_are_copied(event, monkeypatch):
    def refused(*_):
        raise PermissionError(1, "no links here")

    monkeypatch.setattr(revisions.Path, "hardlink_to", refused)
    publish(event, 1, record_of(event), {})
    folder = publish(event, 2, record_of(event), {})
    assert (folder / "summary.txt").read_text() == "summary.txt"


def test_the_link_follows_the_newest_revision(event):
    point_latest(event)
    assert not (event / "latest").is_symlink()
    publish(event, 1, record_of(event), {})
    (event / "latest").unlink()
    point_latest(event)
    assert (event / "latest" / "summary.txt").read_text() == "summary.txt"


def test_content_is_known_again(event):
    record = record_of(event)
    publish(event, 1, record, {})
    digest = file_hashes(event, [event / "event.xml"])["event.xml"]
    assert revision_facts(event, 1)["key"] == content_of(record, digest)
    assert revision_facts(event, 1)["key"] != content_of(record, "other")
    assert revision_facts(event, 2) == {}
