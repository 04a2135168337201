"""``per-obspy process``: files that are read again, corners and reasons, no work done twice."""

import json

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_array_equal
from obspy import Stream, Trace, read
from obspy.core import AttribDict
from typer.testing import CliRunner

from per_obspy.cli.application import app
from per_obspy.config import Processing, Scenario
from per_obspy.errors import CatalogError
from per_obspy.processing.chain import process_station
from per_obspy.records.folder import find_stations, read_station
from per_obspy.records.metadata import with_metadata
from per_obspy.records.processed_files import described, write_description, write_processed
from per_obspy.results.station_summary import RECORD_COLUMNS
from per_obspy.results.table_files import rounded
from per_obspy.runs.process import process_records
from per_obspy.runs.tasks.parallel import Workers
from per_obspy.simulation.earthquake import simulate, write_simulation
from per_obspy.spectra.station import station_spectra

RATE, COUNT = 50.0, 3000
ONE = Workers(1)


def motion(seed):
    """Return an earthquake of 20 s between quiet ends, m/s2."""
    time = np.arange(COUNT) / RATE
    return np.random.default_rng(seed).normal(size=COUNT) * np.exp(-(((time - 30) / 6) ** 2))


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    """A folder with one simulated station, counts with StationXML and QuakeML."""
    folder = tmp_path_factory.mktemp("records")
    write_simulation(simulate(Scenario(stations=1, dt=0.02, lakebed_radius=0)), folder)
    return folder


def processed(source, folder, **options):
    settings = Processing(**options)
    return process_records([source], folder, settings, None, False, ONE)


def only_station(folder):
    """Return name, and records as they are read, of the only station in a folder."""
    found = find_stations(folder)
    ((name, paths),) = found.stations.items()
    stream, rejected = read_station(paths, found.inventory, name)
    assert rejected == found.rejected == ()
    return name, stream


def assert_same(first, other):
    assert_array_equal(first.data, other.data)  # would catch float32, and Steim's whole numbers
    assert other.id == first.id
    # s: MiniSEED keeps microseconds
    assert abs(other.stats.starttime - first.stats.starttime) < 2e-6
    for word in (
        "delta",
        "units",
        "sensor_azimuth",
        "sensor_dip",
        "processing_level",
        "coordinates",
        "corners",
    ):
        assert other.stats.get(word) == first.stats.get(word)
    assert other.stats.per_obspy == first.stats.per_obspy


def test_what_is_read_again_is_what_was_processed(source, tmp_path):
    result = processed(source, tmp_path / "out")
    name, raw = only_station(source)
    memory, _ = process_station(raw, Processing())
    # the same chain in memory, and from the file
    again, file = only_station(tmp_path / "out" / "stations")
    assert again == name == result.done[0].station
    assert len(memory) == len(file) == 3
    for first, other in zip(memory, file, strict=True):
        assert_same(first, other)


def test_names_and_intervals_that_miniseed_cannot_hold_are_in_the_description(tmp_path):
    header = {
        "network": "ABC",
        "station": "SANTIAGO",
        "channel": "HN",
        "delta": 0.0078125001,
        "units": "m/s2",
    }
    trace = Trace(
        motion(0),
        header | {"per_obspy": AttribDict(highpass=0.1), "coordinates": AttribDict(latitude=1.0)},
    )
    path = tmp_path / "ABC.SANTIAGO.mseed"
    write_description(path, write_processed(Stream([trace]), path))
    back = described(read(str(path)), path)[0]
    assert back.id == "ABC.SANTIAGO..HN"
    assert back.stats.delta == trace.stats.delta  # MiniSEED keeps the rate in single precision
    assert back.stats.coordinates.latitude == 1.0


