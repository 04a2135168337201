"""ASDF workspaces of gmprocess: its processed records, and its raw records processed here."""

import json
import random
from collections import Counter
from pathlib import Path

import netCDF4
import numpy as np
import pytest
from obspy import Inventory, Trace, UTCDateTime
from obspy.core.event import Catalog

from per_obspy.config import Scenario
from per_obspy.errors import CatalogError, PerError
from per_obspy.processing.chain import process
from per_obspy.records.asdf import (
    find_asdf_stations,
    has_event,
    is_asdf,
    read_asdf_station,
)
from per_obspy.records.earthquakes.quakeml import read_event
from per_obspy.records.metadata import metadata_text
from per_obspy.simulation.earthquake import Simulation, simulate

PROCESSED = json.dumps({"standard": {"process_level": "corrected physical units"}})
CORNERS = json.dumps({"corner_frequencies": {"type": "snr", "highpass": 0.1, "lowpass": 30.0}})
SECONDS = "%Y-%m-%dT%H:%M:%S"
PROVENANCE = "<x><seis_prov:output_units a='b'>{}</seis_prov:output_units></x>"


@pytest.fixture(scope="module")
def simulation() -> Simulation:
    return simulate(Scenario(stations=2, dt=0.02, magnitude=5.0))


def put_text(group, name: str, text: str | bytes) -> None:
    """Write bytes as ASDF keeps them: as an array."""
    content = np.frombuffer(text.encode() if isinstance(text, str) else text, np.int8)
    group.createDimension(f"{name} bytes", content.size)
    group.createVariable(name, "i1", (f"{name} bytes",))[:] = content


def put_waveform(group, trace, tag: str, samples: np.ndarray) -> None:
    """Write samples under the name that ASDF gives them."""
    start, end = trace.stats.starttime, trace.stats.endtime
    name = f"{trace.id}__{start.strftime(SECONDS)}__{end.strftime(SECONDS)}__{tag}"
    # Start in ns and rate in Hz are attributes
    group.createDimension(name, samples.size)
    variable = group.createVariable(name, samples.dtype, (name,))
    variable[:] = samples
    variable.starttime = np.int64(trace.stats.starttime.ns)
    variable.sampling_rate = float(trace.stats.sampling_rate)


@pytest.fixture
def workspace(simulation: Simulation, tmp_path: Path) -> Path:
    """
    Return a workspace as gmprocess leaves it.

    It holds raw counts, and cm/s2 with auxiliary data and provenance.
    """
    path = tmp_path / "workspace.h5"
    Catalog([simulation.event.copy()]).write(str(tmp_path / "event.xml"), format="QUAKEML")
    with netCDF4.Dataset(path, "w") as file:
        # The event, metadata of every station, and all waveforms
        file.setncattr("file_format", "ASDF")
        put_text(file, "QuakeML", (tmp_path / "event.xml").read_bytes())
        for code in sorted({trace.stats.station for trace in simulation.stream}):
            put_station(file, simulation.inventory.select(station=code))
        for trace in simulation.stream:
            put_trace(file, trace)
    return path


def put_station(file, metadata: Inventory) -> None:
    """Write the metadata of a station, and the level of its processed stream."""
    code = metadata[0][0].code
    group = file.createGroup(f"Waveforms/XX.{code}")
    put_text(group, "StationXML", metadata_text(metadata))
    levels = file.createGroup(f"AuxiliaryData/StreamSupplementalStats/XX.{code}")
    put_text(levels, f"XX.{code}..HN_e1_default", PROCESSED)


def put_trace(file, trace: Trace) -> None:
    """Write a trace raw and processed, with the notes of gmprocess."""
    group = file[f"Waveforms/XX.{trace.stats.station}"]
    put_waveform(group, trace, "e1_unprocessed", trace.data.astype(np.int32))
    # 200 000 counts per m/s2, 2000 per cm/s2
    put_waveform(group, trace, "e1_default", trace.data / 2000.0)
    name = f"{trace.id}_e1_default"
    station = f"XX.{trace.stats.station}"
    parameters = file.createGroup(f"AuxiliaryData/TraceProcessingParameters/{station}")
    put_text(parameters, name, CORNERS)
    put_text(file.createGroup("Provenance"), name, PROVENANCE.format("cm/s^2"))


