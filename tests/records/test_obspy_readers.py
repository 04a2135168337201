"""Formats that ObsPy may read, and its errors, which become rejections of the file."""

import bz2
import gzip
import io
import lzma
import pickle
import tarfile
import tracemalloc
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path

import obspy
import pytest
from obspy.core.util.base import ENTRY_POINTS
from station_files import record

from per_obspy.errors import RecordRejected
from per_obspy.reader_process import Limits
from per_obspy.records import obspy_readers
from per_obspy.records.archive import read_file
from per_obspy.records.earthquakes.quakeml import read_event
from per_obspy.records.folder import find_stations
from per_obspy.records.metadata import read_inventories
from per_obspy.records.obspy_readers import FORMATS, read_bytes_with_obspy, read_content
from per_obspy.records.summary import describe_records


def _read(path: Path) -> obspy.Stream:
    return read_content(obspy.read, read_file(path), path)


class Payload:
    """An object that makes a file when it is unpickled."""

    def __init__(self, made: Path):
        self.made = made

    def __reduce__(self):
        return Path.touch, (self.made,)


def pickled(made: Path) -> bytes:
    """Return a pickle that makes a file, with the words by which ObsPy knows pickled Streams."""
    content = pickle.dumps(("obspy.core.stream", Payload(made)))
    assert b"obspy.core.stream" in content[:100]
    return content


def zipped(content: bytes) -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        archive.writestr("record.mseed", content)
    return packed.getvalue()


def tarred(content: bytes, mode: str = "w") -> bytes:
    packed = io.BytesIO()
    with tarfile.open(fileobj=packed, mode=mode) as archive:
        member = tarfile.TarInfo("record.mseed")
        member.size = len(content)
        archive.addfile(member, io.BytesIO(content))
    return packed.getvalue()


def tarred_and_zipped(content: bytes) -> bytes:
    return tarred(content, "w:gz")


def nested(content: bytes) -> bytes:
    return zipped(zipped(content))


PACKERS: dict[str, Callable[[bytes], bytes]] = {
    "plain": bytes,
    "zip": zipped,
    "tar": tarred,
    "tgz": tarred_and_zipped,
    "gz": gzip.compress,
    "bz2": bz2.compress,
    "nested": nested,
}


@pytest.mark.parametrize("name", ["a.pickle", "a.mseed", "a.zip", "a.tar.gz"])
@pytest.mark.parametrize("packer", PACKERS.values(), ids=PACKERS)
def test_no_file_runs_code(tmp_path: Path, packer: Callable[[bytes], bytes], name: str):
    # would catch obspy.read's own search of a format, which unpickles
    made = tmp_path / "made"
    folder = tmp_path / "records"
    folder.mkdir()
    path = folder / name
    path.write_bytes(packer(pickled(made)))
    # Every entry: a folder, one file, info, an event, metadata, a file and bytes of a service
    entries: list[Callable[[], object]] = [
        lambda: find_stations(folder),
        lambda: find_stations(path),
        lambda: describe_records(path),
        lambda: read_event(path),
        lambda: read_inventories(path),
        lambda: _read(path),
        lambda: read_bytes_with_obspy(obspy.read, path.read_bytes(), "service"),
        lambda: read_bytes_with_obspy(obspy.read, path.read_bytes(), "service", format="PICKLE"),
    ]
    for entry in entries:
        with pytest.raises(ValueError, match=r"\S"):
            entry()
    assert not made.exists()


def test_the_payload_is_one(tmp_path: Path):
    # what the test above must not see
    obspy_formats = set(ENTRY_POINTS["waveform"])
    assert "PICKLE" in obspy_formats - FORMATS["waveform"]
    pickle.loads(pickled(tmp_path / "made"))
    assert (tmp_path / "made").exists()


def test_allowed_formats_are_recorded_motion_that_does_not_reach_beyond_its_file():
    # a format that a new ObsPy brings is read only once it has been looked at
    left_out = {kind: set(ENTRY_POINTS[kind]) - names for kind, names in FORMATS.items()}
    unsafe = {"PICKLE", "CSS", "NNSA_KB_CORE", "GSE1", "GSE2"}
    moon = {"ALSEP_PSE", "ALSEP_WTN", "ALSEP_WTH"}
    other = {"RG16", "SEG2", "SEGY", "SU", "WAV", "DMX", "CYBERSHAKE", *moon}
    assert left_out["waveform"] == unsafe | other
    assert left_out["event"] == {"CSZ", "SC3ML"}
    assert left_out["inventory"] == {"SC3ML"}


