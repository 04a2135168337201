"""Checks of SAC headers: coordinates that ObsPy would compute with."""

import io
import struct

import numpy as np
import obspy
import pytest

from per_obspy.errors import RecordRejected
from per_obspy.formats.sac import require_coordinates
from per_obspy.records.obspy_readers import read_bytes_with_obspy


@pytest.fixture(params=["<", ">"])
def content(request) -> bytes:
    """Return a SAC file with the coordinates of a station and an event."""
    trace = obspy.Trace(np.sin(np.arange(100.0)), {"station": "A"})
    trace.stats.sac = {"stla": 10.0, "stlo": 20.0, "evla": 11.0, "evlo": 350.0, "lcalda": 1}
    file = io.BytesIO()
    trace.write(file, format="SAC", byteorder=request.param)
    return file.getvalue()


def changed(content: bytes, place: int, value: float) -> bytes:
    order = "<" if struct.unpack_from("<i", content, 304)[0] in (6, 7) else ">"
    return content[:place] + struct.pack(order + "f", value) + content[place + 4 :]


def test_coordinates_are_read(content: bytes):
    stream = read_bytes_with_obspy(obspy.read, content, "a.sac")
    assert stream[0].stats.sac.evlo == 350.0


# the places of STLA, STLO, EVLA and EVLO in the SAC manual: words 31, 32, 35 and 36
@pytest.mark.parametrize("word", [31, 32, 35, 36])
@pytest.mark.parametrize("value", [1e30, -1e30, np.inf, np.nan, 361.0])
def test_other_numbers_are_refused_before_obspy_turns_them_for_ever(content, word, value):
    with pytest.raises(RecordRejected, match="expected at most 360"):
        read_bytes_with_obspy(obspy.read, changed(content, 4 * word, value), "a.sac")


def test_fields_that_are_not_given_are_no_coordinates(content: bytes):
    require_coordinates(changed(content, 4 * 36, -12345.0), "a.sac")
