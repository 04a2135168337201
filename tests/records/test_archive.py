"""Archives of records, whole, damaged, or made to exhaust memory or time or to lead elsewhere."""

import io
import struct
import tarfile
import tracemalloc
import zipfile
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest
from obspy import Stream, Trace

from per_obspy.config import Archives, Records
from per_obspy.errors import CatalogError, RecordRejected
from per_obspy.records import archive as module
from per_obspy.records.archive import Archive, archive_files, open_file
from per_obspy.records.folder import find_stations, read_station
from per_obspy.records.sources import find_sources

AT2 = b"""PEER NGA STRONG MOTION DATABASE RECORD
Some Event, 7/21/1952, Some School, 21
ACCELERATION TIME SERIES IN UNITS OF G
NPTS=      3, DT=   .0100 SEC,
  .1E+00 .2E+00 -.3E+00
"""


def mseed(station: str) -> bytes:
    file = io.BytesIO()
    header = {"network": "CI", "station": station, "channel": "HNN", "delta": 0.01}
    Stream([Trace(np.arange(300, dtype=np.int32), header)]).write(file, format="MSEED")
    return file.getvalue()


CONTENT = {
    "deep/one.mseed": mseed("ONE"),
    "two.mseed": mseed("TWO"),
    "three.AT2": AT2,
    "notes.txt": b"words",
}


def pack(path: Path) -> Path:
    if path.suffix == ".zip":
        with zipfile.ZipFile(path, "w") as archive:
            for name, content in CONTENT.items():
                archive.writestr(name, content)
        return path
    mode = {".tar": "w", ".gz": "w:gz", ".tgz": "w:gz", ".bz2": "w:bz2", ".xz": "w:xz"}[path.suffix]
    # the mode is one of those in tarfile's documentation
    with tarfile.open(path, mode) as archive:  # type: ignore[call-overload]
        for name, content in CONTENT.items():
            member = tarfile.TarInfo(name)
            member.size = len(content)
            archive.addfile(member, io.BytesIO(content))
    return path


every = pytest.mark.parametrize(
    "name", ["a.zip", "a.tar", "a.tar.gz", "a.tgz", "a.tar.bz2", "a.tar.xz", "A.ZIP.zip"]
)


@every
def test_an_archive_is_a_folder(tmp_path: Path, name: str):
    archive = pack(tmp_path / name)
    contents = find_stations(tmp_path)
    assert contents.stations["CI.ONE"] == (archive / "deep" / "one.mseed",)
    assert list(contents.stations) == [".SOMESCHOOL", "CI.ONE", "CI.TWO"]
    assert [rejection.name for rejection in contents.rejected] == ["notes.txt"]
    assert open_file(archive / "three.AT2").read() == AT2
    assert sorted(path.name for path in tmp_path.iterdir()) == [name]  # no file is unpacked on disk


@every
@pytest.mark.parametrize("part", [0.0, 0.3, 0.9])
def test_a_damaged_archive_is_a_rejection(tmp_path: Path, name: str, part: float):
    archive = pack(tmp_path / name)
    content = archive.read_bytes()
    archive.write_bytes(content[: int(part * len(content))])
    (tmp_path / "three.AT2").write_bytes(AT2)
    contents = find_stations(tmp_path)
    assert next(iter(contents.stations)) == ".SOMESCHOOL"
    assert contents.rejected


def test_a_folder_of_damaged_archives_is_refused(tmp_path: Path):
    (tmp_path / "a.zip").write_bytes(b"no archive")
    with pytest.raises(CatalogError, match=r"a\.zip: the archive is damaged"):
        find_stations(tmp_path)


def test_missing_members_are_refused(tmp_path: Path):
    archive = pack(tmp_path / "a.zip")
    with pytest.raises(RecordRejected, match="cannot be read"):
        open_file(archive / "none.AT2")


