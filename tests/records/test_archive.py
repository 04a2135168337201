"""Archives of records."""

import io
import tarfile
import zipfile
from pathlib import Path

import pytest
from archive_samples import AT2, mseed

from per_obspy.errors import CatalogError, RecordRejected
from per_obspy.records.archive import archive_files, open_file
from per_obspy.records.folder import find_stations, read_station

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
def test_records_in_archives_are_the_same_as_outside(tmp_path: Path, name: str):
    archive = pack(tmp_path / name)
    (tmp_path / "three.AT2").write_bytes(AT2)
    paths = [archive / "three.AT2", tmp_path / "three.AT2"]
    for path in paths:
        (trace,), rejected = read_station([path], None)
        assert rejected == ()
        assert trace.stats.source == str(path)
        assert "coordinates" not in trace.stats  # the AT2 format has none, and none are made up


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
