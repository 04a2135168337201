"""The kind of a file is seen by its content, not by its name."""

import gzip
import os
import shutil
import zipfile
from pathlib import Path

import pandas as pd
import pytest

from per_obspy.config import Scenario
from per_obspy.errors import CatalogError
from per_obspy.runs.inputs.input_kinds import Kind, files_in, kind_of, records_place
from per_obspy.simulation.earthquake import simulate, write_simulation

PAIRS = "pair_id,longitude_1,latitude_1,height_1,longitude_2,latitude_2,height_2,gap\n"

TEXTS = {
    ('name = "x"\noutput = "o"\n[records]\nfolder = "r"\n', ".toml"): Kind.CONFIGURATION,
    ('name = "x"\noutput = "o"\n[records]\nfolder = "r"\n', ".conf"): Kind.CONFIGURATION,
    ("name = ", ".toml"): Kind.CONFIGURATION,
    ('spectrum = "s.csv"\npairs = "p.csv"\noutput = "o"\n', ".toml"): Kind.DESIGN,
    ('name = "e"\n[[scenario]]\nname = "a"\n', ".toml"): Kind.ENSEMBLE,
    ("[scenario]\nmagnitude = 6.5\n", ".toml"): Kind.SCENARIO,
    ("[[inventory]]\nname = 'a'\n", ".toml"): Kind.CATALOG,
    (PAIRS, ".csv"): Kind.PAIRS,
    (PAIRS, ".txt"): Kind.PAIRS,
    (PAIRS.replace(",", ";"), ".csv"): Kind.PAIRS,
    ("\ufeff" + PAIRS, ".csv"): Kind.PAIRS,
    ("whatever,else\n", ".csv"): Kind.PAIRS,
    ("rank,pair_id,risk_class,state,probability\n", ".csv"): Kind.RISK,
    ("# design\nperiod,damping,sd\n0.1,0.05,0.01\n", ".csv"): Kind.SPECTRUM,
    ("station,latitude,longitude\nA,1,2\n", ".csv"): Kind.STATIONS,
    ("latitude,longitude,area_in_meters,confidence,geometry\n", ".csv"): Kind.FOOTPRINTS,
    ("id,Longitude,Latitude,NumberOfStories\n", ".csv"): Kind.FOOTPRINTS,
    ('{"type": "FeatureCollection", "features": []}', ".geojson"): Kind.FOOTPRINTS,
    ('{"type": "FeatureCollection", "features": [{"commType": "UNK"}]}', ".json"): (
        Kind.STATION_LIST
    ),
    ('{"type": "FeatureColl', "_stationlist.json"): Kind.STATION_LIST,
    ("", "_stationlist.json"): Kind.STATION_LIST,
    ('<?xml version="1.0"?><FDSNStationXML>', ".xml"): Kind.STATIONS,
    ('<?xml version="1.0"?><q:quakeml>', ".xml"): Kind.EVENT,
    ('<?xml version="1.0"?><shakemap_grid>', ".xml"): Kind.SHAKEMAP,
    ("TIMESERIES XX_S001__HNN_D, 2 samples", ".txt"): Kind.RECORDS,
    ("", ".txt"): Kind.RECORDS,
}


@pytest.mark.parametrize(("text", "kind"), TEXTS.items())
def test_a_text_file(tmp_path, text, kind):
    file = tmp_path / f"file{text[1]}"
    file.write_text(text[0], encoding="utf-8")
    assert kind_of(file) is kind


def test_binary_files(tmp_path):
    pd.DataFrame({"pair_id": ["a"], "gap": [0.1], "longitude_1": [1.0]}).to_parquet(
        tmp_path / "table"
    )
    (tmp_path / "layer").write_bytes(b"SQLite format 3\0" + bytes(100))
    (tmp_path / "grid.xml.gz").write_bytes(gzip.compress(b"<shakemap_grid>"))
    (tmp_path / "cut.xml.gz").write_bytes(gzip.compress(b"<shakemap_grid>" * 99)[:12])
    for name, member in (("book", "xl/workbook.xml"), ("shape", "a.shp"), ("bundle", "a.v1")):
        with zipfile.ZipFile(tmp_path / name, "w") as archive:
            archive.writestr(member, "x")
    kinds = {path.name: kind_of(path) for path in tmp_path.iterdir()}
    assert kinds == {
        "table": Kind.PAIRS,
        "layer": Kind.FOOTPRINTS,
        "grid.xml.gz": Kind.SHAKEMAP,
        "cut.xml.gz": Kind.RECORDS,
        "book": Kind.PAIRS,
        "shape": Kind.FOOTPRINTS,
        "bundle": Kind.RECORDS,
    }


