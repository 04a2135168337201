"""Every source of a configuration under one contract."""

import re
import tomllib
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from per_obspy.config import Asdf, Columns, Fdsn, Records, Scenario, Sds, load
from per_obspy.config import Simulation as Demo
from per_obspy.errors import CatalogError
from per_obspy.records.event_file import read_event
from per_obspy.records.folder import read_station
from per_obspy.records.simulation.earthquake import Simulation, simulate, write_simulation
from per_obspy.records.simulation.station_metadata import scenario_event
from per_obspy.records.sources import find_sources, input_files

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
        for piece in whole / 1:
            day = piece.stats.starttime
            target = (
                tmp_path
                / "sds"
                / str(day.year)
                / stats.network
                / stats.station
                / f"{stats.channel}.D"
            )
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


def test_folder_and_table_stand_side_by_side(folder: Path, tmp_path: Path):
    found = find_sources(Records(folder=folder, columns=(table(tmp_path),)), None)
    assert list(found.stations) == ["XX.T1", "XX.S001", "XX.S002"]
    for name, source in found.stations.items():
        stream, rejected = source.reader(source.files, source.inventory, name)
        assert rejected == ()
        assert {f"{trace.stats.network}.{trace.stats.station}" for trace in stream} == {name}
        assert {trace.stats.units for trace in stream} == (
            {"m/s2"} if name == "XX.T1" else {"counts"}
        )


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
    with pytest.raises(ValueError, match="start"):
        Sds(folder=Path("x"), start="yesterday", end="2000-01-01")
    records = Records(sds=Sds(folder=Path("x"), start="2000-01-02", end="2000-01-01"))
    with pytest.raises(CatalogError, match="window: must end after its start, got 2000-01-02"):
        find_sources(records, None)


def test_what_a_result_depends_on(folder: Path, archive: Path, tmp_path: Path):
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
    (archive / "1990").mkdir()
    (archive / "1990" / "old").touch()
    window = Sds(folder=archive, start="1999-12-31T23:00:00", end="2000-01-01T01:00:00")
    names = {path.name for path in input_files(Records(sds=window), None)}
    assert "old" not in names
    assert len(names) == 6
    assert input_files(None, None) == []


def test_a_wrong_event_stops_at_once(folder: Path):
    with pytest.raises(CatalogError, match=r"stations\.xml"):
        find_sources(Records(folder=folder, event=folder / "stations.xml"), None)


def test_readers_travel_to_other_processes_by_name(folder: Path):
    for source in find_sources(Records(folder=folder), None).stations.values():
        assert isinstance(source.reader, partial)
        assert source.reader.func is read_station


@pytest.mark.real_data
def test_a_workspace_brings_its_event(real_data: Path):
    path = real_data / "records" / "asdf" / "nc72282711_workspace.h5"
    found = find_sources(Records(asdf=Asdf(file=path, tag="*_default")), None)
    assert found.event is not None
    assert found.event.path == path
    source = found.stations["CE.68150"]
    assert len(source.reader(source.files, source.inventory, "CE.68150")[0]) == 3


def test_the_sections_in_the_documentation_are_valid():
    text = (CHECKOUT / "docs" / "sources.md").read_text(encoding="utf-8")
    examples = [
        tomllib.loads(block.split("```")[0])["records"] for block in text.split("```toml")[1:]
    ]
    assert [
        name
        for example in examples
        for name in Records(**example).model_fields_set - {"event", "stationxml"}
    ] == [
        "fdsn",
        "sds",
        "asdf",
    ]
    table = text.split("| key |")[1].split("\n\n")[0]
    keys = {
        key for row in table.splitlines()[2:] for key in re.findall(r"`(\w+)`", row.split("|")[1])
    }
    assert keys == set(Fdsn.model_fields) - {"providers", "cache"}


def test_the_demo_s_event_is_that_of_its_scenario():
    known = read_event(CHECKOUT / "catalogs" / "demo" / "event.xml")
    made = scenario_event(load(CHECKOUT / "catalogs" / "demo" / "scenario.toml", Demo).scenario)
    assert (known.origins, known.magnitudes) == (made.origins, made.magnitudes)
