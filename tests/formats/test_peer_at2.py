"""PEER AT2, VT2 and DT2."""

import io
from pathlib import Path

import numpy as np
import obspy
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from per_obspy.config import Processing
from per_obspy.errors import RecordRejected
from per_obspy.formats.peer_at2 import read_at2, write_at2
from per_obspy.processing.chain import pass_through

NAMED = """PEER NGA STRONG MOTION DATABASE RECORD
Kern County, 7/21/1952, Taft Lincoln School, 21
ACCELERATION TIME SERIES IN UNITS OF G
NPTS=      7, DT=   .0100 SEC,
  -.5000000E-03   .2500000E-03   .0000000E+00   .1000000E+01  -.2000000E+01
   .3000000E-02   .4000000E-02
"""
PLAIN = """PEER STRONG MOTION DATABASE RECORD. PROCESSING BY PACIFIC ENGINEERING.
NORTHRIDGE 1/17/94 12:31, PARDEE, UP
VELOCITY TIME HISTORY IN UNITS OF CM/S. FILTER POINTS: HP=0.1 Hz LP=30.0 Hz
   3    0.0200    NPTS, DT
  1.0 2.0
  -3.0
"""


def read(content: str) -> obspy.Trace:
    return read_at2(io.BytesIO(content.encode("latin-1")))[0]


def test_gravity_turns_g_into_metres_per_second_squared():
    trace = read(NAMED)
    # the standard value of gravity is exact
    assert_allclose(
        trace.data, 9.80665 * np.array([-5e-4, 2.5e-4, 0, 1, -2, 3e-3, 4e-3]), rtol=1e-15
    )
    assert trace.stats.units == "m/s2"
    assert trace.stats.delta == 0.01


def test_the_title_tells_event_station_date_and_direction():
    stats = read(NAMED).stats
    assert stats.event.name == "Kern County"
    assert stats.station_name == "Taft Lincoln School"
    assert stats.sensor_azimuth == 21
    assert stats.starttime == obspy.UTCDateTime(1952, 7, 21)
    assert stats.channel == "HN1"


def test_the_older_header_with_velocity():
    trace = read(PLAIN)
    assert_allclose(trace.data, [0.01, 0.02, -0.03], rtol=1e-15)
    assert (trace.stats.units, trace.stats.quantity) == ("m/s", "velocity")
    assert trace.stats.delta == 0.02
    assert trace.stats.sensor_dip == -90
    assert trace.stats.corners == {"highpass": 0.1, "lowpass": 30.0}
    assert trace.stats.starttime.year == 1994  # two digits: records began in 1933


@pytest.mark.parametrize(
    ("line_end", "corners"),
    [
        # Taft 1952: the line is cut after 80 characters
        (
            "   0 POLE @    13.90000 HZ,  -5 POLE @      .10000",
            {"highpass": 0.1, "lowpass": 13.9},
        ),
        ("   5 POLE @ 30.00000 HZ, -5 POLE @ .10000 HZ", {"highpass": 0.1, "lowpass": 30.0}),
        ("  -5 POLE @ .08000 HZ", {"highpass": 0.08}),
        (" -4 Poles @ 0.2 Hz", {"highpass": 0.2}),
        ("+4 pole @ 25. hz", {"lowpass": 25.0}),
        # no filter: the displacement has to show how far it is clean
        ("  -0 POLE @ .10000 HZ", {}),
        ("   0 POLE @ .00000 HZ,   0 POLE @ .00000 HZ", {}),
        # a low-pass corner below the high-pass one, and a number that overflowed
        ("   5 POLE @ .10000 HZ, -5 POLE @ 30.00000 HZ", {}),
        ("  -5 POLE @ ******** HZ", {}),
        ("", {}),
    ],
)
def test_corners_in_the_line_of_sizes(line_end: str, corners: dict):
    trace = read(NAMED.replace(".0100 SEC,", f".0100 SEC, {line_end}"))
    assert trace.stats.get("corners", {}) == corners
    assert (trace.stats.npts, trace.stats.delta) == (7, 0.01)