def test_records_once_processed_pass_through_a_second_time(source, tmp_path):
    processed(source, tmp_path / "out")
    processed(tmp_path / "out" / "stations", tmp_path / "again")
    first, second = (only_station(tmp_path / name / "stations")[1] for name in ("out", "again"))
    for before, after in zip(first, second, strict=True):
        assert_array_equal(before.data, after.data)  # a second filter would change them
        assert before.stats.corners == after.stats.corners


def test_the_table_has_every_corner_and_its_reason(source, tmp_path):
    processed(source, tmp_path / "out", highpass=0.1)
    table = pd.read_csv(tmp_path / "out" / "processed.csv")
    columns = pd.read_csv(tmp_path / "out" / "processed.columns.csv", keep_default_na=False)
    assert list(table) == list(columns["name"]) == list(RECORD_COLUMNS)
    # one row per component, with the corner of the configuration
    assert len(table) == 3
    assert (table["highpass"] == 0.1).all()
    assert (table["highpass_source"] == "configuration").all()
    assert (tmp_path / "out" / table["file"][0]).exists()
    assert columns.set_index("name")["unit"]["highpass"] == "Hz"


def test_every_number_of_a_record_has_a_column(source, tmp_path):
    shard = processed(source, tmp_path / "out").done[0].shard
    note = json.loads(shard.with_suffix(".json").read_text())
    described = {name for trace in note["traces"] for name in trace["per_obspy"]}
    # the mean and its window, and the order of the trend, are steps of the chain: ``processing``
    # lists them
    assert described - set(RECORD_COLUMNS) <= {"mean", "mean_of", "trend_order"}


#: Corners, windows, signal to noise and baseline of every trace; failed checks where there are any.
NOTED = {
    "highpass_source",
    "lowpass_source",
    "noise",
    "onset",
    "signal_to_noise",
    "baseline",
    "residual_velocity",
}


def test_the_spectra_have_the_same_notes_as_the_table(source, tmp_path):
    processed(source, tmp_path / "out")
    _, stream = only_station(tmp_path / "out" / "stations")
    texts = station_spectra(stream, [1.0], [0.05])["processing"].to_numpy()
    notes = [json.loads(text) for text in texts]
    for note in notes:
        assert note.keys() >= NOTED
        assert any("Butterworth" in step for step in note["steps"])
    # the table has five digits, and is otherwise the same
    table = pd.read_csv(tmp_path / "out" / "processed.csv")
    corners = rounded(np.sort([note["highpass"] for note in notes]))
    assert_array_equal(np.sort(table["highpass"]), corners)


def is_resumed(source, folder, **options):
    """Process again and return whether the only station was not done again."""
    (station,) = processed(source, folder, **options).done
    return station.resumed


def test_nothing_is_done_twice_and_what_changed_is_done_again(source, tmp_path):
    out = tmp_path / "out"
    (station,) = processed(source, out).done
    assert not station.resumed
    assert is_resumed(source, out)
    assert not is_resumed(source, out, highpass=0.1)
    # a damaged file, and a missing status
    station.shard.write_bytes(b"half a file")
    assert not is_resumed(source, out, highpass=0.1)
    station.shard.with_suffix(".json").unlink()
    assert not is_resumed(source, out, highpass=0.1)


@pytest.mark.parametrize("name", ["LONGNAME.mseed", "LONGNAME.json"])
def test_a_structure_that_was_lost_comes_back(tmp_path, name):
    # would catch a station that counts as done although a part of its files is missing
    source, out = write_structure(tmp_path / "records"), tmp_path / "out"
    processed(source, out)
    assert is_resumed(source, out)
    (out / "structures" / name).unlink()
    assert not is_resumed(source, out)
    assert (out / "structures" / name).exists()


def test_a_description_of_another_file_is_refused(source, tmp_path):
    path = processed(source, tmp_path / "out").done[0].shard
    path.write_bytes(path.read_bytes()[:-4096])
    with pytest.raises(CatalogError, match="describes another file"):
        find_stations(path)


