"""AFAD (Türkiye, TADAS): DYNA's header below a line of its own, one component per file."""

from typing import Any

from obspy import Stream

from per_obspy.formats.dyna import read_component
from per_obspy.formats.text.lines import WaveformFile, head, read_text


def is_afad(file: WaveformFile) -> bool:
    """Check whether a file starts like a record of AFAD."""
    return head(file, 4) == b"AAD_"


def read_afad(file: WaveformFile, **_unused: Any) -> Stream:
    """Read a record of AFAD: one component, m/s2."""
    return read_component(read_text(file), 1)
