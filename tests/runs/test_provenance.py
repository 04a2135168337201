"""The effective configuration of a run is in its output folder and runs again."""

import json
import shutil

import pytest

from per_obspy.config import Run, load
from per_obspy.errors import CatalogError
from per_obspy.runs.provenance import CONFIGURATION, RunSettings
from per_obspy.runs.run import run

from .small_run import InProcess, write_smallest_configuration

pytestmark = pytest.mark.usefixtures("plain_reports")


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    return folder, run(write_smallest_configuration(folder), executor=InProcess())


def test_it_holds_the_same_settings_and_its_run_does_nothing(finished):
    folder, result = finished
    file = result.folder / CONFIGURATION
    first, again = load(folder / "run.toml", Run), load(file, Run)
    assert again == first
    # paths are relative: nothing names this machine
    assert str(folder) not in file.read_text()
    assert run(file, executor=InProcess()).did_nothing


def test_it_gives_the_same_result_elsewhere(finished, tmp_path):
    folder, result = finished
    shutil.copy(folder / "scenario.toml", tmp_path)
    (tmp_path / "out").mkdir()
    shutil.copy(result.folder / CONFIGURATION, tmp_path / "out")
    again = run(tmp_path / "out" / CONFIGURATION, executor=InProcess())
    assert not again.did_nothing
    same = "risk.parquet", "risk.csv", "totals.csv", "stations.csv"
    hashes = [{name: one.record["outputs"][name] for name in same} for one in (result, again)]
    assert hashes[0] == hashes[1]


def test_settings_that_no_file_holds_are_written_and_key_the_same_run(finished):
    folder, result = finished
    settings = load(folder / "run.toml", Run)
    found = run(settings, executor=InProcess())
    assert found.did_nothing
    assert found.folder == result.folder
    # and with another output, written there
    asked = RunSettings(settings, folder / "other")
    asked.folder.mkdir()
    asked.write()
    assert load(folder / "other" / CONFIGURATION, Run).output == folder / "other"


def test_a_file_that_no_run_wrote_is_not_lost(tmp_path):
    configuration = write_smallest_configuration(tmp_path)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / CONFIGURATION).write_text("# hours of work\n")
    with pytest.raises(CatalogError, match="not written by a run and would be lost"):
        run(configuration, executor=InProcess())
    assert (tmp_path / "out" / CONFIGURATION).read_text() == "# hours of work\n"


def test_the_configuration_that_runs_is_not_written_over(tmp_path):
    settings = load(write_smallest_configuration(tmp_path), Run)
    RunSettings(settings, tmp_path).write()
    file = tmp_path / CONFIGURATION
    file.write_text(file.read_text() + "# a note\n")
    RunSettings(file, None).write()
    assert file.read_text().endswith("# a note\n")


def test_what_the_record_of_a_run_shows_is_seen_from_its_configuration(finished):
    _, result = finished
    record = json.loads((result.folder / "run.json").read_text())
    assert record["configuration"]["simulation"] == "scenario.toml"
    assert record["inputs"].keys() == {"scenario.toml"}


def test_messages_change_no_result_and_are_in_no_file(finished):
    folder, result = finished
    # would catch: the address of a service in run.json
    text = (folder / "run.toml").read_text()
    (folder / "notified.toml").write_text(
        f'{text}[notify]\ncommand = ["mail", "duty@example.org"]\n'
    )
    again = run(folder / "notified.toml", executor=InProcess())
    assert again.did_nothing
    assert RunSettings(folder / "notified.toml", None).settings.notify.command
    for name in ("run.json", CONFIGURATION):
        assert "duty@example.org" not in (result.folder / name).read_text()
    assert result.record["stations"]["expected"] == ["XX.S001"]
    assert result.record["stations"]["late"] == []
