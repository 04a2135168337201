"""The Dataset of a station: its content, and the rejection of unusable Streams."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from obspy import Stream, Trace, UTCDateTime
from obspy.core import AttribDict

import per_obspy
from per_obspy.config import Spectra
from per_obspy.errors import RecordRejected

PERIODS = [0.2, 0.5, 1.0, 2.0]
RANDOM = np.random.default_rng(8)
MOTION = RANDOM.normal(size=(3, 1200)) * np.hanning(1200)


def _stream(azimuths=(0.0, 90.0), vertical=True, **changes):
    traces = []
    # Sensors along any azimuths of the same horizontal motion
    for i, azimuth in enumerate(azimuths, start=1):
        angle = np.radians(azimuth)
        along = MOTION[0] * np.cos(angle) + MOTION[1] * np.sin(angle)
        traces.append(_trace(f"HN{i}", along, sensor_azimuth=azimuth))
    traces += [_trace("HNZ", MOTION[2], sensor_dip=-90.0)] if vertical else []
    for trace in traces:
        trace.stats.update(changes)
    return Stream(traces)


def _trace(channel, data, **stats):
    header = {
        "network": "XX",
        "station": "ONE",
        "channel": channel,
        "delta": 0.01,
        "starttime": UTCDateTime(2020, 1, 1),
        "units": "m/s2",
        "coordinates": AttribDict(latitude=10.0, longitude=20.0, elevation=30.0),
        "per_obspy": AttribDict(
            highpass=0.1, lowpass=30.0, shortest_period=0.3, longest_period=1.5
        ),
    }
    return Trace(data.copy(), header | stats)


@pytest.fixture(scope="module")
def station():
    return per_obspy.station_spectra(_stream(), PERIODS, (0.05, 0.2))


def test_dimensions_and_units(station):
    assert station["per"].dims == ("component", "damping", "period")
    assert station["per_azimuthal"].dims == ("azimuth", "damping", "period")
    assert station["component_name"].values.tolist() == ["horizontal_1", "horizontal_2", "vertical"]
    units = {"per": "m", "sd": "m", "sa": "m s-2", "acceleration": "m s-2", "period": "s"}
    # Would catch: pseudo-acceleration in g
    assert {name: station[name].attrs["units"] for name in units} == units


def test_a_component_is_the_spectrum_of_its_trace(station):
    # would catch: components in the wrong order, dampings and periods exchanged
    for index, row in enumerate(MOTION):
        expected = per_obspy.per_spectrum(row, 0.01, PERIODS, [0.05, 0.2])
        assert_allclose(station["per"][index], expected, rtol=1e-6)  # float32 holds seven digits


def test_along_north_and_east_the_azimuthal_spectrum_is_the_component(station):
    # would catch: azimuth counted from east, cos and sin exchanged
    assert_allclose(
        station["per_azimuthal"].sel(azimuth=0), station["per"][0], rtol=1e-6
    )  # float32
    assert_allclose(station["per_azimuthal"].sel(azimuth=90), station["per"][1], rtol=1e-6)


def test_percentiles_bound_each_other(station):
    for name in ("per", "sd"):
        assert (station[f"{name}_rotd50"] <= station[f"{name}_rotd100"]).all()
        assert (station[f"{name}_azimuthal"].max("azimuth") <= station[f"{name}_rotd100"]).all()


@pytest.mark.parametrize("azimuths", [(90.0, 0.0), (37.0, 127.0), (10.0, 65.0), (200.0, 290.0)])
def test_sensors_of_any_azimuth_give_the_same_motion(station, azimuths):
    turned = per_obspy.station_spectra(_stream(azimuths), PERIODS, (0.05, 0.2))
    assert_allclose(
        turned["acceleration"], MOTION[:2], atol=1e-12
    )  # round-off of a 2 x 2 system, motion of order 1
    assert_allclose(turned["per_azimuthal"], station["per_azimuthal"], rtol=2e-6)  # float32
    assert_allclose(turned["per_rotd100"], station["per_rotd100"], rtol=2e-6)


@pytest.mark.parametrize("codes", [("HN1", "HN2"), ("HNL", "HNT"), ("HNX", "HNE")])
def test_percentiles_over_azimuths_need_no_north(station, codes):
    # Motion over all azimuths is the same in whichever frame of the horizontal plane
    stream = Stream([_trace(code, samples) for code, samples in zip(codes, MOTION, strict=False)])
    unknown = per_obspy.station_spectra(stream, PERIODS, (0.05, 0.2))
    assert np.isnan(unknown["horizontal_azimuth"]).all()
    assert_allclose(unknown["per_rotd100"], station["per_rotd100"], rtol=2e-6)  # float32
    assert_allclose(unknown["per_rotd50"], station["per_rotd50"], rtol=2e-6)
    assert unknown["pga"].size == 2


def test_one_horizontal_serves_its_own_azimuth_only():
    station = per_obspy.station_spectra(_stream((30.0,)), PERIODS)
    assert "per_azimuthal" not in station
    assert "per_rotd50" not in station
    assert station["horizontal_azimuth"].values.tolist() == [30.0]
    assert station.attrs["horizontals"] == 1


def test_usable_periods_are_those_of_the_processing(station):
    assert station["usable"].values.tolist() == [0, 1, 1, 0]
    assert float(station["shortest_usable_period"]) == 0.3


def test_the_ground_is_kept_where_it_is_known(station):
    assert station["site_class"].item() == ""
    assert np.isnan(station["vs30"].item())
    known = per_obspy.station_spectra(_stream(site_class="lakebed", vs30=180.0), PERIODS)
    assert known["site_class"].item() == "lakebed"
    assert known["vs30"].item() == 180.0
    assert known["vs30"].attrs["units"] == "m s-1"


def test_processing_is_kept_as_json(station):
    assert json.loads(station["processing"].values[0])["highpass"] == 0.1


def test_channel_codes_tell_north_and_east_where_metadata_is_silent():
    stream = Stream([_trace("HNE", MOTION[1]), _trace("HNN", MOTION[0])])
    assert_array_equal(per_obspy.station_spectra(stream, PERIODS)["acceleration"], MOTION[:2])


def test_the_stream_is_left_as_it_was():
    stream = _stream()
    before = stream.copy()
    per_obspy.station_spectra(stream, PERIODS)
    assert stream == before


@pytest.mark.parametrize(
    ("stream", "reason"),
    [
        (Stream(), "an empty stream: has 0 horizontal"),
        (_stream((), vertical=True), "has 0 horizontal and 1 vertical"),
        (_stream((0.0, 45.0, 90.0)), "has 3 horizontal"),
        (_stream(units="counts"), "XX.ONE..HN1 is in 'counts', not m/s2"),
        # As obspy.read returns it
        (_stream(units=None), "XX.ONE..HN1 has no stats.units: expected acceleration in m/s2"),
        (_stream((20.0, 30.0)), "too close to the same line"),
        (
            Stream([_trace("HNN", MOTION[0]), _trace("HNE", MOTION[1][:-1])]),
            "npts is 1200, but 1199",
        ),
        (
            Stream([_trace("HNN", MOTION[0]), _trace("HNE", MOTION[1], delta=0.02)]),
            "delta is 0.01, but 0.02",
        ),
    ],
)
def test_a_stream_that_is_no_station_is_refused_with_the_reason(stream, reason):
    with pytest.raises(RecordRejected, match=reason):
        per_obspy.station_spectra(stream, PERIODS)


def test_bad_grids_are_named():
    with pytest.raises(ValueError, match=r"periods must be positive, got 0\.0"):
        per_obspy.station_spectra(_stream(), [0.0])
    with pytest.raises(ValueError, match=r"dampings must be at least 0 and below 1, got 5\.0"):
        per_obspy.station_spectra(_stream(), PERIODS, (5.0,))


def test_periods_default_to_those_of_the_configuration():
    # would catch a grid that differs between a run and a call
    settings = Spectra()
    station = per_obspy.station_spectra(_stream((30.0,), vertical=False))
    expected = np.geomspace(settings.shortest, settings.longest, settings.count)
    assert_array_equal(station["period"], expected)
    assert station["damping"].values.tolist() == list(settings.dampings)


def test_the_hypocentre_of_the_header_is_that_of_the_station(station):
    # would catch headers whose earthquake no field of stations learns of
    assert "hypocentre_depth" not in station.attrs
    stream = _stream()
    for trace in stream:
        trace.stats.event = {"longitude": 142.5, "latitude": 41.0, "depth": 30_000.0}
    known = per_obspy.station_spectra(stream, PERIODS, (0.05,)).attrs
    found = [known[f"hypocentre_{name}"] for name in ("longitude", "latitude", "depth")]
    assert found == [142.5, 41.0, 30_000.0]