def test_damaged_members_are_refused(tmp_path: Path):
    archive = pack(tmp_path / "a.zip")
    archive.write_bytes(archive.read_bytes().replace(b"NPTS", b"MPTS"))
    assert len(archive_files(archive)[0]) == len(CONTENT)
    with pytest.raises(RecordRejected, match="Bad CRC-32"):
        open_file(archive / "three.AT2")


MANY = 2_000


def tar(path: Path, members: Iterable[tuple[str, bytes]], mode: str = "w") -> Path:
    with tarfile.open(path, mode) as packed:  # type: ignore[call-overload]
        for name, content in members:
            info = tarfile.TarInfo(name)
            info.size = len(content)
            packed.addfile(info, io.BytesIO(content))
    return path


def zipped(path: Path, members: Iterable[tuple[str, bytes]]) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as packed:
        for name, content in members:
            packed.writestr(name, content)
    return path


PACK = {"a.zip": zipped, "a.tar": tar}


@pytest.mark.parametrize("kind", PACK)
def test_names_that_begin_with_a_dot_are_found(tmp_path: Path, kind: str):
    archive = PACK[kind](tmp_path / kind, [("./a/./one.AT2", AT2), (".//two.AT2", AT2)])
    files, rejected = archive_files(archive)
    assert (files, rejected) == ([archive / "a" / "one.AT2", archive / "two.AT2"], [])
    assert [open_file(path).read() for path in files] == [AT2, AT2]


NAMES = {
    "/etc/passwd": "leads out of this folder",
    "../victim": "leads out of this folder",
    "a/../../victim": "leads out of this folder",
    "..\\victim": "leads out of this folder",
    "C:\\victim": "is no name of a file on every system",
    "a\nb": "is no name of a file on every system",
    "A" * 300: "is longer than 255 bytes",
    "a/" * 600 + "b": "or 1024 with its folders",
}


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("kind", PACK)
def test_names_that_lead_elsewhere_are_rows(tmp_path: Path, kind: str, name: str):
    archive = PACK[kind](tmp_path / kind, [(name, AT2), ("good.AT2", AT2)])
    files, (row,) = archive_files(archive)
    assert files == [archive / "good.AT2"]
    assert NAMES[name] in row.reasons[0]
    assert len(row.name) <= 80


@pytest.mark.parametrize("kind", PACK)
def test_an_absolute_name_never_reads_the_local_file(tmp_path: Path, kind: str):
    secret = tmp_path / "secret.mseed"
    secret.write_bytes(mseed("LOCAL"))
    (tmp_path / "in").mkdir()
    PACK[kind](tmp_path / "in" / kind, [(str(secret), mseed("INSIDE")), ("b.AT2", AT2)])
    found = find_stations(tmp_path / "in")
    assert list(found.stations) == [".SOMESCHOOL"]
    assert len(found.rejected) == 1


def test_a_nul_in_the_name_of_a_zip_is_a_row(tmp_path: Path):
    archive = zipped(tmp_path / "a.zip", [("a.AT2#b", AT2)])
    archive.write_bytes(archive.read_bytes().replace(b"a.AT2#b", b"a.AT2\0b"))
    files, (row,) = archive_files(archive)
    assert files == []
    assert "is no name of a file on every system" in row.reasons[0]


@pytest.mark.parametrize("kind", PACK)
@pytest.mark.filterwarnings("ignore:Duplicate name:UserWarning")
def test_of_two_members_of_one_name_the_last_is_read_and_the_other_a_row(tmp_path, kind):
    archive = PACK[kind](tmp_path / kind, [("./a.AT2", b"old"), ("a.AT2", AT2), ("a.AT2", AT2)])
    files, rejected = archive_files(archive)
    assert [open_file(path).read() for path in files] == [AT2]
    assert [row.reasons[0] for row in rejected] == [
        "another member of this name comes later in the archive"
    ] * 2


