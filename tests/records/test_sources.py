"""
Every source of a configuration under one contract.

Covers per_obspy.records.file_list too: the files on which a result depends.
"""

import pickle
import re
import tomllib
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from obspy import Stream, Trace, UTCDateTime

from per_obspy.config import Asdf, Columns, Fdsn, Records, Scenario, Sds, load
from per_obspy.config import Simulation as Demo
from per_obspy.errors import CatalogError
from per_obspy.files import file_hash
from per_obspy.records.earthquakes.quakeml import read_event
from per_obspy.records.file_list import input_files
from per_obspy.records.folder import read_station
from per_obspy.records.processed_files import write_description, write_processed
from per_obspy.records.sources import LEFT_OUT, find_path_sources, find_sources
from per_obspy.simulation.earthquake import Simulation, scenario_event, simulate, write_simulation

CHECKOUT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def simulation() -> Simulation:
    return simulate(Scenario(stations=2, dt=0.02, magnitude=5.0))


@pytest.fixture
def folder(simulation: Simulation, tmp_path: Path) -> Path:
    write_simulation(simulation, tmp_path / "records")
    return tmp_path / "records"


@pytest.fixture
def archive(simulation: Simulation, tmp_path: Path) -> Path:
    """An SDS archive of the same records, which lie on both sides of midnight."""
    for trace in simulation.stream:
        whole = trace.copy()
        whole.data = whole.data.astype(np.int32)
        stats = whole.stats
        # One file per day
        for piece in whole / 1:
            day = piece.stats.starttime
            target = tmp_path / "sds" / str(day.year) / stats.network / stats.station
            target = target / f"{stats.channel}.D"
            target.mkdir(parents=True, exist_ok=True)
            piece.write(str(target / f"{piece.id}.D.{day.year}.{day.julday:03d}"), format="MSEED")
    return tmp_path / "sds"


def table(tmp_path: Path, network: str = "XX", station: str = "T1") -> Columns:
    (tmp_path / "table.txt").write_text(
        "".join(f"{i * 0.01:.2f} {np.sin(i / 9):.6f}\n" for i in range(500))
    )
    return Columns(
        file=tmp_path / "table.txt",
        network=network,
        station=station,
        latitude=1.0,
        longitude=2.0,
        units="m/s2",
        channels={"HNE": 1},
        azimuths={"HNE": 90.0},
        time_column=0,
    )


def test_a_folder_and_a_table_are_used_together(folder: Path, tmp_path: Path):
    found = find_sources(Records(folder=folder, columns=(table(tmp_path),)), None)
    assert list(found.stations) == ["XX.T1", "XX.S001", "XX.S002"]
    for name, source in found.stations.items():
        stream, rejected = source.reader(source.files, source.inventory, name)
        assert rejected == ()
        assert {f"{trace.stats.network}.{trace.stats.station}" for trace in stream} == {name}
        # the table is physical, MiniSEED is not
        units = "m/s2" if name == "XX.T1" else "counts"
        assert {trace.stats.units for trace in stream} == {units}


def test_a_station_of_two_sources_is_taken_from_the_first(folder: Path, tmp_path: Path):
    found = find_sources(Records(folder=folder, columns=(table(tmp_path, station="S001"),)), None)
    assert found.stations["XX.S001"].files == (tmp_path / "table.txt",)
    (rejection,) = found.rejected
    assert (rejection.kind, rejection.name) == ("station", "XX.S001")
    assert "table.txt, which comes first" in rejection.reasons[0]


def test_an_archive_gives_the_window_around_the_event(
    folder: Path, archive: Path, simulation: Simulation
):
    records = Records(
        sds=Sds(folder=archive, before=5, after=10),
        event=folder / "event.xml",
        stationxml=folder / "stations.xml",
    )
    found = find_sources(records, None)
    assert list(found.stations) == ["XX.S001", "XX.S002"]
    # 15 s, of the day files of both days
    origin = simulation.event.origins[0].time
    source = found.stations["XX.S001"]
    stream, rejected = source.reader(source.files, source.inventory, "XX.S001")
    assert (len(stream), rejected) == (3, ())
    for trace in stream:
        (sent,) = simulation.stream.select(id=trace.id)
        assert np.array_equal(trace.data, sent.slice(origin - 5, origin + 10).data)


def test_an_archive_needs_a_window():
    with pytest.raises(ValueError, match="sds needs start and end, or event"):
        Records(sds=Sds(folder=Path("x")))
    with pytest.raises(ValueError, match="sds needs start and end, or event"):
        Records(sds=Sds(folder=Path("x"), start="2000-01-01"))
    # times that are none, or in the wrong order
    with pytest.raises(ValueError, match="start"):
        Sds(folder=Path("x"), start="yesterday", end="2000-01-01")
    records = Records(sds=Sds(folder=Path("x"), start="2000-01-02", end="2000-01-01"))
    with pytest.raises(CatalogError, match="window: must end after its start, got 2000-01-02"):
        find_sources(records, None)


