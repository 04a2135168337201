"""Hashes of identifiers, by which repeated pairs are found."""

import pyarrow as pa

from per_obspy.inventory.files.raw_rows import name_hashes


def test_equal_identifiers_have_equal_hashes():
    # blanks around an identifier do not count, an empty cell is an empty identifier
    hashes = name_hashes(pa.array(["a", " a ", "b", None, "", "a b"]))
    assert hashes[0] == hashes[1]
    assert hashes[3] == hashes[4]
    assert len(set(hashes.tolist())) == 4


def test_a_hash_is_that_of_every_block():
    # would catch hashes by the order of first occurrence, which differ from block to block
    whole = name_hashes(pa.array(["a", "b", "c"]))
    assert name_hashes(pa.array(["c", "a"])).tolist() == [whole[2], whole[0]]
