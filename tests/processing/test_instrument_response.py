"""Counts to m/s2: full responses, sensitivities, factors of readers, contradictions."""

import numpy as np
import obspy
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from obspy import Trace
from obspy.core.inventory import Response
from obspy.core.inventory.response import (
    InstrumentSensitivity,
    PolesZerosResponseStage,
    ResponseStage,
)

from per_obspy.errors import RecordRejected
from per_obspy.processing import instrument_response
from per_obspy.processing.account import record_flags
from per_obspy.processing.instrument_response import (
    LONGEST_PAD,
    as_recorded,
    in_acceleration,
)

GAIN, RATE = 2e5, 100.0
TOLERANCE = 0.1  # between gains and sensitivity
CORNER = 2 * np.pi / 30.0  # rad/s: a velocity sensor of 30 s


def response(units="M/S**2", stages=(GAIN,), overall=GAIN):
    # an accelerometer is flat, a velocity sensor has two poles at its corner
    poles = [] if units != "M/S" else CORNER * np.roots([1, 1.4, 1])
    zeros = [0j] * len(poles)
    kind = "LAPLACE (RADIANS/SECOND)"
    first = PolesZerosResponseStage(
        1, stages[0], 1.0, units, "COUNTS", kind, 1.0, zeros, poles, 1.0
    )
    rest = [ResponseStage(i, gain, 1.0, "COUNTS", "COUNTS") for i, gain in enumerate(stages[1:], 2)]
    return with_sensitivity(overall, units, [first, *rest])


def with_sensitivity(overall, units, stages):
    sensitivity = InstrumentSensitivity(overall, 1.0, units, "COUNTS")
    return Response(None, sensitivity, None, stages)


def motion():
    """Return a smooth pulse of acceleration with energy near 1 Hz only, m/s2, and its velocity."""
    time = np.arange(-40, 40, 1 / RATE)
    velocity = np.exp(-(time**2)) * np.sin(2 * np.pi * time)
    return np.gradient(velocity, 1 / RATE), velocity


def counts(samples, **stats):
    header = {
        "network": "XX",
        "station": "STA",
        "channel": "HNE",
        "sampling_rate": RATE,
        "units": "counts",
    }
    return Trace(samples, header | stats)


def test_a_flat_accelerometer_is_divided_by_its_gain():
    acceleration, _ = motion()
    out = in_acceleration(counts(GAIN * acceleration + 500.0, response=response()), TOLERANCE)
    # the pre-filter starts at 40 Hz, far above the pulse: rounding of the transform remains
    assert_allclose(out.data, acceleration - acceleration.mean(), atol=1e-9)
    assert (out.stats.units, out.stats.quantity) == ("m/s2", "acceleration")
    assert out.stats.per_obspy.conversion == "response"
    assert "response" not in out.stats


def test_a_velocity_sensor_gives_acceleration():
    # mutation: output="VEL" misses the derivative; dividing by the gain alone is 5 % off in phase
    # at 1 Hz
    acceleration, velocity = motion()
    rate = 2j * np.pi * np.fft.rfftfreq(velocity.size, 1 / RATE)
    sensor = rate**2 / (rate**2 + 1.4 * CORNER * rate + CORNER**2)
    recorded = np.fft.irfft(np.fft.rfft(velocity) * sensor, velocity.size)
    out = in_acceleration(
        counts(GAIN * recorded, response=response("M/S"), channel="HHE"), TOLERANCE
    )
    # np.gradient is off by (2 pi f dt)^2 / 6: 0.07 % at 1 Hz, 0.2 % at the pulse's upper end
    assert_allclose(out.data, acceleration, atol=2e-3 * acceleration.max())


def test_the_response_of_a_velocity_sensor_is_none_of_an_accelerometer():
    # M/S in place of M/S**2: the samples would be differentiated, 31 times too large at 5 Hz
    wrong = counts(GAIN * np.ones(1000), response=response("M/S"))
    with pytest.raises(RecordRejected, match=r"falls 5 times.*M/S in place of M/S\*\*2"):
        in_acceleration(wrong, TOLERANCE)


