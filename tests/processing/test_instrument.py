"""One instrument through all steps, and records that others have processed."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from obspy import Stream, Trace, UTCDateTime
from obspy.core import AttribDict
from scipy.integrate import cumulative_trapezoid

from per_obspy.config import Processing
from per_obspy.processing.chain import (
    pass_through,
    process,
    process_instrument,
    process_instruments,
    process_station,
)
from per_obspy.processing.earthquake import Source
from per_obspy.processing.filter.butterworth import acausal_bandpass

START = UTCDateTime(2020, 1, 1)
SETTINGS = Processing()


@pytest.fixture(scope="module")
def record(earthquake):
    """Return a function that makes one component of a record with a little noise."""

    def make(channel="HNE", seed=1, factor=1.0, onset=20.0, **stats):
        noise = 1e-4 * np.random.default_rng(seed + 50).normal(size=12000)
        header = {
            "network": "XX",
            "station": "STA",
            "channel": channel,
            "sampling_rate": 100.0,
            "units": "m/s2",
            "starttime": START,
            # verticals point upwards
            "sensor_dip": -90.0 if channel.endswith("Z") else 0.0,
            "per_obspy": AttribDict(),
        }
        return Trace(factor * (earthquake(seed, onset=onset) + noise), header | stats)

    return make


def test_horizontals_share_their_corners_and_the_vertical_has_its_own(record):
    three = Stream([record("HNE", 1), record("HNN", 2), record("HNZ", 3)])
    out, rejected = process_instrument(three, SETTINGS, None)
    assert rejected == ()
    codes = ("HNE", "HNN", "HNZ")
    east, north, vertical = (out.select(channel=code)[0].stats.per_obspy for code in codes)
    # the narrower of the two bands
    assert east.highpass == north.highpass == max(east.own_highpass, north.own_highpass)
    assert "own_highpass" not in vertical
    assert {"shared"} < {east.highpass_source, north.highpass_source}


def test_one_bad_horizontal_does_not_decide_the_corners_of_the_other(record):
    alone, _ = process_instrument(Stream([record("HNE")]), SETTINGS, None)
    broken = record("HNN", 2)
    broken.data = np.random.default_rng(3).normal(size=12000)  # no signal at all
    both, rejected = process_instrument(Stream([record("HNE"), broken]), SETTINGS, None)
    assert [row.name for row in rejected] == ["XX.STA..HNN"]
    assert both[0].stats.per_obspy.highpass == alone[0].stats.per_obspy.highpass


@pytest.mark.parametrize(("size", "corner"), [(4.0, 0.3), (6.0, 0.1)])
def test_without_noise_the_magnitude_decides_from_event_or_header(record, size, corner):
    # a record that starts half a second before the wave
    source = Source(START, 0.0, 0.0, 1e4, size)
    by_event, _ = process_instrument(Stream([record(onset=0.5)]), SETTINGS, source)
    late = record(onset=0.5, event=AttribDict(magnitude=size))
    by_header, _ = process_instrument(Stream([late]), SETTINGS, None)
    for out in (by_event, by_header):
        assert out[0].stats.per_obspy.lowest_highpass == corner
        assert out[0].stats.per_obspy.highpass >= corner


def test_a_second_pass_changes_nothing(record):
    once, _ = process_instrument(Stream([record()]), SETTINGS, None)
    twice, _ = process_instrument(once, SETTINGS, None)
    assert_array_equal(twice[0].data, once[0].data)
    assert twice[0].stats.per_obspy.longest_period == once[0].stats.per_obspy.longest_period


def test_a_raw_record_goes_before_the_same_record_processed_by_others(record):
    others = record(processing_level="processed", corners=AttribDict(highpass=0.3, lowpass=25.0))
    accepted, rejected = process_station(Stream([others, record()]), SETTINGS)
    assert accepted[0].stats.per_obspy.highpass < 0.3
    assert len(rejected) == 1
    # unless it cannot be used
    broken = record()
    broken.data = np.full(12000, np.nan)
    accepted, rejected = process_station(Stream([others, broken]), SETTINGS)
    assert accepted[0].stats.per_obspy.highpass == 0.3
    assert "not finite" in rejected[0].reasons[0]


def test_sensors_of_a_building_are_separate(record):
    floors = Stream()
    for seed, floor in enumerate(("01", "02")):
        floors += record("HNE", seed, location=floor)
        floors += record("HNN", seed + 2, location=floor)
    instruments, rejected = process_instruments(floors, SETTINGS)
    assert rejected == ()
    # both horizontals of a floor, floor by floor
    locations = [trace.stats.location for instrument in instruments for trace in instrument]
    assert list(map(len, instruments)) == [2, 2]
    assert locations == ["01", "01", "02", "02"]


def test_hours_of_quiet_do_not_swallow_the_shaking(record):
    # mutation: without the cut the taper of a tenth of a long record reaches into the shaking
    short, long = record(), record()
    before = 1e-4 * np.random.default_rng(4).normal(size=60_000)
    after = 1e-4 * np.random.default_rng(5).normal(size=60_000)
    long.data = np.concatenate((before, long.data, after))
    settings = Processing(longest_noise=19.0, longest_signal=100.0, highpass=0.1)
    cut, whole = (
        process_instrument(Stream([trace]), settings, None)[0][0] for trace in (long, short)
    )
    assert np.abs(cut.data).max() == pytest.approx(np.abs(whole.data).max(), rel=1e-3)
    assert cut.stats.npts < 20_000  # 119 s and the pads of 75 s, not 22 minutes


def offset_record(record, displacement, after=5e-4):
    """Return a record with a permanent displacement (m) within 4 s and a baseline that shifts."""
    trace = record()
    # comes to rest, but for the additions
    trace.data = acausal_bandpass(trace.data, 100.0, 0.2, np.inf)
    time = np.arange(12000) / 100.0
    pulse = (1 + np.cos(np.pi * (time - 25) / 2)) / 4
    velocity = displacement * np.where(np.abs(time - 25) < 2, pulse, 0.0)
    trace.data = trace.data + np.gradient(velocity, 0.01) + np.where(time > 45, after, 0.0)
    return trace


def final_displacement(trace):
    velocity = cumulative_trapezoid(trace.data, dx=trace.stats.delta, initial=0)
    return cumulative_trapezoid(velocity, dx=trace.stats.delta)[-1]


@pytest.mark.parametrize("displacement", [0.5, -1.0])
def test_a_permanent_offset_is_kept_on_request(record, displacement):
    settings = Processing(permanent_offset=True)
    plain, offset = (
        process_instrument(Stream([offset_record(record, size)]), settings, None)[0]
        for size in (0.0, displacement)
    )
    without, final = (final_displacement(out[0]) for out in (plain, offset))
    # the shift alone would move the ground by 1.4 m; the bridge over the shaking is a guess, good
    # to a decimetre or two
    assert abs(without) < 0.2
    assert final - without == pytest.approx(displacement, rel=0.15)
    # the chain for other records filters it away
    filtered, _ = process_instrument(Stream([offset_record(record, displacement)]), SETTINGS, None)
    assert abs(final_displacement(filtered[0])) < 0.05
    chosen = offset[0].stats.per_obspy
    assert chosen.highpass_source.startswith("not applied")
    assert chosen.longest_period == pytest.approx(96.0)


def test_an_offset_without_quiet_ends_is_rejected(record):
    early = record(onset=0.5)
    out, rejected = process_instrument(Stream([early]), Processing(permanent_offset=True), None)
    assert not out
    assert "permanent offset needs quiet ends" in rejected[0].reasons[0]


def test_an_offset_and_a_high_pass_exclude_each_other():
    with pytest.raises(ValueError, match=r"permanent_offset keeps what highpass = 0\.1 Hz removes"):
        Processing(permanent_offset=True, highpass=0.1)


@pytest.mark.parametrize("units", ["m/s", "m"])
def test_processed_velocity_is_not_taken_for_acceleration(record, units):
    stream = Stream([record("HNN"), record("HNE"), record("HNZ")])
    for trace in stream:
        trace.stats.update({"units": units, "processing_level": "processed"})
    done, rejected = process_station(stream, Processing())
    assert len(done) == 0
    assert len(rejected) == len(stream)  # one row per component
    assert all(f"units '{units}', needs m/s2" in row.reasons[0] for row in rejected)


RATE = 100.0


def others(samples, **stats):
    header = {
        "sampling_rate": RATE,
        "channel": "HNE",
        "units": "m/s2",
        "processing_level": "processed",
    }
    return Trace(samples, header | stats)


def test_samples_and_corners_pass(earthquake):
    given = others(earthquake(), corners=AttribDict(highpass=0.1, lowpass=30.0))
    out = pass_through(given, SETTINGS)
    assert_array_equal(out.data, earthquake())
    # the corners of the header and the periods that follow from them
    known = out.stats.per_obspy
    assert (known.highpass, known.lowpass) == (0.1, 30.0)
    assert (known.highpass_source, known.lowpass_source) == ("header", "header")
    assert known.longest_period == pytest.approx(8.0)
    assert "per_obspy" not in given.stats


def test_a_low_pass_beyond_the_sampling_is_none(earthquake):
    given = others(earthquake(), corners=AttribDict(highpass=0.1, lowpass=999.0))
    assert pass_through(given, SETTINGS).stats.per_obspy.lowpass == 37.5


@pytest.mark.parametrize(("drift", "longest"), [(0.0, (14.0, 96.0)), (3e-3, (1.0, 14.0))])
def test_silent_headers_are_limited_by_their_drift(earthquake, drift, longest):
    # the drift has 20 s; mutation: taking the duration as the limit calls the record usable to 96 s
    time = np.arange(12000) / RATE
    out = pass_through(others(earthquake() + drift * np.sin(2 * np.pi * time / 20)), SETTINGS)
    known = out.stats.per_obspy
    assert longest[0] < known.longest_period <= longest[1]
    assert "the header is silent" in known.highpass_source
    assert known.lowpass == 37.5
    assert_array_equal(out.data, earthquake() + drift * np.sin(2 * np.pi * time / 20))


def test_a_drift_that_no_corner_cleans_leaves_short_periods(earthquake):
    settings = Processing(highpass_range=(0.001, 0.02), drift=1e-6)
    known = pass_through(others(earthquake()), settings).stats.per_obspy
    assert known.longest_period == pytest.approx(40.0)
    assert "drifts at any corner" in known.highpass_source


@pytest.mark.parametrize(("shift", "seconds"), [(0.05, 15.0), (0.015, 3.0)])
def test_the_limit_of_a_shifted_baseline_stays_when_a_file_is_read_back(earthquake, shift, seconds):
    time = np.arange(12000) / RATE
    baseline = np.where((time > 23) & (time < 23 + seconds), shift, 0.0)
    noise = 1e-5 * np.random.default_rng(1).normal(size=12000)
    header = {"sampling_rate": RATE, "channel": "HNE", "units": "m/s2"}
    first = process(Stream([Trace(earthquake() + noise + baseline, header)]))[0]
    again = process(Stream([first]))[0].stats.per_obspy
    # The period, its flag and its text, once each
    assert first.stats.per_obspy.longest_period == first.stats.per_obspy.certain_period
    for name in ("longest_period", "certain_period", "record_flags", "warnings", "failed_checks"):
        assert again[name] == first.stats.per_obspy[name]


def test_motion_that_does_not_rest_is_a_warning(earthquake):
    moving = others(earthquake() + 0.05, header_peak=99.0)
    known = pass_through(moving, SETTINGS).stats.per_obspy
    assert "final velocity over its peak" in known.warnings
    assert "largest sample off the header's 99" in known.warnings


def test_noise_is_measured_before_the_wave_of_the_vertical(record):
    out, _ = process_instrument(Stream([record("HNE"), record("HNZ", 3)]), SETTINGS, None)
    assert out[0].stats.per_obspy.noise == pytest.approx(19.5, abs=0.3)


def test_an_outlier_is_dropped_with_its_figure(record):
    three = Stream([record("HNE"), record("HNN", 2, factor=8.0), record("HNZ", 3)])
    out, rejected = process_instrument(three, SETTINGS, None)
    assert {trace.stats.channel for trace in out} == {"HNE", "HNZ"}
    assert "peak over that of" in rejected[0].reasons[0]