def test_raw_records_are_counts_with_their_response(workspace: Path, simulation: Simulation):
    found = find_asdf_stations(workspace)
    assert found.stations == {"XX.S001": (workspace,), "XX.S002": (workspace,)}
    stream, rejected = read_asdf_station((workspace,), found.inventory, "XX.S002")
    assert rejected == ()
    assert len(stream) == 3
    # Samples and times are exact
    for trace in stream:
        (sent,) = simulation.stream.select(id=trace.id)
        assert np.array_equal(trace.data, sent.data)
        assert trace.stats.starttime.ns == sent.stats.starttime.ns
        assert trace.stats.delta == sent.stats.delta
        assert (trace.stats.units, trace.stats.processing_level) == ("counts", "raw")
        assert trace.stats.response.instrument_sensitivity.value == 2e5
        assert trace.stats.coordinates == sent.stats.coordinates


def test_processed_records_are_si_with_their_corners(workspace: Path, simulation: Simulation):
    found = find_asdf_stations(workspace, "*_default")
    stream, rejected = read_asdf_station((workspace,), found.inventory, "XX.S001", "*_default")
    assert (len(stream), rejected) == (3, ())
    for trace in stream:
        (sent,) = simulation.stream.select(id=trace.id)
        # one division and one multiplication
        assert trace.data == pytest.approx(sent.data / 2e5, rel=1e-15)
        assert (trace.stats.units, trace.stats.processing_level) == ("m/s2", "processed")
        assert dict(trace.stats.corners) == {"highpass": 0.1, "lowpass": 30.0}


@pytest.mark.parametrize(
    ("unit", "reason"), [("furlong", "gives furlong as output_units"), ("", "gives no unit")]
)
def test_an_unknown_unit_is_a_reason(workspace: Path, unit: str, reason: str):
    with netCDF4.Dataset(workspace, "a") as file:
        provenance = file["Provenance"].variables["XX.S001..HNE_e1_default"]
        text = PROVENANCE.format(unit).encode().ljust(provenance.size)
        provenance[:] = np.frombuffer(text, np.int8)[: provenance.size]
    # One component is rejected, the others are read
    found = find_asdf_stations(workspace, "*_default")
    stream, (rejection,) = read_asdf_station((workspace,), found.inventory, "XX.S001", "*_default")
    assert len(stream) == 2
    assert rejection.name == "XX.S001..HNE"
    assert reason in rejection.reasons[0]


def test_a_tag_that_is_not_there_names_those_that_are(workspace: Path):
    with pytest.raises(
        CatalogError, match=r"no waveform of tag x, only of e1_default, e1_unprocessed"
    ):
        find_asdf_stations(workspace, "x")


def test_other_files_are_refused(tmp_path: Path):
    (tmp_path / "text.h5").write_text("no HDF5")
    assert not is_asdf(tmp_path / "text.h5")
    with pytest.raises(CatalogError, match=r"text\.h5: cannot be read as ASDF"):
        find_asdf_stations(tmp_path / "text.h5")
    # HDF5 of another kind
    with netCDF4.Dataset(tmp_path / "spectra.nc", "w"):
        pass
    with pytest.raises(CatalogError, match="is HDF5, but no ASDF file"):
        find_asdf_stations(tmp_path / "spectra.nc")
    with pytest.raises(CatalogError, match=r"none\.h5: cannot be read: No such file"):
        read_event(tmp_path / "none.h5")


def test_a_workspace_without_its_event(workspace: Path):
    with netCDF4.Dataset(workspace, "a") as file:
        file.renameVariable("QuakeML", "Other")
    assert not has_event(workspace)
    with pytest.raises(CatalogError, match="must hold one event, holds 0"):
        read_event(workspace)


