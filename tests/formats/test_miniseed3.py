"""MiniSEED 3, against records that are built here byte by byte from the FDSN's definition."""

import io
import json
import struct
import subprocess
import sys

import numpy as np
import obspy
import pytest
from obspy import Stream, Trace, UTCDateTime

from per_obspy.errors import RecordRejected
from per_obspy.formats.miniseed3 import is_miniseed3, read_miniseed3, write_miniseed3
from per_obspy.records.obspy_readers import read_bytes_with_obspy

#: Encodings of the definition -> type of their samples in little endian.
TYPES = {1: "<i2", 3: "<i4", 4: "<f4", 5: "<f8"}


def checksum(content: bytes) -> int:
    """Return the CRC-32C of bytes, bit by bit."""
    value = 0xFFFFFFFF
    for byte in content:
        value ^= byte
        for _ in range(8):
            value = (value >> 1) ^ (0x82F63B78 * (value & 1))
    return value ^ 0xFFFFFFFF


def record(
    samples: list[float],
    second: int = 0,
    encoding: int = 3,
    source: str = "FDSN:XX_ABC_00_H_N_Z",
    rate: float = 10.0,
    extra: str = "",
    nanosecond: int = 0,
) -> bytes:
    """Return a record of 1 January 2024 by the definition's layout of 40 bytes and what follows."""
    data = np.array(samples, TYPES[encoding]).tobytes()
    names, headers = source.encode(), extra.encode()
    start = (nanosecond, 2024, 1, 0, 0, second, encoding, rate, len(samples))
    sizes = (2, len(names), len(headers), len(data))
    layout = "<2sBBIHHBBBBdIIBBHI"

    def joined(check: int) -> bytes:
        return struct.pack(layout, b"MS", 3, 4, *start, check, *sizes) + names + headers + data

    return joined(checksum(joined(0)))


def test_the_checksum_is_that_of_its_definition():
    # the check value of CRC-32C that is published with the algorithm
    assert checksum(b"123456789") == 0xE3069283


@pytest.mark.parametrize("encoding", TYPES)
def test_samples_of_every_plain_encoding(encoding):
    content = record([1, -2, 300], encoding=encoding, nanosecond=123_456_789)
    (trace,) = read_bytes_with_obspy(obspy.read, content, "a.mseed")
    assert trace.id == "XX.ABC.00.HNZ"
    assert trace.data.tolist() == [1, -2, 300]
    assert trace.stats.sampling_rate == 10.0
    assert trace.stats.starttime.ns == UTCDateTime(2024, 1, 1).ns + 123_456_789


def test_records_of_channels_that_alternate_are_joined():
    east = "FDSN:XX_ABC_00_H_N_E"
    parts = [record([k] * 10, k, source=name) for k in range(3) for name in (east, east[:-1] + "N")]
    stream = read_miniseed3(io.BytesIO(b"".join(parts)))
    assert [trace.id for trace in stream] == ["XX.ABC.00.HNE", "XX.ABC.00.HNN"]
    assert all(trace.data.tolist() == [0] * 10 + [1] * 10 + [2] * 10 for trace in stream)


@pytest.mark.parametrize("second", [2, 0], ids=["gap", "overlap"])
def test_a_gap_or_an_overlap_begins_a_trace(second):
    content = record([1] * 10) + record([2] * 10, second)
    assert len(read_miniseed3(io.BytesIO(content))) == 2


def test_extra_headers_flags_and_long_codes_are_kept_and_written():
    extra = {"FDSN": {"Time": {"Quality": 60}}}
    parts = [record([1] * 10), record([2] * 10, 1, extra=json.dumps(extra))]
    (trace,) = read_miniseed3(io.BytesIO(b"".join(parts)))
    assert trace.stats.mseed3.extra_headers == [(10, extra)]
    assert (trace.stats.mseed3.publication_version, trace.stats.mseed3.flags) == (2, 4)
    again = io.BytesIO()
    trace.stats.station = "LONGSTATION"
    write_miniseed3(Stream([trace]), again)
    (copy,) = read_miniseed3(io.BytesIO(again.getvalue()))
    assert copy.id == "XX.LONGSTATION.00.HNZ"
    assert copy.data.tolist() == trace.data.tolist()
    assert copy.stats.mseed3.extra_headers == trace.stats.mseed3.extra_headers
    assert (copy.stats.mseed3.publication_version, copy.stats.mseed3.flags) == (2, 4)