def test_links_and_devices_are_rows_and_not_followed(tmp_path: Path):
    kinds = (tarfile.SYMTYPE, tarfile.LNKTYPE, tarfile.CHRTYPE, tarfile.FIFOTYPE)
    with tarfile.open(tmp_path / "a.tar", "w") as packed:
        for number, kind in enumerate(kinds):
            info = tarfile.TarInfo(f"{number}.AT2")
            info.type, info.linkname = kind, "/etc/passwd"
            packed.addfile(info)
    files, rejected = archive_files(tmp_path / "a.tar")
    assert files == []
    reasons = [row.reasons[0] for row in rejected]
    assert reasons[:2] == ["is a link, which is not followed"] * 2
    assert reasons[2:] == ["is no file but a device or pipe"] * 2


@pytest.mark.parametrize("kind", PACK)
def test_archives_deeper_than_the_limit_are_rows(tmp_path: Path, kind: str, monkeypatch):
    monkeypatch.setattr(module, "MOST_LEVELS", 1)
    inner = zipped(tmp_path / "inner.zip", [("a.AT2", AT2)]).read_bytes()
    archive = PACK[kind](tmp_path / kind, [("deep/inner.zip", inner)])
    files, (row,) = archive_files(archive)
    assert files == []
    assert "is an archive deeper than 1 levels: unpack the outer one" in row.reasons[0]


@pytest.mark.parametrize("kind", PACK)
@pytest.mark.parametrize("inside", PACK)
def test_an_archive_inside_an_archive_is_a_folder(tmp_path: Path, kind: str, inside: str):
    inner = PACK[inside](tmp_path / inside, [("deep/a.AT2", AT2)])
    name = f"one/{inner.name}"
    archive = PACK[kind](tmp_path / f"outer-{kind}", [(name, inner.read_bytes()), ("b.AT2", AT2)])
    inner.unlink()
    files, rejected = archive_files(archive)
    assert (files, rejected) == ([archive / "b.AT2", archive / name / "deep/a.AT2"], [])
    # Back and forth: the archive inside is opened again
    assert [open_file(path).read() for path in (*files, *files)] == [AT2] * 4
    assert [path.name for path in tmp_path.iterdir()] == [archive.name]


def test_files_of_two_archives_inside_are_not_confused(tmp_path: Path):
    inner = {
        name: zipped(tmp_path / name, [("a.txt", name.encode())]).read_bytes()
        for name in ("x.zip", "y.zip")
    }
    archive = zipped(tmp_path / "a.zip", list(inner.items()))
    x, y = archive_files(archive)[0]
    assert [open_file(path).read() for path in (x, y, x)] == [b"x.zip", b"y.zip", b"x.zip"]


def test_a_damaged_archive_inside_is_one_row(tmp_path: Path):
    inner = zipped(tmp_path / "i.zip", [("a.AT2", AT2)]).read_bytes()
    members = [("cut.zip", inner[:50]), ("whole.zip", inner), ("cut.tar", b"no archive")]
    archive = zipped(tmp_path / "a.zip", members)
    files, rejected = archive_files(archive)
    assert files == [archive / "whole.zip/a.AT2"]
    assert sorted(row.name for row in rejected) == ["cut.tar", "cut.zip"]
    assert all("the archive is damaged" in row.reasons[0] for row in rejected)


@pytest.mark.parametrize(
    ("key", "value"), [("largest_total", 8000), ("MOST_FILES", 10), ("largest_ratio", 1)]
)
def test_archives_inside_share_the_limits_of_the_outermost(
    tmp_path: Path, key: str, value: int, monkeypatch
):
    # Each archive inside is within every limit, all together are not
    content = bytes(30 * 2**20) if key == "largest_ratio" else bytes(900)
    inner = zipped(tmp_path / "i.zip", [(f"{i}.bin", content) for i in range(3)]).read_bytes()
    archive = zipped(tmp_path / "a.zip", [(f"{i}.zip", inner) for i in range(4)])
    limits = Archives(**({key: value} if key != "MOST_FILES" else {}))
    monkeypatch.setattr(module, "MOST_FILES", value if key == "MOST_FILES" else 1000)
    with pytest.raises(RecordRejected, match=f"{value}"):
        archive_files(archive, limits)
    alone = zipped(tmp_path / "alone.zip", [("0.zip", inner)])
    if key != "largest_ratio":
        assert len(archive_files(alone, limits)[0]) == 3