def test_corners_of_a_real_record(real_data: Path):
    trace = obspy.read(real_data / "records" / "peer_at2" / "RSN15_KERN_TAF021.AT2")[0]
    assert trace.stats.corners == {"highpass": 0.1, "lowpass": 13.9}
    passed = pass_through(trace, Processing()).stats.per_obspy
    assert_allclose(passed.longest_period, 0.8 / 0.1, rtol=1e-12)


@pytest.mark.parametrize(
    ("points", "corners"),
    [
        ("HP=.1 Hz LP=30. Hz", {"highpass": 0.1, "lowpass": 30.0}),
        ("HP=0.08 HZ LP=NULL HZ", {"highpass": 0.08}),
    ],
)
def test_corners_in_the_line_of_units(points: str, corners: dict):
    text = PLAIN.replace("HP=0.1 Hz LP=30.0 Hz", points)
    assert read(text).stats.corners == corners


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "NPTS=      7",
            "NPTS=      8",
            "line 6, samples: the header promises 8, the file holds 7",
        ),
        (
            "NPTS=      7",
            "NPTS=      6",
            "line 6, samples: the header promises 6, the file holds 7",
        ),
        ("NPTS=      7", "NPTS=     -7", "line 4, NPTS: must be a positive whole number, got '-7'"),
        ("NPTS=      7", "NPTS=    ***", "line 4, NPTS: '\\*\\*\\*' is not a number"),
        (".0100 SEC", "0 SEC", "line 4, DT: must be positive and plausible, got '0'"),
        (".2500000E-03", "************", "line 5, samples: '\\*+' is not a number"),
        (".2500000E-03", "NaN", "line 5, samples: 'NaN' is not a number"),
        ("7/21/1952", "7/41/1952", r"line 2, date: \(1952, 7, 41\)"),
    ],
)
def test_faults_name_file_line_and_field(tmp_path: Path, old: str, new: str, message: str):
    path = tmp_path / "bad.AT2"
    path.write_text(NAMED.replace(old, new))
    with pytest.raises(RecordRejected, match=rf"bad\.AT2: {message}"):
        read_at2(path)


def test_written_and_read_again(tmp_path: Path):
    stream = obspy.Stream([read(NAMED)])
    before = stream.copy()
    path = tmp_path / "again.AT2"
    stream.write(str(path), format="PEER_AT2")
    again = obspy.read(str(path))[0]
    # eight significant digits are written
    assert_allclose(again.data, stream[0].data, rtol=5e-8)
    for word in (
        "station",
        "starttime",
        "delta",
        "channel",
        "sensor_azimuth",
        "event",
        "station_name",
    ):
        assert again.stats[word] == stream[0].stats[word]
    assert_array_equal(stream[0].data, before[0].data)


def test_only_one_trace_of_acceleration_can_be_written(tmp_path: Path):
    trace = read(NAMED)
    with pytest.raises(ValueError, match="holds one trace, got 2"):
        write_at2(obspy.Stream([trace, trace]), tmp_path / "two.AT2")
    trace.stats.units = "counts"
    with pytest.raises(ValueError, match="got 'counts'"):
        write_at2(obspy.Stream([trace]), tmp_path / "raw.AT2")


@pytest.mark.parametrize(
    "words",
    ["DT= .0050 SEC, 5 POLE @ 30.00000 HZ, -5 POLE @ .08000 HZ", "DT= .0050 SEC, -5 POLE @ .08000"],
)
def test_the_corner_of_the_header_sets_the_longest_usable_period(words: str):
    # A pulse of 0.9 m/s with a drifting displacement, as near a fault: from the drift alone it
    # would end early
    times = 0.005 * np.arange(3000)
    samples = np.where(np.abs(times - 3) < 1, np.sin(np.pi * (times - 2)) + 0.3, 0.0)
    header = [*NAMED.split("\n")[:3], f"NPTS= {times.size}, {words}"]
    body = [f"{0.1 * value:.7E}" for value in samples]
    stream = obspy.Stream([read("\n".join(header + body))])
    settings = Processing()
    # 0.8 / HP (Boore and others): 10 s
    longest = pass_through(stream[0], settings).stats.per_obspy.longest_period
    assert_allclose(longest, 10.0, rtol=1e-12)
    # Without it the displacement decides
    del stream[0].stats.corners["highpass"]
    assert pass_through(stream[0], settings).stats.per_obspy.longest_period < 5.0
