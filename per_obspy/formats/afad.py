"""AFAD (Türkiye, TADAS): DYNA's header below a few other lines, one component per file."""

from typing import Any

from obspy import Stream

from per_obspy.formats.text.dyna_header import read_dyna_text
from per_obspy.formats.text.lines import WaveformFile, head, read_text


def is_afad(file: WaveformFile) -> bool:
    """Check whether a file starts like a record of AFAD."""
    return head(file, 4) == b"AAD_"


def read_afad(file: WaveformFile, **_unused: Any) -> Stream:
    """Read a record of AFAD: one component, m/s2."""
    return read_dyna_text(read_text(file), 1)
