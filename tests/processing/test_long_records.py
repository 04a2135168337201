"""Memory that a long record takes, and its numbers against those of the record in one part."""

import gc
import subprocess
import sys
import tracemalloc

import numpy as np
import pytest
from numpy.testing import assert_allclose
from obspy import Stream, Trace, UTCDateTime
from obspy.core.inventory import Response

from per_obspy.config import Processing
from per_obspy.processing import instrument_response, series
from per_obspy.processing.account import taken
from per_obspy.processing.chain import process_station

RATE, MINUTES, GAIN = 200.0, 20, 4e5
COUNT = round(60 * MINUTES * RATE)


def day_in_small(has_event):
    """Return the counts of three components, with an event of a minute in noise or noise alone."""
    rng = np.random.default_rng(3)
    response = Response.from_paz([], [-900.0], GAIN, input_units="M/S**2", output_units="COUNTS")
    response.instrument_sensitivity.value = GAIN
    response.response_stages[0].normalization_factor = 900.0
    time = np.arange(COUNT) / RATE - 0.4 * 60 * MINUTES
    scaled = np.maximum(time, 0) / 5
    envelope = 20 + 4e5 * np.sqrt(scaled) * np.exp(-scaled) if has_event else 2e4
    header = {"network": "XX", "station": "DAY", "sampling_rate": RATE, "units": "counts"}
    header |= {"starttime": UTCDateTime(2020, 1, 1), "response": response}
    return Stream(
        [
            Trace(np.round(envelope * rng.normal(size=COUNT)), header | {"channel": code})
            for code in ("HNE", "HNN", "HNZ")
        ]
    )


@pytest.fixture
def small_parts(monkeypatch):
    """Make parts and zeros as small for the record as they are for a day at 200 Hz."""
    monkeypatch.setattr(series, "BLOCK", 2**14)
    monkeypatch.setattr(instrument_response, "LONGEST_PAD", MINUTES * 60 / 24)


@pytest.mark.usefixtures("small_parts")
@pytest.mark.parametrize("has_event", [True, False])
def test_memory_per_sample_of_a_component_is_bounded(has_event):
    settings = Processing(longest_noise=10.0, longest_signal=60.0)
    process_station(day_in_small(has_event), settings)  # loads what is loaded once
    gc.collect()
    tracemalloc.start()
    stream = day_in_small(has_event)
    tracemalloc.reset_peak()
    process_station(taken(stream), settings)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # Three components of 8 bytes, and at most six arrays of the one that is worked on. A day of
    # 17.28 million samples at 75 bytes each is 1.3 GB beside the libraries
    assert peak / COUNT < 75


def test_parts_do_not_change_the_record(monkeypatch):
    whole, _ = process_station(day_in_small(has_event=False), Processing())
    monkeypatch.setattr(series, "BLOCK", 2**14)
    parts, _ = process_station(day_in_small(has_event=False), Processing())
    for expected, found in zip(whole, parts, strict=True):
        # Sums in another order: rounding of 1e-16 over a hundred thousand samples
        peak = np.abs(expected.data).max()
        assert_allclose(found.data, expected.data, rtol=0, atol=1e-11 * peak)


@pytest.mark.usefixtures("small_parts")
def test_a_stream_that_is_not_handed_over_stays_as_it_was():
    stream = day_in_small(has_event=True)
    before = [trace.data.copy() for trace in stream]
    process_station(stream, Processing())
    assert [trace.stats.channel for trace in stream] == ["HNE", "HNN", "HNZ"]
    assert all(np.array_equal(trace.data, old) for trace, old in zip(stream, before, strict=True))


@pytest.mark.parametrize("count", [0, 1, 3, 4, 9])
def test_blocks_cover_every_place_once(monkeypatch, count):
    monkeypatch.setattr(series, "BLOCK", 4)
    places = [place for block in series.blocks(2, 2 + count) for place in range(50)[block]]
    assert places == list(range(2, 2 + count))


#: Memory that a transform leaves, over that of its record, in a process of its own.
LEFT = """
import numpy as np
from pathlib import Path
from scipy.fft import rfft
from per_obspy.processing import series

def resident():
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096

rfft(np.ones(1000))
record = np.ones(2**21 * 3)
before = resident()
rfft(record)
series.forget_plans(record.size)
print((resident() - before) / record.nbytes)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="reads the memory in /proc")
def test_the_plan_of_a_long_transform_is_not_kept():
    # Of its own, as other tests of a process free and take memory meanwhile
    command = [sys.executable, "-c", LEFT]
    left = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    # The plan has the size of the record; a tenth of it for whatever else has changed
    assert float(left) < 0.1
