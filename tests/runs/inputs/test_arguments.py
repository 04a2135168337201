"""Interpretation of ``per-obspy run A B``, and messages where an input is missing."""

from pathlib import Path

import pytest

from per_obspy.errors import CatalogError
from per_obspy.runs.inputs.arguments import requested_run

PAIRS = "pair_id,longitude_1,latitude_1,height_1,longitude_2,latitude_2,height_2,gap\n"
RUN = 'name = "x"\noutput = "out"\n[records]\nfolder = "records"\n[pairs]\nfile = "pairs.csv"\n'


@pytest.fixture
def desk(tmp_path, monkeypatch):
    """A folder with records, a pair table and a layer, in which the shell is."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "records").mkdir()
    (tmp_path / "records" / "a.mseed").write_bytes(b"a record")
    (tmp_path / "pairs.csv").write_text(PAIRS)
    (tmp_path / "town.gpkg").write_bytes(b"SQLite format 3\0")
    (tmp_path / "tables").mkdir()
    (tmp_path / "tables" / "old_town.csv").write_text(PAIRS)
    return tmp_path


def test_two_arguments_in_either_order(desk):
    first, second = requested_run("records", "pairs.csv"), requested_run("pairs.csv", "records")
    assert first == second
    settings = first.configuration
    assert settings.records.folder == desk / "records"
    assert settings.pairs.file == desk / "pairs.csv"
    assert settings.output == desk / "results" / "records-pairs"
    assert settings.name == "records, pairs"
    assert first.line == (
        "records: records (folder); pairs: pairs.csv (pair table); results: results/records-pairs"
    )


def test_footprints_a_folder_with_one_table_and_a_named_output(desk):
    settings = requested_run("records", "town.gpkg", desk / "out").configuration
    assert settings.pairs.footprints.file == desk / "town.gpkg"
    assert settings.output == desk / "out"
    settings = requested_run("records", "tables").configuration
    assert settings.pairs.file == desk / "tables" / "old_town.csv"
    # the same results whether the folder or its file is named
    assert settings.output == desk / "results" / "records-old_town"


def test_changes_go_into_the_settings(desk):
    changes = ["screening.exact=false", "pairs.largest_rejected_share=0.9", "workers=1"]
    settings = requested_run("records", "pairs.csv", None, changes).configuration
    assert not settings.screening.exact
    assert settings.pairs.largest_rejected_share == 0.9
    assert settings.pairs.file == desk / "pairs.csv"
    # pairs that are simulated need no argument
    settings = requested_run("records", None, None, ["pairs.simulated.count=7"]).configuration
    assert settings.pairs.simulated.count == 7


def test_what_lies_beside_the_records_is_used(desk, caplog):
    (desk / "records" / "event.xml").write_text("<q:quakeml>")
    (desk / "records" / "grid.xml").write_text("<shakemap_grid>")
    (desk / "records" / "list.json").write_text('{"commType": "FeatureCollection"}')
    found = requested_run("records", "pairs.csv").configuration.records
    names = (found.event.name, found.shakemap.name, found.stationlist.name)
    assert names == ("event.xml", "grid.xml", "list.json")
    # of two earthquakes none is chosen
    (desk / "records" / "other.xml").write_text("<q:quakeml>")
    assert requested_run("records", "pairs.csv").configuration.records.event is None
    # nor of two maps, which is said; the uncertainty of a map is no second one
    (desk / "records" / "uncertainty.xml").write_text("<shakemap_grid>")
    found = requested_run("records", "pairs.csv").configuration.records
    names = (found.shakemap.name, found.shakemap_uncertainty.name)
    assert (names, caplog.text) == (("grid.xml", "uncertainty.xml"), "")
    (desk / "records" / "list2.json").write_text('{"commType": "FeatureCollection"}')
    assert requested_run("records", "pairs.csv").configuration.records.stationlist is None
    assert "none of list.json, list2.json is used: name one in records.stationlist" in caplog.text


def test_a_folder_of_a_map_or_a_list_alone_needs_no_record(desk):
    (desk / "map").mkdir()
    (desk / "map" / "stationlist.json").write_text('{"commType": "FeatureCollection"}')
    found = requested_run("map", "pairs.csv").configuration.records
    assert (found.folder, found.stationlist) == (None, desk / "map" / "stationlist.json")


def test_other_sources_of_motion(desk):
    (desk / "scenario.toml").write_text("[scenario]\nmagnitude = 6.5\n")
    (desk / "grid.xml").write_text("<shakemap_grid>")
    settings = requested_run("scenario.toml", "pairs.csv").configuration
    assert (settings.simulation, settings.records) == (desk / "scenario.toml", None)
    # its own pairs are those of the scenario
    assert requested_run("scenario.toml").configuration.pairs is None
    settings = requested_run("grid.xml", "pairs.csv").configuration
    assert settings.records.shakemap == desk / "grid.xml"
    (desk / "list.json").write_text('{"commType": "FeatureCollection"}')
    settings = requested_run("list.json", "pairs.csv").configuration
    assert settings.records.stationlist == desk / "list.json"
    settings = requested_run("GEONET:2016p858000", "pairs.csv", desk / "out").configuration
    fdsn = settings.records.fdsn
    assert (fdsn.event_provider, fdsn.event_id) == ("GEONET", "2016p858000")
    assert fdsn.cache == desk / "out" / "fetched"


def test_a_configuration_alone_is_taken_as_before(desk):
    (desk / "run.toml").write_text(RUN)
    asked = requested_run("run.toml")
    assert (asked.configuration.name, asked.line) == ("run.toml", "")
    # also one that is wrong or missing, which is said where it is read
    assert requested_run("absent.toml").configuration.name == "absent.toml"
    # a folder that holds one
    asked = requested_run(".")
    assert (asked.configuration.name, asked.line) == ("run.toml", "configuration: run.toml")
    settings = requested_run("run.toml", None, None, ["screening.exact=false"]).configuration
    assert settings.output == desk / "out"
    assert settings.records.folder == desk / "records"
    assert not settings.screening.exact
    # the folder of the command does for one that is not named, and leaves others alone
    assert requested_run("run.toml", None, Path("else")).configuration.name == "run.toml"
    without = "".join(line for line in RUN.splitlines(True) if not line.startswith("output"))
    (desk / "run.toml").write_text(without)
    settings = requested_run("run.toml", None, Path("else")).configuration
    assert (settings.output, settings.records.folder) == (desk / "else", desk / "records")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("records",), "records: records without pairs: name a pair table or footprints too"),
        (("pairs.csv",), "pairs.csv: pairs without records: name a folder, archive or file of"),
        (("records", "records"), "neither is a pair table or footprints of buildings"),
        (("pairs.csv", "town.gpkg"), "neither is records: per-obspy run RECORDS PAIRS"),
        (("records", "absent.csv"), "absent.csv: no such folder or file"),
        (("records", "many"), "many: holds several pair tables or layers, name one: a.csv, b.csv"),
        (("twice",), "twice: holds several configurations, name one: a.toml, b.toml"),
        (("twice/a.toml", "pairs.csv"), "a configuration names its records and pairs itself"),
        (("records", "spectrum.csv"), "design spectrum, neither records nor pairs"),
        (("records/event.xml", "pairs.csv"), "--set records.event=FILE"),
        (("design.toml",), "configuration of a screening by a spectrum, neither records nor pairs"),
        (("records", "pairs.csv", "records/out"), "lies inside the folder of the records"),
    ],
)
def test_what_is_missing_is_one_line(desk, arguments, message):
    (desk / "many").mkdir()
    (desk / "twice").mkdir()
    for name in ("a", "b"):
        (desk / "many" / f"{name}.csv").write_text(PAIRS)
        (desk / "twice" / f"{name}.toml").write_text(RUN)
    (desk / "spectrum.csv").write_text("period,damping,sd\n")
    (desk / "design.toml").write_text('spectrum = "spectrum.csv"\npairs = "p"\noutput = "o"\n')
    (desk / "records" / "event.xml").write_text("<q:quakeml>")
    output = desk / arguments[2] if len(arguments) == 3 else None
    with pytest.raises(CatalogError) as caught:
        requested_run(*arguments[:2], output=output)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_wrong_value_is_named_with_where_it_came_from(desk):
    (desk / "run.toml").write_text(RUN)
    with pytest.raises(CatalogError, match=r"run\.toml and --set: spectra\.count: .*got 1"):
        requested_run("run.toml", None, None, ["spectra.count=1"])
    with pytest.raises(CatalogError, match=r"command line: spectra\.count: .*got 1"):
        requested_run("records", "pairs.csv", None, ["spectra.count=1"])