def test_an_accelerometer_may_be_described_by_velocity():
    # A zero at the origin makes the response to acceleration flat, whatever the unit in the file
    flat = response("M/S")
    flat.response_stages[0].zeros, flat.response_stages[0].poles = [0j], [-6283.0 + 0j]
    acceleration, _ = motion()
    given = counts(GAIN * acceleration, response=flat)
    assert in_acceleration(given, TOLERANCE).stats.units == "m/s2"


def test_an_overall_sensitivity_divides():
    acceleration, _ = motion()
    bare = with_sensitivity(GAIN, "M/S**2", [])
    out = in_acceleration(counts(GAIN * acceleration, response=bare), TOLERANCE)
    assert_allclose(out.data, acceleration, rtol=1e-14)  # one multiplication and one division
    # networks of cheap sensors state that of the model
    assert "nominal_sensitivity" in record_flags(out)


def test_the_factor_of_a_reader_of_acceleration_is_used():
    out = in_acceleration(counts(np.arange(10.0), calib=0.5, quantity="acceleration"), TOLERANCE)
    assert_array_equal(out.data, np.arange(10.0) / 2)
    assert out.stats.calib == 1.0


@pytest.mark.parametrize(
    ("stats", "reason"),
    [
        ({}, "counts without a response"),
        ({"calib": 0.5}, "counts without a response"),  # of what?
        ({"units": "gal"}, "units 'gal'"),
        ({"response": response("PA", (GAIN,), GAIN)}, "response from 'PA'"),
        (
            {"response": response(stages=(GAIN, 2.0))},
            "product of stage gains 400000, overall sensitivity 200000",
        ),
        ({"response": response(stages=(GAIN, 0.85))}, "more than 10% apart"),
        ({"response": response(overall=0.0)}, "overall sensitivity 0"),
        (
            {"response": with_sensitivity(GAIN, "M/S", [])},
            "velocity sensor with an overall sensitivity but no response stages",
        ),
    ],
)
def test_what_cannot_be_converted_is_a_reason(stats, reason):
    with pytest.raises(RecordRejected, match=reason.replace("(", r"\(")):
        in_acceleration(counts(np.arange(10.0), **stats), TOLERANCE)


def test_a_gain_within_the_tolerance_is_no_reason():
    near = counts(np.arange(100.0), response=response(stages=(GAIN, 1.09)))
    assert in_acceleration(near, TOLERANCE).stats.units == "m/s2"


def test_knet_records_that_obspy_read_are_converted_by_their_factor():
    # mutation: the factor of a reader without a quantity refused, or used twice
    record = obspy.read("/path/to/test.knet")[0]  # comes with ObsPy
    out = in_acceleration(record, TOLERANCE)
    expected = abs(record.data).max() * record.stats.calib
    assert abs(out.data).max() == pytest.approx(expected, rel=1e-12)
    assert out.stats.units == "m/s2"


def test_an_hour_of_zeros_behind_a_long_record_is_enough(monkeypatch):
    # A velocity sensor moves most: its pre-filter begins at 0.005 Hz
    count, rate = 100_000, 10.0
    ground = np.random.default_rng(2).normal(size=count) * np.exp(
        -(((np.arange(count) - 0.9 * count) / 500) ** 2)
    )
    sensor = {"response": response("M/S"), "channel": "HHE"}
    trace = counts(GAIN * ground, sampling_rate=rate, **sensor)
    assert count / rate > LONGEST_PAD
    found = in_acceleration(trace, TOLERANCE).data
    monkeypatch.setattr(instrument_response, "LONGEST_PAD", count / rate)
    expected = in_acceleration(trace, TOLERANCE).data
    # The tail of the pre-filter after an hour, which is 18 of its longest periods
    assert_allclose(found, expected, rtol=0, atol=1e-7 * np.abs(expected).max())


def recorded_counts(**stats):
    """Return whole counts of noise that shakes for some seconds, with a response, ObsPy's way."""
    noise = np.convolve(np.random.default_rng(4).normal(size=4000), np.hanning(11) / 2, "same")
    samples = GAIN * noise * np.hanning(4000)
    trace = counts(np.round(samples).astype(np.int32), response=response(), **stats)
    del trace.stats.units
    return trace


def motion_of(trace):
    return in_acceleration(as_recorded(trace), TOLERANCE).data


