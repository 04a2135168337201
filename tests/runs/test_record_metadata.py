"""Place, ground and earthquake of real records on their way to tables and ground-motion field."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from per_obspy.config import Interpolation, Processing, Records
from per_obspy.processing.chain import process_station
from per_obspy.records.sources import find_sources
from per_obspy.results.station_summary import station_table
from per_obspy.runs.process import process_records
from per_obspy.runs.tasks.parallel import Workers
from per_obspy.screening.site_motion import hypocentre_of, prepared_field
from per_obspy.spectra.station import station_spectra

pytestmark = pytest.mark.real_data

#: Pazarcik 2023 by AFAD, as its headers have it: degrees, degrees, m
PAZARCIK = (37.043, 37.288, 8600.0)


@pytest.fixture(scope="module")
def folder(real_data: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The records of AFAD, and a table that moves one station by 11 km."""
    folder = tmp_path_factory.mktemp("afad")
    for file in (real_data / "records" / "afad2023").iterdir():
        (folder / file.name).write_bytes(file.read_bytes())
    table = "code,latitude,longitude,vs30\n4414,38.506947,38.754133,300\n"
    (folder / "stations.csv").write_text(table)
    return folder


def test_everything_reaches_the_field_and_the_table(folder: Path):
    sources = find_sources(Records(folder=folder), None)
    (facts,) = sources.earthquakes
    assert (facts["headers"]["magnitude"], facts["headers"]["contradicting"]) == (7.7, {})
    spectra = []
    for name, source in sources.stations.items():
        stream, _ = source.reader(source.files, source.inventory, name)
        clean, _ = process_station(stream, Processing(), None)
        spectra.append(station_spectra(clean, np.geomspace(0.1, 3.0, 5), [0.05]))
    # The hypocentre of the headers is that of the field, from which its distances are measured
    source = hypocentre_of([station.attrs for station in spectra])
    assert tuple(source) == PAZARCIK
    field = prepared_field(spectra, Interpolation(), source)
    assert field.source == source
    assert [float(station["vs30"]) for station in spectra] == [448.0, 300.0]
    assert str(spectra[0]["site_class"].item()) == "B"
    # Each station says where its place comes from, and what contradicts it
    table = station_table(spectra, (), {}).set_index("station")
    assert table["coordinates_source"].to_dict() == {
        "TK.3125": "header",
        "TK.4414": "stations.csv",
    }
    conflict = table.loc["TK.4414", "coordinates_conflict"]
    assert conflict.startswith("stations.csv 38.5069, 38.7541 used, header 38.4069, 38.7541 is 11")
    assert table.loc["TK.3125", "coordinates_conflict"] == ""
    assert "contradicting_coordinates" in table.loc["TK.4414", "flags"].split()
    assert "contradicting_coordinates" not in table.loc["TK.3125", "flags"].split()


def test_processed_records_keep_all_of_it(folder: Path, tmp_path: Path):
    process_records([folder], tmp_path, Processing(), None, False, Workers(1))
    (trace, *_) = json.loads((tmp_path / "stations" / "TK.4414.json").read_text())["traces"]
    assert trace["coordinates_source"] == "stations.csv"
    assert "header 38.4069" in trace["coordinates_conflict"]
    assert trace["event"]["time"].startswith("2023-02-06T01:17:32")
    table = pd.read_csv(tmp_path / "processed.csv").set_index("id")
    assert set(table["coordinates_source"]) == {"stations.csv", "header"}
    assert set(table["vs30"]) == {300.0, 448.0}
    # Read again, they are the same
    again = find_sources(Records(folder=tmp_path / "stations"), None)
    source = again.stations["TK.4414"]
    for record in source.reader(source.files, source.inventory, "TK.4414")[0]:
        assert record.stats.coordinates_source == "stations.csv"
        assert record.stats.event.magnitude == 7.7
        assert record.stats.vs30 == 300.0
    assert again.earthquakes[0]["headers"]["depth"] == PAZARCIK[2]
