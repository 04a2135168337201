"""Small records for archives."""

import io

import numpy as np
from obspy import Stream, Trace

AT2 = b"""PEER NGA STRONG MOTION DATABASE RECORD
Some Event, 7/21/1952, Some School, 21
ACCELERATION TIME SERIES IN UNITS OF G
NPTS=      3, DT=   .0100 SEC,
  .1E+00 .2E+00 -.3E+00
"""


def mseed(station: str) -> bytes:
    file = io.BytesIO()
    header = {"network": "CI", "station": station, "channel": "HNN", "delta": 0.01}
    Stream([Trace(np.arange(300, dtype=np.int32), header)]).write(file, format="MSEED")
    return file.getvalue()
