"""Spectra on disk: identical when read back, and conforming to the conventions."""

import numpy as np
import obspy
import pytest
import xarray as xr
from compliance_checker.runner import CheckSuite
from numpy.testing import assert_array_equal
from obspy import Stream, Trace
from obspy.core import AttribDict

import per_obspy
from per_obspy import station_spectra, stream_spectra
from per_obspy.errors import CatalogError
from per_obspy.spectra.storage import read_spectra, region, write_spectra

RANDOM = np.random.default_rng(9)


def _station(name, channels=("HNN", "HNE", "HNZ"), count=20):
    traces = [
        Trace(
            RANDOM.normal(size=600) * np.hanning(600),
            {
                "network": "XX",
                "station": name,
                "channel": channel,
                "delta": 0.02,
                "units": "m/s2",
                "coordinates": AttribDict(latitude=10.0, longitude=20.0, elevation=30.0),
            },
        )
        for channel in channels
    ]
    return per_obspy.station_spectra(
        Stream(traces), np.geomspace(0.1, 5.0, count), (0.02, 0.05), 30
    )


@pytest.fixture(scope="module")
def stations():
    return [_station("B"), _station("A"), _station("C", ("HNE",))]


@pytest.mark.parametrize("index", [0, 2])
def test_a_shard_is_identical_after_a_round_trip(stations, tmp_path, index):
    # would catch: a decoded time, a lost attribute, float64 squeezed into float32, fill values in
    # coordinates
    write_spectra(stations[index], tmp_path / "shard.nc")
    again = read_spectra(tmp_path / "shard.nc")
    xr.testing.assert_identical(again, stations[index])
    write_spectra(again.drop_encoding(), tmp_path / "again.nc")
    assert (tmp_path / "again.nc").read_bytes() == (tmp_path / "shard.nc").read_bytes()


def test_a_region_is_identical_after_a_round_trip(stations, tmp_path):
    joined = region(stations)
    write_spectra(joined, tmp_path / "spectra.nc")
    xr.testing.assert_identical(read_spectra(tmp_path / "spectra.nc"), joined)


def test_a_region_made_of_shards_is_that_of_the_stations(stations, tmp_path):
    for i, station in enumerate(stations):
        write_spectra(station, tmp_path / f"{i}.nc")
    xr.testing.assert_identical(
        region([read_spectra(tmp_path / f"{i}.nc") for i in range(3)]), region(stations)
    )


def test_a_region_is_sorted_and_tells_what_is_missing(stations):
    joined = region(stations)
    assert joined["station_name"].values.tolist() == ["XX.A", "XX.B", "XX.C"]
    assert joined["horizontals"].values.tolist() == [2, 2, 1]
    assert np.isnan(joined["per_rotd50"][2]).all()
    assert np.isfinite(joined["per_rotd50"][:2]).all()
    assert "acceleration" not in joined


def test_one_simulated_station_marks_the_region(stations):
    # would catch a mark that is dropped because other stations differ
    assert region(stations).attrs["simulated"] == "false"
    marked = stations[0].assign_attrs(simulated="true")
    assert region([marked, *stations[1:]]).attrs["simulated"] == "true"


def test_a_simulated_record_marks_the_spectra():
    trace = Trace(RANDOM.normal(size=200), {"channel": "HNE", "delta": 0.02, "units": "m/s2"})
    trace.stats.simulated = True
    spectra = per_obspy.station_spectra(Stream([trace]), [0.5, 1.0], (0.05,), 90)
    assert spectra.attrs["simulated"] == "true"


def test_stations_on_different_grids_do_not_make_a_region(stations):
    with pytest.raises(ValueError, match="period differs between the stations"):
        region([stations[0], _station("D", count=21)])


@pytest.mark.filterwarnings(
    "ignore::DeprecationWarning"
)  # raised inside the checker by its own dependencies
@pytest.mark.parametrize("which", ["shard", "region"])
def test_conventions(stations, tmp_path, which):
    path = tmp_path / f"{which}.nc"
    write_spectra(stations[0] if which == "shard" else region(stations), path)
    suite = CheckSuite()
    suite.load_all_available_checkers()
    dataset = suite.load_dataset(str(path))
    scores = suite.run_all(dataset, ["cf:1.11", "acdd:1.3"], skip_checks=[])

    # All of CF
    cf, errors = scores["cf:1.11"]
    assert not errors, "the checker itself failed"
    assert [result.msgs for result in cf if _failed(result)] == []

    # What ACDD highly recommends, but for standard names, which no table has for these spectra
    high = [
        result
        for result in scores["acdd:1.3"][0]
        if result.weight == 3 and "standard_name" not in result.msgs
    ]
    assert any(result.name == "Global Attributes" and result.value == (3, 3) for result in high)
    assert [(result.name, result.msgs) for result in high if _failed(result)] == []


def _failed(result):
    """Return whether a check reports a fault; messages alone may be remarks."""
    reached, possible = (
        result.value if isinstance(result.value, tuple) else (bool(result.value), True)
    )
    return reached < possible


def test_a_file_that_is_no_netcdf_is_named(tmp_path):
    (tmp_path / "text.nc").write_text("hello")
    with pytest.raises(CatalogError, match=r"text\.nc: cannot be read as netCDF"):
        read_spectra(tmp_path / "text.nc")


def test_another_netcdf_is_named(tmp_path):
    xr.Dataset({"tas": ("x", [1.0])}).to_netcdf(tmp_path / "other.nc")
    with pytest.raises(CatalogError, match=r"other\.nc: has no variable 'per', only \['tas'\]"):
        read_spectra(tmp_path / "other.nc")


PERIODS = [0.3, 1.0]


def component(station: str, channel: str, seed: int) -> obspy.Trace:
    """Return a component in m/s2."""
    data = np.random.default_rng(seed).normal(size=400)
    header = {"delta": 0.01, "network": "XX", "station": station, "channel": channel}
    return obspy.Trace(data, header | {"units": "m/s2"})


def test_every_station_has_the_spectra_that_it_has_alone():
    stream = obspy.Stream(
        [component(name, f"HN{end}", seed) for seed, (name, end) in enumerate(["BN", "AN", "BE"])]
    )
    joined = stream_spectra(stream, PERIODS)
    assert joined["station"].to_numpy().tolist() == ["XX.A", "XX.B"]
    for name in ("A", "B"):
        alone = station_spectra(stream.select(station=name), PERIODS)
        found = joined["per"].sel(station=f"XX.{name}").dropna("component")
        assert_array_equal(found, alone["per"])


def test_a_trace_is_a_stream_of_one():
    assert stream_spectra(component("A", "HNE", 1), PERIODS).sizes["station"] == 1


def test_an_empty_stream_is_refused():
    with pytest.raises(ValueError, match="no traces"):
        stream_spectra(obspy.Stream())