def test_an_archive_that_holds_itself_ends_at_the_deepest_level(tmp_path: Path):
    content = AT2
    for _ in range(6):
        content = zipped(tmp_path / "i.zip", [("i.zip", content)]).read_bytes()
    (tmp_path / "i.zip").unlink()
    (tmp_path / "a.zip").write_bytes(content)
    files, (row,) = archive_files(tmp_path / "a.zip")
    assert files == []
    assert "deeper than 3 levels" in row.reasons[0]


def test_encrypted_and_unknown_packing_are_rows(tmp_path: Path):
    archive = zipped(tmp_path / "a.zip", [("a.AT2", AT2), ("b.AT2", AT2)])
    content = bytearray(archive.read_bytes())
    first, second = content.find(b"PK\x01\x02"), content.rfind(b"PK\x01\x02")
    # flags and method of the list of members, APPNOTE 4.3.12
    content[first + 8] |= 1
    content[second + 10 : second + 12] = struct.pack("<H", 9)
    archive.write_bytes(content)
    files, rejected = archive_files(archive)
    assert files == []
    assert [row.reasons[0] for row in rejected] == [
        "is encrypted: unpack it first",
        "is packed by method 9, which is unknown: unpack it first",
    ]


#: Unpacked size of a bomb: beyond the 64 MiB from which the ratio counts.
BOMB = 96 * 2**20


