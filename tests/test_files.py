"""Atomic writes, part files of killed processes, and hashes."""

import errno
import os
import stat
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from per_obspy import files
from per_obspy.errors import CatalogError, WriteError
from per_obspy.files import (
    bytes_hash,
    content_hash,
    file_hash,
    is_part,
    remove_dead_parts,
    remove_file,
    temporary_folder,
    written_whole,
)


def test_the_final_name_appears_only_at_the_end(tmp_path):
    final = tmp_path / "new" / "risk.csv"
    with written_whole(final) as part:
        part.write_text("half")
        assert not final.exists()
        assert part.suffix == ".csv"
    assert final.read_text() == "half"
    assert list(final.parent.iterdir()) == [final]


def test_a_failure_leaves_the_old_file_and_nothing_else(tmp_path):
    final = tmp_path / "risk.csv"
    final.write_text("old")

    def fails():
        with written_whole(final) as part:
            part.write_text("half")
            raise RuntimeError("power cut")

    with pytest.raises(RuntimeError, match="power cut"):
        fails()
    assert final.read_text() == "old"
    assert list(tmp_path.iterdir()) == [final]


def test_a_folder_that_cannot_be_made_is_named_in_one_line(tmp_path):
    (tmp_path / "file").write_text("")
    reason = r"risk\.csv: cannot be written: .*file: (File exists|Not a directory)"
    with pytest.raises(CatalogError, match=reason):
        written_whole(tmp_path / "file" / "risk.csv").__enter__()


def test_a_full_disk_is_named_in_one_line(tmp_path):
    def fill():
        with written_whole(tmp_path / "risk.csv") as part:
            part.write_text("half")
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    reason = r"risk\.csv: cannot be written: No space left on device; try again when there is room"
    with pytest.raises(WriteError, match=reason):
        fill()
    assert list(tmp_path.iterdir()) == []


class LibraryError(Exception):
    """An error of a library that writes, which is not one of the operating system."""


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EROFS, errno.EACCES, errno.EMFILE])
def test_a_library_that_names_the_failure_in_its_message_only(tmp_path, number):
    # would catch the traceback of a database on a full disk
    reason = os.strerror(number)
    expected = rf"risk\.csv: cannot be written: {reason}; try again"
    with pytest.raises(WriteError, match=expected), written_whole(tmp_path / "risk.csv"):
        raise LibraryError(f'IO Error: Could not write file "x": {reason}')


def test_a_library_that_gives_no_reason_is_asked_for_by_a_probe(tmp_path, monkeypatch):
    # HDF5 states only that it failed
    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def fails():
        with written_whole(tmp_path / "spectra.nc") as part:
            part.write_text("half")
            monkeypatch.setattr(Path, "write_bytes", full)
            raise RuntimeError("NetCDF: HDF error")

    with pytest.raises(WriteError, match=r"spectra\.nc: cannot be written: No space left"):
        fails()
    assert list(tmp_path.iterdir()) == []


def test_a_mistake_of_the_program_is_not_taken_for_a_full_disk(tmp_path):
    reason = "NetCDF: HDF error"
    with pytest.raises(RuntimeError, match=reason), written_whole(tmp_path / "spectra.nc"):
        raise RuntimeError(reason)
    with pytest.raises(FileNotFoundError), written_whole(tmp_path / "risk.csv"):
        (tmp_path / "absent").read_text()
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_must_stay_is_named(tmp_path, monkeypatch):
    remove_file(tmp_path / "absent")

    def refuses(*_, **__):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    monkeypatch.setattr(Path, "unlink", refuses)
    with pytest.raises(WriteError, match=r"risk\.csv: cannot be written: Permission denied"):
        remove_file(tmp_path / "risk.csv")


@pytest.fixture(scope="module")
def ended_process():
    """Return the number of a process that has ended."""
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    return process.pid


def test_part_files_of_ended_processes_are_removed(tmp_path, ended_process):
    # would catch a pattern that does not know a name that written_whole gives
    with written_whole(tmp_path / "chunks" / "000004.json") as part:
        part.write_text("{}")
        name = part.name.replace(str(os.getpid()), str(ended_process))
    left = [tmp_path / "chunks" / name, tmp_path / f".XX.S001.{ended_process}.part.mseed"]
    for path in left:
        path.write_bytes(b"half")
        assert is_part(path)
    (tmp_path / f".spill.{ended_process}.part").mkdir()
    (tmp_path / f".spill.{ended_process}.part" / "block").write_bytes(b"half")
    remove_dead_parts(tmp_path)
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["000004.json", "chunks"]


def test_part_files_that_may_still_be_written_stay(tmp_path, ended_process):
    with written_whole(tmp_path / "risk.csv") as own, temporary_folder(tmp_path) as room:
        own.write_text("half")
        elsewhere = tmp_path / f".risk.{ended_process}@another-machine.part.csv"
        elsewhere.write_text("half")
        remove_dead_parts(tmp_path)
        assert own.exists()
        assert room.exists()
        assert elsewhere.exists()
    assert not room.exists()


@pytest.mark.parametrize(
    "name", ["run.json", ".holder.json", "part.csv", "S001.part.mseed", ".S001.part", "1.part.csv"]
)
def test_other_files_are_no_part_files(tmp_path, name):
    (tmp_path / name).write_text("whole")
    assert not is_part(Path(name))
    remove_dead_parts(tmp_path)
    assert (tmp_path / name).exists()


def test_without_posix_every_process_counts_as_running(ended_process, monkeypatch):
    # on Windows the same call would end the process
    with monkeypatch.context() as patch:
        patch.setattr(files.os, "name", "nt")
        running = files._is_running(ended_process, None)
    assert running
    assert not files._is_running(ended_process, None)


def test_hash_is_sha256(tmp_path):
    file = tmp_path / "abc"
    file.write_bytes(b"abc")  # the first example of FIPS 180-2
    expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
    assert file_hash(file) == bytes_hash(b"abc") == expected


def test_the_hash_of_values_depends_on_them_and_not_on_their_order():
    content = {"a": 1, "b": [1.5, None]}
    assert content_hash(content) == content_hash(dict(reversed(content.items())))
    assert content_hash(content) != content_hash(content | {"a": 2})


@pytest.mark.skipif(os.name != "posix", reason="folders are synchronised on POSIX only")
def test_file_and_folder_are_on_the_disk_around_the_renaming(tmp_path, monkeypatch):
    # would catch an empty file of the final name after a power cut
    steps = []
    synced = os.fsync

    def noted(handle):
        steps.append((os.fstat(handle).st_mode & 0o170000, (tmp_path / "table.csv").exists()))
        synced(handle)

    monkeypatch.setattr(os, "fsync", noted)
    with written_whole(tmp_path / "table.csv") as part:
        part.write_text("gap")
    assert steps == [(stat.S_IFREG, False), (stat.S_IFDIR, True)]


def test_no_place_for_temporary_files_is_no_fault_of_a_file(monkeypatch, tmp_path):
    # tempfile says that a file is missing, which a reader would take for a damaged one
    monkeypatch.setattr(tempfile, "tempdir", None)
    monkeypatch.setattr(tempfile, "_candidate_tempdir_list", lambda: [str(tmp_path / "none")])
    with pytest.raises(WriteError, match="TMPDIR"), files.scratch_folder():
        pass
