"""The raw record for comparison with its processed one: same time, same samples, no filter."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from obspy import Stream, Trace, UTCDateTime

from per_obspy.config import Processing
from per_obspy.processing.chain import before_processing, process_station

START = UTCDateTime(2020, 1, 1)
SETTINGS = Processing()


def recorded(samples, channel="HNE", **stats):
    noise = 1e-4 * np.random.default_rng(3).normal(size=samples.size)
    header = {"sampling_rate": 100.0, "channel": channel, "units": "m/s2", "starttime": START}
    return Trace(samples + noise, header | stats)


@pytest.mark.parametrize(
    "settings", [SETTINGS, Processing(longest_noise=10.0, longest_signal=50.0)]
)
def test_it_covers_the_processed_time_without_the_pads(earthquake, settings):
    # would catch a start that is wrong by the pad or by the seconds that were cut
    trace = recorded(earthquake() + 0.3)
    processed = process_station(Stream([trace]), settings)[0][0]
    chosen = processed.stats.per_obspy
    before = before_processing(Stream([trace]), processed, settings)
    assert before.stats.starttime - processed.stats.starttime == pytest.approx(chosen.pad_before)
    assert processed.stats.endtime - before.stats.endtime == pytest.approx(chosen.pad_after)
    # the same samples, without the mean of the noise
    first = round((before.stats.starttime - START) * 100)
    same = trace.data[first : first + before.stats.npts]
    quiet = same[: round(chosen.noise * 100)].mean()
    assert_allclose(before.data, same - quiet, atol=1e-12)


def test_the_mean_is_that_of_the_noise(earthquake):
    trace = recorded(earthquake() + 0.3)
    processed = process_station(Stream([trace]), SETTINGS)[0][0]
    before = before_processing(Stream([trace]), processed, SETTINGS)
    assert abs(before.data[:1500].mean()) < 1e-5


def test_another_channel_is_not_it_and_a_record_processed_by_others_has_none(earthquake):
    trace = recorded(earthquake())
    processed = process_station(Stream([trace]), SETTINGS)[0][0]
    others = Stream(
        [recorded(earthquake(2), "HNN"), recorded(earthquake(), processing_level="processed")]
    )
    assert before_processing(others, processed, SETTINGS) is None
    assert before_processing(others + trace, processed, SETTINGS) is not None


def test_inputs_stay_unchanged(earthquake):
    stream = Stream([recorded(earthquake())])
    processed = process_station(stream, SETTINGS)[0][0]
    earlier = stream.copy(), processed.copy()
    before_processing(stream, processed, SETTINGS)
    assert (stream, processed) == earlier
