"""Whole stations: laws of the result, choice of instruments, the raw record beside it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from obspy import Inventory, Stream, Trace, UTCDateTime, read, read_inventory
from obspy.core import AttribDict

from per_obspy.config import Checks, Processing
from per_obspy.errors import RecordRejected
from per_obspy.processing.chain import before_processing, process, process_station
from per_obspy.processing.instrument_response import in_acceleration

RATE, COUNT = 100.0, 6000
SETTINGS = Processing()


def pulse(channel="HNE"):
    """Return an earthquake of 20 s between quiet ends, m/s2; each component is another one."""
    time = np.arange(COUNT) / RATE
    rng = np.random.default_rng(ord(channel[-1]))
    envelope = np.exp(-(((time - 30) / 6) ** 2))
    motion = rng.normal(size=COUNT) * envelope
    # The ground comes to rest
    return motion - motion.sum() / envelope.sum() * envelope


def trace(channel="HNE", samples=None, station="STA", **stats):
    header = {
        "network": "XX",
        "station": station,
        "channel": channel,
        "sampling_rate": RATE,
        "units": "m/s2",
    }
    data = pulse(channel) if samples is None else samples
    return Trace(data, header | {"starttime": UTCDateTime(2020, 1, 1)} | stats)


def station(factor=1.0, offset=0.0, **stats):
    codes = ("HNE", "HNN", "HNZ")
    return Stream([trace(code, factor * pulse(code) + offset, **stats) for code in codes])


def channels(stream):
    return [trace.stats.channel for trace in stream]


def test_a_trace_is_a_stream_of_one():
    record = trace()
    assert_array_equal(process(record)[0].data, process(Stream([record]))[0].data)


@pytest.mark.parametrize("wrong", [None, np.zeros(100), "record.mseed"])
def test_anything_else_is_named_with_its_type(wrong):
    with pytest.raises(TypeError, match=f"Stream or Trace, got {type(wrong).__name__}"):
        process(wrong)


def test_the_offset_of_the_baseline_does_not_matter():
    plain, shifted = process(station()), process(station(offset=3.0))
    for expected, found in zip(plain, shifted, strict=True):
        assert_allclose(found.data, expected.data, atol=1e-12)  # rounding of numbers near 3


def test_the_result_is_proportional_to_the_motion():
    single, double = process(station()), process(station(factor=-2))
    for expected, found in zip(single, double, strict=True):
        assert_allclose(found.data, -2 * expected.data, atol=1e-12)


def test_corners_of_the_configuration_are_used_as_they_are():
    chosen = process(station(), Processing(highpass=0.08, lowpass=45.0))[0].stats.per_obspy
    assert (chosen.highpass, chosen.lowpass) == (0.08, 37.5)  # 0.75 of Nyquist is the most
    assert chosen.highpass_source == "configuration"
    assert chosen.longest_period == pytest.approx(10.0)


def test_every_number_and_step_is_recorded():
    out = process(station())[0]
    assert all(type(value) in (str, int, float) for value in out.stats.per_obspy.values())
    steps = " | ".join(out.stats.processing)
    words = ("mean", "trend", "tapered", "zeros before", "Butterworth", "usable")
    order = [steps.index(word) for word in words]
    assert order == sorted(order)


def test_horizontals_have_the_same_times_after_padding():
    out = process(Stream([trace("HNE"), trace("HNN", starttime=UTCDateTime(2020, 1, 1) + 1.003)]))
    assert out[0].stats.starttime == out[1].stats.starttime
    assert out[0].stats.npts == out[1].stats.npts


def test_a_bad_trace_is_rejected_alone():
    stream = station()
    stream[0].data[5] = np.nan
    stream[2].stats.units = "gal"
    accepted, rejected = process_station(stream, SETTINGS)
    assert channels(accepted) == ["HNN"]
    assert {row.name for row in rejected} == {"XX.STA..HNE", "XX.STA..HNZ"}


def test_the_preferred_instrument_goes_first_and_the_other_is_named():
    stream = station() + Stream([trace("BNE"), trace("BNN")])
    accepted, rejected = process_station(stream, SETTINGS)
    assert sorted(channels(accepted)) == ["HNE", "HNN", "HNZ"]
    assert [row.name for row in rejected] == ["XX.STA..BNE", "XX.STA..BNN"]
    assert "goes first" in rejected[0].reasons[0]


def test_a_whole_instrument_goes_before_half_a_preferred_one():
    codes = ("HNE", "HNZ", "BNE", "BNN")
    accepted, rejected = process_station(Stream([trace(code) for code in codes]), SETTINGS)
    assert sorted(channels(accepted)) == ["BNE", "BNN"]
    assert {row.name for row in rejected} == {"XX.STA..HNE", "XX.STA..HNZ"}


def test_a_vertical_alone_is_of_no_use_and_named():
    accepted, rejected = process_station(Stream([trace("HNZ")]), SETTINGS)
    assert not accepted
    assert rejected[0].reasons == ("no horizontal of its instrument is usable",)


def test_nothing_left_is_an_error_with_every_reason():
    stream = Stream([trace("HNE", units="gal"), trace("HNN", samples=np.full(COUNT, np.nan))])
    with pytest.raises(RecordRejected, match=r"units 'gal'.*|not finite") as caught:
        process(stream)
    assert len(caught.value.reasons) == 2
    with pytest.raises(RecordRejected, match="empty stream: no traces"):
        process(Stream())


def test_stations_do_not_mix():
    out = process(station() + station(station="STB"))
    assert [trace.stats.station for trace in out].count("STB") == 3


SHAPES = {
    "silence": lambda t, _: 0 * t,
    "offset": lambda t, _: 0 * t + 1,
    "noise": lambda t, rng: rng.normal(size=t.size),
    "sine": lambda t, _: np.sin(t),
    "parabola": lambda t, _: t**2,
    "late noise": lambda t, rng: np.where(2 * t > t[-1], rng.normal(size=t.size), 0),
    "burst": lambda t, rng: (
        rng.normal(size=t.size) * np.exp(-(((t - t.mean()) / (t[-1] / 9 + 1e-3)) ** 2))
    ),
    "giants": lambda t, rng: np.where(rng.random(t.size) > 0.99, 1e200, 0),
}
NOTES = {name: check.model_copy(update={"level": "note"}) for name, check in Checks()}
LENIENT = Processing(checks=Checks(**NOTES))


@settings(max_examples=40, deadline=None, derandomize=True)
@given(
    shape=st.sampled_from(sorted(SHAPES)),
    count=st.sampled_from([1, 2, 9, 49, 50, 51, 150, 600, 5000]),
    rate=st.sampled_from([1.0, 20.0, 100.0, 500.0]),
    how=st.sampled_from([Processing(), LENIENT, Processing(permanent_offset=True)]),
)
def test_any_record_is_kept_whole_or_named(shape, count, rate, how):
    samples = SHAPES[shape](np.arange(count) / rate, np.random.default_rng(count))
    stream = Stream()
    for code, size in {"HNE": 1, "HNN": 2, "HNZ": 3}.items():
        stream += trace(code, samples * size, sampling_rate=rate)
    # every trace is either processed or rejected, never a crash that loses the station
    accepted, rejected = process_station(stream, how)
    names = [component.id for component in accepted]
    names += [row.name for row in rejected]
    assert sorted(names) == sorted(component.id for component in stream)
    # with every check off as well the result is finite
    for component in accepted:
        assert np.isfinite(component.data).all()
        chosen = component.stats.per_obspy
        assert 0 < chosen.shortest_period < chosen.longest_period


def test_inputs_stay_unchanged():
    stream = station()
    before = stream.copy()
    process(stream)
    assert stream == before


@pytest.fixture(scope="module")
def ridgecrest(real_data):
    folder = real_data / "records" / "ridgecrest2019_mseed"
    inventory = sum((read_inventory(path) for path in sorted(folder.glob("*.xml"))), Inventory())
    stream = read(str(folder / "*.mseed"))
    # response and direction of each sensor at the time of the record
    for component in stream:
        stats, start = component.stats, component.stats.starttime
        stats.response = inventory.get_response(component.id, start)
        direction = inventory.get_orientation(component.id, start)
        stats.sensor_azimuth, stats.sensor_dip = direction["azimuth"], direction["dip"]
    return stream


@pytest.mark.real_data
@pytest.mark.parametrize("station", ["CCC", "WNM"])
def test_the_response_is_removed_as_obspy_removes_it(ridgecrest, station):
    trace = ridgecrest.select(station=station, channel="HNE")[0]
    found = in_acceleration(trace, 0.1).data
    expected = trace.copy()
    expected.data = expected.data - expected.data.mean()
    expected.remove_response(
        output="ACC", water_level=None, pre_filt=(-2, -1, 40, 45), zero_mean=False, taper=False
    )
    # another length of transform moves what wraps around: 1e-5 of the peak; the phase of this
    # filter is worth 10 %
    assert_allclose(found, expected.data, atol=1e-4 * np.abs(expected.data).max())


@pytest.mark.real_data
def test_ridgecrest_gives_sane_motion_at_all_stations(ridgecrest):
    out = process(ridgecrest)
    assert len(out) == 33
    for trace in out:
        velocity = np.cumsum(trace.data) * trace.stats.delta
        displacement = np.cumsum(velocity) * trace.stats.delta
        # m/s2: the strongest station is known to have 0.57 g
        assert 0.2 < np.abs(trace.data).max() < 6.0
        # a filtered record ends at rest: the pads hold 1.5 n periods of the corner
        assert abs(velocity[-1]) < 1e-3 * np.abs(velocity).max()
        assert abs(displacement[-1]) < 0.01 * np.abs(displacement).max()


START = UTCDateTime(2020, 1, 1)


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


def test_another_channel_is_not_it_and_a_record_processed_by_others_has_none(earthquake):
    trace = recorded(earthquake())
    processed = process_station(Stream([trace]), SETTINGS)[0][0]
    others = Stream(
        [recorded(earthquake(2), "HNN"), recorded(earthquake(), processing_level="processed")]
    )
    assert before_processing(others, processed, SETTINGS) is None
    assert before_processing(others + trace, processed, SETTINGS) is not None


def test_the_raw_record_stays_unchanged(earthquake):
    stream = Stream([recorded(earthquake())])
    processed = process_station(stream, SETTINGS)[0][0]
    earlier = stream.copy(), processed.copy()
    before_processing(stream, processed, SETTINGS)
    assert (stream, processed) == earlier


def test_records_processed_already_pass_through():
    corners = AttribDict(highpass=0.1, lowpass=30.0)
    out = process(station(processing_level="processed", corners=corners))[0]
    assert_array_equal(out.data, pulse())
    assert (out.stats.per_obspy.highpass, out.stats.per_obspy.lowpass) == (0.1, 30.0)
    assert out.stats.per_obspy.highpass_source == "header"


def test_the_mean_is_that_of_the_noise(earthquake):
    trace = recorded(earthquake() + 0.3)
    processed = process_station(Stream([trace]), SETTINGS)[0][0]
    before = before_processing(Stream([trace]), processed, SETTINGS)
    assert abs(before.data[:1500].mean()) < 1e-5
