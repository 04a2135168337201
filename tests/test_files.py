"""A file appears whole or not at all."""

import pytest

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


def test_hash_is_sha256(tmp_path):
    file = tmp_path / "abc"
    file.write_bytes(b"abc")  # the first example of FIPS 180-2
    assert file_hash(file) == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