@pytest.mark.parametrize("encoding", ["STEIM1", "STEIM2", "INT32", "FLOAT32", "FLOAT64"])
def test_what_obspy_writes_by_this_plugin_it_reads_again(encoding):
    kind = {"FLOAT32": "float32", "FLOAT64": "float64"}.get(encoding, "int32")
    samples = (1e4 * np.sin(np.arange(20_000) / 7)).astype(kind)
    header = {"network": "XX", "station": "A", "channel": "HNE", "sampling_rate": 200.0}
    file = io.BytesIO()
    Stream([Trace(samples, header)]).write(file, format="MSEED3", encoding=encoding)
    file.seek(0)
    (trace,) = obspy.read(file)
    assert (trace.data.dtype, trace.id) == (samples.dtype, "XX.A..HNE")
    np.testing.assert_array_equal(trace.data, samples)


def test_heads_have_times_and_counts_but_no_samples():
    content = record([1] * 10) + record([2] * 10, 1)
    (trace,) = read_miniseed3(io.BytesIO(content), headonly=True)
    assert (trace.stats.npts, trace.data.size) == (20, 0)


def test_texts_beside_numbers_are_left_out():
    text = record([1] * 4, encoding=1, source="FDSN:XX_ABC__L_O_G", rate=0.0)
    text = bytearray(text)
    # encoding 0 is text; two bytes a number become two letters, so that the count doubles
    text[15], text[24:28], text[28:32] = 0, struct.pack("<I", 8), bytes(4)
    text[28:32] = struct.pack("<I", checksum(bytes(text)))
    (trace,) = read_miniseed3(io.BytesIO(bytes(text) + record([5, 6])))
    assert trace.data.tolist() == [5, 6]
    with pytest.raises(RecordRejected, match="only texts"):
        read_miniseed3(io.BytesIO(bytes(text)))


def damaged(content: bytes) -> bytes:
    return content[:-1] + bytes([content[-1] ^ 1])


GOOD = record([1] * 10)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (GOOD + damaged(record([2] * 10, 1)), "record 2: .*CRC"),
        (GOOD + record([2] * 10, 1)[:-3], "record 2: .*[Ii]ncomplete"),
        (GOOD + b"MS\x03", "record 2: "),
        (record([1], source="XFDSN:ABC"), "source identifier 'XFDSN:ABC'"),
        (record([1], rate=0.0), "sample rate: 0 Hz"),
        (record([1], rate=np.nan), "[Ss]ample rate: nan"),
        (record([1], extra="{no"), "extra headers"),
    ],
    ids=["checksum", "cut", "start", "source", "no-rate", "nan-rate", "extra"],
)
def test_damaged_records_reject_the_file_with_their_number(content, reason):
    assert is_miniseed3(io.BytesIO(content))
    with pytest.raises(RecordRejected, match=f"a.mseed: .*{reason}"):
        read_bytes_with_obspy(obspy.read, content, "a.mseed")


def test_wrong_types_and_encodings_are_refused_by_name():
    masked = np.ma.masked_less(np.arange(5, dtype="int32"), 2)
    for samples, options, message in (
        (np.arange(5, dtype="int64"), {}, "got int64"),
        (masked, {}, "without a mask"),
        (np.arange(5, dtype="float32"), {"encoding": "STEIM2"}, "one of FLOAT32, got 'STEIM2'"),
    ):
        with pytest.raises(ValueError, match=message):
            write_miniseed3(Stream([Trace(samples)]), io.BytesIO(), **options)


def test_without_the_library_a_file_is_rejected_with_the_command_that_installs_it():
    # an import of None is that of a module that is not there
    code = (
        "import io, sys, importlib.util as u; find = u.find_spec\n"
        "import per_obspy.errors as e\n"
        "e.find_spec = lambda name: None if name == 'pymseed' else find(name)\n"
        "from per_obspy.formats.miniseed3 import read_miniseed3\n"
        "try: read_miniseed3(io.BytesIO(b'MS\\x03'))\n"
        "except e.RecordRejected as error: print(error)\n"
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "per_obspy[miniseed3]" in said.stdout
