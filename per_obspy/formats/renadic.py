"""RENADIC (Universidad de Chile): volume 1 in CSMIP's layout, mostly without place and time."""

from typing import Any

from obspy import Stream

from per_obspy.formats import csmip
from per_obspy.formats.text.lines import WaveformFile


def is_renadic(file: WaveformFile) -> bool:
    """Check whether a file starts like a record of RENADIC."""
    return csmip.volume_1_agency(file) == "RENADIC"


def read_renadic(file: WaveformFile, **_unused: Any) -> Stream:
    """Read a record of RENADIC: uncorrected acceleration of all channels, m/s2."""
    return csmip.read_volume_1(file)
