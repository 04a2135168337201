"""A file appears whole or not at all."""

import errno
import os

import pytest

from per_obspy.errors import CatalogError
from per_obspy.files import file_hash, written_whole


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


def test_what_cannot_be_written_is_said_in_one_line(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(
        CatalogError, match=r"risk\.csv: cannot be written: .*file: (File exists|Not a directory)"
    ):
        written_whole(tmp_path / "file" / "risk.csv").__enter__()

    def fill():
        with written_whole(tmp_path / "risk.csv") as part:
            part.write_text("half")
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with pytest.raises(CatalogError, match=r"risk\.csv: cannot be written: No space left"):
        fill()
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_hash_is_sha256(tmp_path):
    file = tmp_path / "abc"
    file.write_bytes(b"abc")  # the first example of FIPS 180-2
    assert file_hash(file) == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