def test_what_a_result_depends_on(folder: Path, tmp_path: Path):
    (tmp_path / "grid.xml").touch()
    records = Records(
        folder=folder,
        columns=(table(tmp_path),),
        event=folder / "event.xml",
        shakemap=tmp_path / "grid.xml",
    )
    assert {path.name for path in input_files(records, None)} == {
        "XX.S001.mseed",
        "XX.S002.mseed",
        "event.xml",
        "grid.xml",
        "stations.xml",
        "table.txt",
    }
    assert input_files(None, None) == []


def test_only_day_files_of_the_window_are_inputs(archive: Path):
    (archive / "1990").mkdir()
    (archive / "1990" / "old").touch()
    window = Sds(folder=archive, start="1999-12-31T23:00:00", end="2000-01-01T01:00:00")
    names = {path.name for path in input_files(Records(sds=window), None)}
    assert "old" not in names
    assert len(names) == 6


def test_every_file_has_its_hash(folder: Path, archive: Path, tmp_path: Path):
    # would catch a change of a record that leaves the key of its station as it was
    window = Sds(folder=archive, start="1999-12-31T23:00:00", end="2000-01-01T01:00:00")
    for records in (
        Records(folder=folder, columns=(table(tmp_path),), event=folder / "event.xml"),
        Records(sds=window, stationxml=folder / "stations.xml"),
    ):
        found = find_sources(records, None)
        for source in found.stations.values():
            assert source.hashes == tuple(map(file_hash, source.files))
        assert all(file_hash(path) == digest for path, digest in found.hashes.items())


def test_a_file_that_cannot_be_read_has_no_hash(folder: Path, archive: Path):
    # would catch a run that ends with one damaged day file
    window = Sds(folder=archive, start="1999-12-31T23:00:00", end="2000-01-01T01:00:00")
    records = Records(sds=window, stationxml=folder / "stations.xml")
    (victim, *_) = find_sources(records, None).stations["XX.S001"].files
    victim.unlink()
    victim.mkdir()
    assert "" in find_sources(records, None).stations["XX.S001"].hashes


def test_files_of_a_station_in_several_paths_are_joined(folder: Path, tmp_path: Path):
    copy = tmp_path / "later.mseed"
    copy.write_bytes((folder / "XX.S001.mseed").read_bytes())
    found = find_path_sources([copy, folder])
    source = found.stations["XX.S001"]
    assert source.files == (copy, folder / "XX.S001.mseed")
    assert source.hashes == (file_hash(copy),) * 2
    # metadata of the folder describes the other file too
    stream, rejected = source.reader(source.files, source.inventory, "XX.S001")
    assert (len(stream), rejected) == (6, ())


def test_a_wrong_event_stops_at_once(folder: Path):
    with pytest.raises(CatalogError, match=r"stations\.xml"):
        find_sources(Records(folder=folder, event=folder / "stations.xml"), None)


@pytest.mark.real_data
def test_a_workspace_brings_its_event(real_data: Path):
    path = real_data / "records" / "asdf" / "nc72282711_workspace.h5"
    found = find_sources(Records(asdf=Asdf(file=path, tag="*_default")), None)
    assert found.event is not None
    assert found.event.path == path
    assert found.event.hash == file_hash(path)
    # Three components of each station
    source = found.stations["CE.68150"]
    assert len(source.reader(source.files, source.inventory, "CE.68150")[0]) == 3


def test_the_sections_in_the_documentation_are_valid():
    text = (CHECKOUT / "docs" / "sources.md").read_text(encoding="utf-8")
    blocks = [block.split("```")[0] for block in text.split("```toml")[1:]]
    # one example of each source
    sources = []
    for block in blocks:
        records = Records(**tomllib.loads(block)["records"])
        sources += records.model_fields_set - {
            "event",
            "stationxml",
            "time",
            "event_gap",
            "archives",
        }
    assert sources == ["folder", "columns", "folder", "fdsn", "sds", "asdf"]


def test_the_documentation_has_every_key_of_the_services():
    text = (CHECKOUT / "docs" / "sources.md").read_text(encoding="utf-8")
    rows = text.split("| key |")[1].split("\n\n")[0].splitlines()[2:]
    keys = {key for row in rows for key in re.findall(r"`(\w+)`", row.split("|")[1])}
    assert keys == set(Fdsn.model_fields) - {"providers", "cache"}


def test_the_demo_s_event_is_that_of_its_scenario():
    known = read_event(CHECKOUT / "catalogs" / "demo" / "event.xml")
    made = scenario_event(load(CHECKOUT / "catalogs" / "demo" / "scenario.toml", Demo).scenario)
    assert (known.origins, known.magnitudes) == (made.origins, made.magnitudes)


#: Codes that would lead out of every folder in which they name a file.
VICTIM = "../../../victim"