def test_the_report_has_a_page_a_record_and_comes_back_if_it_was_lost(source, tmp_path):
    out = tmp_path / "out"
    for _ in range(2):
        done = process_records([source], out, Processing(), None, True, ONE).done
        assert not done[0].resumed
        pdf = done[0].shard.with_suffix(".pdf")
        assert pdf.read_bytes().count(b"/Type /Page ") == 3
        pdf.unlink()


def test_structures_are_apart_with_their_reason(tmp_path):
    source = write_structure(tmp_path / "records")
    result = processed(source, tmp_path / "out")
    files = (tmp_path / "out" / "structures").glob("*.mseed")
    assert [path.name for path in files] == ["LONGNAME.mseed"]
    # the table has both, and the roof is no ground motion
    table = pd.read_csv(tmp_path / "out" / "processed.csv")
    assert set(table["file"]) == {"stations/LONGNAME.mseed", "structures/LONGNAME.mseed"}
    reasons = [reason for row in result.rejected for reason in row.reasons]
    assert any("in a structure (Roof)" in reason for reason in reasons)


def write_structure(folder):
    """Write a station with instruments in the free field and on the roof, as this package does."""
    folder.mkdir()
    common = {"station": "LONGNAME", "sampling_rate": RATE, "units": "m/s2"}
    common |= {"quantity": "acceleration", "processing_level": "raw"}
    traces = []
    for place, code in (("Freefield", "01"), ("Roof", "02")):
        # Two horizontals of each instrument
        for number, channel in enumerate(("HNE", "HNN")):
            header = {"location": code, "channel": channel, "sensor_location": place}
            traces.append(with_metadata(Trace(motion(number), common | header), None))
    write_description(folder / "XX.mseed", write_processed(Stream(traces), folder / "XX.mseed"))
    return folder


def call(*arguments):
    return CliRunner().invoke(app, ["process", *map(str, arguments)])


def test_the_command_prints_what_there_is(source, tmp_path):
    (tmp_path / "settings.toml").write_text("highpass = 0.2\n")
    done = call(source, "-o", tmp_path / "out", "--settings", tmp_path / "settings.toml", "--json")
    assert done.exit_code == 0
    result = json.loads(done.stdout)
    assert (result["stations"], result["rejected"]) == (1, [])
    # the settings reach the chain
    assert pd.read_csv(tmp_path / "out" / "processed.csv")["highpass"].tolist() == [0.2, 0.2, 0.2]


def test_nothing_usable_exits_with_3_and_says_why(source, tmp_path):
    (tmp_path / "records").mkdir()
    (tmp_path / "records" / "stations.xml").write_bytes((source / "stations.xml").read_bytes())
    # a station with its vertical only
    vertical = read(str(source / "*.mseed")).select(channel="HNZ")
    vertical.write(str(tmp_path / "records" / "vertical.mseed"), format="MSEED")
    assert call(tmp_path / "records", "-o", tmp_path / "out").exit_code == 3
    rejected = pd.read_csv(tmp_path / "out" / "rejected.csv")
    assert rejected["reasons"].tolist() == ["no horizontal of its instrument is usable"]


WRONG = {"no such folder": "absent", "wrong key": "highpas", "no such event": "absent.xml"}


@pytest.mark.parametrize("fault", WRONG)
def test_wrong_input_is_one_line(source, tmp_path, fault):
    (tmp_path / "settings.toml").write_text("highpas = 0.2\n")
    arguments = {
        "no such folder": (tmp_path / "absent", "-o", tmp_path / "out"),
        "wrong key": (source, "-o", tmp_path / "out", "--settings", tmp_path / "settings.toml"),
        "no such event": (source, "-o", tmp_path / "out", "--event", tmp_path / "absent.xml"),
    }
    done = call(*arguments[fault])
    # which ``application.main`` turns into a line and exit code 2
    assert isinstance(done.exception, CatalogError)
    assert WRONG[fault] in str(done.exception)
