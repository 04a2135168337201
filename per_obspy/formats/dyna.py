"""DYNA 1.x of ESM and ITACA (``.ASC``), one component per file."""

from typing import Any

from obspy import Stream

from per_obspy.formats.text.dyna_header import read_dyna_text
from per_obspy.formats.text.lines import WaveformFile, head, read_text


def is_dyna(file: WaveformFile) -> bool:
    """Check whether a file starts like DYNA."""
    start = head(file, 300)
    return start.startswith(b"EVENT_NAME:") and b"\nEVENT_DATE_YYYYMMDD:" in start


def read_dyna(file: WaveformFile, **_unused: Any) -> Stream:
    """Read a DYNA record: one component, m/s2 (or m/s, m)."""
    return read_dyna_text(read_text(file), 0)