def described_as(folder: Path, network: str, station: str) -> Path:
    """Write a processed record whose description gives it codes that MiniSEED could not hold."""
    samples = np.sin(np.arange(3000) / 20)
    header = {"network": "XX", "station": "S001", "channel": "HNE", "delta": 0.01, "units": "m/s2"}
    stream = Stream([Trace(samples, header)])
    path = folder / "record.mseed"
    facts = write_processed(stream, path)
    facts["traces"][0] |= {"network": network, "station": station}
    write_description(path, facts)
    return path


@pytest.mark.parametrize(
    ("network", "station"),
    [("XX_", "/" + VICTIM), ("/etc", "passwd"), ("..", ".."), ("XX", "A" * 70), ("XX", "S\n1")],
)
def test_codes_that_name_no_file_are_a_row(folder: Path, network: str, station: str):
    described_as(folder, network, station)
    for found in (find_sources(Records(folder=folder), None), find_path_sources([folder])):
        assert list(found.stations) == ["XX.S001", "XX.S002"]
        (row,) = found.rejected
        assert row.kind == "station"
        assert row.source.endswith("record.mseed")
        assert row.reasons[0].startswith(("network code", "station code"))
        assert len(row.name) <= 80


def test_codes_of_day_files_are_checked(archive: Path, simulation: Simulation):
    start = simulation.stream[0].stats.starttime
    day = archive / str(start.year) / "XX" / "S 1" / "HNE.D"
    day.mkdir(parents=True)
    (day / f"XX.S 1..HNE.D.{start.year}.{start.julday:03d}").write_bytes(b"never read")
    window = {"start": str(start), "end": str(start + 60)}
    found = find_sources(Records(sds=Sds(folder=archive, **window)), None)
    assert list(found.stations) == ["XX.S001", "XX.S002"]
    assert [row.name for row in found.rejected] == ["XX.S 1"]


@pytest.mark.parametrize(
    "changes", [{"network": "../.."}, {"station": VICTIM}, {"channels": {"H/E": 1}}]
)
def test_codes_of_tables_are_checked_with_the_configuration(tmp_path: Path, changes):
    described = table(tmp_path).model_dump() | {"azimuths": {}} | changes
    with pytest.raises(ValueError, match="expected letters, digits, - and _ only"):
        Columns(**described)


def test_records_of_several_earthquakes_among_paths_are_a_warning(tmp_path: Path, caplog):
    # would catch: two earthquakes processed as one without a word
    first, second = tmp_path / "first.mseed", tmp_path / "second.mseed"
    for path, start in ((first, "2020-01-01T10:00:00"), (second, "2020-01-01T11:00:00")):
        trace = Trace(np.arange(500.0), {"network": "XX", "station": "A", "channel": "HNE"})
        trace.stats.starttime = UTCDateTime(start)
        trace.write(str(path), format="MSEED")
    find_path_sources([first])
    assert not caplog.records
    find_path_sources([first, second])
    assert "2 earthquakes are used together, they start 2020-01-01T10:00, 2020-01-01T11:00" in (
        caplog.text
    )


def test_readers_travel_to_other_processes_by_name(folder: Path):
    for source in find_sources(Records(folder=folder), None).stations.values():
        assert isinstance(source.reader, partial)
        assert source.reader.func is read_station


def test_stations_and_channels_that_are_left_out_are_rows(folder: Path, caplog):
    without = ("XX.S001", "XX.S002..HNE", "XX.S002.*.HNX", "XX.S999", "XX.S9..HNZ")
    found = find_sources(Records(folder=folder, without=without), None)
    assert list(found.stations) == ["XX.S002"]
    (row,) = found.rejected
    assert (row.kind, row.name, row.reasons) == ("station", "XX.S001", (LEFT_OUT,))
    # a name that is written wrongly is said
    assert [message.split()[-1] for message in caplog.messages] == ["XX.S999", "XX.S9..HNZ"]
    source = found.stations["XX.S002"]
    stream, rejected = source.reader(source.files, source.inventory, "XX.S002")
    assert {trace.stats.channel for trace in stream} == {"HNN", "HNZ"}
    assert [(row.kind, row.name) for row in rejected] == [
        ("record", "XX.S002..HNE"),
        ("record", "XX.S002.*.HNX"),
    ]
    assert rejected[1].reasons == ("records.without: no such channel",)
    assert all(row.source for row in rejected)
    # other processes know the reader by the same words
    again = pickle.loads(pickle.dumps(source.reader))
    assert str(again.keywords) == str(source.reader.keywords)
    assert " at 0x" not in str(source.reader.keywords)


@pytest.mark.parametrize(
    ("settings", "problem"),
    [
        ({"without": ("XX.S001",), "trust": ("XX.S001",)}, "in both without and trust"),
        ({"without": ("S001",)}, "without"),
        ({"without": ("XX.S001.HNE",)}, "without"),
        ({"without": ("*.S001",)}, "without"),
        ({"trust": ("XX.S001..HNE",)}, "trust"),
    ],
)
def test_names_of_stations_and_channels_are_checked(settings, problem):
    with pytest.raises(ValueError, match=problem):
        Records(folder=Path("x"), **settings)
