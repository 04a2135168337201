"""Flags of a record: from its failed checks and from the reasons of its corners."""

import numpy as np
import pytest
from obspy import Stream, Trace
from obspy.core import AttribDict

from per_obspy.config import Processing
from per_obspy.processing.already_processed import passed_through
from per_obspy.processing.filter.corners import fallback_highpass
from per_obspy.processing.quality.record_flags import flags_noted, record_flags
from per_obspy.screening.columns import RECORD_FLAGS

TABLE = {-10.0: 0.5, 5.5: 0.1}


def _trace(**known):
    return Trace(np.zeros(3), {"per_obspy": AttribDict(known)})


@pytest.mark.parametrize(
    ("known", "flags"),
    [
        ({}, []),
        ({"highpass_source": "noise", "lowpass_source": "0.75 Nyquist"}, []),
        ({"failed_checks": "baseline_shift second_event"}, ["baseline_shift", "second_event"]),
        ({"failed_checks": "late_trigger cut_off"}, ["record_warning"]),
        ({"highpass_source": fallback_highpass(6.0, TABLE, 0.08).reason}, ["assumed_corners"]),
        ({"highpass_source": fallback_highpass(None, TABLE, 0.08).reason}, ["assumed_corners"]),
        (
            {"highpass_source": "highest allowed: the baseline shifts during the shaking"},
            ["baseline_shift"],
        ),
        # flags of an earlier processing stay when its file is read back
        ({"record_flags": "second_event", "highpass_source": "header"}, ["second_event"]),
    ],
)
def test_flags_of_a_record(known, flags):
    trace = _trace(**known)
    assert record_flags(trace) == flags
    assert set(flags) <= set(RECORD_FLAGS)
    before = dict(trace.stats.per_obspy)
    (noted,) = flags_noted(Stream([trace]))
    assert noted.stats.per_obspy.get("record_flags", "") == " ".join(flags)
    # a step changes its own copy only
    assert dict(trace.stats.per_obspy) == before


def test_a_silent_header_is_an_assumed_corner(earthquake):
    header = {
        "sampling_rate": 100.0,
        "channel": "HNE",
        "units": "m/s2",
        "processing_level": "processed",
    }
    silent = passed_through(Stream([Trace(earthquake(), header)]), Processing())[0]
    assert "assumed_corners" in silent.stats.per_obspy.record_flags.split()
    header["corners"] = AttribDict(highpass=0.1, lowpass=30.0)
    known = passed_through(Stream([Trace(earthquake(), header)]), Processing())[0]
    assert "assumed_corners" not in known.stats.per_obspy.get("record_flags", "")
