"""Flags of a record: from its failed checks and from the reasons of its corners."""

import numpy as np
import pytest
from obspy import Trace, UTCDateTime
from obspy.core import AttribDict

from per_obspy.config import Processing
from per_obspy.processing.account import record_flags, with_flags
from per_obspy.processing.earthquake import fallback_highpass
from per_obspy.processing.instrument import pass_through
from per_obspy.screening.columns import RECORD_FLAGS

TABLE = {-10.0: 0.5, 5.5: 0.1}


def _trace(start="2019-07-06T03:19:53", **known):
    return Trace(np.zeros(3), {"starttime": UTCDateTime(start), "per_obspy": AttribDict(known)})


@pytest.mark.parametrize(
    ("known", "flags"),
    [
        ({}, []),
        ({"highpass_source": "noise", "lowpass_source": "0.75 Nyquist"}, []),
        ({"failed_checks": "baseline_shift second_event"}, ["baseline_shift", "second_event"]),
        ({"failed_checks": "late_trigger cut_off"}, ["record_warning"]),
        ({"failed_checks": "possible_saturation dropout"}, ["clipped", "filled"]),
        ({"failed_checks": "wrapped channel_rate weak_motion"}, ["implausible_record", "wrapped"]),
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
    noted = with_flags(trace)
    assert noted.stats.per_obspy.get("record_flags", "") == " ".join(flags)
    # a step changes its own copy only
    assert dict(trace.stats.per_obspy) == before


@pytest.mark.parametrize("start", ["1970-01-01", "1980-01-06T00:00:12", "1980-01-01"])
def test_a_clock_that_was_never_set_is_a_flag_and_a_warning(start):
    noted = with_flags(_trace(start, warnings="late trigger 3"))
    assert record_flags(noted) == ["undated"]
    assert noted.stats.per_obspy.warnings.startswith("late trigger 3; the start time is unknown")
    # a file that is read back and processed again has each warning once
    again = with_flags(noted)
    assert again.stats.per_obspy.warnings == noted.stats.per_obspy.warnings
    # zeros of the filter begin a day earlier
    padded = _trace(UTCDateTime(start) - 60.0, pad_before=60.0)
    assert record_flags(padded) == ["undated"]


def test_film_is_a_flag_and_a_warning():
    film = _trace()
    film.stats.digitised = True
    noted = with_flags(film)
    assert record_flags(noted) == ["digitised"]
    assert "film" in noted.stats.per_obspy.warnings


def test_a_silent_header_is_an_assumed_corner(earthquake):
    header = {
        "sampling_rate": 100.0,
        "channel": "HNE",
        "units": "m/s2",
        "processing_level": "processed",
    }
    silent = pass_through(Trace(earthquake(), header), Processing())
    assert "assumed_corners" in silent.stats.per_obspy.record_flags.split()
    header["corners"] = AttribDict(highpass=0.1, lowpass=30.0)
    known = pass_through(Trace(earthquake(), header), Processing())
    assert "assumed_corners" not in known.stats.per_obspy.get("record_flags", "")
