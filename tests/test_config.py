"""A configuration that is wrong is refused with file, key and value."""

from pathlib import Path

import pytest

from per_obspy.config import Run, Simulation, load, screening_kind
from per_obspy.errors import CatalogError

GOOD = 'name = "x"\noutput = "out"\n[records]\nfolder = "in"\n[pairs]\nfile = "pairs.csv"\n'
CHECKOUT = Path(__file__).parents[1]


def _load(tmp_path, text):
    file = tmp_path / "run.toml"
    file.write_text(text)
    return load(file, Run)


def test_paths_are_relative_to_the_file(tmp_path):
    settings = _load(tmp_path, GOOD)
    assert settings.output == tmp_path / "out"
    assert settings.records.folder == tmp_path / "in"


def test_what_a_run_says_of_itself_holds_no_absolute_path(tmp_path):
    said = _load(tmp_path, GOOD).model_dump_json(context={"folder": tmp_path})
    assert str(tmp_path) not in said


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (GOOD + "[processing]\nhighpas = 0.1\n", r"run\.toml: processing\.highpas: unknown key \(got 0\.1\)"),
        (GOOD + "[processing]\nhighpass = -1\n", r"processing\.highpass: .*greater than 0 \(got -1\)"),
        (GOOD + "[screening]\nclasses = { high = 2.0, low = 1.0 }\n", r"screening\.classes: .*ascending"),
        (GOOD + "[totals]\nh3 = 16\n", r"totals\.h3: .*less than or equal to 15 \(got 16\)"),
        (GOOD + '[totals]\nh3 = 8\narea = "ward"\n', r"totals: .*give one of cell, area and h3, got area, h3"),
        (GOOD + "[totals]\ncell = 1000.0\nh3 = 8\n", r"totals: .*give one of cell, area and h3, got cell, h3"),
        (GOOD.replace('name = "x"\n', ""), r"name: Field required"),
        (GOOD.replace("[records]", "[record]"), r"record: unknown key"),
        (GOOD + 'simulation = "s.toml"\n', r"pairs\.simulation: unknown key"),
        ('simulation = "s.toml"\n' + GOOD, r"give either simulation or records"),
        ('name = "x"\noutput = "o"\nsimulation = "s"\n[pairs]\n', r"pairs: .*give one of file, catalog and simulated"),
        (GOOD.split("[pairs]")[0], r"give pairs"),
        (GOOD.replace("[records]", '[records]\nshakemap_uncertainty = "u.xml"'), r"belongs to a shakemap: give both"),
        ("name = ", r"run\.toml: cannot be read as TOML"),
        ('name = "\xff"', r"name"),
    ],
)
def test_every_fault_names_key_and_value(tmp_path, text, message):
    with pytest.raises(CatalogError, match=message):
        _load(tmp_path, text)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(CatalogError, match=r"absent\.toml: cannot be read"):
        load(tmp_path / "absent.toml", Run)


@pytest.mark.parametrize("path", sorted((CHECKOUT / "workflows").glob("*.toml")), ids=lambda path: path.name)
def test_the_workflows_are_valid(path):
    assert load(path, screening_kind(path)).name


def test_the_demo_scenario_is_what_the_readme_says():
    simulation = load(CHECKOUT / "catalogs" / "demo" / "scenario.toml", Simulation)
    assert (simulation.scenario.magnitude, simulation.scenario.stations, simulation.scenario.seed) == (7.0, 24, 20)
    assert simulation.pairs.count == 2000
