"""MiniSEED files of processed records, and their descriptions."""

import json
import os
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from obspy import Stream, Trace, read
from obspy.core import AttribDict

from per_obspy.errors import RecordRejected
from per_obspy.records.processed_files import (
    described,
    read_descriptions,
    write_description,
    write_processed,
)


def processed(samples: int = 50) -> Stream:
    """Return two traces with words that MiniSEED has no place for."""
    header = {"network": "CI", "station": "ABCDEFG", "delta": 0.01, "units": "m/s2"}
    header |= {"corners": AttribDict(highpass=0.1), "source": "/folder/raw.mseed"}
    values = np.random.default_rng(1).standard_normal(samples)
    return Stream([Trace(values, header | {"channel": code}) for code in ("HNN", "HNE")])


def write(stream: Stream, path: Path) -> None:
    write_description(path, write_processed(stream, path))


def test_samples_and_words_come_back_exactly(tmp_path: Path):
    path = tmp_path / "CI.ABCDEFG.mseed"
    write(processed(), path)
    for sent, trace in zip(processed(), described(read(str(path)), path), strict=True):
        # in double precision: single precision or Steim compression would round
        assert_array_equal(trace.data, sent.data)
        assert trace.id == sent.id
        assert (trace.stats.units, trace.stats.corners) == ("m/s2", {"highpass": 0.1})


def test_descriptions_name_the_source(tmp_path: Path):
    write(processed(), tmp_path / "a.mseed")
    descriptions = read_descriptions(tmp_path / "a.mseed")
    assert [description["id"] for description in descriptions] == [
        "CI.ABCDEFG..HNN",
        "CI.ABCDEFG..HNE",
    ]
    assert {description["source"] for description in descriptions} == {"raw.mseed"}


def test_a_file_without_a_description_is_unchanged(tmp_path: Path):
    write_processed(processed(), tmp_path / "a.mseed")
    stream = read(str(tmp_path / "a.mseed"))
    assert read_descriptions(tmp_path / "a.mseed") is None
    assert described(stream, tmp_path / "a.mseed") is stream


def test_the_description_of_another_file_is_refused(tmp_path: Path):
    write(processed(), tmp_path / "a.mseed")
    write_processed(processed(samples=51), tmp_path / "a.mseed")
    with pytest.raises(RecordRejected, match=r"a\.json describes another file of this name"):
        read_descriptions(tmp_path / "a.mseed")


def test_the_description_of_other_traces_is_refused(tmp_path: Path):
    write(processed(), tmp_path / "a.mseed")
    with pytest.raises(RecordRejected, match=r"a\.json describes other traces"):
        described(read(str(tmp_path / "a.mseed"))[:1], tmp_path / "a.mseed")


@pytest.mark.parametrize(
    "change",
    [
        {"traces": [{}, {}]},
        {"traces": "none"},
        {"traces": [1, 2]},
        {"delta": "fast"},
        {"coordinates": "here"},
        {"corners": [0.1, 30.0]},
        {"units": 7},
        {"processing": "text"},
        {"sensor_azimuth": "north"},
    ],
)
def test_a_description_that_others_wrote_is_refused(tmp_path: Path, change: dict):
    # the hash is right, the words are not
    path = tmp_path / "a.mseed"
    write(processed(), path)
    note = json.loads(path.with_suffix(".json").read_text())
    words = [{**description, **change} for description in note["traces"]]
    path.with_suffix(".json").write_text(json.dumps({**note, "traces": words, **change}))
    with pytest.raises(RecordRejected, match=r"a\.json is no description of records"):
        described(read(str(path)), path)


def test_a_pipe_or_endless_brackets_are_no_description(tmp_path: Path):
    # would catch a reader that waits for ever, and a traceback of the parser
    path = tmp_path / "a.mseed"
    write_processed(processed(), path)
    path.with_suffix(".json").write_text("[" * 200_000)
    assert read_descriptions(path) is None
    path.with_suffix(".json").unlink()
    os.mkfifo(path.with_suffix(".json"))
    assert read_descriptions(path) is None