def test_damaged_workspaces_are_refused_in_one_line(workspace: Path, tmp_path: Path):
    # would catch errors of HDF5 that are none of this package's: 11 of 100 before; of 600 tried by
    # hand none crashes or hangs the process
    content = workspace.read_bytes()
    chance = random.Random("workspaces")
    # HDF5 is sparse: its own blocks are where bytes are not zero
    places = [place for place in range(0, len(content), 64) if any(content[place : place + 64])]
    outcomes = Counter()
    for _ in range(60):
        damaged = bytearray(content)
        for place in chance.choices(places, k=chance.choice((1, 10, 40))):
            damaged[place + chance.randrange(64) if place < len(content) - 64 else place] ^= 255
        path = tmp_path / "damaged.h5"
        path.write_bytes(damaged)
        outcomes[outcome(path)] += 1
    assert set(outcomes) == {"read", "partly", "refused"}


def outcome(path: Path) -> str:
    """Return how far a workspace can be read; errors of other kinds than ours pass."""
    try:
        found = find_asdf_stations(path, "*")
        rejected = list(found.rejected)
        for station in found.stations:
            rejected += read_asdf_station((path,), found.inventory, station, "*")[1]
        if has_event(path):
            read_event(path)
    except PerError as error:
        return "several lines" if "\n" in str(error) else "refused"
    return "partly" if rejected else "read"


@pytest.mark.parametrize(
    ("attribute", "value", "reason"),
    [
        ("sampling_rate", 0.0, "sampling_rate: 0 Hz is not plausible"),
        ("sampling_rate", np.nan, "sampling_rate: nan Hz is not plausible"),
        ("sampling_rate", "fast", "the workspace is damaged: ValueError"),
        ("starttime", "never", "the workspace is damaged: ValueError"),
    ],
)
def test_wrong_attributes_reject_one_waveform(workspace: Path, attribute, value, reason: str):
    with netCDF4.Dataset(workspace, "a") as file:
        waveforms = file["Waveforms/XX.S001"].variables
        name = next(name for name in waveforms if name.endswith("unprocessed"))
        waveforms[name].delncattr(attribute)
        waveforms[name].setncattr(attribute, value)
    found = find_asdf_stations(workspace)
    stream, (rejection,) = read_asdf_station((workspace,), found.inventory, "XX.S001")
    assert len(stream) == 2
    assert rejection.reasons[0].startswith(reason)


def test_a_waveform_of_absurd_size_takes_no_memory(workspace: Path):
    # a promise of 800 GB in a file of 200 kB: HDF5 keeps what was never written as nothing
    with netCDF4.Dataset(workspace, "a") as file:
        group = file["Waveforms/XX.S001"]
        group.createDimension("many", 10**11)
        name = "XX.S001..HNX__a__b__e1_unprocessed"
        huge = group.createVariable(name, "f8", ("many",), chunksizes=(10**6,))
        huge.sampling_rate, huge.starttime = 100.0, np.int64(0)
    found = find_asdf_stations(workspace)
    stream, (rejection,) = read_asdf_station((workspace,), found.inventory, "XX.S001")
    assert len(stream) == 3
    assert rejection.reasons == ("800000000000 bytes, at most 536870912 are read",)


@pytest.mark.real_data
def test_our_processing_of_gmprocess_s_raw_records_comes_to_its_results(real_data: Path):
    path = real_data / "records" / "asdf" / "nc72282711_workspace.h5"
    found = find_asdf_stations(path)
    assert (list(found.stations), found.rejected) == (["CE.68150"], ())
    assert read_event(path).origins[0].time == UTCDateTime("2014-08-24T10:20:44.07")
    ours = process(read_asdf_station((path,), found.inventory, "CE.68150")[0])
    theirs, _ = read_asdf_station((path,), found.inventory, "CE.68150", "*_default")
    assert {trace.stats.processing_level for trace in theirs} == {"processed"}
    for trace in theirs:
        (same,) = ours.select(id=trace.id)
        # other windows, tapers and corners (0.037 and 0.041 Hz) change the peak of a 5 Hz pulse
        # by less than 1 %
        assert np.abs(same.data).max() == pytest.approx(np.abs(trace.data).max(), rel=0.01)


def test_the_event(workspace: Path, simulation: Simulation):
    assert has_event(workspace)
    assert read_event(workspace).origins[0].time == simulation.event.origins[0].time