def test_a_record_names_no_file_elsewhere(tmp_path: Path):
    # a table of CSS names the file of its samples: any that this process may read
    samples = tmp_path / "secret"
    samples.write_bytes(bytes(80))
    row = bytearray(b" " * 283)
    fields = {0: b"STA", 7: b"HHZ", 16: b"0.00000", 79: b"20", 88: b"100.0", 143: b"s4"}
    fields |= {148: str(tmp_path).encode()[:64], 213: b"secret", 246: b"0"}
    for place, word in fields.items():
        row[place : place + len(word)] = word
    folder = tmp_path / "records"
    folder.mkdir()
    (folder / "a.wfdisc").write_bytes(bytes(row) + b"\n")
    with pytest.raises(RecordRejected, match="its format is unknown"):
        _read(folder / "a.wfdisc")


@pytest.mark.parametrize("packer", [gzip.compress, bz2.compress], ids=["gz", "bz2"])
def test_packed_files_are_read_up_to_a_limit(tmp_path: Path, packer, monkeypatch):
    content = io.BytesIO()
    record("HN1").write(content, format="MSEED")
    path = tmp_path / "record.mseed"
    path.write_bytes(packer(content.getvalue()))
    (trace,) = _read(path)
    assert trace.stats.channel == "HN1"
    # the same file with a limit of one byte less; then cut
    monkeypatch.setattr(obspy_readers, "LARGEST_UNPACKED", len(content.getvalue()) - 1)
    with pytest.raises(RecordRejected, match="it unpacks to more than 0 MiB"):
        _read(path)
    path.write_bytes(path.read_bytes()[:-12])
    with pytest.raises(RecordRejected, match="the packed file is damaged"):
        _read(path)


