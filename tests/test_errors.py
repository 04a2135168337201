"""Errors name file and field in one line, and are the built-in errors they amount to."""

import pickle
from unicodedata import category

import pytest

from per_obspy.errors import (
    CatalogError,
    FolderInUse,
    PerError,
    RecordRejected,
    ServiceError,
    TryLater,
    WriteError,
    did_you_mean,
    printable,
    reason_of,
    shortened,
)


@pytest.mark.parametrize(
    ("error", "built_in"),
    [
        (RecordRejected, ValueError),
        (CatalogError, ValueError),
        (WriteError, OSError),
        (FolderInUse, BlockingIOError),
    ],
)
def test_errors_are_also_built_in(error, built_in):
    assert issubclass(error, PerError)
    assert issubclass(error, built_in)
    assert issubclass(ServiceError, ConnectionError)


@pytest.mark.parametrize("error", [ServiceError, WriteError, FolderInUse])
def test_what_passes_by_itself_is_no_wrong_input(error):
    assert issubclass(error, TryLater)
    assert not issubclass(error, CatalogError)


def test_every_reason_is_in_the_text():
    assert (
        str(RecordRejected("CI.CLC", "clipped at 2 g", "too short: 3 s"))
        == "CI.CLC: clipped at 2 g; too short: 3 s"
    )


@pytest.mark.parametrize(
    "error",
    [
        RecordRejected("CI.CLC", "a", "b"),
        CatalogError("pairs.csv", "no column gap"),
        WriteError("risk.csv", "No space left on device"),
        FolderInUse("out", "process 4711"),
    ],
)
def test_errors_come_back_from_a_worker_process_as_they_left(error):
    assert str(pickle.loads(pickle.dumps(error))) == str(error)


def test_a_mistyped_word_is_asked_about_and_a_strange_one_is_not():
    known = ["height_1", "gap", "system_1"]
    assert did_you_mean("Hieght_1", known) == ", did you mean height_1?"
    assert did_you_mean("GAP", known) == ", did you mean gap?"
    assert did_you_mean("owner", known) == ""


def test_what_an_error_says(tmp_path):
    with pytest.raises(FileNotFoundError) as error:
        (tmp_path / "absent").read_text()
    assert reason_of(error.value) == "No such file or directory"
    assert (
        reason_of(OSError("Corrupt snappy compressed data.")) == "Corrupt snappy compressed data."
    )


def test_messages_quote_a_bounded_part_of_a_file():
    # a word of a million characters once came back whole
    for error in (RecordRejected("n" * 10**6, "w" * 10**6), CatalogError("file", "w" * 10**6)):
        assert len(str(error)) < 2100
        assert str(pickle.loads(pickle.dumps(error))) == str(error)


def test_texts_on_one_line_follow_the_categories_of_unicode():
    """Every hundredth character, alone and within a text: C becomes a blank, Z in short texts."""
    for code in [*range(0x300), *range(0x2000, 0x2070), *range(0x300, 0x110000, 100)]:
        kinds = category(chr(code))
        alone = "?" if kinds == "Cs" else " " if kinds[0] == "C" else chr(code)
        assert printable(f"a{chr(code)}b") == f"a{alone}b"
        assert shortened(f"a{chr(code)}b") == ("a b" if kinds[0] == "Z" else f"a{alone}b")