@pytest.mark.parametrize(
    "head", [b"PAR1", b"PK\x03\x04", b"\x89HDF\r\n\x1a\n", b"\x1f\x8b", b"CDF", b"\x00" * 100]
)
def test_a_damaged_file_has_a_kind(tmp_path, head):
    file = tmp_path / "damaged.xml.gz"
    file.write_bytes(head + b"\xff" * 50)
    assert isinstance(kind_of(file), Kind)


def test_a_folder_of_one_table_stands_for_it_and_notes_are_no_records(tmp_path):
    (tmp_path / "pairs.csv").write_text(PAIRS)
    (tmp_path / "README.txt").write_text("Dear colleague")
    assert kind_of(tmp_path) is Kind.PAIRS
    # a record makes it a folder of records
    scenario = Scenario(stations=1, dt=0.02, magnitude=6.5)
    write_simulation(simulate(scenario), tmp_path / "made")
    shutil.move(next((tmp_path / "made").glob("*.mseed")), tmp_path)
    shutil.rmtree(tmp_path / "made")
    assert kind_of(tmp_path) is Kind.RECORDS


def test_a_file_that_cannot_be_read_does_not_hide_the_others(tmp_path, monkeypatch):
    (tmp_path / "pairs.csv").write_text(PAIRS)
    (tmp_path / "secret.txt").write_text("x")
    opened = Path.open

    def refuse(path, *arguments, **options):
        if path.name == "secret.txt":
            raise PermissionError(13, "Permission denied", str(path))
        return opened(path, *arguments, **options)

    monkeypatch.setattr(Path, "open", refuse)
    assert set(files_in(tmp_path).values()) == {Kind.PAIRS, Kind.RECORDS}
    with pytest.raises(CatalogError, match=r"secret\.txt: cannot be read: Permission denied"):
        kind_of(tmp_path / "secret.txt")


def test_a_folder_of_results(tmp_path):
    (tmp_path / "run.json").write_text("{}")
    assert kind_of(tmp_path) is Kind.RESULT


def test_an_identifier_is_one_only_where_there_is_no_path(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for identifier in (
        "us7000abcd",
        "GEONET:2016p858000",
        "EMSC:20230206_0000008",
        "ingv:31234567",
    ):
        assert kind_of(identifier) is Kind.EVENT_ID
    (tmp_path / "us7000abcd").mkdir()
    assert kind_of("us7000abcd") is Kind.RECORDS
    # would catch a service that is asked for a folder whose name is mistyped
    for path in ("records2019", "recods", "pairs.csv", "data/ci38457511", ""):
        if path:
            with pytest.raises(CatalogError, match="no such folder or file"):
                kind_of(path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes here")
def test_a_pipe_is_refused_instead_of_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(CatalogError, match="neither a folder nor a regular file"):
        kind_of(tmp_path / "pipe")


@pytest.mark.real_data
def test_real_data(real_data):
    kinds = {
        "records/ridgecrest2019_mseed": Kind.RECORDS,
        "records/afad2023": Kind.RECORDS,
        "records/mexico_lakebed_1989": Kind.RECORDS,
        "records/asdf": Kind.RECORDS,
        "records/ridgecrest2019_mseed/CI.CLC.xml": Kind.STATIONS,
        "inventories/footprints/guatemala_pilot_region_all_fields.gpkg": Kind.FOOTPRINTS,
    }
    for name, kind in kinds.items():
        assert kind_of(real_data / name) is kind, name
    place, is_workspace = records_place(real_data / "records" / "asdf")
    assert is_workspace
    assert place.suffix == ".h5"