STEPS = {
    "remove_response": {"output": "ACC", "pre_filt": (0.05, 0.1, 40, 45), "water_level": None},
    "remove_sensitivity": {},
}


@pytest.mark.parametrize("step", STEPS)
def test_what_obspy_converted_is_not_converted_again(step):
    # mutation: the response that ObsPy leaves in the header divides once more
    trace = recorded_counts().detrend("demean")
    getattr(trace, step)(**STEPS[step])
    # in counts beforehand: 2e5 of them are 1 m/s2
    assert 1 < np.abs(trace.data).max() < 10
    assert_array_equal(motion_of(trace), trace.data)


@pytest.mark.parametrize(
    ("version", "separator"), [("ObsPy 0.10.2", ","), ("ObsPy 1.6.0.dev0+12", "::"), ("", ", ")]
)
def test_steps_of_any_version_of_obspy_are_read(version, separator):
    text = f"{version}: remove_response(inventory=None{separator}output='ACC'{separator}plot=False)"
    acceleration, _ = motion()
    trace = counts(acceleration, response=response(), processing=[text])
    assert_array_equal(motion_of(trace), acceleration)


def test_velocity_that_is_differentiated_is_acceleration():
    trace = recorded_counts().detrend("demean")
    trace.remove_response(output="VEL", pre_filt=(0.05, 0.1, 40, 45), water_level=None)
    with pytest.raises(RecordRejected, match=r"units 'm/s', needs .* output='ACC', or diff"):
        motion_of(trace)
    trace.differentiate()
    assert_array_equal(motion_of(trace), trace.data)


@pytest.mark.parametrize(
    ("steps", "unit"),
    [
        ([("remove_response", {"output": "DISP"})], "units 'm'"),
        ([("remove_response", {"output": "ACC"}), ("integrate", {})], "units 'm/s'"),
        ([("remove_response", {"output": "ACC"})] * 2, "unknown after remove_response"),
        ([("remove_sensitivity", {}), ("normalize", {})], "unknown after normalize"),
        ([("integrate", {})], "unknown after integrate"),
        ([("simulate", {"paz_remove": {"poles": [], "zeros": [], "gain": 1.0,
                                       "sensitivity": 1.0}})], "unknown after simulate"),
    ],
)  # fmt: skip
def test_samples_of_another_unit_are_refused_by_the_step(steps, unit):
    trace = recorded_counts().detrend("demean")
    for step, options in steps:
        getattr(trace, step)(**options)
    with pytest.raises(RecordRejected, match=unit):
        motion_of(trace)


@pytest.mark.parametrize("kind", [np.float64, np.float32])
@pytest.mark.parametrize("change", ["demean", "linear", None])
def test_samples_without_their_steps_are_known_by_the_factor_of_whole_counts(kind, change):
    # As a file of MiniSEED or SAC has them: no list of steps
    trace = recorded_counts()
    trace.remove_sensitivity()
    if change:
        trace.detrend(change)
    trace.data = trace.data.astype(kind)
    del trace.stats.processing
    assert_array_equal(motion_of(trace), trace.data)
    # and counts remain counts, whole or without mean and trend
    raw = recorded_counts().detrend(change or "demean")
    raw.data = raw.data.astype(kind)
    assert_allclose(np.abs(motion_of(raw)).max(), np.abs(raw.data).max() / GAIN, rtol=1e-3)


@pytest.mark.parametrize("unit", [1.0, 100.0, 1 / 9.80665])
@pytest.mark.parametrize("quantity", ["ACC", "VEL"])
def test_samples_that_are_no_counts_are_refused_where_their_unit_is_lost(unit, quantity):
    # m/s2, gal or g of a file; mutation: divided again they are 1e-5 m/s2
    trace = recorded_counts().detrend("demean")
    trace.remove_response(output=quantity, pre_filt=(0.05, 0.1, 40, 45), water_level=None)
    trace.data = trace.data * unit
    del trace.stats.processing
    with pytest.raises(RecordRejected, match="samples: no whole numbers up to"):
        motion_of(trace)


