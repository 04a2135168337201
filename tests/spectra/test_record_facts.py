"""Facts of the records of a station: peaks of a known motion, sources, warnings and flags."""

import numpy as np
import pytest
from obspy import Stream, Trace
from obspy.core import AttribDict

from per_obspy.spectra.station import header_hypocentre, peak_motions, record_facts


def _trace(channel, source="", **known):
    header = {
        "network": "XX",
        "station": "ONE",
        "location": "00",
        "channel": channel,
        "source": source,
        "instrument": AttribDict(model="K2"),
        "per_obspy": AttribDict(known),
    }
    return Trace(np.zeros(3), header)


def test_peaks_are_those_of_a_sine():
    # a = A w cos(w t): v = A sin(w t)
    time = np.arange(0.0, 2.0, 0.001)
    trace = Trace(0.3 * 5.0 * np.cos(5.0 * time), {"delta": 0.001})
    # step 0.001 s: the trapezoidal rule is off by (w dt)^2 / 12 = 2e-6
    assert peak_motions(trace) == pytest.approx((1.5, 0.3), rel=1e-5)


def test_facts_are_text():
    stream = Stream(
        [
            _trace("HNN", "a/one.evt", record_flags="second_event", warnings="another event: 0.5"),
            _trace("HNE", "a/one.evt", record_flags="baseline_shift"),
            _trace("HNZ", "b/two\udcff\n.evt", warnings="late trigger: 0.2", notes="short"),
        ]
    )
    found = record_facts(stream, list(stream[:2]))
    facts = {name: str(found[name][1]) for name in found}
    # control characters and bytes that are no UTF-8 would stop netCDF or break a table
    assert facts == {
        "source_files": "one.evt, two? .evt",
        "instrument": "00 HN K2",
        "record_level": "raw",
        # flags of the horizontals, warnings of all
        "record_flags": "baseline_shift second_event",
        "warnings": "HNN: another event: 0.5; HNZ: late trigger: 0.2",
        "notes": "HNZ: short",
        "coordinates_source": "",
        "coordinates_conflict": "",
    }


def test_records_processed_by_others_are_marked():
    trace = _trace("HNN")
    trace.stats.processing = ["per_obspy: processed already, passed through"]
    assert record_facts(Stream([trace]), [trace])["record_level"][1] == "processed by others"


def _located(**event):
    """Return a trace whose header has an event."""
    trace = _trace("HNN")
    trace.stats.event = AttribDict(event)
    return trace


def test_a_hypocentre_is_that_of_the_first_header_that_has_all_of_it():
    known = {"longitude": 142.5, "latitude": 41.0, "depth": 30_000.0}
    traces = [_trace("HNN"), _located(longitude=1.0, latitude=2.0, depth=None), _located(**known)]
    assert header_hypocentre(traces) == {f"hypocentre_{name}": known[name] for name in known}
    # nothing is guessed: no depth, no place, 0 and 0 for unknown, no event
    assert header_hypocentre(traces[:2]) == {}
    assert header_hypocentre([_located(longitude=0.0, latitude=0.0, depth=5.0)]) == {}
    assert header_hypocentre([_located(longitude=np.nan, latitude=0.0, depth=5.0)]) == {}
