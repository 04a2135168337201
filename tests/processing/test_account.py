"""Notes on a trace, failed checks, flags, and rows of rejected traces."""

import numpy as np
import pytest
from obspy import Stream, Trace, UTCDateTime
from obspy.core import AttribDict
from obspy.core.inventory import Response

from per_obspy.config import Check, Checks, Processing
from per_obspy.errors import RecordRejected
from per_obspy.processing.account import (
    SILENT_HEADER,
    Finding,
    Findings,
    copy_header,
    is_processed,
    judge,
    record_flags,
    rejection,
    survivors,
    taken,
    trusting,
    with_flags,
    with_note,
)
from per_obspy.processing.chain import pass_through
from per_obspy.processing.earthquake import fallback_highpass
from per_obspy.screening.meanings import RECORD_FLAGS


def test_a_copy_is_equal_and_shares_nothing_but_samples_and_response():
    header = {
        "station": "STA",
        "delta": 0.02,
        "starttime": UTCDateTime(2020, 1, 1),
        "corners": AttribDict(highpass=0.1),
    }
    trace = Trace(np.arange(5.0), header | {"response": Response(), "processing": ["one"]})
    before, out = trace.copy(), copy_header(trace)
    assert out == trace
    assert out.stats.response is trace.stats.response
    assert out.data is trace.data
    # New samples and notes are those of the copy alone
    out.data, out.stats.corners.highpass = out.data + 7.0, 0.2
    out.stats.processing.append("two")
    assert trace == before  # would catch a copy of the header that is not deep


def test_traces_that_are_taken_leave_their_stream():
    first, second = Trace(np.zeros(3)), Trace(np.ones(3))
    stream = Stream([first, second])
    remaining = [(trace, len(stream)) for trace in taken(stream)]
    assert [count for _, count in remaining] == [1, 0]
    assert remaining[0][0] is first
    assert remaining[1][0] is second


def test_masked_samples_stay_masked():
    data = np.ma.masked_equal(np.arange(5.0), 2.0)
    assert copy_header(Trace(data)).data.mask.tolist() == data.mask.tolist()


def test_steps_are_listed_and_numbers_are_replaced():
    given = Trace(np.zeros(3))
    trace = with_note(given, "first step", corner=0.1)
    trace = with_note(trace, "second step", corner=0.2, order=5)
    assert "processing" not in given.stats
    assert trace.stats.processing == ["per_obspy: first step", "per_obspy: second step"]
    assert trace.stats.per_obspy == {"corner": 0.2, "order": 5}


def test_a_rejection_names_trace_and_file():
    trace = Trace(np.zeros(3), {"channel": "HNE", "source": "a.mseed"})
    row = rejection(trace, "first", "second")
    assert row == ("record", "...HNE", "a.mseed", None, ("first", "second"))


def test_only_the_level_processed_counts_as_processed():
    levels = ("processed", "raw", "unknown")
    traces = [Trace(header={"processing_level": level}) for level in levels]
    assert [is_processed(trace) for trace in [*traces, Trace()]] == [True, False, False, False]


def test_thresholds_belong_to_the_good_side():
    limit = Check(threshold=2.0, level="warn")
    findings = Findings(Checks(duration=limit, outlier=limit))
    assert not findings.compare("duration", 2.0)
    assert not findings.compare("outlier", 2.0, "HNE")
    assert findings.compare("duration", 1.5)
    assert findings.compare("outlier", 2.5, "HNE")
    assert findings == [
        ("duration", "warn", "duration, s: 1.5, needs 2"),
        ("outlier", "warn", "peak over that of HNE: 2.5, allowed 2"),
    ]


def test_levels_decide_what_a_finding_means():
    trace = Trace(np.zeros(3), {"channel": "HNE"})
    accepted = judge(
        trace,
        [Finding("a", "warn", "one"), Finding("b", "note", "two"), Finding("c", "warn", "three")],
    )
    assert (accepted.stats.per_obspy.warnings, accepted.stats.per_obspy.notes) == (
        "one; three",
        "two",
    )
    assert accepted.stats.per_obspy.failed_checks == "a c"  # not b, which only notes
    with pytest.raises(RecordRejected) as caught:
        judge(
            accepted,
            [
                Finding("d", "reject", "four"),
                Finding("e", "reject", "five"),
                Finding("f", "warn", "six"),
            ],
        )
    assert caught.value.reasons == ("four", "five", "one; three", "six")
    assert "per_obspy" not in trace.stats


def test_records_of_trusted_stations_pass_checks_of_plausibility_alone():
    trace = _trace()
    findings = Findings(trusting(Checks()))
    findings.compare("impossible_acceleration", 100.0)
    accepted = judge(trace, findings)
    # used, flagged, and said to be
    (reason,) = accepted.stats.per_obspy.warnings.split("; ")
    assert reason.endswith("100, allowed 86 (used: records.trust)")
    assert record_flags(accepted) == ["implausible_record"]
    # what a recorder lost, trust does not bring back; what warns anyway needs no trust
    findings.compare("unusual_velocity", 4.0, "HNE")
    assert "trust" not in findings[-1].reason
    findings.add("clipped_run", "clipped: 9 equal samples")
    with pytest.raises(RecordRejected):
        judge(trace, findings)


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
        ({"lowpass_source": f"0.75 Nyquist, {SILENT_HEADER}"}, ["assumed_corners"]),
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


def test_film_and_a_nominal_sensitivity_are_flags_and_warnings():
    film = _trace(conversion="sensitivity")
    film.stats.digitised = True
    noted = with_flags(film)
    assert record_flags(noted) == ["digitised", "nominal_sensitivity"]
    assert "film" in noted.stats.per_obspy.warnings
    assert "no stages of the response" in noted.stats.per_obspy.warnings
    # a response with stages, and a factor of a reader, say nothing of the kind
    for conversion in ("response", "calibration factor"):
        assert record_flags(_trace(conversion=conversion)) == []


def test_a_bad_trace_is_rejected_alone():
    # a step that refuses one channel
    def picky(trace):
        if trace.stats.channel == "HNE":
            raise RecordRejected(trace.id, "first", "second")
        return trace

    traces = [Trace(np.zeros(3), {"channel": channel}) for channel in ("HNE", "HNN")]
    accepted, rejected = survivors(picky, traces)
    assert [trace.stats.channel for trace in accepted] == ["HNN"]
    assert rejected[0].reasons == ("first", "second")


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