def test_filtered_counts_and_fractions_of_counts_remain_counts():
    # the overall sensitivity is a multiple of 20
    for trace in (
        recorded_counts().filter("bandpass", freqmin=0.1, freqmax=30),
        recorded_counts(),
    ):
        trace.data = trace.data / 20
        expected = np.abs(trace.data).max() / GAIN
        # the window leaves 1e-4 of the noise above the 40 Hz of the pre-filter
        assert_allclose(np.abs(motion_of(trace)).max(), expected, rtol=1e-3)


@pytest.mark.parametrize("with_response", [False, True])
def test_a_calibration_that_is_applied_is_not_applied_again(with_response):
    # mutation: calib stays in the header and multiplies once more, or the response divides
    record = obspy.read("/path/to/test.knet")[0]
    expected = record.data * record.stats.calib
    applied = obspy.read("/path/to/test.knet", apply_calib=True)[0]
    if with_response:
        applied.stats.response = response()
    assert_allclose(motion_of(applied), expected, rtol=1e-12)
    # where the header's peak is cut off, whole counts show it
    half = applied.copy()
    half.trim(endtime=half.stats.starttime + 20)
    assert_allclose(motion_of(half), half.data, rtol=1e-12)
    # gal, by the header's peak
    applied.data = 100 * applied.data
    with pytest.raises(RecordRejected, match=r"needs counts, or stats\.units"):
        motion_of(applied)


def test_a_unit_that_the_user_sets_is_right():
    acceleration, _ = motion()
    trace = counts(acceleration, response=response(), units="m/s2")
    assert_array_equal(motion_of(trace), acceleration)


@pytest.mark.parametrize("stages", [(GAIN,), (GAIN / 8, 8.0), (2.0, GAIN, 0.5)])
def test_without_an_overall_sensitivity_the_product_of_the_stages_converts(stages):
    acceleration, _ = motion()
    silent = response(stages=stages)
    silent.instrument_sensitivity = None
    out = in_acceleration(counts(GAIN * acceleration, response=silent), TOLERANCE)
    # the pre-filter starts at 40 Hz, far above the pulse: rounding of the transform remains
    assert_allclose(out.data, acceleration - acceleration.mean(), atol=1e-9)
    # gains alone
    gains = Response(None, None, None, [ResponseStage(1, GAIN, 1.0, "M/S**2", "COUNTS")])
    out = in_acceleration(counts(GAIN * acceleration, response=gains), TOLERANCE)
    assert_allclose(out.data, acceleration, rtol=1e-14)


def test_a_flat_accelerometer_in_metres_per_second_is_one_of_acceleration():
    # mutation: its record is differentiated, 2 pi f times too large
    acceleration, _ = motion()
    wrong = response()
    wrong.instrument_sensitivity.input_units = wrong.response_stages[0].input_units = "M/S"
    out = in_acceleration(counts(GAIN * acceleration, response=wrong), TOLERANCE)
    assert_allclose(out.data, acceleration - acceleration.mean(), atol=1e-9)
    assert "taken as M/S**2" in out.stats.per_obspy.warnings


def test_an_accelerometer_that_is_described_by_velocity_is_differentiated_with_a_warning():
    # a zero at the origin makes a flat accelerometer one to velocity
    acceleration, velocity = motion()
    by_velocity = response("M/S")
    by_velocity.response_stages[0].zeros = [0j]
    by_velocity.response_stages[0].poles = []
    by_velocity.response_stages[0].normalization_factor = 1 / (2 * np.pi)
    # counts of acceleration: GAIN at 1 Hz to velocity is GAIN / (2 pi) to acceleration
    out = in_acceleration(
        counts(GAIN / (2 * np.pi) * acceleration, response=by_velocity), TOLERANCE
    )
    # the pre-filter of velocity sensors takes what is below 0.01 Hz
    assert_allclose(out.data, acceleration, atol=2e-3 * acceleration.max())
    assert "code N is an accelerometer" in out.stats.per_obspy.warnings
    assert "warnings" not in in_acceleration(
        counts(GAIN * velocity, response=response("M/S"), channel="HHE"), TOLERANCE
    ).stats.get("per_obspy", {})


def test_physical_records_pass():
    acceleration, _ = motion()
    assert_array_equal(
        in_acceleration(counts(acceleration, units="m/s2"), TOLERANCE).data, acceleration
    )
