"""Counts to m/s2: full responses, sensitivities, factors of readers, contradictions."""

import numpy as np
import obspy
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from obspy import Stream, Trace
from obspy.core.inventory import Response
from obspy.core.inventory.response import (
    InstrumentSensitivity,
    PolesZerosResponseStage,
    ResponseStage,
)

from per_obspy.errors import RecordRejected
from per_obspy.processing import instrument_response
from per_obspy.processing.instrument_response import LONGEST_PAD, in_acceleration

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
    return Stream([Trace(samples, header | stats)])


def test_a_flat_accelerometer_is_divided_by_its_gain():
    acceleration, _ = motion()
    out = in_acceleration(counts(GAIN * acceleration + 500.0, response=response()), TOLERANCE)[0]
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
    )[0]
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
    assert in_acceleration(given, TOLERANCE)[0].stats.units == "m/s2"


def test_an_overall_sensitivity_divides():
    acceleration, _ = motion()
    bare = with_sensitivity(GAIN, "M/S**2", [])
    out = in_acceleration(counts(GAIN * acceleration, response=bare), TOLERANCE)[0]
    assert_allclose(out.data, acceleration, rtol=1e-14)  # one multiplication and one division


def test_physical_records_pass():
    acceleration, _ = motion()
    assert_array_equal(
        in_acceleration(counts(acceleration, units="m/s2"), TOLERANCE)[0].data, acceleration
    )


def test_the_factor_of_a_reader_of_acceleration_is_used():
    out = in_acceleration(counts(np.arange(10.0), calib=0.5, quantity="acceleration"), TOLERANCE)[0]
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
    assert in_acceleration(near, TOLERANCE)


def test_inputs_stay_unchanged():
    stream = counts(np.arange(100.0), response=response())
    before = stream.copy()
    in_acceleration(stream, TOLERANCE)
    assert stream == before


def test_knet_records_that_obspy_read_are_converted_by_their_factor():
    # mutation: the factor of a reader without a quantity refused, or used twice
    record = obspy.read("/path/to/test.knet")  # comes with ObsPy
    out = in_acceleration(record, TOLERANCE)
    expected = abs(record[0].data).max() * record[0].stats.calib
    assert abs(out[0].data).max() == pytest.approx(expected, rel=1e-12)
    assert out[0].stats.units == "m/s2"


def test_an_hour_of_zeros_behind_a_long_record_is_enough(monkeypatch):
    # A velocity sensor moves most: its pre-filter begins at 0.005 Hz
    count, rate = 100_000, 10.0
    ground = np.random.default_rng(2).normal(size=count) * np.exp(
        -(((np.arange(count) - 0.9 * count) / 500) ** 2)
    )
    sensor = {"response": response("M/S"), "channel": "HHE"}
    stream = counts(GAIN * ground, sampling_rate=rate, **sensor)
    assert count / rate > LONGEST_PAD
    found = in_acceleration(stream, TOLERANCE)[0].data
    monkeypatch.setattr(instrument_response, "LONGEST_PAD", count / rate)
    expected = in_acceleration(stream, TOLERANCE)[0].data
    # The tail of the pre-filter after an hour, which is 18 of its longest periods
    assert_allclose(found, expected, rtol=0, atol=1e-7 * np.abs(expected).max())
