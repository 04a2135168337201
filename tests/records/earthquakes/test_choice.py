"""The earthquake of a folder that is screened."""

import shutil
from functools import partial
from pathlib import Path

import numpy as np
import obspy
import pytest
from obspy import Stream, UTCDateTime
from obspy.core.event import Event, Origin

from per_obspy.config import Records, Scenario
from per_obspy.errors import CatalogError
from per_obspy.records.earthquakes.groups import (
    event_groups,
    largest_motion,
    one_earthquake,
    peak_motion,
)
from per_obspy.records.folder import find_stations
from per_obspy.records.sources import Sources, find_sources
from per_obspy.simulation.earthquake import simulate, write_simulation

MAIN, AFTER = "2019-07-06T03:19:53", "2019-07-06T04:30:00"


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with two earthquakes of three stations; one station recorded the first alone."""
    folder = tmp_path_factory.mktemp("both")
    for name, time, magnitude in (("main", MAIN, 6.5), ("after", AFTER, 5.0)):
        scenario = Scenario(stations=3, dt=0.05, magnitude=magnitude, origin_time=time)
        write_simulation(simulate(scenario), folder / name)
        (folder / name / "event.xml").unlink()
    (folder / "after" / "XX.S003.mseed").unlink()
    return folder


def screened(folder: Path, **settings: object) -> Sources:
    return find_sources(Records(folder=folder, **settings), None)


def starts(sources: Sources, station: str) -> set[str]:
    """Return the day and hour in which the traces of a station start."""
    source = sources.stations[station]
    stream, rejected = source.reader(source.files, source.inventory, station)
    assert rejected == ()
    assert len(stream) == 3
    return {str(trace.stats.starttime)[:13] for trace in stream}


def test_the_earthquake_of_most_stations_is_screened_and_the_other_listed(both: Path):
    sources = screened(both)
    assert sorted(sources.stations) == ["XX.S001", "XX.S002", "XX.S003"]
    assert starts(sources, "XX.S001") == {"2019-07-06T03"}
    # three components of two stations
    assert len(sources.rejected) == 6
    row = sources.rejected[0]
    assert (row.kind, row.name) == ("record", "XX.S001..HNN")
    pattern = (
        "belongs to another earthquake: starts 2019-07-06T04:29, the screened one 2019-07-06T03"
    )
    assert row.reasons[0].startswith(pattern)
    facts = [(group["stations"], group["screened"]) for group in sources.earthquakes]
    assert facts == [(3, True), (2, False)]


def test_a_time_chooses_another_earthquake(both: Path):
    sources = screened(both, time=AFTER)
    assert sorted(sources.stations) == ["XX.S001", "XX.S002"]
    assert starts(sources, "XX.S001") == {"2019-07-06T04"}
    with pytest.raises(CatalogError, match=r"records\.time: no record is of 2019-07-07"):
        screened(both, time="2019-07-07")


def test_the_origin_time_of_the_event_chooses_its_records(both: Path):
    origin = Origin(time=UTCDateTime(AFTER), latitude=0.0, longitude=0.0)
    found = find_stations(both)
    chosen = one_earthquake(found, Records(folder=both), Event(origins=[origin]))
    assert [group["screened"] for group in chosen[1]] == [False, True]


def test_a_file_that_holds_both_earthquakes_is_read_in_the_window_of_one(
    both: Path, tmp_path: Path
):
    shutil.copy(both / "main" / "stations.xml", tmp_path)
    files = [both / name / "XX.S001.mseed" for name in ("main", "after")]
    joined = sum((obspy.read(str(file)) for file in files), Stream())
    joined.write(str(tmp_path / "both.mseed"), format="MSEED")
    sources = screened(tmp_path, time=AFTER)
    assert starts(sources, "XX.S001") == {"2019-07-06T04"}
    # the samples are those of the file of the earthquake alone
    source = sources.stations["XX.S001"]
    stream, _ = source.reader(source.files, source.inventory, "XX.S001")
    for trace, alone in zip(stream.sort(), obspy.read(str(files[1])).sort(), strict=True):
        np.testing.assert_array_equal(trace.data, alone.data)


def test_the_largest_motion_is_the_peak_of_the_strongest_record(both: Path):
    found = find_stations(both)
    motion = partial(largest_motion, found)
    after, main = sorted(map(motion, event_groups(found.records)))
    # magnitudes 5.0 and 6.5 at the same places
    assert 0.0 < after < main
    trace = obspy.Trace(np.array([1.0, 2.0, 6.0]), {"units": "m/s2"})
    assert peak_motion(trace) == (3.0, "m/s2")


@pytest.mark.real_data
def test_ridgecrest_next_to_other_earthquakes(real_data: Path, tmp_path: Path):
    for name in ("ridgecrest2019_mseed", "ridgecrest2019_csmip", "afad2023", "cosmos"):
        shutil.copytree(real_data / "records" / name, tmp_path / name)
    sources = screened(tmp_path)
    (group,) = [group for group in sources.earthquakes if group["screened"]]
    assert group["start"] == "2019-07-06T03:16"
    # 11 stations as MiniSEED; of CSMIP's, which are of the same earthquake, one more
    assert len(sources.stations) == 12
    others = [row for row in sources.rejected if "another earthquake" in row.reasons[0]]
    # AFAD 4 and COSMOS 8 records
    assert len(others) == 12


@pytest.mark.real_data
def test_maule_s_clocks_are_no_other_earthquakes_for_sure(real_data: Path):
    # RENADIC's files are of one earthquake; clocks were an hour off, or never set
    folder = real_data / "records" / "maule2010_renadic"
    sources = screened(folder)
    joined = {group["start"]: group["joined_by"] for group in sources.earthquakes}
    assert joined == {
        "2010-02-27T02:45": 4300.0,
        "2010-02-27T03:38": 4300.0,
        "2010-02-27T03:54": None,
    }
    reasons = {row.reasons[0] for row in sources.rejected if row.kind == "record"}
    assert not any("belongs to another earthquake" in reason for reason in reasons)
    assert all("records.event_gap = 4300 takes them as one" in reason for reason in reasons)
    # with that gap all seven stations are read
    (group,) = screened(folder, event_gap=4300.0).earthquakes
    assert (group["stations"], group["screened"]) == (7, True)
