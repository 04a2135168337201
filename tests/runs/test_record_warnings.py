"""Warnings about records reach pairs, the station table, ``run.json`` and the console of a run."""

import json
import shutil

import numpy as np
import obspy
import pandas as pd
import pytest

from per_obspy.cli.run import print_result
from per_obspy.records.processed_files import write_description, write_processed
from per_obspy.runs.run import run, screen
from per_obspy.screening.meanings import RECORD_FLAGS

from .small_run import SPECTRA, InProcess, write_folder_configuration

DOUBLED, ALONE, FILM = "XX.S003", "XX.S002", "XX.S001"

#: The film's baseline shifts too.
SHIFTED = FILM


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


def _shift(trace):
    """Shift the baseline by a tenth of the peak for 3 s of the strong shaking."""
    energy = np.cumsum((trace.data - trace.data[:100].mean()) ** 2)
    first = int(np.searchsorted(energy, 0.3 * energy[-1]))
    last = first + round(3.0 * trace.stats.sampling_rate)
    trace.data[first:last] += round(0.1 * float(np.abs(trace.data).max()))


pytestmark = pytest.mark.usefixtures("plain_reports")


@pytest.fixture(scope="module")
def finished(small_run, tmp_path_factory):
    """A run of stations with a second event, with one horizontal, and with undated film."""
    folder = tmp_path_factory.mktemp("warnings")
    shutil.copytree(small_run, folder, dirs_exist_ok=True)
    # The same records, stations changed
    shutil.copytree(folder / "out" / "simulated", folder / "records")
    for path in sorted((folder / "records").glob("*.mseed")):
        stream = obspy.read(path)
        name = f"{stream[0].stats.network}.{stream[0].stats.station}"
        if name == DOUBLED:
            stream = obspy.Stream([_repeat(trace) for trace in stream])
        if name == ALONE:
            stream = stream.select(component="E") + stream.select(component="Z")
        if name == FILM:
            _shift(stream.select(component="E")[0])
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


def test_a_baseline_that_shifts_ends_the_exact_demand_at_the_period_it_leaves(finished):
    _, result = finished
    stations = _stations(result)
    assert "baseline_shift" in stations.loc[SHIFTED, "flags"].split()
    longest = stations["longest_usable_period"].astype(float)[SHIFTED]
    # Pairs of the run before the shift and after it, by name
    first = pd.read_parquet(result.folder.parent / "out" / "risk.parquet").set_index("pair_id")
    risk = pd.read_parquet(result.folder / "risk.parquet").set_index("pair_id")
    pairs = risk[risk["station"] == SHIFTED]
    assert all("baseline_shift" in flags.split() for flags in pairs["flags"])
    beyond = pairs[["period_1", "period_2"]].max(axis=1) > longest
    was_exact = first.loc[pairs.index, "demand_rule"] == "exact"
    # The exact rung leaves what the shift took, and keeps the rest
    assert (beyond & was_exact).any()
    assert not (pairs["demand_rule"][beyond] == "exact").any()
    assert all("outside_usable_periods" in flags.split() for flags in pairs["flags"][beyond])
    assert (pairs["demand_rule"][~beyond & was_exact] == "exact").all()
    # The table for readers has the flag too
    table = pd.read_csv(result.folder / "risk.csv", keep_default_na=False).set_index("pair_id")
    assert all("baseline_shift" in flags.split() for flags in table.loc[pairs.index, "flags"])


def test_the_console_names_the_stations(finished, capsys):
    _, result = finished
    assert DOUBLED in result.record["warnings"]["second_event"]
    assert result.record["warnings"]["one_horizontal"] == [ALONE]
    # One line for all warnings
    print_result(result)
    (line,) = [line for line in capsys.readouterr().out.splitlines() if "warnings:" in line]
    assert line.startswith(f"warnings: 1 station with a baseline shift ({SHIFTED})")
    assert f"1 with a second event ({DOUBLED})" in line
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