@pytest.mark.parametrize("packer", [gzip.compress, bz2.compress], ids=["gz", "bz2"])
def test_a_bomb_is_refused_before_it_fills_the_memory(tmp_path: Path, packer):
    # 256 MiB of zeros in a few kB: refused at 64 MiB and a ratio of 200
    path = tmp_path / "bomb.mseed"
    path.write_bytes(packer(bytes(256 << 20)))
    tracemalloc.start()
    with pytest.raises(RecordRejected, match="more than 200 times its packed size"):
        _read(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # What is unpacked, and its buffer as it grows by an eighth
    assert peak < 2 * (64 << 20)


@pytest.mark.parametrize(
    ("content", "packer"), [(lzma.compress(bytes(9)), "xz"), (b"\x28\xb5\x2f\xfd$", "Zstandard")]
)
def test_other_packers_are_named(tmp_path: Path, content, packer):
    (tmp_path / "record.mseed").write_bytes(content)
    with pytest.raises(RecordRejected, match=f"it is packed by {packer}: unpack it first"):
        _read(tmp_path / "record.mseed")


def test_archives_under_other_names_are_named(tmp_path: Path):
    (tmp_path / "record").write_bytes(zipped(b"words"))
    with pytest.raises(RecordRejected, match=r"it is an archive: its name must end with \.zip"):
        _read(tmp_path / "record")


def test_samples_in_a_file_beside_are_found(tmp_path: Path):
    record("HNZ").write(str(tmp_path / "record"), format="Q")
    (trace,) = _read(tmp_path / "record.QHD")
    assert trace.stats.npts == record("HNZ").stats.npts


def test_names_with_wildcards_mean_themselves(tmp_path: Path):
    # would catch obspy.read's own reading of wildcards
    record("HN1").write(str(tmp_path / "[H*]?.mseed"), format="MSEED")
    record("HN2").write(str(tmp_path / "HN2.mseed"), format="MSEED")
    (trace,) = _read(tmp_path / "[H*]?.mseed")
    assert trace.stats.channel == "HN1"


@pytest.mark.parametrize(
    ("content", "options", "reason"),
    [
        (b"words", {}, "ObsPy cannot read it: its format is unknown"),
        (b"PEER\n\nACCELERATION TIME SERIES IN UNITS OF G\nNPTS", {}, "line 4, NPTS, DT: "),
        (b"words", {"format": "QUAKEML"}, "ObsPy cannot read it: .*Error: "),
    ],
)
def test_any_error_is_a_rejection_on_one_line(content: bytes, options: dict, reason: str):
    reader = obspy.read_events if options else obspy.read
    with pytest.raises(RecordRejected, match=reason) as rejection:
        read_bytes_with_obspy(reader, content, "service", **options)
    assert "\n" not in str(rejection.value)


def test_foreign_readers_work_apart_and_read_the_same():
    # would catch samples, times or headers that change on the way between the processes
    folder = Path(obspy.__file__).parent / "io"
    for name, file in {
        "GCF": "gcf/tests/data/20160603_1910n.gcf",
        "SLIST": "ascii/tests/data/slist_float.ascii",
        "WIN": "win/tests/data/25112618_ch0000.24bits",
    }.items():
        content = (folder / file).read_bytes()
        here = obspy.read(io.BytesIO(content), format=name)
        apart = read_bytes_with_obspy(obspy.read, content, "service", format=name)
        assert apart == here
    # A recorder's file without its last packet is read with its warning
    content = (folder / "reftek/tests/data/221935615_00000000").read_bytes()
    with warnings.catch_warnings(record=True) as doubts:
        warnings.simplefilter("always")
        assert read_bytes_with_obspy(obspy.read, content, "service")[0].stats.npts > 0
    assert any("File might be truncated" in str(doubt.message) for doubt in doubts)
    for file in ("dataless.seed.BW_FURT", "RESP.BK.BRIB..BV1"):
        content = (folder / "xseed/tests/data" / file).read_bytes()
        here = obspy.read_inventory(io.BytesIO(content))
        apart = read_bytes_with_obspy(obspy.read_inventory, content, "service")
        assert apart.get_contents() == here.get_contents()
        assert apart[0][0][0].response == here[0][0][0].response


@pytest.mark.parametrize(
    ("program", "reason"),
    [
        ("while True: pass", "reading it takes more than 1 s of processor time"),
        ("bytearray(1 << 33)", "reading it takes more than 64 MiB of memory"),
        ("import os; os.abort()", "reading it takes more than 64 MiB of memory"),
        ("import os; os._exit(3)", "its reader ends with code 3"),
    ],
)
def test_a_reader_that_fails_loses_its_file_only(tmp_path: Path, monkeypatch, program, reason):
    # a GCF file whose reader never ends, fills the memory or ends the process
    gcf = Path(obspy.__file__).parent / "io/gcf/tests/data/20160603_1910n.gcf"
    (tmp_path / "a.gcf").write_bytes(gcf.read_bytes())
    record("HN1").write(str(tmp_path / "b.mseed"), format="MSEED")
    monkeypatch.setattr(obspy_readers, "Limits", lambda *_: Limits(1.0, 64 << 20))
    call = obspy_readers.read_apart
    monkeypatch.setattr(obspy_readers, "read_apart", lambda limits, *_: call(limits, exec, program))
    contents = find_stations(tmp_path)
    assert list(contents.stations) == ["CI.CLC"]
    (row,) = contents.rejected
    assert (row.name, row.reasons) == ("a.gcf", (f"{reason}: damaged, or no GCF file",))


@pytest.mark.real_data
def test_a_file_that_hung_is_a_row_of_the_rejected(tmp_path: Path, real_data: Path):
    hangs = real_data / "field/record-that-hangs/x.rg16"
    if not hangs.exists():
        pytest.skip("no record-that-hangs among the data")
    (tmp_path / "x.rg16").write_bytes(hangs.read_bytes())
    record("HN1").write(str(tmp_path / "b.mseed"), format="MSEED")
    contents = find_stations(tmp_path)
    assert list(contents.stations) == ["CI.CLC"]
    assert [row.name for row in contents.rejected] == ["x.rg16"]


@pytest.mark.parametrize(
    ("head", "row"),
    [
        # Canterbury's text files: two lines of words, then six samples to a line
        (
            "REHS 090 title\n 1000 0.005 0 0 -1.0 0 0 0\n",
            " 1.2345e-02 -3.4e-02 5.0e-01 0.1 0.2 0.3\n",
        ),
        ("", "0.01\t-0.002\t0.003\n"),
        ("time;north\n", "0,01;-0,002\n"),
        ("", "1.5\n"),
    ],
)
def test_plain_numbers_are_sent_to_their_configuration(tmp_path: Path, head: str, row: str):
    (tmp_path / "REHS.090").write_text(head + 400 * row)
    with pytest.raises(RecordRejected, match=r"\[\[records.columns\]\]"):
        _read(tmp_path / "REHS.090")


def test_a_file_and_its_bytes_are_read_alike(tmp_path: Path):
    path = tmp_path / "record.mseed"
    record("HN1").write(str(path), format="MSEED")
    (trace,) = read_bytes_with_obspy(obspy.read, path.read_bytes(), "service", format="MSEED")
    assert trace == _read(path)[0]
