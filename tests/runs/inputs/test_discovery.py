"""A first configuration holds the inputs that were found, and names the missing ones."""

import tomllib

import pytest

from per_obspy.config import Run, Scenario, load
from per_obspy.errors import CatalogError
from per_obspy.runs.inputs.discovery import found_inputs, write_first_configuration
from per_obspy.simulation.earthquake import simulate, write_simulation

PAIRS = "pair_id,longitude_1,latitude_1,height_1,longitude_2,latitude_2,height_2,gap\n"


@pytest.fixture(scope="module")
def simulation():
    return simulate(Scenario(stations=1, dt=0.02, magnitude=6.5))


def test_what_is_found_is_set_and_the_rest_is_help(simulation, tmp_path):
    write_simulation(simulation, tmp_path / "records")
    (tmp_path / "pairs.csv").write_text(PAIRS)
    (tmp_path / "notes").mkdir()
    (tmp_path / "notes" / "letter.txt").write_text("Dear colleague")
    lines = write_first_configuration(tmp_path / "run.toml", None, None)
    assert lines == [
        "records: records (records, found here)",
        "pairs: pairs.csv (pair table, found here)",
    ]
    settings = load(tmp_path / "run.toml", Run)
    assert settings.records.folder == tmp_path / "records"
    assert settings.records.event == tmp_path / "records" / "event.xml"
    assert settings.pairs.file == tmp_path / "pairs.csv"
    # paths are relative, so that the folder may move
    assert str(tmp_path) not in (tmp_path / "run.toml").read_text()


def test_loose_records_are_their_folder_and_results_go_beside_it(simulation, tmp_path):
    desk = tmp_path / "desk"
    write_simulation(simulation, desk)
    assert found_inputs(desk).records == [desk]
    write_first_configuration(desk / "run.toml", None, None)
    content = tomllib.loads((desk / "run.toml").read_text())
    assert content["records"]["folder"] == "."
    assert content["output"] == "../desk_results"


def test_what_is_missing_or_several_is_said_and_nothing_is_guessed(tmp_path):
    (tmp_path / "a.csv").write_text(PAIRS)
    (tmp_path / "b.csv").write_text(PAIRS)
    lines = write_first_configuration(tmp_path / "run.toml", None, None)
    assert lines == [
        "records: none found here; fill in the section [records]",
        "pairs: several found (a.csv, b.csv); fill in the section [pairs]",
    ]
    text = (tmp_path / "run.toml").read_text()
    assert set(tomllib.loads(text)) >= {"name", "output"}
    assert "#[records]" in text
    with pytest.raises(CatalogError, match="give either simulation or records"):
        load(tmp_path / "run.toml", Run)


def test_named_inputs_are_taken_and_checked(simulation, tmp_path):
    write_simulation(simulation, tmp_path / "records")
    (tmp_path / "pairs.csv").write_text(PAIRS)
    names = str(tmp_path / "records"), str(tmp_path / "pairs.csv")
    write_first_configuration(tmp_path / "new" / "run.toml", *names)
    assert load(tmp_path / "new" / "run.toml", Run).pairs.file == tmp_path / "pairs.csv"
    with pytest.raises(CatalogError, match="pair table, no records"):
        write_first_configuration(tmp_path / "other.toml", *reversed(names))
    assert not (tmp_path / "other.toml").exists()


def test_nothing_is_overwritten_unless_asked(tmp_path):
    file = tmp_path / "run.toml"
    file.write_text("# hours of work\n")
    with pytest.raises(CatalogError, match="exists already"):
        write_first_configuration(file, None, None)
    assert file.read_text() == "# hours of work\n"
    write_first_configuration(file, None, None, force=True)
    assert "[processing]" in file.read_text()
