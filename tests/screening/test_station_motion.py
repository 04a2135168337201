"""Decoding of a station's Dataset: two horizontals, one, and the azimuths of the stored spectra."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from screening_samples import make_station

from per_obspy.screening.station_motion import nearest_azimuth, station_motion


def test_components_are_in_their_order(station, record):
    # would catch: north and east exchanged, which no symmetric quantity shows
    north, east = station["acceleration"].to_numpy()
    assert_array_equal(record.records[0].north, north)
    assert_array_equal(record.records[0].east, east)
    assert record.records[0].dt == 0.01
    assert record.records[0].usable_periods == (0.05, 9.0)
    assert record.horizontals == 2
    assert np.isnan(record.sensor_azimuth)


def test_arrays_are_contiguous_doubles(record):
    # functions of NumPy may differ in the last bit between strides
    for array in (
        record.records[0].north,
        record.records[0].east,
        record.per.radii,
        record.sd.radii,
    ):
        assert array.dtype == np.float64
        assert array.flags["C_CONTIGUOUS"]


@pytest.mark.parametrize("name", ["per", "sd"])
def test_stored_spectra_are_logarithms_by_azimuth_damping_and_period(station, record, name):
    # would catch: PER for SD, rows of another azimuth, axes exchanged
    spectra = getattr(record, name)
    stored = station[f"{name}_azimuthal"].sel(azimuth=40.0, damping=0.05).to_numpy()
    assert_allclose(np.exp(spectra.radii[4, 1]), stored, rtol=1e-12)
    assert_allclose(np.exp(spectra.periods), station["period"], rtol=1e-12)
    assert_allclose(np.exp(spectra.dampings), station["damping"], rtol=1e-12)


def test_a_single_horizontal_counts_as_north_and_has_one_azimuth():
    # would catch: an east component that counts at the azimuths of pairs
    station = make_station(channels=("HNE",))
    record = station_motion(station)
    assert record.horizontals == 1
    assert record.sensor_azimuth == 90.0
    assert_array_equal(record.records[0].north, station["acceleration"][0])
    assert not record.records[0].east.any()
    assert record.azimuths.size == len(record.per.radii) == len(record.sd.radii) == 1
    assert_allclose(np.exp(record.per.radii[0]), station["per"][0], rtol=1e-12)


def test_the_nearest_stored_azimuth_repeats_after_a_half_turn(record):
    # stored every 10 degrees; would catch 179 degrees taken to a row beyond the last
    azimuth = np.array([0.0, 4.9, 5.1, 40.0, 174.0, 179.0, 220.0, np.nan])
    rows = nearest_azimuth(record, {"azimuth_used": azimuth})
    assert rows.tolist() == [0, 0, 1, 4, 17, 0, 4, 0]


def test_every_azimuth_of_a_single_horizontal_is_its_own():
    record = station_motion(make_station(channels=("HNN",)))
    assert nearest_azimuth(record, {"azimuth_used": np.array([0.0, 77.0])}).tolist() == [0, 0]