@pytest.mark.parametrize("name", ["bomb.tar.gz", "bomb.zip"])
def test_a_bomb_is_one_row_and_takes_no_memory(tmp_path: Path, name: str):
    members = [("zeros.AT2", bytes(BOMB))]
    path = tmp_path / name
    bomb = zipped(path, members) if name == "bomb.zip" else tar(path, members, "w:gz")
    assert bomb.stat().st_size < 2**20
    (tmp_path / "good.AT2").write_bytes(AT2)
    tracemalloc.start()
    found = find_stations(tmp_path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    # pieces of 1 MiB and the parts of libraries that are loaded meanwhile
    assert peak < 32 * 2**20
    assert list(found.stations) == [".SOMESCHOOL"]
    (row,) = found.rejected
    assert "records.archives.largest_ratio = 200 times its packed size" in row.reasons[0]


@pytest.mark.parametrize("kind", [*PACK, "a.tar.gz"])
def test_limits_of_the_configuration_count(tmp_path: Path, kind: str):
    key, value = "largest_total", 8000
    pack = PACK.get(kind) or (lambda path, members: tar(path, members, "w:gz"))
    archive = pack(tmp_path / kind, [(f"{number}.mseed", mseed("ONE")) for number in range(5)])
    (tmp_path / "good.AT2").write_bytes(AT2)
    records = Records(folder=tmp_path, archives=Archives(**{key: value}))
    found = find_sources(records, None)
    assert list(found.stations) == [".SOMESCHOOL"]
    assert str(value) in found.rejected[0].reasons[0]
    # and the readers of the stations have them too
    assert found.stations[".SOMESCHOOL"].reader.keywords == {"limits": records.archives}
    assert len(archive_files(archive)[0]) == 5


@pytest.mark.parametrize("kind", PACK)
def test_a_member_that_is_too_large_is_left_out_alone(tmp_path: Path, kind: str):
    archive = PACK[kind](tmp_path / kind, [("large.AT2", AT2 * 10), ("small.AT2", AT2)])
    files, (row,) = archive_files(archive, Archives(largest_member=len(AT2)))
    assert files == [archive / "small.AT2"]
    assert f"larger than records.archives.largest_member = {len(AT2)}" in row.reasons[0]


def tar_header(name: str, size: bytes) -> bytearray:
    """Return a header of tar with the twelve bytes of its size as given."""
    header = bytearray(tarfile.TarInfo(name).tobuf(tarfile.USTAR_FORMAT))
    header[124:136] = size
    header[148:156] = b" " * 8
    header[148:156] = b"%06o\0 " % sum(header)
    return header


SIZES = {
    "larger than the file": b"%011o\0" % 10_000,
    "8 GB": b"77777777777\0",
    "beyond 64 bits": b"\x80" + b"\x7f" * 11,
    "negative": b"\xff" * 12,
}


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("kind", [b"0", b"x", b"L", b"g"])
def test_a_wrong_size_in_a_header_is_damage(tmp_path: Path, size: str, kind: bytes):
    header = tar_header("a.AT2", SIZES[size])
    header[156:157] = kind
    header[148:156] = b" " * 8
    header[148:156] = b"%06o\0 " % sum(header)
    (tmp_path / "a.tar").write_bytes(bytes(header) + AT2.ljust(512, b"\0") + bytes(1024))
    with pytest.raises(RecordRejected, match="the archive is damaged"):
        archive_files(tmp_path / "a.tar")


def test_damage_between_members_does_not_hide_the_rest(tmp_path: Path):
    archive = tar(tmp_path / "a.tar", [("a.AT2", AT2), ("b.AT2", AT2), ("c.AT2", AT2)])
    content = bytearray(archive.read_bytes())
    content[content.find(b"b.AT2")] ^= 1
    archive.write_bytes(content)
    with pytest.raises(RecordRejected, match="no header and no end mark at byte 1024"):
        archive_files(archive)


def test_a_size_that_a_zip_understates_is_damage(tmp_path: Path):
    archive = zipped(tmp_path / "a.zip", [("a.AT2", AT2 * 100)])
    content = bytearray(archive.read_bytes())
    listed = content.find(b"PK\x01\x02")
    # the unpacked size in the list of members, APPNOTE 4.3.12
    content[listed + 24 : listed + 28] = struct.pack("<I", 10)
    archive.write_bytes(content)
    (path,) = archive_files(archive)[0]
    with pytest.raises(RecordRejected, match="Bad CRC-32"):
        open_file(path)


@pytest.mark.parametrize("name", ["a.tar", "a.zip", "a.tar.gz"])
def test_many_members_are_walked_once(tmp_path: Path, monkeypatch, name: str):
    members = [(f"{number:06d}.txt", b"words") for number in range(MANY)]
    mode = "w:gz" if name == "a.tar.gz" else "w"
    path = tmp_path / name
    archive = zipped(path, members) if name == "a.zip" else tar(path, members, mode)
    # every opening of the archive and every member that is described
    opened, described = [], []
    listed = Archive.listed

    def counted(self):
        opened.append(self)
        for member in listed(self):
            described.append(member)
            yield member

    monkeypatch.setattr(Archive, "listed", counted)
    files, rejected = archive_files(archive)
    assert (len(files), rejected) == (MANY, [])
    # members of all parts, the last first
    for path in files[::-100]:
        assert open_file(path).read() == b"words"
    assert len(opened) == 1
    assert len(described) == MANY


def test_a_changed_archive_is_walked_again(tmp_path: Path):
    for content in (AT2, AT2 * 2):
        archive = tar(tmp_path / "a.tar", [("a.AT2", content)])
        # the block of the longer content makes the file no longer
        with archive.open("ab") as file:
            file.write(bytes(len(content)))
        (path,) = archive_files(archive)[0]
        assert open_file(path).read() == content


@every
def test_records_in_archives_are_the_same_as_outside(tmp_path: Path, name: str):
    archive = pack(tmp_path / name)
    (tmp_path / "three.AT2").write_bytes(AT2)
    paths = [archive / "three.AT2", tmp_path / "three.AT2"]
    for path in paths:
        (trace,), rejected = read_station([path], None)
        assert rejected == ()
        assert trace.stats.source == str(path)
        assert "coordinates" not in trace.stats  # the AT2 format has none, and none are made up
