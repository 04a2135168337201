"""Warnings about records reach pairs, the station table, ``run.json`` and the console of a run."""

import json
import shutil

import obspy
import pandas as pd
import pytest

from per_obspy.commands.run import print_result
from per_obspy.pipeline.run import run, screen
from per_obspy.records.processed_files import write_description, write_processed
from per_obspy.screening.columns import RECORD_FLAGS

from .small_run import SPECTRA, InProcess, write_configuration, write_folder_configuration

DOUBLED, ALONE, FILM = "XX.S001", "XX.S002", "XX.S003"


def _repeat(trace):
    """Append the record to itself after a minute of its quiet end: a second event."""
    later = trace.copy()
    later.stats.starttime = trace.stats.endtime + 60.0
    last = int(trace.data[-1])
    return (obspy.Stream([trace, later])).merge(fill_value=last)[0]


def _write_film(stream, path):
    """Write records whose clock was never set, with the mark that readers of film give."""
    for trace in stream:
        trace.stats.starttime = obspy.UTCDateTime(0)
        trace.stats.digitised = True
    write_description(path, write_processed(stream, path))


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A run of stations with a second event, with one horizontal, and with undated film."""
    folder = tmp_path_factory.mktemp("warnings")
    run(write_configuration(folder), executor=InProcess())
    # The same records, two stations changed
    shutil.copytree(folder / "out" / "simulated", folder / "records")
    for path in sorted((folder / "records").glob("*.mseed")):
        stream = obspy.read(path)
        name = f"{stream[0].stats.network}.{stream[0].stats.station}"
        if name == DOUBLED:
            stream = obspy.Stream([_repeat(trace) for trace in stream])
        if name == ALONE:
            stream = stream.select(component="E") + stream.select(component="Z")
        if name == FILM:
            _write_film(stream, path)
        else:
            stream.write(str(path), format="MSEED")
    configuration = write_folder_configuration(folder, "again", SPECTRA)
    return configuration, run(configuration, executor=InProcess())


def _stations(result):
    table = pd.read_csv(result.folder / "stations.csv", keep_default_na=False)
    return table.set_index("station")


def test_the_station_table_has_every_station_and_its_warnings(finished):
    _, result = finished
    table = _stations(result)
    assert len(table) == 3
    # Warnings of the two stations that were changed
    assert (table["state"] == "used").all()
    assert "second_event" in table.loc[DOUBLED, "flags"].split()
    assert "another event, over the peak: 1" in table.loc[DOUBLED, "warnings"]
    assert "one_horizontal" in table.loc[ALONE, "flags"].split()
    assert table["pairs"].sum() == result.record["counts"]["pairs"]
    assert {"digitised", "undated"} <= set(table.loc[FILM, "flags"].split())
    assert "digitised from film" in table.loc[FILM, "warnings"]
    assert "the start time is unknown" in table.loc[FILM, "warnings"]
    assert "undated" not in table.loc[DOUBLED, "flags"]
    # The earthquake was simulated, but the folder of records names no event
    first = pd.read_csv(result.folder.parent / "out" / "stations.csv")
    assert (first["epicentral_distance"] < first["hypocentral_distance"]).all()
    assert (table["epicentral_distance"] == "").all()
    assert {"stations.csv", "stations.columns.csv"} <= set(result.record["outputs"])


def test_every_pair_has_the_flags_of_its_station(finished):
    _, result = finished
    # Flags of a pair are those of its station and others
    risk, stations = pd.read_parquet(result.folder / "risk.parquet"), _stations(result)
    for name, pairs in risk.groupby("station"):
        expected = set(stations.loc[name, "flags"].split())
        for flags in pairs["flags"]:
            assert expected <= set(flags.split())
    explained = pd.read_csv(result.folder / "risk.columns.csv")["name"].tolist()
    assert {f"flag_{name}" for name in RECORD_FLAGS} <= set(explained)


def test_the_console_names_the_stations(finished, capsys):
    _, result = finished
    assert DOUBLED in result.record["warnings"]["second_event"]
    assert result.record["warnings"]["one_horizontal"] == [ALONE]
    # One line for all warnings
    print_result(result)
    (line,) = [line for line in capsys.readouterr().out.splitlines() if "warnings:" in line]
    assert line.startswith("warnings: 1 station with a second event (XX.S001)")
    assert f"1 with one horizontal ({ALONE})" in line
    assert f"1 digitised from film ({FILM}), 1 without a date ({FILM})" in line
    assert line.endswith("; see stations.csv")


def test_a_screening_alone_writes_the_same_table(finished, tmp_path):
    configuration, result = finished
    folder = tmp_path / "copy"
    shutil.copytree(result.folder, folder)
    before = (folder / "stations.csv").read_bytes()
    (folder / "stations.csv").unlink()
    again = screen(configuration, folder, executor=InProcess())
    assert (folder / "stations.csv").read_bytes() == before
    assert again.record["warnings"] == result.record["warnings"]
    # of which earthquake the stations are
    assert again.record["earthquakes"] == result.record["earthquakes"] != []


def test_a_lost_station_table_is_written_again(finished, tmp_path):
    configuration, result = finished
    folder = tmp_path / "copy"
    shutil.copytree(result.folder, folder)
    # No station is computed again for it
    (folder / "stations.csv").unlink()
    again = run(configuration, folder, executor=InProcess())
    assert not again.did_nothing
    assert again.record["counts"]["stations_resumed"] == 3
    assert (folder / "stations.csv").read_bytes() == (result.folder / "stations.csv").read_bytes()
    assert json.loads((folder / "run.json").read_text())["outputs"] == result.record["outputs"]
